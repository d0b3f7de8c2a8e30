"""Large caps made as fine as their surroundings, and as smooth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh

ROUNDS = 8
LIMIT = 20_000
"""Faces of one cap at most."""


def refine(points, triangles) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Split long inner edges at their middles and flip edges until the cap is about as fine as its rim.

    points (n, 3) the rim in order; triangles (t, 3). Returns the rim followed by new points, and the triangles.
    After Liepa, "Filling holes in meshes", SGP 2003, section 4, with edges split rather than faces.
    """
    target = 1.5 * float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).mean())
    for _ in range(ROUNDS):
        triangles = _flipped_to_delaunay(points, triangles)
        topology = Mesh(points, triangles).topology
        edges = topology.edges
        if len(topology.points) != len(points):
            break
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        long = np.flatnonzero((topology.faces_per_edge == 2) & (length > target))
        if len(long) == 0 or len(triangles) > LIMIT:
            break
        points, triangles = _split(points, triangles, topology, long[np.argsort(-length[long], kind="stable")])
    return points, _flipped_to_delaunay(points, triangles)


def _split(points, triangles, topology, long):
    """Every edge of ``long`` split that shares no face with one before it."""
    faces_of = _two_faces(topology)
    used = np.zeros(len(triangles), bool)
    picked = []
    for edge in long:
        if not used[faces_of[edge]].any():
            used[faces_of[edge]] = True
            picked.append(edge)
    chosen = np.array(picked)
    middle = len(points) + np.arange(len(chosen))
    points = np.concatenate([points, points[topology.edges[chosen]].mean(axis=1)])
    new = [triangles[~used]]
    for column in range(2):
        face = faces_of[chosen, column]
        side = np.argmax(topology.face_edges[face] == chosen[:, None], axis=1)
        a, b, c = (triangles[face, (side + k) % 3] for k in range(3))
        new += [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return points, np.concatenate(new)


def _two_faces(topology) -> NDArray[np.int64]:
    """(e, 2) the faces of each edge; the same one twice at a boundary."""
    flat = topology.face_edges.ravel()
    order = np.argsort(flat, kind="stable")
    starts = np.searchsorted(flat[order], np.arange(len(topology.edges)))
    last = starts + topology.faces_per_edge - 1
    return np.stack([order[starts] // 3, order[last] // 3], axis=1)


def _flipped_to_delaunay(points, triangles, rounds: int = 10) -> NDArray[np.int64]:
    """Inner edges flipped while the angles opposite to them add up to more than half a turn."""
    triangles = triangles.copy()
    for _ in range(rounds):
        topology = Mesh(points, triangles).topology
        if len(topology.points) != len(points):
            break
        inner = np.flatnonzero(topology.faces_per_edge == 2)
        if len(inner) == 0:
            break
        pair = _two_faces(topology)[inner]
        side = [np.argmax(topology.face_edges[pair[:, k]] == inner[:, None], axis=1) for k in range(2)]
        a, b, tip = (triangles[pair[:, 0], (side[0] + k) % 3] for k in range(3))
        far = triangles[pair[:, 1], (side[1] + 2) % 3]
        angle = _angle(points, a, tip, b) + _angle(points, a, far, b)
        # flipped, neither new triangle may stand on its head
        normal = np.cross(points[b] - points[a], points[tip] - points[a])
        first = np.cross(points[far] - points[a], points[tip] - points[a])
        second = np.cross(points[b] - points[far], points[tip] - points[far])
        sound = ((first * normal).sum(1) > 0) & ((second * normal).sum(1) > 0) & (far != tip)
        keys = topology.edges[:, 0] * len(points) + topology.edges[:, 1]
        fresh = ~np.isin(np.minimum(tip, far) * len(points) + np.maximum(tip, far), keys)
        wanted = np.flatnonzero((angle > np.pi + 1e-6) & sound & fresh)
        if len(wanted) == 0:
            break
        used, made = np.zeros(len(triangles), bool), set()
        for n in wanted[np.argsort(-angle[wanted], kind="stable")]:
            chord = (min(tip[n], far[n]), max(tip[n], far[n]))
            if used[pair[n]].any() or chord in made:
                continue
            used[pair[n]] = True
            made.add(chord)
            triangles[pair[n, 0]] = (a[n], far[n], tip[n])
            triangles[pair[n, 1]] = (far[n], b[n], tip[n])
    return triangles


def _angle(points, a, at, b) -> NDArray[np.float64]:
    u, v = points[a] - points[at], points[b] - points[at]
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))


def fair(points, triangles, rim: int, topology, loop) -> NDArray[np.float64]:
    """Inner points moved so that the cap goes on smoothly from the surface round it: least bending.

    Minimises the squares of the umbrella operator over the cap and its rim, the surface held (Kobbelt et al.,
    "Interactive multi-resolution modeling on arbitrary meshes", SIGGRAPH 1998, section 3).
    """
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import spsolve

    inner = len(points) - rim
    if inner == 0:
        return points
    edges = Mesh(points, triangles).topology.edges
    # the rim's neighbours in the surface, numbered after the cap's points
    touching = topology.edges[np.isin(topology.edges, loop).any(axis=1)]
    outside = np.setdiff1d(touching, loop)
    number = np.full(len(topology.points), -1)
    number[loop], number[outside] = np.arange(rim), len(points) + np.arange(len(outside))
    links = np.concatenate([edges, number[touching[np.isin(touching, outside).any(axis=1)]]])
    every = np.concatenate([points, topology.points[outside]])
    start, end = np.concatenate([links, links[:, ::-1]]).T
    start, end = start[start < len(points)], end[start < len(points)]
    degree = np.bincount(start, minlength=len(points))
    shape = (len(points), len(every))
    umbrella = coo_array((1 / degree[start], (start, end)), shape=shape).tocsr()
    identity = coo_array((np.ones(len(points)), (np.arange(len(points)),) * 2), shape=shape).tocsr()
    operator = (umbrella - identity).tocsc()
    free = np.arange(rim, len(points))
    held = np.setdiff1d(np.arange(len(every)), free)
    centre = every.mean(axis=0)
    right = -(operator[:, held] @ (every[held] - centre))
    matrix = operator[:, free]
    moved = spsolve((matrix.T @ matrix).tocsc(), matrix.T @ right).reshape(-1, 3) + centre
    if not np.isfinite(moved).all():
        return points
    return np.concatenate([points[:rim], moved])
