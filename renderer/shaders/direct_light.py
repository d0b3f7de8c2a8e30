"""Light that reaches a surface straight from its source."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..optics.multiple_importance import power_heuristic
from ..scene.lights import Illumination
from ..tracing.shadow import transmittance
from ..tracing.traced_scene import offset_from
from ..tracing.transport import Transport

Float32 = NDArray[np.float32]

FAINT = np.float32(0.02)
"""Throughput times scattering function, per steradian, below which a sampled light is followed by chance: a quarter of
what isotropic scattering has."""


def received(
    transport: Transport,
    position: Float32,
    normal: Float32,
    light: Illumination,
    inside: NDArray[np.int8],
    owner: NDArray[np.int16],
) -> Float32:
    """(3, n) irradiance across the beam of ``light`` at surface points, after shadows.

    position  (3, n) on surfaces; normal (3, n) towards the side that is lit
    inside, owner  what that side is inside of, see ``Paths``
    """
    origin = offset_from(position, normal, np.ones(position.shape[1], np.float32))
    return light.irradiance * transmittance(transport.scene, origin, light, inside, owner, transport.tally)


def arriving(
    transport: Transport, index: NDArray[np.intp], position: Float32, skies: bool = False
) -> Iterator[Illumination]:
    """One beam from each light to the paths ``index`` at ``position`` (3, n): all of a point light, a random part of
    the others; with ``skies`` environments that are worth it are sampled too."""
    for source in transport.scene.lights.points:
        yield source.illuminate(position)
    yield from arriving_from_areas(transport, index, position, skies)


def arriving_from_areas(
    transport: Transport, index: NDArray[np.intp], position: Float32, skies: bool
) -> Iterator[Illumination]:
    """As ``arriving``, without the lights that have no extent."""
    lights = transport.scene.lights
    for sampled in (*lights.rectangles, *lights.spheres, *(lights.skies if skies else ())):
        yield sampled.sample(position, *transport.draw(index))


def pick(light: Illumination, columns: NDArray[np.intp]) -> Illumination:
    """The given columns of ``light``."""
    irradiance = light.irradiance if light.irradiance.shape[1] == 1 else light.irradiance[:, columns]
    density = None if light.density is None else light.density[columns]
    return Illumination(light.direction[:, columns], light.distance[columns], irradiance, density, light.ball)


def worthwhile(
    transport: Transport, index: NDArray[np.intp], light: Illumination, value: Float32, drawn: Float32 | None
) -> tuple[NDArray[np.intp], Float32]:
    """Which connections of the paths ``index`` to ``light`` are followed, columns of it, and their weights.

    value  (n,) scattering function times cosine, or phase function
    drawn  (n,) density per steradian with which the paths themselves draw the direction to the light; may be None where
           it has no extent

    Of a light with an extent, which paths may also meet, only a share counts; and little that it brings is followed
    with a probability in proportion. Lights without extent are always followed.
    """
    if light.density is None or drawn is None:
        columns = np.flatnonzero(value > 0)
        return columns, value[columns]
    columns = np.flatnonzero((value > 0) & (light.density > 0))
    weight = value[columns] * power_heuristic(light.density[columns], drawn[columns])
    chance = np.minimum(transport.paths.throughput[:, index[columns]].max(axis=0) * weight / FAINT, 1)
    u, _ = transport.draw(index[columns])
    keep = np.flatnonzero(u < chance)
    return columns[keep], weight[keep] / chance[keep]
