"""What a mesh has around it in a scene, as plain data that travels to worker processes.

Meshes are named by path here and read where the check runs: a neighbour that hangs or crashes its reader must not
do so in the command.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .loading import load_mesh
from .mesh import Mesh
from .validation.rule import Neighbour


@dataclass(frozen=True, eq=False)
class Placed:
    """An object of a scene.

    path         its mesh file
    matrix       (4, 4) from mesh units to scene units, acting on columns
    translucent  whether light enters it
    """

    name: str
    path: Path
    matrix: NDArray[np.float64]
    translucent: bool

    @property
    def scale(self) -> float:
        """Scene units in one mesh unit; the geometric mean of the axes where they differ."""
        return float(abs(np.linalg.det(self.matrix[:3, :3])) ** (1 / 3))


@dataclass(frozen=True, eq=False)
class View:
    """A pinhole camera, in scene units.

    position, forward  (3,) where it is, and the unit vector along its axis
    pixel              width of what a pixel covers, per unit of depth along the axis
    """

    position: NDArray[np.float64]
    forward: NDArray[np.float64]
    pixel: float


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The place of a mesh in a scene.

    placed  the mesh itself
    others  all other objects
    view    the camera
    """

    placed: Placed
    others: tuple[Placed, ...]
    view: View

    def neighbours(self) -> tuple[tuple[Neighbour, ...], list[str]]:
        """The other objects in the frame and unit of this mesh; and a line for each that could not be read."""
        into_mesh = np.linalg.inv(self.placed.matrix)
        found, problems = [], []
        for other in self.others:
            try:
                mesh = _loaded(str(other.path), _state(other.path))
            except InputError as error:
                problems.append(f"{self.placed.path}: its neighbour {other.name} is left out: {error.line()}")
                continue
            if len(mesh.faces) and np.isfinite(mesh.vertices).all():
                found.append(Neighbour(other.name, moved(mesh, into_mesh @ other.matrix), other.translucent))
        return tuple(found), problems

    def pixel_footprint(self, mesh: Mesh) -> float | None:
        """Width in mesh units of what a pixel covers where the mesh is nearest to the camera.

        None for a mesh that is nowhere in front of it.
        """
        matrix = self.placed.matrix
        with np.errstate(all="ignore"):
            depth = (mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3] - self.view.position) @ self.view.forward
        depth = depth[depth > 0]
        return float(depth.min() * self.view.pixel / self.placed.scale) if len(depth) else None


def moved(mesh: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """The geometry of a mesh under a (4, 4) matrix; where that mirrors, faces turn so that outside stays outside."""
    vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    mirrored = np.linalg.slogdet(matrix[:3, :3]).sign < 0
    return Mesh(vertices, mesh.faces[:, ::-1] if mirrored else mesh.faces)


def _state(path: Path) -> tuple[int, int]:
    """What changes when a file does."""
    try:
        state = path.stat()
    except OSError:
        return 0, 0
    return state.st_mtime_ns, state.st_size


@lru_cache(maxsize=8)
def _loaded(path: str, state: tuple[int, int]) -> Mesh:
    """The objects of a scene are checked one after the other, each beside all others: read them once."""
    return load_mesh(path)
