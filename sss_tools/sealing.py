"""Holes closed for light alone: a mesh with caps on its boundary loops, made for a ray tracer and never written.

Faces are turned so that solids face outwards, every loop of what encloses a volume gets a cap that faces as the
surface around it does, and the loop is measured as light inside sees it. A cap that would pass through the surface it
closes, or through another cap of it, by more than a fold at its rim, is left out: there a count of the surfaces around
a place would say less than outside. One that passes through other components stays: solids that overlap count as one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .intersection import self_intersections
from .mesh import Mesh
from .rays import RayCaster, UnitFrame
from .repair.draft import Draft
from .repair.holes import cap_loop, missing_loops
from .repair.orientation import orient
from .winding import spread_by_area, winding_numbers

Float64 = NDArray[np.float64]
Indices = NDArray[np.int64]

FOLD = 0.01
"""Share of a cap's area that may lie in folds through its own component, at jags of the rim: there the count is wrong,
and paths take the material's colour."""
_PLACES = 1024
"""Faces before which is looked for places that are less than outside."""
BULGE = 1e-2
"""How far a cap that lies upon another one is bulged out, as a share of its width."""
_AWAY = 1e-4
"""How far behind a cap the ray starts that measures the room there, as a share of the mesh's longest side."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A boundary loop of what encloses a volume.

    edges       how many
    centroid    (3,) of its cap, or of its points where it has none, mesh units
    half_angle  degrees: of the cone with the solid angle that the loop takes of the sphere around the middle of the
                room behind it; NaN where it spans no area
    radius      half the depth of that room, mesh units
    width       longest side of the loop's box, mesh units
    capped      whether ``Sealed.mesh`` closes it
    """

    edges: int
    centroid: Float64
    half_angle: float
    radius: float
    width: float
    capped: bool


@dataclass(frozen=True, eq=False)
class Sealed:
    """A mesh as light shall meet it.

    mesh    the faces of the original in their order, some of them turned; then those of the caps
    faces   how many of them are the original's
    turned  how many were turned
    overlapping  whether caps pass through other components, or fold through their own
    loops   all loops, capped or not
    """

    mesh: Mesh
    faces: int
    turned: int
    overlapping: bool
    loops: tuple[Loop, ...]

    @property
    def closed(self) -> bool:
        """Whether every loop has its cap, and no open sheet is left."""
        return all(loop.capped for loop in self.loops) and len(self.mesh.topology.boundary_edges) == 0


@dataclass(frozen=True, eq=False)
class _Cap:
    """Corners (k, 3), those of the loop first, and triangles over them."""

    loop: Indices
    corners: Float64
    triangles: Indices

    @property
    def width(self) -> float:
        """The longest side of its box."""
        return float(np.ptp(self.corners, axis=0).max())

    @property
    def vectors(self) -> Float64:
        """(t, 3) along each triangle's normal, twice its area long."""
        a, b, c = (self.corners[self.triangles[:, side]] for side in range(3))
        return np.cross(b - a, c - a)

    @property
    def centroid(self) -> Float64:
        """(3,) of its surface; zero where it has no area."""
        areas = np.linalg.norm(self.vectors, axis=1)
        return areas @ self.corners[self.triangles].mean(axis=1) / max(areas.sum(), 1e-300)

    @property
    def normal(self) -> Float64:
        """(3,) unit mean normal; zero where it has none."""
        total = self.vectors.sum(axis=0)
        return total / max(float(np.linalg.norm(total)), 1e-300)


def seal(mesh: Mesh, caps: bool = True) -> Sealed:
    """The mesh with its solids turned outwards and, where ``caps`` says so, caps on the loops that can have one.

    Without caps the loops are measured all the same. Raises ValueError for a mesh without faces or with coordinates
    that are not finite.
    """
    draft = Draft.of(mesh)
    upright = orient(draft) or draft
    loops = missing_loops(upright)
    turned = int((upright.faces != draft.faces).any(axis=1).sum())
    body = upright.mesh
    whole = _Whole(body, _caps(upright, loops, smooth=True))
    crossing, overlapping = _crossing(whole)
    if crossing.any():
        plain = _caps(upright, loops, smooth=False)
        made = [simple if crosses else cap for cap, simple, crosses in zip(whole.caps, plain, crossing, strict=True)]
        whole = _Whole(body, made)
        crossing, overlapping = _crossing(whole)
    made = _apart(upright, whole.caps)
    measures = [_measured(loop, body.topology.points) for loop in loops]
    if loops:
        measures = _seen_from_inside(body, made, measures)
    kept = [cap if caps and not crosses else None for cap, crosses in zip(made, crossing, strict=True)]
    described = tuple(
        Loop(len(loop), *measure, float(np.ptp(body.topology.points[loop], axis=0).max()), cap is not None)
        for loop, measure, cap in zip(loops, measures, kept, strict=True)
    )
    # what was looked at has its topology already
    sealed = whole.mesh if kept == whole.caps else _Whole(body, kept).mesh
    return Sealed(sealed, len(body.faces), turned, overlapping, described)


def _caps(draft: Draft, loops: list[Indices], smooth: bool) -> list[_Cap | None]:
    """A cap for each loop; None where it cannot be triangulated."""
    topology, made = draft.topology, []
    on_rim = np.zeros(len(topology.points), bool)
    for loop in loops:
        on_rim[loop] = True
    chords = topology.edges[on_rim[topology.edges].all(axis=1)]
    for loop in loops:
        cap = cap_loop(topology, loop, chords, smooth)
        made.append(None if cap is None else _Cap(loop, *cap))
        if cap is not None:
            # points of the rim alone: no other cap knows the new ones
            rim = cap[1][(cap[1] < len(loop)).all(axis=1)]
            sides = np.concatenate([rim[:, [0, 1]], rim[:, [1, 2]], rim[:, [2, 0]]])
            chords = np.concatenate([chords, loop[sides]])
    return made


@dataclass(frozen=True, eq=False)
class _Whole:
    """A body with caps, or None where a loop has none."""

    body: Mesh
    caps: list[_Cap | None]

    @cached_property
    def mesh(self) -> Mesh:
        """The body, its exactly equal positions taken as one, and the caps after it."""
        topology = self.body.topology
        points, faces, count = [topology.points], [topology.faces], len(topology.points)
        for cap in self.caps:
            if cap is None:
                continue
            new = len(cap.corners) - len(cap.loop)
            number = np.concatenate([cap.loop, count + np.arange(new)])
            points.append(cap.corners[len(cap.loop) :])
            faces.append(number[cap.triangles])
            count += new
        return Mesh(np.concatenate(points), np.concatenate(faces))


def _crossing(joined: _Whole) -> tuple[NDArray[np.bool_], bool]:
    """(loops,) whether a cap passes through the component whose hole it closes by more than a fold, or is none; of two
    caps of one component that pass through each other, the larger one. And whether any cap meets any surface.

    Other components do no harm: shells that are closed each for themselves add up to a union.
    """
    body, caps = joined.body, joined.caps
    crosses = np.array([cap is None for cap in caps], bool)
    present = [cap for cap in caps if cap is not None]
    if not present:
        return crosses, False
    whole = joined.mesh
    owner = np.full(len(whole.faces), -1)
    owner[len(body.faces) :] = np.repeat(np.flatnonzero(~crosses), [len(cap.triangles) for cap in present])
    component = whole.topology.component_of_face
    # only what shares a cap's box can meet it
    near = owner >= 0
    lower, upper = _boxes(whole)
    for cap in present:
        meets = np.ones(len(owner), bool)
        for axis in range(3):
            meets &= lower[axis] <= cap.corners[:, axis].max()
            meets &= upper[axis] >= cap.corners[:, axis].min()
        near |= meets
    faces = np.flatnonzero(near)
    pairs = faces[self_intersections(Mesh(whole.vertices, whole.faces[faces]).topology)]
    pairs = pairs[(owner[pairs] >= 0).any(axis=1)]
    own = component[pairs[:, 0]] == component[pairs[:, 1]]
    first, second = owner[pairs[own]].T
    crosses[first[second < 0]] = crosses[second[first < 0]] = True
    crosses &= _folded_share(whole, owner, pairs[own], len(caps)) > FOLD
    size = [0.0 if cap is None else cap.width for cap in caps]
    for one, other in zip(first.tolist(), second.tolist(), strict=True):
        if one >= 0 and other >= 0 and one != other and not (crosses[one] or crosses[other]):
            crosses[max(one, other, key=size.__getitem__)] = True
    kept = own & ~crosses[np.maximum(owner[pairs], 0)].any(axis=1)
    remaining = [None if out else cap for cap, out in zip(caps, crosses, strict=True)]
    if kept.any() and _less_than_outside(_Whole(body, remaining).mesh) > FOLD:
        crosses[np.setdiff1d(owner[pairs[kept]], [-1])] = True
    return crosses, len(pairs) > 0


def _boxes(mesh: Mesh) -> tuple[list[Float64], list[Float64]]:
    """Least and greatest coordinates of each face, (m,) for each axis."""
    lower, upper = [], []
    for column in mesh.vertices.T:
        a, b, c = (column[corner] for corner in mesh.faces.T)
        lower.append(np.minimum(np.minimum(a, b), c))
        upper.append(np.maximum(np.maximum(a, b), c))
    return lower, upper


def _folded_share(whole: Mesh, owner: Indices, pairs: Indices, count: int) -> NDArray[np.float64]:
    """(count,) share of each cap's area in faces that pass through others; 1 for caps that are not there."""
    areas = np.where(owner >= 0, whole.face_areas, 0)
    folded = np.zeros(len(owner), bool)
    folded[pairs] = True
    total = np.bincount(np.maximum(owner, 0), areas, count)
    share = np.bincount(np.maximum(owner, 0), areas * folded, count)
    return np.divide(share, total, out=np.ones(count), where=total > 0)


def _less_than_outside(mesh: Mesh) -> float:
    """Share of the area before which the winding number is below zero: what a spike through a cap looks like."""
    from igl import fast_winding_number

    chosen = spread_by_area(mesh.face_areas, _PLACES)
    chosen = chosen[mesh.face_areas[chosen] > 0]
    centre = mesh.bounds.mean(axis=0)
    places = mesh.vertices[mesh.faces[chosen]].mean(axis=1) + _AWAY * mesh.longest_side * mesh.face_normals[chosen]
    winding = fast_winding_number(mesh.vertices - centre, np.ascontiguousarray(mesh.faces), places - centre)
    return float((winding < -0.5).mean())


def _apart(draft: Draft, caps: list[_Cap | None]) -> list[_Cap | None]:
    """The caps, the smaller of two that lie upon each other bulged out by a hair.

    A lid and the body under it, cut at one height, are closed by two caps in one plane: rays could not tell which
    comes first. With the bulge the solids overlap, and that is counted.
    """
    component = draft.topology.component_of_face
    of_point = np.zeros(len(draft.topology.points), np.int64)
    of_point[draft.topology.faces[draft.topology.live]] = component[draft.topology.live][:, None]
    caps = list(caps)
    flat = [(k, cap) for k, cap in enumerate(caps) if cap is not None and len(cap.corners) == len(cap.loop) > 3]
    for one, other in combinations(flat, 2):
        if of_point[one[1].loop[0]] != of_point[other[1].loop[0]] and _coincide(one[1], other[1]):
            place, smaller = min(one, other, key=lambda pair: pair[1].width)
            bulged = _bulged(smaller)
            if not _crossing(_Whole(draft.mesh, [bulged]))[0][0]:
                caps[place] = bulged
    return caps


def _coincide(one: _Cap, other: _Cap) -> bool:
    """Whether two flat caps lie in one plane, as far as rays can tell, with boxes that overlap."""
    lower = np.maximum(one.corners.min(axis=0), other.corners.min(axis=0))
    upper = np.minimum(one.corners.max(axis=0), other.corners.max(axis=0))
    width = max(one.width, other.width)
    if (lower > upper + BULGE * width).any():
        return False
    heights = (np.concatenate([one.corners, other.corners]) - one.corners.mean(axis=0)) @ one.normal
    return bool(np.abs(heights).max() < BULGE * width / 2)


def _bulged(cap: _Cap) -> _Cap:
    """A fan from the middle of a flat cap's loop, moved outwards by ``BULGE`` of its width."""
    count = len(cap.loop)
    apex = cap.corners.mean(axis=0) + BULGE * cap.width * cap.normal
    start = np.arange(count)
    fan = np.stack([start, (start + 1) % count, np.full(count, count)], axis=1)
    return _Cap(cap.loop, np.concatenate([cap.corners, apex[None]]), fan)


def _measured(loop: Indices, points: Float64) -> tuple[Float64, float, float]:
    """What a loop is without a cap: its middle, no angle, half its width."""
    corners = points[loop]
    middle = corners.mean(axis=0)
    return middle, np.nan, float(np.linalg.norm(corners - middle, axis=1).max())


def _seen_from_inside(body: Mesh, caps: list[_Cap | None], measures: list) -> list[tuple[Float64, float, float]]:
    """Middle, half angle and radius of each loop that has a triangulation; the others' as given.

    The room behind a cap reaches from its middle, straight in, to the next surface: in a ball that is its diameter.
    """
    frame = UnitFrame.around(*body.bounds)
    faced = [(k, cap) for k, cap in enumerate(caps) if cap is not None and cap.normal.any()]
    if not faced:
        return measures
    inwards = -np.array([cap.normal for _, cap in faced])
    centre = np.array([cap.centroid for _, cap in faced])
    inside = frame.points_in(centre) + _AWAY * inwards
    distance, hit = RayCaster(frame.points_in(body.vertices), body.faces).closest(
        np.ascontiguousarray(inside.T, np.float32), np.ascontiguousarray(inwards.T, np.float32)
    )
    measures = list(measures)
    for n, (k, cap) in enumerate(faced):
        radius = measures[k][2]
        if hit[n] >= 0:
            radius = float(distance[n] + _AWAY) * frame.scale / 2
        place = centre[n] + radius * inwards[n]
        share = abs(float(winding_numbers(place, cap.corners, cap.triangles)[0]))
        half_angle = float(np.degrees(np.arccos(np.clip(1 - 2 * share, -1, 1))))
        measures[k] = (centre[n], half_angle, radius)
    return measures
