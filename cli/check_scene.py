"""The objects of a scene as sss-check wants them: each mesh with its material, scale, neighbours and camera."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from renderer.scene.description import Camera, Translucent
from renderer.scene.scene_file import Outline, Placement, read_outline
from sss_tools.medium import Medium
from sss_tools.surroundings import Placed, Surroundings, View


class SceneMesh(NamedTuple):
    """One object of a scene.

    path      of its mesh
    medium    coefficients per mesh unit; None for an opaque object
    material  what the scene calls it; None for an opaque object
    unit      what one mesh unit is; None where the object is scaled: such units have no name
    """

    path: str
    surroundings: Surroundings
    medium: Medium | None
    material: str | None
    unit: str | None


class SceneMeshes:
    """The objects of a scene file; their meshes are not read here. Raises InputError for what is no scene."""

    def __init__(self, path: str):
        self._outline: Outline = read_outline(path)
        self._placed = [_placed(placement) for placement in self._outline.placements]
        self._view = _view(self._outline.camera)

    def all(self) -> list[SceneMesh]:
        """Every object, in the order of the scene."""
        return [self._object(number) for number in range(len(self._placed))]

    def of(self, mesh: str) -> list[SceneMesh]:
        """The objects that show a mesh file, under the name it is given here."""
        file = Path(mesh).resolve()
        return [entry._replace(path=mesh) for entry in self.all() if Path(entry.path).resolve() == file]

    def _object(self, number: int) -> SceneMesh:
        placed, placement = self._placed[number], self._outline.placements[number]
        others = tuple(other for place, other in enumerate(self._placed) if place != number)
        material = placement.material
        medium = material.medium.scaled(placed.scale) if isinstance(material, Translucent) else None
        return SceneMesh(
            path=str(placed.path),
            surroundings=Surroundings(placed, others, self._view),
            medium=medium,
            material=None if medium is None else placement.material_name,
            unit=self._outline.unit if math.isclose(placed.scale, 1.0) else None,
        )


def _placed(placement: Placement) -> Placed:
    translucent = isinstance(placement.material, Translucent)
    return Placed(placement.name, placement.mesh_path, placement.matrix, translucent)


def _view(camera: Camera) -> View:
    forward = camera.target - camera.position
    pixel = 2 * math.tan(math.radians(camera.fov) / 2) / camera.resolution[1]
    return View(camera.position, forward / np.linalg.norm(forward), pixel)
