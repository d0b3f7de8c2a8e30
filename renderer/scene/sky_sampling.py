"""Drawing directions from where an image of the sky is bright."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

_MOST_ROWS = 1024
"""Rows of the table of densities, at most; pixels of larger images are taken together."""


class SkySampler:
    """Directions with density in proportion to the brightness, channels added up, of an equirectangular image.

    The density is constant in cells of one pixel, or of some in large images. A cell's is the mean of what bilinear
    interpolation shows in it, which is positive wherever any light is.

    unevenness  mean square over squared mean of the density: 1 for an even sky, large where a sun is
    """

    def __init__(self, image: Float32):
        """image (3, h, w) float32, rows from +y to -y."""
        _, height, width = image.shape
        bright = image.sum(axis=0, dtype=np.float64)
        # mean over a pixel of linear interpolation between the middles of pixels, one axis after the other
        bright = (6 * bright + np.roll(bright, 1, axis=1) + np.roll(bright, -1, axis=1)) / 8
        above, below = np.vstack([bright[:1], bright[:-1]]), np.vstack([bright[1:], bright[-1:]])
        bright = (6 * bright + above + below) / 8
        self._step = -(-height // _MOST_ROWS)
        rows, columns = np.arange(0, height, self._step), np.arange(0, width, self._step)
        self._height, self._width = height, width
        self._cosines = np.cos(np.pi * np.append(rows, height) / height)
        self._columns = np.append(columns, width) / width
        pixel = (2 * np.pi / width) * -np.diff(np.cos(np.pi * np.arange(height + 1) / height))
        solid_angle = np.outer(-np.diff(self._cosines), 2 * np.pi * np.diff(self._columns))
        power = np.add.reduceat(np.add.reduceat(bright * pixel[:, None], rows, axis=0), columns, axis=1)
        total = power.sum()
        self.dark = not total > 0
        share = power / total if not self.dark else solid_angle / (4 * np.pi)
        self._density = (share / solid_angle).astype(np.float32)
        self.unevenness = float(4 * np.pi * np.sum(share * share / solid_angle))
        of_row = share.sum(axis=1)
        self._rows = _cumulative(of_row)
        within = share / np.where(of_row > 0, of_row, 1)[:, None]
        within[of_row == 0] = 1 / share.shape[1]
        # row after row in one ascending list: entry j of row i is i plus the share of the columns up to j
        self._within = (np.apply_along_axis(_cumulative, 1, within) + np.arange(len(rows))[:, None]).ravel()

    def sample(self, u1: Float32, u2: Float32) -> tuple[Float32, Float32, Float32]:
        """(n,) each: share of the turn from the left edge, cosine to +y, density per steradian."""
        row = np.searchsorted(self._rows, u1, side="right")
        down = _between(self._rows, row, u1, np.zeros(len(row)))
        columns = len(self._columns) - 1
        place = u2.astype(np.float64) + row
        cell = np.clip(np.searchsorted(self._within, place, side="right"), row * columns, row * columns + columns - 1)
        column = cell - row * columns
        over = _between(self._within, cell, place, row, first=column == 0)
        cosine = self._cosines[row] + down * (self._cosines[row + 1] - self._cosines[row])
        across = self._columns[column] + over * (self._columns[column + 1] - self._columns[column])
        return across.astype(np.float32), cosine.astype(np.float32), self._density[row, column]

    def density(self, across: Float32, down: Float32) -> Float32:
        """(n,) density per steradian, at shares in [0, 1] of the way across and down the image."""
        row = np.minimum((down * self._height).astype(np.int64), self._height - 1) // self._step
        column = np.minimum((across * self._width).astype(np.int64), self._width - 1) // self._step
        return self._density[row, column]


def _cumulative(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares up to and with each entry; the last is 1, and entries after the last that has a share are never drawn."""
    total = np.cumsum(share)
    total[total >= total[-1]] = 1
    return total


def _between(cumulative, entry, u, floor, first=None) -> NDArray[np.float64]:
    """(n,) how far between the ends of its entry each u is, in [0, 1]; ``floor`` is where first entries begin."""
    first = entry == 0 if first is None else first
    low = np.where(first, floor, cumulative[np.maximum(entry - 1, 0)])
    width = cumulative[entry] - low
    return np.clip((u - low) / np.where(width > 0, width, 1), 0, 1)
