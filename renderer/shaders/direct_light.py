"""Light that reaches a surface straight from its source."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.lights import Illumination
from ..tracing.shadow import transmittance
from ..tracing.tally import Tally
from ..tracing.traced_scene import TracedScene, offset_from

Float32 = NDArray[np.float32]


def received(
    scene: TracedScene,
    position: Float32,
    normal: Float32,
    light: Illumination,
    inside: NDArray[np.int8],
    owner: NDArray[np.int16],
    tally: Tally,
) -> Float32:
    """(3, n) irradiance across the beam of ``light`` at surface points, after shadows.

    position  (3, n) on surfaces; normal (3, n) towards the side that is lit
    inside, owner  what that side is inside of, see ``Paths``
    """
    origin = offset_from(position, normal, np.ones(position.shape[1], np.float32))
    return light.irradiance * transmittance(scene, scene.media, origin, light, inside, owner, tally)


def arriving(scene: TracedScene, position: Float32, draw) -> list[Illumination]:
    """One beam from each light but environments: all of a point light, a random part of an area light.

    draw  called without arguments, returns two (n,) uniforms
    """
    lights = [source.illuminate(position) for source in scene.lights.points]
    lights += [rectangle.sample(position, *draw()) for rectangle in scene.lights.rectangles]
    lights += [sphere.sample(position, *draw()) for sphere in scene.lights.spheres]
    return lights


def pick(light: Illumination, columns: NDArray[np.intp]) -> Illumination:
    """The given columns of ``light``."""
    irradiance = light.irradiance if light.irradiance.shape[1] == 1 else light.irradiance[:, columns]
    return Illumination(light.direction[:, columns], light.distance[columns], irradiance, light.ball)
