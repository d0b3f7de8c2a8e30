"""All lights as a few beams, for shaders that take no random samples: other ones in each pass.

Within a pass every point sees the same beams, so a single pass has no noise. From pass to pass the points on area
lights and the directions for environments move along sequences that fill their ranges evenly, so passes converge
to the whole light: soft shadows for the price of one hard one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lights import (
    DirectionalSource,
    Environment,
    Illumination,
    LightSet,
    PointSource,
    RectangleSource,
    column,
    fibonacci_directions,
)

Float32 = NDArray[np.float32]

AMBIENT_AXES = 2
"""Axes that probe a constant environment in one pass; both directions of each are looked at."""
IMAGE_DIRECTIONS = 12
"""Beams that stand for an environment image in one pass."""

_CELL_SAMPLES = 256 * IMAGE_DIRECTIONS
_STEPS_2 = np.array([0.7548776662466927, 0.5698402909980532])
_STEPS_3 = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
"""Roberts' sequences in two and three dimensions: multiples, modulo 1, of the powers of 1/rho with rho^3 = rho + 1 and
rho^4 = rho + 1 (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences")."""


@dataclass(frozen=True)
class Beam:
    """Light from one place, or a constant environment (``ambient``).

    radiance  (3,) float32, ambient beams only
    axes      (3, k) float32, ambient beams only: directions across each other, to probe with
    """

    source: PointSource | DirectionalSource | RectanglePoint | None = None
    radiance: Float32 | None = None
    axes: Float32 | None = None

    @property
    def ambient(self) -> bool:
        """Whether the light comes from everywhere alike."""
        return self.source is None

    def at(self, position: Float32) -> tuple[Float32, Float32, Float32]:
        """Direction to the light (3, n), distance (n,), irradiance across the beam (3, n) at ``position`` (3, n)."""
        assert self.source is not None, "an ambient beam comes from everywhere"
        light = self.source.illuminate(position)
        return light.direction, light.distance, np.broadcast_to(light.irradiance, position.shape)


class RectanglePoint:
    """The point of a rectangle light at the same share of its solid angle from everywhere, sending all of its light."""

    def __init__(self, rectangle: RectangleSource, share: NDArray[np.float64]):
        self._rectangle, self._share = rectangle, share

    def illuminate(self, position: Float32) -> Illumination:
        """What arrives at ``position`` (3, n)."""
        return self._rectangle.sample_at(position, self._share)


def beams(lights: LightSet, pass_index: int) -> list[Beam]:
    """The beams of one pass. Pass 0 looks at the middle of area lights."""
    share = (0.5 + pass_index * _STEPS_2) % 1
    turned = rotation((np.array([0.25, 0.5, 0.0]) + pass_index * _STEPS_3) % 1)
    found = [Beam(source) for source in lights.points]
    found += [Beam(RectanglePoint(rectangle, share)) for rectangle in lights.rectangles]
    for sphere in lights.spheres:
        # seen from outside a shining ball is a point of this intensity
        found.append(Beam(PointSource(sphere.center, sphere.radiance * np.float32(np.pi * sphere.radius**2))))
    for environment in lights.environments:
        if environment.constant is not None:
            found.append(Beam(radiance=environment.constant[:, 0], axes=turned[:, :AMBIENT_AXES]))
        else:
            found += _image_beams(environment, turned)
    return found


def change(lights: LightSet, axes: bool) -> bool:
    """Whether a pass has other beams than the one before; ``axes``: those of constant environments matter."""
    return bool(lights.rectangles) or any(axes or one.constant is None for one in lights.environments)


def rotation(share: NDArray[np.float64]) -> Float32:
    """(3, 3) rotation for three numbers in [0, 1), uniform over rotations where they are uniform.

    By a unit quaternion: Shoemake 1992, "Uniform random rotations", Graphics Gems III, p. 129.
    """
    radii = np.sqrt(1 - share[0]), np.sqrt(share[0])
    x, y = radii[0] * np.sin(2 * np.pi * share[1]), radii[0] * np.cos(2 * np.pi * share[1])
    z, w = radii[1] * np.sin(2 * np.pi * share[2]), radii[1] * np.cos(2 * np.pi * share[2])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ],
        np.float32,
    )


def _image_beams(environment: Environment, turned: Float32) -> list[Beam]:
    """Parts of the sky, as equal as can be, each with all its light from where the light's middle is.

    On a level surface, the mean over passes is within 5 % of the sky's irradiance, for even, sloping and sunny skies;
    a single pass within 4 % of that (standard deviation). The middle finds a sun that a part's centre would miss.
    """
    samples = fibonacci_directions(_CELL_SAMPLES)
    centres = turned @ fibonacci_directions(IMAGE_DIRECTIONS)
    nearest = np.argmax(centres.T @ samples, axis=0)
    seen = environment.radiance(samples)
    share = np.float32(4 * np.pi / _CELL_SAMPLES)
    irradiance = share * np.stack([np.bincount(nearest, channel, IMAGE_DIRECTIONS) for channel in seen])
    brightness = seen.sum(axis=0)
    middle = np.stack([np.bincount(nearest, brightness * along, IMAGE_DIRECTIONS) for along in samples])
    length = np.linalg.norm(middle, axis=0)
    middle = np.where(length > 0, middle / np.where(length > 0, length, 1), centres)
    return [Beam(DirectionalSource(column(middle[:, k]), column(irradiance[:, k]))) for k in range(IMAGE_DIRECTIONS)]
