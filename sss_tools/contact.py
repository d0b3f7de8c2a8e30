"""Two meshes in one place: where they meet, what of one lies in the other, where they are too near."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .box_tree import BoxTree
from .intersection import self_intersections
from .mesh import Mesh
from .topology import Topology
from .winding import spread_by_area, winding_numbers

Indices = NDArray[np.int64]

SOLID = 0.5
"""From this winding number on (in size), a point counts as inside a solid."""


def common_faces(mesh: Mesh, other: Mesh) -> Indices:
    """(f,) faces of ``mesh`` that meet a face of ``other``, be it in one point: exact."""
    both = Mesh(
        np.concatenate([mesh.vertices, other.vertices]), np.concatenate([mesh.faces, other.faces + len(mesh.vertices)])
    )
    topology = Topology(both)
    pairs = self_intersections(topology)
    count = len(mesh.faces)
    crossing = pairs[(pairs[:, 0] < count) & (pairs[:, 1] >= count), 0]
    # what has a point of the other is no intersection there but a neighbour
    shared = np.zeros(len(topology.points), bool)
    shared[topology.faces[count:]] = True
    return np.union1d(crossing, np.flatnonzero(shared[topology.faces[:count]].any(axis=1)))


def lies_within(mesh: Mesh, other: Mesh) -> bool:
    """Whether most of a few points of the surface of ``mesh`` lie inside the solid ``other``."""
    chosen = spread_by_area(mesh.face_areas, 5)
    samples = mesh.vertices[mesh.faces[chosen]].mean(axis=1)
    lower, upper = other.bounds
    if len(samples) == 0 or not ((samples >= lower) & (samples <= upper)).all(axis=1).any():
        return False
    return bool(np.median(np.abs(winding_numbers(samples, other.vertices, other.faces))) > SOLID)


def near_faces(mesh: Mesh, other: Mesh, distance: float) -> tuple[Indices, float]:
    """(f,) faces of ``mesh`` within ``distance`` of a face of ``other`` (mesh units), and the least gap found.

    The gap is inf where nothing is so near, and 0 where they meet.
    """
    corners = [part.vertices[part.faces] for part in (mesh, other)]
    middle = mesh.bounds.mean(axis=0)
    corners = [part - middle for part in corners]
    lower = np.concatenate([corners[0].min(axis=1) - distance, corners[1].min(axis=1)])
    upper = np.concatenate([corners[0].max(axis=1) + distance, corners[1].max(axis=1)])
    count = len(mesh.faces)
    tree = BoxTree(lower.T, upper.T, (np.arange(len(lower)) >= count).astype(np.int64))
    found = tree.for_each_block(lambda a, b: np.stack([tree.order[a], tree.order[b]], axis=1))
    pairs = np.sort(np.concatenate([np.zeros((0, 2), np.int64), *found]), axis=1)
    first, second = corners[0][pairs[:, 0]], corners[1][pairs[:, 1] - count]
    gaps = _gaps(first, second)
    # sides that pass through the inside of the other face have no near ends
    gaps[np.isin(pairs[:, 0], common_faces(mesh, other)) & (gaps <= distance)] = 0.0
    near = gaps <= distance
    return np.unique(pairs[near, 0]), float(gaps[near].min(initial=np.inf))


def _gaps(first, second) -> NDArray[np.float64]:
    """(n,) distances of triangles (n, 3, 3) that do not meet: corner to face, or side to side."""
    gaps = np.full(len(first), np.inf)
    for one, other in ((first, second), (second, first)):
        for k in range(3):
            np.minimum(gaps, _point_to_triangle(one[:, k], other), out=gaps)
    for i in range(3):
        for j in range(3):
            pair = first[:, i], first[:, (i + 1) % 3], second[:, j], second[:, (j + 1) % 3]
            np.minimum(gaps, _segment_to_segment(*pair), out=gaps)
    return gaps


def _point_to_triangle(point, triangle):
    """(n,) distance where the foot of the perpendicular lies in the triangle, else inf: sides serve the rest."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    within = length > 0
    for start, end in ((a, b), (b, c), (c, a)):
        within &= np.einsum("ij,ij->i", np.cross(end - start, point - start), normal) >= 0
    height = np.abs(np.einsum("ij,ij->i", point - a, normal))
    return np.divide(height, length, out=np.full(len(length), np.inf), where=within)


def _segment_to_segment(p, q, r, s):
    """(n,) distances of segments p - q and r - s. Ericson 2005, Real-Time Collision Detection, section 5.1.9."""
    u, v, w = q - p, s - r, p - r
    a, e = np.einsum("ij,ij->i", u, u), np.einsum("ij,ij->i", v, v)
    b, c, f = np.einsum("ij,ij->i", u, v), np.einsum("ij,ij->i", u, w), np.einsum("ij,ij->i", v, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.clip(np.nan_to_num((b * f - c * e) / (a * e - b * b)), 0, 1)
        y = np.nan_to_num((b * x + f) / e)
        clipped = np.clip(y, 0, 1)
        x = np.where(y == clipped, x, np.clip(np.nan_to_num((b * clipped - c) / a), 0, 1))
    return np.linalg.norm(w + x[:, None] * u - clipped[:, None] * v, axis=1)
