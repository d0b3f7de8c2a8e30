"""Vertices, faces, and what follows directly from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .topology import Topology


@dataclass(frozen=True)
class Body:
    """One named part of a file: a range of faces."""

    name: str
    first_face: int
    face_count: int
    material: str | None = None


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles as the file has them: vertices in file order, bodies one after the other.

    vertices           (n, 3) float64, mesh units, read-only
    faces              (m, 3) int64 indices into vertices, counter-clockwise seen from outside, read-only
    bodies             the file's parts, covering all faces in order
    vertex_attributes  name -> (n, k) array that travels with the vertices: "uv", "normal", "color"
    path               where it was read from, if it was

    A UV seam duplicates vertices; ``topology`` sees through it (exactly equal positions are one point) while
    the vertices and their attributes here stay untouched.

    Raises ValueError for arrays of another shape or indices out of range.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    bodies: tuple[Body, ...] = ()
    vertex_attributes: dict[str, NDArray] = field(default_factory=dict)
    path: Path | None = None

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64, order="C")
        faces = np.array(self.faces, dtype=np.int64, order="C")
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise ValueError(f"vertices must be (n, 3), not {vertices.shape}")
        if faces.size == 0:
            faces = faces.reshape(0, 3)
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError(f"faces must be (m, 3), not {faces.shape}")
        if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError(f"face indices must lie in [0, {len(vertices)}), found {faces.min()}..{faces.max()}")
        vertices.flags.writeable = faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        if not self.bodies:
            object.__setattr__(self, "bodies", (Body("mesh", 0, len(faces)),))

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) least and greatest coordinates of the vertices that faces use; zeros without faces."""
        if len(self.faces) == 0:
            return np.zeros((2, 3))
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        # by columns: reducing rows of three is ten times slower
        columns = [column[used] for column in self.vertices.T]
        return np.array([[column.min() for column in columns], [column.max() for column in columns]])

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, mesh units."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))

    @property
    def longest_side(self) -> float:
        """Length of the bounding box's longest side, mesh units."""
        return float((self.bounds[1] - self.bounds[0]).max())

    @cached_property
    def face_vectors(self) -> NDArray[np.float64]:
        """(m, 3) cross products of two edges: along the outward normal, twice the face's area long."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def face_areas(self) -> NDArray[np.float64]:
        """(m,) areas, square mesh units."""
        return np.linalg.norm(self.face_vectors, axis=1) / 2

    @cached_property
    def face_normals(self) -> NDArray[np.float64]:
        """(m, 3) unit outward normals; zero for faces without area."""
        length = 2 * self.face_areas[:, None]
        return np.divide(self.face_vectors, length, out=np.zeros_like(self.face_vectors), where=length > 0)

    @cached_property
    def longest_sides(self) -> NDArray[np.float64]:
        """(m,) length of each face's longest side, mesh units."""
        a, b, c = (np.ascontiguousarray(column) for column in self.faces.T)
        squares = [np.zeros(len(self.faces)) for _ in range(3)]
        for column in self.vertices.T:
            x, y, z = column.take(a), column.take(b), column.take(c)
            for square, difference in zip(squares, (x - y, y - z, z - x), strict=True):
                square += difference * difference
        return np.sqrt(np.maximum(np.maximum(*squares[:2]), squares[2]))

    @property
    def area(self) -> float:
        """Total area, square mesh units."""
        return float(self.face_areas.sum())

    @cached_property
    def volume(self) -> float:
        """Signed volume by the divergence theorem, cubic mesh units; means a volume only where closed."""
        if len(self.faces) == 0:
            return 0.0
        # about the centre: far from the origin the tetrahedra would cancel to nothing
        first = self.vertices[self.faces[:, 0]] - self.bounds.mean(axis=0)
        return float(np.einsum("ij,ij->", first, self.face_vectors) / 6)

    @property
    def mean_inradius(self) -> float:
        """3 V / A, mesh units: the radius of the ball with this ratio of volume to area; 0 without area."""
        return 3 * abs(self.volume) / self.area if self.area > 0 else 0.0

    @cached_property
    def topology(self) -> Topology:
        """Which faces meet where, with exactly equal positions taken as one point."""
        from .topology import Topology

        return Topology(self)

    def _repr_png_(self) -> bytes | None:
        """How notebooks show it."""
        from .thumbnail import thumbnail

        return thumbnail([self])
