"""A mesh on its way through the ladder: points and faces, and which face of the file each one stems from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..closedness import Assessment, assess
from ..mesh import Body, Mesh
from ..topology import Topology

Points = NDArray[np.float64]
Indices = NDArray[np.int64]


class Declined(Exception):
    """A rung that cannot be taken says why; it ends as ``skipped`` with this reason."""


@dataclass(frozen=True, eq=False)
class Draft:
    """Geometry under repair. Rungs move points and faces; attributes come back in ``finished``.

    source  the mesh as the file has it
    points  (k, 3) float64, no two alike
    faces   (m, 3) int64 over points
    birth   (m,) int64 the face of the source that each face is a part of, or continues
    note    what the last rung did, in a few words
    """

    source: Mesh
    points: Points
    faces: Indices
    birth: Indices
    note: str = ""

    @classmethod
    def of(cls, mesh: Mesh) -> Draft:
        """The mesh with exactly equal positions taken as one point."""
        return cls(mesh, mesh.topology.points, mesh.topology.faces, np.arange(len(mesh.faces)))

    @cached_property
    def mesh(self) -> Mesh:
        """The geometry alone, without points that no face uses; the source itself where that is all it is."""
        used = np.zeros(len(self.points), bool)
        used[self.faces] = True
        if self._as_in_source and used.all() and len(self.points) == len(self.source.vertices):
            return self.source
        return Mesh(self.points[used], (np.cumsum(used) - 1)[self.faces])

    @property
    def _as_in_source(self) -> bool:
        topology = self.source.topology
        return self.points is topology.points and self.faces is topology.faces

    @property
    def topology(self) -> Topology:
        """Over ``mesh``."""
        return self.mesh.topology

    @cached_property
    def assessment(self) -> Assessment:
        """Components, roles and holes of ``mesh``. Raises ValueError where no face is left."""
        # which looks at welded points in use alone
        return assess(self.source if self._as_in_source else self.mesh)

    @property
    def diagonal(self) -> float:
        """Of the source's bounding box, mesh units: tolerances do not change on the way."""
        return self.source.diagonal

    def with_faces(self, faces: Indices, note: str, keep=None, points: Points | None = None) -> Draft:
        """Other faces over ``mesh``'s points (or other ``points``), of those of ``keep`` (m,) where that is given."""
        points = self.mesh.vertices if points is None else points
        birth = self.birth if keep is None else self.birth[keep]
        return Draft(self.source, points, faces if keep is None else faces[keep], birth, note)

    def noted(self, note: str) -> Draft:
        """The same geometry with another note."""
        return replace(self, note=note)

    def finished(self) -> Mesh:
        """The result as a mesh with the source's bodies and vertex attributes.

        A corner at a position of its birth face takes that corner's attributes, any other corner what the face
        has there by linear interpolation (clamped to the face).
        """
        source = self.source
        bodies = np.array([body.first_face for body in source.bodies])
        # bodies without faces start where the next one does: the last of equal starts owns the face
        body = np.searchsorted(bodies, self.birth, side="right") - 1
        order = np.argsort(body, kind="stable")
        faces, birth = self.faces[order], self.birth[order]
        counts = np.bincount(body, minlength=len(bodies))
        firsts = np.concatenate([[0], np.cumsum(counts)])
        kept = tuple(
            Body(old.name, int(firsts[n]), int(counts[n]), old.material)
            for n, old in enumerate(source.bodies)
            if counts[n]
        )
        used, point_of_corner = np.unique(faces, return_inverse=True)
        points, point_of_corner = self.points[used], point_of_corner.reshape(-1)
        if not source.vertex_attributes:
            return Mesh(points, point_of_corner.reshape(-1, 3), kept)
        weights = _weights_in_birth(source, points[point_of_corner].reshape(-1, 3, 3), birth)
        columns, attributes = [point_of_corner[:, None].astype(float)], {}
        for name, values in source.vertex_attributes.items():
            corners = np.einsum("fck,fka->fca", weights, values[source.faces[birth]].astype(float))
            if name == "normal":
                length = np.linalg.norm(corners, axis=2, keepdims=True)
                corners = np.divide(corners, length, out=corners, where=length > 0)
            if np.issubdtype(values.dtype, np.integer):
                corners = np.rint(corners)
            attributes[name] = corners.reshape(len(point_of_corner), -1).astype(values.dtype)
            columns.append(attributes[name].astype(float))
        # corners that agree in position and all attributes are one vertex
        _, first, vertex = np.unique(np.concatenate(columns, axis=1), axis=0, return_index=True, return_inverse=True)
        return Mesh(
            points[point_of_corner[first]],
            vertex.reshape(-1, 3),
            kept,
            {name: values[first] for name, values in attributes.items()},
        )


def _weights_in_birth(source: Mesh, corners: Points, birth: Indices) -> NDArray[np.float64]:
    """(f, 3, 3) barycentric weights of each corner (f, 3, 3) in the birth face, clamped to it."""
    a, b, c = (source.vertices[source.faces[birth, k]][:, None] for k in range(3))
    u, v, w = b - a, c - a, corners - a
    uu, uv, vv = ((x * y).sum(-1) for x, y in ((u, u), (u, v), (v, v)))
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    determinant = uu * vv - uv * uv
    safe = np.where(determinant > 0, determinant, 1)
    second = np.where(determinant > 0, (vv * wu - uv * wv) / safe, 0)
    third = np.where(determinant > 0, (uu * wv - uv * wu) / safe, 0)
    weights = np.clip(np.stack([1 - second - third, second, third], axis=-1), 0, None)
    weights /= weights.sum(-1, keepdims=True)
    original = np.stack([a, b, c], axis=2)  # (f, 1, 3, 3)
    same = (corners[:, :, None] == original).all(-1)
    first = same & (np.cumsum(same, axis=-1) == 1)
    return np.where(same.any(-1, keepdims=True), first.astype(float), weights)
