"""Rung ``split``: where solids touch in an edge or a point, each gets its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology import connected_components
from .draft import Draft
from .judge import count_crossing_faces

APART = 2e-5
"""How far the copies of a shared point are drawn apart, as a share of the diagonal: twice the weld tolerance, and
twenty times the ray offset. Otherwise the next exact weld would join them again."""

NEAR = 0.1
"""And no farther than this share of the shortest edge there."""


def split_non_manifold(draft: Draft) -> Draft | None:
    """Cut at edges with more than two faces and at pinches, and stitch up again what belongs to one sheet.

    Round an edge the faces are sorted by angle; two with matter between them belong together, so that solids that
    share an edge come apart. Every fan of faces gets its own copy of the point, drawn back a little.
    """
    topology = draft.topology
    if len(topology.nonmanifold_edges) == 0 and len(topology.pinched_points) == 0:
        return None
    faces, fan_point, split = _fans(topology)
    still = _still_shared(topology, faces)
    if len(still):
        # both ends hold together by other ways: a point in the middle lets the sheets part there
        draft = _with_middles(draft, still)
        topology = draft.topology
        faces, fan_point, split = _fans(topology)
    if len(split) == 0:
        return None
    best, fewest = None, None
    for way in ("inwards", "outwards", "back"):
        points = _drawn_apart(topology.points, fan_point, faces, split, way, draft.diagonal)
        candidate = draft.with_faces(faces, f"{len(split)} copies of shared points drawn apart", points=points)
        crossings = count_crossing_faces(candidate.mesh)
        if fewest is None or (crossings or 0) < fewest:
            best, fewest = candidate, crossings or 0
        if fewest == 0:
            break
    return best


def _still_shared(topology, faces) -> NDArray[np.int64]:
    """The non-manifold edges of ``topology`` two sheets of which run between the same points of ``faces``."""
    shared = np.isin(topology.face_edges, topology.nonmanifold_edges)
    face, side = np.nonzero(shared)
    ends = np.sort(np.stack([faces[face, side], faces[face, (side + 1) % 3]], axis=1), axis=1)
    _, which, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    return np.unique(topology.face_edges[face, side][uses[which.ravel()] > 2])


def _with_middles(draft: Draft, edges) -> Draft:
    """The draft with a new point in the middle of each of the topology's ``edges``, all faces there cut in two."""
    topology = draft.topology
    middle_of = {
        tuple(ends): len(topology.points) + number for number, ends in enumerate(topology.edges[edges].tolist())
    }
    points = np.concatenate([draft.mesh.vertices, topology.points[topology.edges[edges]].mean(axis=1)])
    cut = np.isin(topology.face_edges, edges).any(axis=1)
    faces, birth = [], []
    for face in np.flatnonzero(cut):
        waiting = [tuple(topology.faces[face].tolist())]
        while waiting:
            corner = waiting.pop()
            for k in range(3):
                a, b, c = corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3]
                middle = middle_of.get((min(a, b), max(a, b)))
                if middle is not None:
                    waiting += [(a, middle, c), (middle, b, c)]
                    break
            else:
                faces.append(corner)
                birth.append(draft.birth[face])
    return Draft(
        draft.source,
        points,
        np.concatenate([topology.faces[~cut], np.array(faces, np.int64).reshape(-1, 3)]),
        np.concatenate([draft.birth[~cut], np.array(birth, np.int64)]),
    )


def _fans(topology) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Faces over one point a fan; which old point each new one is; the new points that are copies.

    New points that stand alone keep the old number; further fans are numbered behind.
    """
    count = len(topology.faces)
    tail, head = _corners_of_sides(topology)
    first, second = _joined_sides(topology)
    label = connected_components(
        3 * count,
        np.concatenate([tail[first], head[first]]),
        np.concatenate([tail[second], head[second]]),
    )
    corner_point = topology.faces.ravel()
    corners = np.flatnonzero(np.repeat(topology.live, 3))
    _, one, fan_of_corner = np.unique(label[corners], return_index=True, return_inverse=True)
    point_of_fan = corner_point[corners[one]]
    order = np.argsort(point_of_fan, kind="stable")
    again = np.zeros(len(order), bool)
    again[1:] = point_of_fan[order[1:]] == point_of_fan[order[:-1]]
    number = np.empty(len(order), np.int64)
    number[order[~again]] = point_of_fan[order[~again]]
    extra = order[again]
    number[extra] = len(topology.points) + np.arange(len(extra))
    fan_point = np.concatenate([np.arange(len(topology.points)), point_of_fan[extra]])
    faces = topology.faces.copy().ravel()
    faces[corners] = number[fan_of_corner.ravel()]
    several = np.unique(point_of_fan[extra])
    return faces.reshape(-1, 3), fan_point, np.flatnonzero(np.isin(fan_point, several))


def _corners_of_sides(topology) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For each side (3 * face + k) its corners at the edge's lesser and greater point."""
    side = np.arange(3 * len(topology.faces))
    following = side // 3 * 3 + (side + 1) % 3
    forward = topology.side_direction.ravel()
    return np.where(forward, side, following), np.where(forward, following, side)


def _joined_sides(topology) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of sides that stay together: both of a two-faced edge, by angle where there are more."""
    edge = topology.face_edges.ravel()
    sides = np.flatnonzero(edge >= 0)
    sides = sides[np.argsort(edge[sides], kind="stable")]
    two = sides[topology.faces_per_edge[edge[sides]] == 2]
    first, second = [two[0::2]], [two[1::2]]
    many = sides[topology.faces_per_edge[edge[sides]] > 2]
    for group in np.split(many, np.flatnonzero(np.diff(edge[many])) + 1):
        if len(group):
            pairs = _wedges(topology, group)
            first.append(pairs[:, 0])
            second.append(pairs[:, 1])
    return np.concatenate(first), np.concatenate(second)


def _wedges(topology, sides) -> NDArray[np.int64]:
    """(w, 2) sides at one edge with matter between their faces.

    Counter-clockwise round the edge, matter begins at a face that runs through it backwards and ends at one
    that runs forwards; wedges within wedges close like brackets.
    """
    points = topology.points
    a, b = points[topology.edges[topology.face_edges.ravel()[sides[0]]]]
    axis = (b - a) / max(np.linalg.norm(b - a), 1e-300)
    tips = points[topology.faces[sides // 3, (sides + 2) % 3]] - a
    tips -= (tips @ axis)[:, None] * axis
    u = tips[0] / max(np.linalg.norm(tips[0]), 1e-300)
    angle = np.arctan2(tips @ np.cross(axis, u), tips @ u) % (2 * np.pi)
    forward = topology.side_direction.ravel()[sides]
    # of faces at one angle those that end matter come first
    order = np.lexsort((~forward, np.round(angle, 12)))
    pairs: list[tuple[int, int]] = []
    waiting: list[int] = []
    for place in np.concatenate([order, order]):
        side = sides[place]
        if not forward[place]:
            if side not in waiting and all(side not in pair for pair in pairs):
                waiting.append(side)
        elif waiting and all(side not in pair for pair in pairs):
            pairs.append((waiting.pop(), side))
    return np.array(pairs, np.int64).reshape(-1, 2)


def _drawn_apart(points, fan_point, faces, split, way: str, diagonal: float) -> NDArray[np.float64]:
    """The points of all fans, those of ``split`` moved: inwards, outwards, or back towards their fan."""
    places = points[fan_point]
    moved = places.copy()
    index = np.full(len(places), -1)
    index[split] = np.arange(len(split))
    face, corner = np.nonzero(index[faces] >= 0)
    own = index[faces[face, corner]]
    here = places[faces[face, corner]]
    ahead, behind = places[faces[face, (corner + 1) % 3]] - here, places[faces[face, (corner + 2) % 3]] - here
    lengths = [np.linalg.norm(edge, axis=1) for edge in (ahead, behind)]
    shortest = np.full(len(split), np.inf)
    for length in lengths:
        np.minimum.at(shortest, own, np.where(length > 0, length, np.inf))
    unit = [edge / np.maximum(length, 1e-300)[:, None] for edge, length in zip((ahead, behind), lengths, strict=True)]
    if way == "back":
        pull = unit[0] + unit[1]
    else:
        # the normal, weighted by the angle at the corner
        normal = np.cross(unit[0], unit[1])
        size = np.linalg.norm(normal, axis=1)
        angle = np.arctan2(size, (unit[0] * unit[1]).sum(axis=1))
        pull = normal * (angle / np.maximum(size, 1e-300))[:, None] * (-1 if way == "inwards" else 1)
    total = np.zeros((len(split), 3))
    np.add.at(total, own, pull)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    direction = np.divide(total, length, out=np.zeros_like(total), where=length > 1e-9)
    moved[split] += direction * np.minimum(APART * diagonal, NEAR * shortest)[:, None]
    return moved
