"""A scene's camera and lights as line drawings, and where around the camera shaders change."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ..scene.camera import view_basis
from ..scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    RectangleLight,
    Scene,
    SphereLight,
)
from ..shaders.selection import thresholds
from . import palette
from .specimen import Specimen

FAR = 2.0
"""How far from the middle of the objects, in their size, cameras and lights are drawn; farther ones only point."""
FRUSTUM = 0.15
"""Length of the camera's pyramid, in the objects' size."""


@dataclass
class Drawing:
    """Lines in the frame.

    middle   (3,) of what is looked at, and ``size``, the longest side of the box around it
    strokes  ends (k, 2, 3), colour, width in pixels
    labels   place (3,), words, colour
    corners  points that a view of the whole should hold
    """

    middle: NDArray[np.float64]
    size: float
    strokes: list[tuple[NDArray[np.float32], palette.Colour, float]] = field(default_factory=list)
    labels: list[tuple[NDArray[np.float64], str, palette.Colour]] = field(default_factory=list)
    corners: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def reach(self) -> NDArray[np.float64]:
        """(n, 3) ``corners`` together."""
        return np.concatenate([np.atleast_2d(corner) for corner in self.corners]) if self.corners else np.empty((0, 3))

    def add(self, ends, colour: palette.Colour, width: float = 2.0, held: bool = True) -> None:
        """Add lines (k, 2, 3); ``held``: a view of the whole should hold them."""
        ends = np.asarray(ends, float).reshape(-1, 2, 3)
        self.strokes.append((ends.astype(np.float32), colour, width))
        if held:
            self.corners.append(ends.reshape(-1, 3))

    def placed(self, place: NDArray[np.float64], words: str, frame: UnitFrame) -> tuple[NDArray[np.float64], str]:
        """A place and its name; what is too far away to show stands nearer, and says how far it is."""
        away = place - self.middle
        distance = float(np.linalg.norm(away))
        if distance <= FAR * self.size:
            return place, words
        return self.middle + away * (FAR * self.size / distance), f"{words}, {distance * frame.scale:.3g} away"

    def name(self, place, words: str, colour: palette.Colour) -> None:
        """Add a label."""
        self.labels.append((np.asarray(place, float), words, colour))


def draw(scene: Scene, frame: UnitFrame, specimens: tuple[Specimen, ...], objects: NDArray[np.float64]) -> Drawing:
    """The camera, the lights, and arcs about the camera where the choice of shaders changes.

    objects  (n, 3) points of what is looked at, in the frame
    """
    lower, upper = objects.min(axis=0), objects.max(axis=0)
    drawing = Drawing((lower + upper) / 2, max(float((upper - lower).max()), 1e-9))
    _camera(drawing, scene.camera, frame)
    for light in scene.lights:
        _light(drawing, light, frame)
    _circles(drawing, scene, frame, specimens)
    return drawing


def _camera(drawing: Drawing, camera: Camera, frame: UnitFrame) -> None:
    position, words = drawing.placed(frame.points_in(camera.position), "camera", frame)
    drawing.name(position, words, palette.CAMERA)
    forward, left, upward = view_basis(camera)
    length = FRUSTUM * drawing.size
    high = math.tan(math.radians(camera.fov) / 2)
    wide = high * camera.resolution[0] / camera.resolution[1]
    corners = [
        position + length * (forward + x * wide * left + y * high * upward)
        for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]
    ends = [(position, corner) for corner in corners] + list(zip(corners, corners[1:] + corners[:1], strict=True))
    drawing.add(ends, palette.CAMERA)
    tip = position + length * (forward + 1.35 * high * upward)
    drawing.add([(corners[0], tip), (corners[1], tip)], palette.CAMERA)  # which way is up
    drawing.add(
        [(position, frame.points_in(camera.target))], palette.mixed(palette.CAMERA, palette.WALL, 0.6), 1.0, False
    )


def _light(drawing: Drawing, light: Light, frame: UnitFrame) -> None:
    colour = palette.LIGHT
    match light:
        case EnvironmentLight():
            return
        case DirectionalLight():
            direction = np.asarray(light.direction, float) / np.linalg.norm(light.direction)
            start = drawing.middle - 0.95 * drawing.size * direction
            drawing.add(_arrow(start, start + 0.25 * drawing.size * direction), colour, 3.0)
            drawing.name(start, "directional light", colour)
        case PointLight():
            place, words = drawing.placed(frame.points_in(light.position), "point light", frame)
            drawing.add(_star(place, 0.03 * drawing.size), colour)
            drawing.name(place, words, colour)
        case SphereLight():
            place, words = drawing.placed(frame.points_in(light.center), "sphere light", frame)
            for axis in range(3):
                drawing.add(_circle(place, light.radius / frame.scale, axis, 32), colour)
            drawing.name(place, words, colour)
        case RectangleLight():
            middle, words = drawing.placed(frame.points_in(light.center), "rectangle light", frame)
            forward = np.asarray(light.target, float) - light.center
            forward /= np.linalg.norm(forward)
            across = np.cross(forward, np.asarray(light.up, float))
            across /= np.linalg.norm(across)
            upward = np.cross(across, forward)
            half = np.array(light.half) / frame.scale
            corners = [
                middle + x * half[0] * across + y * half[1] * upward for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))
            ]
            drawing.add(
                list(zip(corners, corners[1:] + corners[:1], strict=True)), colour, held=max(half) < FAR * drawing.size
            )
            drawing.add(_arrow(middle, middle + 0.15 * drawing.size * forward), colour)
            drawing.name(middle, words, colour)


def _circles(drawing: Drawing, scene: Scene, frame: UnitFrame, specimens: tuple[Specimen, ...]) -> None:
    """Where shaders change with distance: about the camera, level, through each object's middle."""
    centre = frame.points_in(scene.camera.position)
    seen: set[tuple[str, int]] = set()
    for thing, specimen in zip(scene.objects, specimens, strict=True):
        plan = specimen.plan
        if plan is None or plan.state is None or plan.hole_handling == "surface" or thing.shader != "auto":
            continue  # there is nothing to choose
        middle = frame.points_in(thing.mesh.bounds.mean(axis=0))
        for distance, nearer, farther in thresholds(scene, thing):
            radius = distance / frame.scale
            key = (f"{nearer} {farther}", round(20 * radius / drawing.size))
            if key in seen or abs(radius - np.linalg.norm(middle - centre)) > FAR * drawing.size:
                continue
            seen.add(key)
            colour = palette.SHADERS.get(farther, palette.UNKNOWN)
            flat = middle - centre
            flat[1] = 0
            length = max(float(np.linalg.norm(flat)), 1e-9)
            # an arc where the object might stand, not a circle through half the country
            angle = math.atan2(flat[0], flat[2])
            spread = min(math.pi, 0.8 * drawing.size / max(radius, 1e-9))
            turn = angle + np.linspace(-spread, spread, 49)
            level = np.array([centre[0], middle[1], centre[2]])
            points = level + radius * np.stack([np.sin(turn), np.zeros(49), np.cos(turn)], axis=-1)
            drawing.add(np.stack([points[:-1], points[1:]], axis=1), colour, 2.0, held=False)
            drawing.name(level + radius * flat / length, f"{nearer} | {farther}: {distance:.3g}", colour)


def _arrow(start, end) -> list:
    along = end - start
    side = np.cross(along, [0.3, 0.9, 0.2])
    side *= 0.25 * np.linalg.norm(along) / np.linalg.norm(side)
    neck = start + 0.7 * along
    return [(start, end), (end, neck + side), (end, neck - side)]


def _star(place, size: float) -> list:
    rays = [
        np.array(ray, float) for ray in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, -1))
    ]
    return [(place - size * ray / np.linalg.norm(ray), place + size * ray / np.linalg.norm(ray)) for ray in rays]


def _circle(centre, radius: float, axis: int, count: int) -> NDArray[np.float64]:
    turn = np.linspace(0, 2 * np.pi, count + 1)
    flat = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(count + 1)], axis=-1)
    points = centre + np.roll(flat, axis, axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)
