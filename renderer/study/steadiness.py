"""Changes of a scene that should change no picture: turned, moved, subdivided; and how much one does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sss_tools.mesh import Mesh

from ..render import Renderer, Settings
from ..scene.description import DirectionalLight, EnvironmentLight, Light, PointLight, RectangleLight, Scene

Float64 = NDArray[np.float64]

DEGREES, EXTENTS = 1.0, 1e3
MOST = 0.995
"""Share of the pixels whose change is looked at."""


def turned(scene: Scene, axis: ArrayLike = (0.3, 0.8, 0.5), degrees: float = DEGREES) -> Scene:
    """The scene with camera and lights, turned about an axis through the origin."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -unit[2], unit[1]], [unit[2], 0, -unit[0]], [-unit[1], unit[0], 0]])
    angle = np.radians(degrees)
    matrix = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return _mapped(scene, lambda points: points @ matrix.T, lambda vectors: vectors @ matrix.T)


def displaced(scene: Scene, extents: float = EXTENTS) -> Scene:
    """The scene with camera and lights, moved by many times the length of its first object's longest side."""
    step = extents * scene.objects[0].mesh.longest_side * np.array([1.0, -0.7, 0.4])
    return _mapped(scene, lambda points: points + step, lambda vectors: vectors)


def finer(scene: Scene) -> Scene:
    """Every face in four, cut at the middles of its sides: the same surface."""
    objects = tuple(replace(thing, mesh=_quartered(thing.mesh), closedness=None) for thing in scene.objects)
    return replace(scene, objects=objects, hash="")


def change(scene: Scene, other: Scene, shader: str, pass_index: int = 0) -> tuple[float, float]:
    """Of a pass, over the pixels that show an object in both: relative change of the mean, and what ``MOST`` of the
    pixels change by at most, over the mean.

    Camera rays are the same in both, so nothing is left to chance. Single pixels whose ray passes an edge on the other
    side may change altogether, which is why the greatest change says little.
    """
    films = []
    for each in (scene, other):
        renderer = Renderer(each, Settings(shader=shader))
        renderer.run([pass_index])
        films.append(renderer.film)
    where = films[0].object_pixels() & films[1].object_pixels()
    before, after = (film.mean()[where] for film in films)
    mean = float(before.mean())
    return float(after.mean()) / mean - 1, float(np.quantile(np.abs(after - before).max(axis=1), MOST)) / mean


def _mapped(scene: Scene, points: Callable[[Float64], Float64], vectors: Callable[[Float64], Float64]) -> Scene:
    camera = scene.camera
    camera = replace(
        camera, position=points(camera.position), target=points(camera.target), up=vectors(np.asarray(camera.up, float))
    )
    objects = tuple(
        replace(thing, mesh=Mesh(points(thing.mesh.vertices), thing.mesh.faces), closedness=None)
        for thing in scene.objects
    )
    lights = tuple(_light(light, points, vectors) for light in scene.lights)
    return replace(scene, camera=camera, objects=objects, lights=lights, hash="")


def _light(light: Light, points, vectors) -> Light:
    if isinstance(light, EnvironmentLight):
        if light.image is not None:
            raise ValueError("environment images cannot be turned about any axis")
        return light
    if isinstance(light, DirectionalLight):
        return replace(light, direction=vectors(np.asarray(light.direction, float)))
    if isinstance(light, PointLight):
        return replace(light, position=points(light.position))
    if isinstance(light, RectangleLight):
        up = vectors(np.asarray(light.up, float))
        return replace(light, center=points(light.center), target=points(light.target), up=up)
    return replace(light, center=points(light.center))


def _quartered(mesh: Mesh) -> Mesh:
    faces = mesh.topology.faces
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    sides, side = np.unique(ends, axis=0, return_inverse=True)
    points = mesh.topology.points
    middle = len(points) + side.reshape(-1, 3)
    corners = [
        np.stack([faces[:, k], middle[:, k], middle[:, k - 1]], axis=1) for k in range(3)
    ] + [middle]  # fmt: skip
    return Mesh(np.concatenate([points, points[sides].mean(axis=1)]), np.concatenate(corners))
