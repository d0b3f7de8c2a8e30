"""Light from infinitely far away, all around: one radiance, or an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..description import EnvironmentLight
from ..sky_sampling import SkySampler
from .illumination import Illumination, column

Float32 = NDArray[np.float32]
UNEVEN_SKY = 3.0
"""Unevenness (``SkySampler``) from which on skies are sampled: a sky white above and black below has 2."""


class Environment:
    """Radiance from infinitely far away.

    sampled  whether directions are worth drawing from where it is bright; else it is met by chance
    """

    def __init__(self, light: EnvironmentLight):
        self.constant = None if light.radiance is None else column(light.radiance)
        self.sampled = False
        if light.image is not None:
            self._image = np.ascontiguousarray(np.moveaxis(light.image, -1, 0), np.float32)
            self._turn = np.float32(light.rotation / 360)
            self._sampler = SkySampler(self._image)
            self.sampled = not self._sampler.dark and self._sampler.unevenness >= UNEVEN_SKY

    def radiance(self, direction: Float32) -> Float32:
        """(3, n) radiance seen along unit ``direction`` (3, n), (3, 1) where it is the same everywhere.

        Images are interpolated bilinearly between the centres of their pixels, around the seam too. Row 0 is
        +y, the centre column -z, columns grow towards +x.
        """
        if self.constant is not None:
            return self.constant
        _, height, width = self._image.shape
        across, down = self._place(direction)
        x, y = across * width - np.float32(0.5), np.clip(down * height - np.float32(0.5), 0, height - 1)
        left, top = np.floor(x).astype(np.int64), np.minimum(np.floor(y).astype(np.int64), height - 1)
        fx, fy = x - left, y - top
        right, bottom = (left + 1) % width, np.minimum(top + 1, height - 1)
        left %= width
        image = self._image
        upper = image[:, top, left] * (1 - fx) + image[:, top, right] * fx
        lower = image[:, bottom, left] * (1 - fx) + image[:, bottom, right] * fx
        return upper * (1 - fy) + lower * fy

    def _place(self, direction: Float32) -> tuple[Float32, Float32]:
        """(n,) shares of the way across and down the image."""
        # counter-clockwise from above turns -z towards -x, against the growth of the columns
        across = (np.arctan2(direction[0], -direction[2]) / np.float32(2 * np.pi) + np.float32(0.5) + self._turn) % 1
        return across, np.arccos(np.clip(direction[1], -1, 1)) / np.float32(np.pi)

    def density(self, direction: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws the unit directions (3, n)."""
        return self._sampler.density(*self._place(direction))

    def sample(self, position: Float32, u1: Float32, u2: Float32) -> Illumination:
        """Light from a random direction, as if all of it came from there."""
        across, cosine, density = self._sampler.sample(u1, u2)
        turn = np.float32(2 * np.pi) * (across - np.float32(0.5) - self._turn)
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
        direction = np.stack([sine * np.sin(turn), cosine, -sine * np.cos(turn)])
        far = np.full(len(cosine), np.inf, np.float32)
        irradiance = np.divide(self.radiance(direction), density, out=np.zeros_like(direction), where=density > 0)
        return Illumination(direction, far, irradiance, density)


def fibonacci_directions(count: int) -> Float32:
    """(3, count) unit vectors spread evenly over the sphere (Swinbank & Purser 2006, QJRMS 132, eq. 1-2)."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    turn = k * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z]).astype(np.float32)
