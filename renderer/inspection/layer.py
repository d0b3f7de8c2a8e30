"""Pictures with depth, and how what is hidden is made to shine through."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .exhibit import Exhibit
from .viewpoint import Viewpoint

GLOW = 0.62
"""How strongly what is hidden shows before what hides it."""
NEARER = 5e-4
"""How much nearer something must be to hide what lies behind, as a share of the distance looked over: strokes lie on
their surface."""
FINER = 2
"""Samples across a pixel, in both directions."""


@dataclass(frozen=True, eq=False)
class Clip:
    """What is kept: ``lower`` <= coordinate ``axis`` <= ``upper``, shares of the box around everything."""

    axis: int
    lower: float
    upper: float

    def planes(self, exhibit: Exhibit) -> tuple[float, float]:
        """Both limits in the frame."""
        low, high = exhibit.frame.points_in(exhibit.inspection.bounds)[:, self.axis]
        return low + self.lower * (high - low), low + self.upper * (high - low)

    def keeps(self, exhibit: Exhibit, points) -> NDArray[np.bool_]:
        """(...,) whether points (..., 3) of the frame are kept."""
        low, high = self.planes(exhibit)
        along = np.asarray(points)[..., self.axis]
        return (along >= low - 1e-9) & (along <= high + 1e-9)


@dataclass(frozen=True, eq=False)
class Layer:
    """A picture and how far away what it shows is.

    image  (h, w, 3) uint8
    depth  (h, w) along the line of sight, unit-size frame; inf where there is nothing
    """

    image: NDArray[np.uint8]
    depth: NDArray[np.float32]


class Artist(Protocol):
    """Whoever draws exhibits."""

    def draw(self, view: Viewpoint, size: tuple[int, int], shining: bool = False) -> Layer:
        """Everything, or only what shines through, in a picture of ``size`` (width, height)."""


def seen_through(artist: Artist, view: Viewpoint, size: tuple[int, int]) -> Layer:
    """A picture of everything, with what shines glowing through whatever is before it."""
    everything, shining = artist.draw(view, size), artist.draw(view, size, shining=True)
    nearer = NEARER * float(np.linalg.norm(view.target - view.position))
    hidden = np.isfinite(shining.depth) & (shining.depth > everything.depth + nearer)
    image = everything.image.astype(float)
    image[hidden] += GLOW * (shining.image[hidden] - image[hidden])
    return Layer(np.rint(image).astype(np.uint8), everything.depth)


def averaged(colour: NDArray, depth: NDArray[np.float32]) -> Layer:
    """The picture made of ``FINER`` samples across each pixel: mean colours, nearest depths."""
    height, width = (length // FINER for length in depth.shape)
    image = colour.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3))
    return Layer(np.rint(image).astype(np.uint8), depth.reshape(height, FINER, width, FINER).min(axis=(1, 3)))
