"""How wrong pictures of a scene are, judged by two independent halves of an exact picture of it.

All pictures are divided by the mean of the exact one over the object's pixels: a scene does not look better for being
dark, and relMSE's floor means the same in all of them. What differences are divided by is the exact picture smoothed
over a few pixels: its noise would weigh pixels by chance that are too dark by chance, and bias what is found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .judges import FLOOR, Bias, flip

Float64 = NDArray[np.float64]

SMOOTHED = 5
"""Pixels along a side of the squares over which the exact picture is smoothed for dividing by it."""


@dataclass(frozen=True, eq=False)
class Truth:
    """An exact picture as two halves of other random numbers.

    halves  two (h, w, 3) radiance
    where   (h, w) bool, the pixels to judge: all of whose samples met the object first
    """

    halves: tuple[Float64, Float64]
    where: NDArray[np.bool_]

    @cached_property
    def mean(self) -> Float64:
        """(h, w, 3) both halves together."""
        return (self.halves[0] + self.halves[1]) / 2

    @cached_property
    def exposure(self) -> float:
        """What pictures are multiplied by."""
        level = float(self.mean[self.where].mean()) if self.where.any() else 0.0
        return 1 / level if level > 0 else 1.0

    @cached_property
    def _scaled(self) -> tuple[Float64, Float64, Float64]:
        """(p, 3) the halves, and what differences are divided by."""
        one, two = (self.exposure * half[self.where] for half in self.halves)
        return one, two, np.sqrt((self.exposure * self._smooth[self.where]) ** 2 + FLOOR)

    @cached_property
    def _smooth(self) -> Float64:
        """(h, w, 3) the mean over squares of pixels, those that are judged."""
        from scipy.ndimage import uniform_filter

        weight = uniform_filter(self.where.astype(float), SMOOTHED, mode="constant")[..., None]
        kept = np.where(self.where[..., None], self.mean, 0.0)
        blurred = uniform_filter(kept, (SMOOTHED, SMOOTHED, 1), mode="constant")
        return blurred / np.maximum(weight, 1e-12)

    def relative_mse(self, image: ArrayLike) -> float:
        """relMSE = mean[(a - S1)(a - S2) / (S^2 + floor)]: the noise of the halves is independent and cancels, so that
        this is the picture's own error, and may be below zero by chance."""
        one, two, scale = self._scaled
        a = self.exposure * np.asarray(image, float)[self.where]
        return float(((a - one) * (a - two) / scale**2).mean())

    def flip(self, image: ArrayLike) -> float:
        """Mean HDR-FLIP against both halves together. Raises InputError where the package is missing."""
        return flip(self.exposure * np.asarray(image, float), self.exposure * self.mean, self.where)

    def bias(self, images: Sequence[ArrayLike]) -> Bias:
        """Squared relative bias, mean[(M1 - S1)(M2 - S2) / (S^2 + floor)] over all pairs of independent pictures of a
        method: all noise cancels, that of the method and that of the truth.

        The stated error counts the spread over pixels, their channels taken as one. Needs two pictures.
        """
        one, two, scale = self._scaled
        chosen = [self.exposure * np.asarray(image, float)[self.where] for image in images]
        products = [
            ((a - x) * (b - y) / scale**2).mean(axis=1)
            for a, b in combinations(chosen, 2)
            for x, y in ((one, two), (two, one))
        ]
        return _mean_with_error(np.mean(products, axis=0))

    def difference(self, image: ArrayLike) -> tuple[float, float]:
        """Relative difference of the means over the object, and its standard error by the spread over pixels."""
        one, two, _ = self._scaled
        a = self.exposure * np.asarray(image, float)[self.where]
        per_pixel = (a - (one + two) / 2).mean(axis=1)
        found = _mean_with_error(per_pixel)
        return found.squared, found.stderr


def _mean_with_error(values: Float64) -> Bias:
    error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else float("nan")
    return Bias(float(values.mean()) if len(values) else float("nan"), float(error))
