"""Which pixels can see any triangle: the others need no rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .camera import CameraRays

MARGIN = 1.0
"""Pixels left around each triangle: a thousand times what single precision can move a ray on 10 000 pixels."""
_LARGE = 1 / 16
"""Share of the picture from which on a triangle is looked at pixel by pixel."""
_MOST_LARGE = 256
"""More large triangles than these are not looked at one by one."""


def covered_pixels(camera: CameraRays, vertices: NDArray, triangles: NDArray) -> NDArray[np.bool_]:
    """(h * w,) whether any ray through the pixel can meet one of the triangles, (n, 3) in the camera's frame.

    Says yes too often, by a margin and by the boxes around small triangles, and never too seldom.
    """
    width, height = camera.resolution
    seen = camera.view(vertices)
    in_front = (seen[2] > 0)[triangles]
    behind = in_front.any(axis=1) & ~in_front.all(axis=1)
    triangles, behind = triangles[in_front.any(axis=1)], behind[in_front.any(axis=1)]
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = camera.place(seen)
    columns, rows = _range(x, triangles, width), _range(y, triangles, height)
    large = behind | ((columns[1] - columns[0]) * (rows[1] - rows[0]) > _LARGE * width * height)
    if large.sum() > _MOST_LARGE:
        if behind.any():
            return np.ones(width * height, bool)
        large[:] = False
    covered = _boxes([each[~large] for each in columns], [each[~large] for each in rows], width, height)
    for triangle in triangles[large]:
        covered |= _triangle(camera, seen[:, triangle])
    return covered.ravel()


def _range(place: NDArray, triangles: NDArray, count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and one past the last pixel over each triangle in front, along an axis of ``count`` pixels."""
    corners = [place[column] for column in triangles.T]
    least, most = np.minimum.reduce(corners) - MARGIN, np.maximum.reduce(corners) + MARGIN
    # places of what is behind mean nothing, and are not used
    least, most = np.nan_to_num(least), np.nan_to_num(most)
    first = np.floor(np.clip(least, 0, count)).astype(np.int64)
    return first, np.maximum(np.floor(np.clip(most, -1, count - 1)).astype(np.int64) + 1, first)


def _boxes(columns, rows, width: int, height: int) -> NDArray[np.bool_]:
    """(h, w) pixels in any of the boxes: corners with signs, summed over what is above and to the left."""
    boxes = np.zeros((height + 1) * (width + 1), np.int64)
    for i in range(2):
        for j in range(2):
            count = np.bincount(rows[i] * (width + 1) + columns[j], minlength=len(boxes))
            boxes += count if i == j else -count
    return boxes.reshape(height + 1, width + 1).cumsum(axis=0).cumsum(axis=1)[:height, :width] > 0


def _triangle(camera: CameraRays, corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(h, w) pixels that see a triangle whose corners are the columns (3, 3).

    A ray meets it where the ray's direction is a sum of the corners with weights of 0 or more, wherever they are; the
    weights are linear across the picture (Olano & Greer 1997, "Triangle scan conversion using 2D homogeneous
    coordinates").
    """
    width, height = camera.resolution
    length = np.linalg.norm(corners, axis=0)
    if abs(np.linalg.det(corners)) < 1e-9 * length.prod():
        return np.ones((height, width), bool)  # seen from the side
    weights = np.linalg.inv(corners) @ camera.unplace()
    covered = np.ones((height, width), bool)
    column, row = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    for across, down, start in weights:
        # within half a pixel and the margin
        slack = (abs(across) + abs(down)) * (0.5 + MARGIN)
        covered &= across * column + down * row + (start + slack) >= 0
    return covered
