"""Where findings are: each one taken apart into the places a reader would point at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sss_tools.mesh import Mesh
from sss_tools.validation.outcome import RuleReport, Severity

from . import palette
from .specimen import Inspection, Specimen

SPOTS = 60
"""Places told apart in one finding, the largest first; the rest share one more."""

SLIVER = 1e-9
"""Twice the area, in the frame, below which a place has no normal to speak of."""

Indices = NDArray[np.int64]

URGENCY = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}
"""Rank of severities, the most urgent first."""


@dataclass(frozen=True, eq=False)
class Spot:
    """One place of a finding. Lengths and places are those of the inspection's frame.

    specimen  number of the mesh
    code, name, severity, waived, colour   of the rule
    centre    (3,) in the middle
    radius    of the ball about the centre that holds it
    normal    (3,) mean outward normal of the surface there; zero where it has none
    faces     (f,) faces in it
    edges     (e, 2) vertices at the ends of edges in it
    vertices  (v,) vertices that are all there is to see of it
    places    how many places it stands for: 1, but for the one that holds all beyond the first ``SPOTS``
    """

    specimen: int
    code: str
    name: str
    severity: Severity
    waived: bool
    colour: palette.Colour
    centre: NDArray[np.float64]
    radius: float
    normal: NDArray[np.float64]
    faces: Indices
    edges: Indices
    vertices: Indices
    places: int = 1


def find_spots(inspection: Inspection) -> list[Spot]:
    """The places of all findings: errors first, then by code, large before small."""
    frame = inspection.frame
    spots = []
    for number, specimen in enumerate(inspection.specimens):
        points = frame.points_in(specimen.mesh.vertices)
        for rule in specimen.findings:
            spots += _spots(number, specimen, rule, points, frame.scale)
    return sorted(spots, key=lambda spot: (URGENCY[spot.severity], spot.waived, spot.specimen, spot.code))


def faces_of(rule: RuleReport) -> Indices:
    """(f,) all faces that a rule names, by themselves or in pairs."""
    pairs = np.asarray(rule.face_pairs, np.int64).ravel()
    return np.union1d(np.asarray(rule.faces, np.int64), pairs)


def _spots(number: int, specimen: Specimen, rule: RuleReport, points, scale: float) -> list[Spot]:
    mesh = specimen.mesh
    faces = faces_of(rule)
    edges = np.asarray(rule.edges, np.int64).reshape(-1, 2)
    vertices = np.asarray(rule.vertices, np.int64)
    # the most precise thing known says where it is, as in the report; faces come along
    if len(vertices):
        groups = _connected(mesh, vertices[:, None])
        kind = vertices[:, None]
    elif len(edges):
        groups = _connected(mesh, edges)
        kind = edges
    elif len(faces):
        groups = _connected(mesh, mesh.faces[faces])
        kind = mesh.faces[faces]
    else:
        return []
    extents = np.bincount(groups)
    order = np.argsort(-extents, kind="stable")
    found = []
    for rank, group in enumerate(order[:SPOTS]):
        rest = rank == SPOTS - 1 and len(order) > SPOTS
        members = np.flatnonzero(np.isin(groups, order[rank:])) if rest else np.flatnonzero(groups == group)
        places = points[np.unique(kind[members])]
        places = places[np.isfinite(places).all(axis=1)]
        if not len(places):
            places = _beside(mesh, np.unique(kind[members]), points)
        if not len(places):
            continue
        centre = places.mean(axis=0)
        its_faces = _faces_there(mesh, faces, kind, members)
        normal = mesh.face_vectors[its_faces]
        normal = normal[np.isfinite(normal).all(axis=1)].sum(axis=0)
        length = float(np.linalg.norm(normal))
        found.append(
            Spot(
                number, rule.code, rule.name, rule.severity, rule.reason is not None, palette.of_rule(rule),
                centre, float(np.linalg.norm(places - centre, axis=1).max()),
                normal / length if SLIVER * scale**2 < length < np.inf else np.zeros(3),
                its_faces, edges[members] if kind is edges else np.empty((0, 2), np.int64),
                vertices[members] if kind.shape[1] == 1 else np.empty(0, np.int64),
                len(order) - SPOTS + 1 if rest else 1,
            )
        )  # fmt: skip
    return found


def _beside(mesh: Mesh, vertices: Indices, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Finite points that share a face with vertices that are not finite."""
    near = mesh.faces[np.isin(mesh.faces, vertices).any(axis=1)]
    places = points[np.unique(near)]
    return places[np.isfinite(places).all(axis=1)]


def _faces_there(mesh: Mesh, faces: Indices, kind: Indices, members: Indices) -> Indices:
    """The faces of a finding at some of its edges or vertices; all faces there where it names none."""
    if kind.shape[1] == 3:
        return faces[members]
    candidates = faces if len(faces) else np.arange(len(mesh.faces))
    there = np.zeros(len(mesh.vertices), bool)
    there[kind[members]] = True
    corners = there[mesh.faces[candidates]].sum(axis=1)
    return candidates[corners >= kind.shape[1]]


def _connected(mesh: Mesh, items: Indices) -> Indices:
    """(k,) number of the connected group that each item (k, c), a set of vertices, belongs to.

    Items are connected that share a position: seams in the file are none in space.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    used, place = np.unique(items, return_inverse=True)
    _, point = np.unique(mesh.vertices[used], axis=0, return_inverse=True)
    point = point.reshape(-1)[place.reshape(items.shape)]
    ends = np.roll(point, -1, axis=1)
    ones = np.ones(point.size, np.int8)
    graph = coo_array((ones, (point.ravel(), ends.ravel())), shape=(point.max() + 1, point.max() + 1))
    _, label = connected_components(graph, directed=False)
    return np.unique(label[point[:, 0]], return_inverse=True)[1].reshape(-1)
