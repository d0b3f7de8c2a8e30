"""Rungs ``internal`` and ``unite``: nothing but the boundary between matter and the outside stays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology import Topology, weld_exactly
from ..winding import spread_by_area, winding_numbers
from .draft import Declined, Draft

ROUNDS = 4
"""Rounding the exact result to doubles can make new crossings, a few at a time; as often it is united again."""

SPECK = 1e-12
"""Least volume of a shell of the result, as a share of the diagonal cubed: below are leftovers of rounding."""


def remove_internal(draft: Draft) -> Draft | None:
    """Drop components that lie inside a solid and bound no cavity, and sheets that lie wholly inside one."""
    assessment = draft.assessment
    roles = [part.role for part in assessment.components]
    drop = [number for number, role in enumerate(roles) if role == "internal"]
    sheets = [number for number, role in enumerate(roles) if role == "sheet"]
    drop += _sheets_inside(draft, assessment, sheets)
    if "solid" not in roles or not drop:
        return None
    keep = ~np.isin(assessment.component_of_face, drop)
    what = f"{len(drop)} components inside a solid removed ({int((~keep).sum())} faces)"
    return draft.with_faces(draft.topology.faces, what, keep)


def _sheets_inside(draft: Draft, assessment, sheets: list[int]) -> list[int]:
    """Those of the sheets no sample of which is outside the solids."""
    points, faces, component = draft.topology.points, draft.topology.faces, assessment.component_of_face
    solid = faces[np.isin(component, [n for n, part in enumerate(assessment.components) if part.role != "sheet"])]
    if not sheets or len(solid) == 0:
        return []
    groups = [np.flatnonzero(component == number) for number in sheets]
    areas = draft.mesh.face_areas
    chosen = [group[spread_by_area(areas[group], 8)] for group in groups]
    winding = winding_numbers(points[faces[np.concatenate(chosen)]].mean(axis=1), points, solid)
    split = np.split(winding, np.cumsum([len(group) for group in chosen])[:-1])
    return [number for number, values in zip(sheets, split, strict=True) if (values > 0.9).all()]


def unite(draft: Draft) -> Draft | None:
    """The boundary of everything with a winding number of 1 or more, by exact arithmetic.

    Overlapping solids become one, inner walls go, a surface folded through itself loses the fold. Matter is
    where the winding number is positive: shells that wind inwards take away, so cavities stay cavities.

    Zhou, Grinspun, Zorin & Jacobson, "Mesh Arrangements for Solid Geometry", ACM Trans. Graph. 35(4):39, 2016.
    Raises Declined where the surface is not closed (an edge is run through more often one way than the other):
    then the winding number is no whole number.
    """
    topology = _closed(draft)
    faces, birth = topology.faces[topology.live], draft.birth[topology.live]
    return _as_draft(draft, _boundary_of_matter(topology.points, faces, birth))


def unite_both_signs(draft: Draft) -> Draft | None:
    """As ``unite``, with matter also where the winding number is negative.

    For surfaces that cross themselves so that a part of them is inside out: the part is there to be seen, and no
    turning of whole components sets it right.
    """
    topology = _closed(draft)
    faces, birth = topology.faces[topology.live], draft.birth[topology.live]
    halves = []
    for turned in (faces, faces[:, ::-1]):
        try:
            halves.append(_boundary_of_matter(topology.points, turned, birth))
        except Declined:
            continue
    if not halves:
        raise Declined("nothing encloses a volume")
    points = np.concatenate([half[0] for half in halves])
    offset = len(halves[0][0])
    faces = np.concatenate([half[1] + number * offset for number, half in enumerate(halves)])
    birth = np.concatenate([half[2] for half in halves])
    return _as_draft(draft, _boundary_of_matter(points, faces, birth))


def _closed(draft: Draft) -> Topology:
    if (directed_balance(draft.topology) != 0).any():
        raise Declined("the surface is not closed")
    return draft.topology


def _boundary_of_matter(points, faces, birth):
    """Points, faces and births of the boundary of where the winding number is 1 or more."""
    try:
        from igl.copyleft.cgal import mesh_boolean
    except ImportError:
        raise Declined("needs the package libigl: install it") from None
    nothing = np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    for _ in range(ROUNDS):
        points, faces, origin = mesh_boolean(np.array(points), np.array(faces), *nothing, "union")
        points, faces, birth = _joined(points, faces, birth[origin])
        if len(faces) == 0:
            raise Declined("nothing encloses a volume")
        if not _crosses(points, faces):
            break
    return points, faces, birth


def _as_draft(draft: Draft, united) -> Draft:
    points, faces, birth = united
    faces, birth, specks = _without_specks(points, faces, birth, SPECK * draft.diagonal**3)
    if len(faces) == 0:
        raise Declined("nothing encloses a volume")
    before = int(draft.topology.live.sum())
    what = f"{before} faces became {len(faces)}" + (f", {specks} specks dropped" if specks else "")
    return Draft(draft.source, points, faces, birth, what)


def directed_balance(topology: Topology) -> NDArray[np.int64]:
    """(e,) how much oftener each edge is run through from its lesser point than from its greater one."""
    sides = topology.face_edges[topology.live].ravel()
    direction = np.where(topology.side_direction[topology.live].ravel(), 1, -1)
    return np.rint(np.bincount(sides, direction, minlength=len(topology.edges))).astype(np.int64)


def _joined(points, faces, birth):
    """Points that rounding made equal joined, faces that vanish with that dropped."""
    point, first = weld_exactly(points)
    faces = point[faces]
    a, b, c = faces.T
    keep = (a != b) & (b != c) & (c != a)
    return points[first], faces[keep], birth[keep]


def _crosses(points, faces) -> bool:
    from igl.copyleft.cgal import remesh_self_intersections

    found = remesh_self_intersections(np.array(points), np.array(faces), detect_only=True, first_only=True)
    return len(found[2]) > 0


def _without_specks(points, faces, birth, least: float):
    """The faces but for components of next to no volume."""
    from ..mesh import Mesh

    mesh = Mesh(points, faces)
    component = mesh.topology.component_of_face
    count = mesh.topology.component_count
    first = points[faces[:, 0]] - mesh.bounds.mean(axis=0)
    volumes = np.bincount(component, np.einsum("ij,ij->i", first, mesh.face_vectors) / 6, count)
    open_components = component[np.isin(mesh.topology.face_edges, mesh.topology.boundary_edges).any(axis=1)]
    speck = np.abs(volumes) < least
    speck[open_components] = False
    keep = ~speck[component]
    return faces[keep], birth[keep], int(speck.sum())
