"""Camera rays: from pixels to directions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from .description import Camera

Float32 = NDArray[np.float32]

_CHUNK = 8192
"""Columns worked on at a time: temporaries of 32 kB stay in cache and are not returned to the system."""


class CameraRays:
    """A pinhole camera in the unit-size frame.

    With f = unit(target - position), left = unit(up x f), v = f x left, a sample at (a, b) in [0, 1)^2 of the
    pixel in row i and column j looks along

        f + (1 - 2 (j + a) / W) tan(fov / 2) (W / H) left + (1 - 2 (i + b) / H) tan(fov / 2) v,

    made a unit vector. Row 0 is on top. Pixels are numbered row by row: pixel = i W + j.

    origin      (3,) float32, in the frame
    resolution  (width, height)
    """

    def __init__(self, camera: Camera, frame: UnitFrame):
        self.resolution = width, height = camera.resolution
        self.origin = frame.points_in(camera.position).astype(np.float32)
        forward, left, upward = view_basis(camera)
        tangent = math.tan(math.radians(camera.fov) / 2)
        self._pixel = 2 * tangent / height
        # the formula above, sorted by powers of column + a and row + b, and rounded once
        self._axes, self._reach = np.stack([left, upward, forward]), (tangent * (width / height), tangent)
        corner = forward + tangent * (width / height) * left + tangent * upward
        self._corner, self._per_column, self._per_row = (
            vector.astype(np.float32) for vector in (corner, -self._pixel * left, -self._pixel * upward)
        )

    def directions(self, pixel: NDArray[np.integer], jitter: Float32, out: Float32 | None = None) -> Float32:
        """(3, n) float32 unit directions.

        pixel   (n,) indices, row by row
        jitter  (2, n) float32 in [0, 1): across the pixel to the right, and down
        out     (3, n) float32 to write to
        """
        n = len(pixel)
        out = np.empty((3, n), np.float32) if out is None else out
        for start in range(0, n, _CHUNK):
            part = slice(start, start + _CHUNK)
            self._fill(pixel[part], jitter[:, part], out[:, part])
        return out

    def _fill(self, pixel: NDArray[np.integer], jitter: Float32, out: Float32) -> None:
        row, column = np.divmod(pixel, self.resolution[0])
        x = np.add(column, jitter[0], dtype=np.float32, casting="same_kind")
        y = np.add(row, jitter[1], dtype=np.float32, casting="same_kind")
        for axis in range(3):
            np.multiply(x, self._per_column[axis], out=out[axis])
            out[axis] += y * self._per_row[axis]
            out[axis] += self._corner[axis]
        out /= np.sqrt(np.einsum("ij,ij->j", out, out))

    def centre_directions(self) -> Float32:
        """(3, h * w) float32 unit directions through the pixels' centres, row by row."""
        width, height = self.resolution
        pixel = np.arange(width * height, dtype=np.int32)
        return self.directions(pixel, np.full((2, len(pixel)), 0.5, np.float32))

    def view(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """(3, n) coordinates of points (n, 3) in the frame: to the left, up, and along the line of sight."""
        return self._axes @ (np.asarray(points, float) - self.origin).T

    def place(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """(2, n) where points (3, n) of ``view`` are in the picture, in pixels from its left and from its top."""
        left, up, depth = seen
        return np.stack([(self._reach[0] - left / depth) / self._pixel, (self._reach[1] - up / depth) / self._pixel])

    def unplace(self) -> NDArray[np.float64]:
        """(3, 3) takes (column, row, 1) of a place in the picture to a direction as ``view`` has it."""
        return np.array([[-self._pixel, 0, self._reach[0]], [0, -self._pixel, self._reach[1]], [0, 0, 1]])

    def pixel_footprint(self, distance):
        """Side of the square that a pixel covers at ``distance`` along the line of sight, in distance's unit.

        Exact on the plane across the line of sight in the middle of the picture.
        """
        return self._pixel * distance


def view_basis(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors (3,) forward, to the left and upward in the picture."""
    forward = _unit(np.asarray(camera.target, float) - camera.position)
    left = _unit(np.cross(camera.up, forward))
    return forward, left, np.cross(forward, left)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector)
