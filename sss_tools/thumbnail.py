"""Small pictures of meshes, by one ray a sample: for notebooks, without OpenGL."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh
from .rays import RayCaster, UnitFrame

SIZE = (360, 300)
FINER = 2
"""Rays across a pixel, in both directions."""
BACKGROUND = (250, 250, 248)
COLOURS = ((205, 200, 190), (141, 190, 160), (240, 190, 110), (150, 175, 220), (220, 150, 150), (185, 165, 215))
"""sRGB of meshes, in turn."""
INSIDE = (112, 92, 128)
"""Of the backs of faces: seen through holes and clips, and all over where normals point inwards."""


@dataclass(frozen=True, eq=False)
class Eye:
    """A pinhole camera: (3,) position and unit vectors; ``slope`` is the tangent of half its vertical angle."""

    position: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    forward: NDArray[np.float64]
    slope: float


def thumbnail(meshes: Sequence[Mesh], size: tuple[int, int] = SIZE, eye: Eye | None = None) -> bytes | None:
    """A PNG of ``meshes`` seen from ``eye``, or from in front with everything in the picture.

    Faces with coordinates that are not finite are left out; None where nothing is left.
    """
    points, faces, colours = [], [], []
    count = 0
    for number, mesh in enumerate(meshes):
        finite = np.logical_and.reduce(np.isfinite(mesh.vertices), axis=1)
        kept = mesh.faces[np.logical_and.reduce(finite[mesh.faces], axis=1)]
        used, compact = np.unique(kept, return_inverse=True)
        points.append(mesh.vertices[used])
        faces.append(compact.reshape(-1, 3) + count)
        colours.append(np.tile(COLOURS[number % len(COLOURS)], (len(kept), 1)))
        count += len(used)
    if count == 0:
        return None
    corners = np.concatenate(points)
    frame = UnitFrame.around(corners.min(axis=0), corners.max(axis=0))
    inside = frame.points_in(corners)
    if eye is None:
        position, axes, slope = _before(inside)
    else:
        position, axes, slope = frame.points_in(eye.position), np.stack([eye.right, eye.up, eye.forward]), eye.slope
    return _drawn(inside, np.concatenate(faces), np.concatenate(colours).astype(float), position, axes, slope, size)


def _before(points):
    """Of a camera in front of the points, a little above and to the right, that holds the ball around them: position
    (3,), rows right, up and forward (3, 3), slope as in ``Eye``."""
    forward = -np.array([0.35, 0.34, 0.87])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    radius = float(np.linalg.norm(points, axis=1).max())
    slope = 0.23
    return (
        -1.02 * radius * np.sqrt(1 + slope**-2) * forward,
        np.stack([right, np.cross(right, forward), forward]),
        slope,
    )


def _drawn(points, faces, colours, position, axes, slope: float, size: tuple[int, int]) -> bytes:
    """The PNG of triangles in the unit-size frame, shaded by a lamp at the camera, see ``_before``."""
    from PIL import Image

    width, height = size[0] * FINER, size[1] * FINER
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * slope * width / height
    y = (1 - (np.arange(height) + 0.5) / height * 2) * slope
    local = np.stack([*(grid.ravel() for grid in np.meshgrid(x, y)), np.ones(width * height)])
    direction = np.ascontiguousarray(axes.T @ (local / np.linalg.norm(local, axis=0)), np.float32)
    origin = np.ascontiguousarray(np.broadcast_to(position[:, None], direction.shape), np.float32)
    _, hit = RayCaster(points, faces).closest(origin, direction)
    found = np.flatnonzero(hit >= 0)
    a, b, c = (points[faces[hit[found], k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    facing = np.divide(np.einsum("ij,ji->i", normal, direction[:, found]), length, out=length * 0, where=length > 0)
    image = np.tile(np.array(BACKGROUND, float), (width * height, 1))
    base = np.where((facing <= 0)[:, None], colours[hit[found]], np.array(INSIDE, float))
    image[found] = base * (0.35 + 0.65 * np.abs(facing))[:, None]
    small = image.reshape(size[1], FINER, size[0], FINER, 3).mean(axis=(1, 3))
    file = io.BytesIO()
    Image.fromarray(np.rint(small).astype(np.uint8)).save(file, "PNG")
    return file.getvalue()
