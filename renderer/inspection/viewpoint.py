"""From where to look, so that findings are seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RayCaster

from .spots import Spot

FOV = 26.0
"""Vertical angle of view, degrees, as ``sss-render`` stages a mesh."""
MARGIN = 0.84
"""Share of the picture's half that what is looked at reaches across."""
FIRST_VIEW = (20.0, 30.0)
"""Elevation and azimuth, degrees, that are taken where nothing speaks for others; azimuth from +z towards +x."""
FAVOUR = 0.25
"""How much more, as a share of all spots, another view must show to be taken."""
SAMPLES = 12
"""Faces of a spot that are asked whether they can be seen."""
FROM_BEHIND = 0.3
"""What a face counts whose back is seen."""
LIFT = 1e-4
"""How far from the surface rays start, unit-size frame."""
UP = np.array([0.0, 1.0, 0.0])

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A pinhole camera in the inspection's frame; ``fov`` is its full vertical angle in degrees."""

    position: Vector
    target: Vector
    up: Vector
    fov: float = FOV

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) rows: unit vectors to the right, up and forward."""
        forward = _unit(self.target - self.position)
        right = _unit(np.cross(forward, self.up))
        return np.stack([right, np.cross(right, forward), forward])

    def project(self, points, size: tuple[int, int]) -> NDArray[np.float64]:
        """(..., 3) of points (..., 3): column and row in a picture of ``size`` (width, height), and depth.

        Depth is along the line of sight; what has none above zero is behind the camera.
        """
        width, height = size
        x, y, depth = np.moveaxis((np.asarray(points, float) - self.position) @ self.axes.T, -1, 0)
        scale = height / 2 / math.tan(math.radians(self.fov) / 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.stack([width / 2 + scale * x / depth, height / 2 - scale * y / depth, depth], axis=-1)

    def rays(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """(3, h w) unit directions through the pixels' centres, row by row."""
        width, height = size
        tangent = math.tan(math.radians(self.fov) / 2)
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * tangent * width / height
        y = (1 - (np.arange(height) + 0.5) / height * 2) * tangent
        local = np.stack([*(grid.ravel() for grid in np.meshgrid(x, y)), np.ones(width * height)])
        local /= np.linalg.norm(local, axis=0)
        return (self.axes.T @ local).astype(np.float32)


def towards(elevation: float, azimuth: float) -> Vector:
    """Unit vector to a place this many degrees above the horizon, and from +z towards +x."""
    e, a = math.radians(elevation), math.radians(azimuth)
    return np.array([math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)])


def directions() -> NDArray[np.float64]:
    """(n, 3) unit vectors to look from, the first view first, then all round."""
    elevation, azimuth = FIRST_VIEW
    found = [towards(elevation, azimuth)]
    for ring, count in ((elevation, 8), (60.0, 4), (-25.0, 8), (-65.0, 4)):
        found += [towards(ring, azimuth + 360 * k / count) for k in range(count)]
    return np.array(found)


def centred(direction, target: Vector, radius: float, fov: float = FOV) -> Viewpoint:
    """The view from ``direction`` with ``target`` in the middle and a ball of ``radius`` about it filling it."""
    backward = _unit(np.asarray(direction, float))
    distance = radius / math.sin(math.radians(fov) / 2)
    return Viewpoint(target + distance * backward, np.asarray(target, float), _upward(backward), fov)


def framing(direction, points: NDArray[np.float64], aspect: float, fov: float = FOV) -> Viewpoint:
    """The nearest view from ``direction`` that holds all ``points`` (n, 3), in the middle.

    aspect  width over height of the picture
    """
    backward = _unit(np.asarray(direction, float))
    right = _unit(np.cross(_upward(backward), backward))
    axes = np.stack([right, np.cross(backward, right), backward])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y, b = axes @ (points - middle).T
    slope = MARGIN * math.tan(math.radians(fov) / 2)
    (across, needed), (upwards, needed_too) = (_touching(v, b, s) for v, s in ((x, slope * aspect), (y, slope)))
    target = middle + across * axes[0] + upwards * axes[1]
    distance = max(needed, needed_too, float(b.max()) + 1e-6)
    return Viewpoint(target + distance * backward, target, axes[1], fov)


def _upward(backward: Vector) -> Vector:
    return UP if abs(backward[1]) < 0.99 else np.array([0.0, 0.0, -1.0])


def _touching(x, back, slope: float) -> tuple[float, float]:
    """Where a camera is to be, across and backwards, for both sides of its angle to touch the points."""
    right, left = float((x + slope * back).max()), float((-x + slope * back).max())
    return (right - left) / 2, (right + left) / (2 * slope)


@dataclass(frozen=True, eq=False)
class Visibility:
    """Which spots (rows) can be seen from which of ``directions()`` (columns), as shares of what was asked."""

    share: NDArray[np.float64]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """(s,) spots that hardly show from anywhere."""
        return self.share.max(axis=1, initial=0) < 0.05

    def best(self, weights: NDArray[np.float64]) -> int:
        """The number of the direction from which most can be seen; the first unless another shows clearly more."""
        if not len(self.share) or weights.sum() == 0:
            return 0
        seen = weights @ np.minimum(2 * self.share, 1) / weights.sum()
        best = int(np.argmax(seen))
        return best if seen[best] > seen[0] + FAVOUR else 0


def look_round(spots: list[Spot], points: NDArray[np.float32], faces: NDArray[np.int64], places) -> Visibility:
    """Ask which spots can be seen from far away, by rays against all triangles.

    points, faces  of all meshes together, in the frame, finite
    places         for each spot, (k, 3) points on it and (k, 3) normals there
    """
    views = directions()
    share = np.zeros((len(spots), len(views)))
    if not spots or not len(faces):
        return Visibility(share)
    caster = RayCaster(points, faces)
    sizes = np.array([len(points) for points, _ in places])
    start = np.concatenate([points for points, _ in places])
    normal = np.concatenate([normals for _, normals in places])
    owner = np.repeat(np.arange(len(spots)), sizes)
    for k, view in enumerate(views):
        # a face can be seen from both its sides; the ray starts on the side of the viewer
        side = np.where((normal @ view < 0)[:, None], -normal, normal)
        origin = np.ascontiguousarray((start + LIFT * side + 1e-5 * view).T, np.float32)
        away = np.ascontiguousarray(np.broadcast_to(view, start.shape).T, np.float32)
        clear = ~caster.occluded(origin, away)
        seen = np.where(normal @ view < 0, FROM_BEHIND, 1.0) * clear
        share[:, k] = np.bincount(owner, seen, len(spots)) / np.maximum(sizes, 1)
    return Visibility(share)


def _unit(vector: Vector) -> Vector:
    return vector / np.linalg.norm(vector)
