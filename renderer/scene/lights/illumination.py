"""Light that arrives at points, whatever it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .sphere import SphereSource

Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class Illumination:
    """Light that arrives at n points from one direction each.

    direction   (3, n) float32 unit vectors towards the light
    distance    (n,) float32 to the light, inf where it is infinitely far
    irradiance  (3, n) or (3, 1) float32 on a plane across the beam, unoccluded
    density     (n,) float32 per steradian with which the direction was drawn; None of lights without extent
    ball        the shining ball that the light comes from, which does not shade itself
    """

    direction: Float32
    distance: Float32
    irradiance: Float32
    density: Float32 | None = None
    ball: SphereSource | None = None


def unit(vector) -> NDArray[np.float64]:
    """The vector (3,) at length 1."""
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def column(vector) -> Float32:
    """Three numbers as (3, 1) float32, to stand for all points."""
    return np.asarray(vector, np.float32).reshape(3, 1)


def inverse(solid_angle: Float32) -> Float32:
    """One over it, 0 for 0."""
    return np.divide(1, solid_angle, out=np.zeros_like(solid_angle), where=solid_angle > 0)
