"""Normals at points of a mesh, and between them: what smooth shading shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sss_tools.mesh import Mesh

from ..scene.description import SceneObject

Float32 = NDArray[np.float32]


class SmoothNormals:
    """Normals at the corners of triangles, interpolated on objects with ``normals = "smooth"``."""

    def __init__(self, objects: Sequence[SceneObject], triangle_count: int):
        self._corners = np.zeros((triangle_count, 3, 3), np.float32)
        self._applies = np.zeros(triangle_count, bool)
        first = 0
        for thing in objects:
            last = first + len(thing.mesh.faces)
            if thing.normals == "smooth":
                self._corners[first:last] = corner_normals(thing.mesh)
                self._applies[first:last] = True
            first = last

    def corners(self, flat: Float32) -> Float32:
        """(t, 3, 3) normals at the corners of all triangles; ``flat`` (t, 3, 3) on objects that are not smooth."""
        return np.where(self._applies[:, None, None], self._corners, flat)

    def interpolate(self, weights: Float32, triangle: NDArray[np.int32], flat: Float32) -> Float32:
        """(3, n) unit normals at barycentric ``weights`` (3, n); ``flat`` (3, n) where the object is not smooth."""
        mixed = np.einsum("ki,ikj->ji", weights, self._corners[triangle])
        length = np.sqrt(np.einsum("ij,ij->j", mixed, mixed))
        usable = np.take(self._applies, triangle) & (length > 1e-6)
        return np.where(usable, mixed / np.maximum(length, np.float32(1e-6)), flat)


def corner_normals(mesh: Mesh) -> Float32:
    """(m, 3, 3) ``point_normals`` at the three corners of each face."""
    return point_normals(mesh)[mesh.topology.faces].astype(np.float32)


def point_normals(mesh: Mesh) -> NDArray[np.float64]:
    """(k, 3) unit normals at the points of ``mesh.topology``; zero where the faces around say nothing.

    The mean of the normals of the faces around, weighted by the corner's angle (Thuermer & Wuthrich 1998, JGT
    3(1)), so that it does not matter how sides are cut into triangles, over exactly coincident vertices, so that
    UV seams do not show.
    """
    topology = mesh.topology
    corners = mesh.vertices[mesh.faces]
    total = np.zeros_like(topology.points)
    for k in range(3):
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
        for axis in range(3):
            total[:, axis] += np.bincount(topology.faces[:, k], angle * mesh.face_normals[:, axis], len(total))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)
