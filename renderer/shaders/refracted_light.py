"""Light without extent connected to collisions through smooth boundaries.

    w p(mu) E exp(-sigma_t t) T prod(F) / eta^2

for every facet behind which the light reaches the collision, E being the irradiance across the bent beam: ``E0 x/x'``
of parallel light, ``I d omega/dA`` of a point (see ``optics.flat_refraction``). Paths carry radiance over squared
index, hence eta^2. Each way is followed with shadow rays, inside from surface to surface and outside to the light.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.phase import henyey_greenstein
from ..scene.lights import DirectionalSource, Illumination
from ..tracing.refracted_beams import FAR_CHANCE, Arrivals, RefractedBeams
from ..tracing.shadow import cross, follow, transmittance
from ..tracing.traced_scene import offset_from
from ..tracing.transport import Transport

Float32 = NDArray[np.float32]
_FAINT = np.float32(0.1)
"""Below this share of a full contribution, light is followed with a probability in proportion."""

_MIRRORED_CHANCE = 0.25
"""Probability with which a collision asks for light mirrored inside: what it adds is small, finding it is not cheap."""


def light_through_facets(transport: Transport, index: NDArray[np.intp], slot: int) -> None:
    """Light the collisions of the paths ``index`` in the medium ``slot`` through smooth boundaries of its index.

    ``paths.direction`` must still be the one before the collision.
    """
    if not len(index):
        return
    position = transport.paths.origin[:, index]
    for beams in transport.scene.beams:
        if np.float32(beams.ior) != transport.scene.media.ior[slot]:
            continue
        choice, play = transport.draw(index)
        _add(transport, index, slot, beams, beams.near_arrivals(position), 1.0, play)
        far = np.flatnonzero(choice < FAR_CHANCE)
        if len(far) and not beams.all_near:
            found = beams.far_arrivals(position[:, far])
            _add(transport, index[far], slot, beams, found, 1 / FAR_CHANCE, play[far])
        some = np.flatnonzero(choice >= 1 - _MIRRORED_CHANCE)
        for generation in range(1, len(beams.generations)) if len(some) else ():
            found = beams.near_arrivals(position[:, some], generation)
            _add(transport, index[some], slot, beams, found, 1 / _MIRRORED_CHANCE, play[some])


def _add(
    transport: Transport, index: NDArray[np.intp], slot: int, beams: RefractedBeams, found: Arrivals, times: float,
    play: Float32,
) -> None:  # fmt: skip
    """Add what ``found`` brings to the paths ``index``, ``times`` over; ``play`` (n,) uniforms for roulette."""
    paths, media = transport.paths, transport.scene.media
    path = index[found.point]
    depth = media.sigma_t[:, slot, None] * found.length.astype(np.float32)
    share = (times * found.share).astype(np.float32)
    chance = np.minimum((paths.throughput[:, path] * np.exp(-depth)).max(axis=0) * share / _FAINT, 1)
    keep = np.flatnonzero(play[found.point] < chance)
    if not len(keep):
        return
    found, path, weight = found.take(keep), path[keep], share[keep] / chance[keep]
    weight *= found.focus.astype(np.float32) / np.float32(beams.ior**2)
    direction = [one.astype(np.float32) for one in found.direction]
    mu = -np.einsum("ij,ij->j", paths.direction[:, path], direction[0])
    phase = henyey_greenstein(mu, media.g[slot])
    arriving = _follow(transport, path, beams, found, direction)
    strength = beams.source.irradiance if isinstance(beams.source, DirectionalSource) else beams.source.intensity
    light = paths.throughput[:, path] * arriving * (strength * (phase * weight))
    sample, place = np.unique(paths.sample[path], return_inverse=True)
    for row, values in zip(transport.radiance, light, strict=True):
        row[sample] += np.bincount(place, values).astype(np.float32)


def _follow(
    transport: Transport, path: NDArray[np.intp], beams: RefractedBeams, found: Arrivals, direction: list[Float32]
) -> Float32:
    """(3, c) share of the light that comes through from outside, with attenuation and shadows."""
    scene, paths, tally = transport.scene, transport.paths, transport.tally
    media, ior = scene.media, np.float32(beams.ior)
    result = np.zeros((3, len(path)), np.float32)
    left = np.arange(len(path))
    position, inside, owner = paths.origin[:, path], paths.inside[:, path], paths.owner[path]
    passed = np.ones((3, len(path)), np.float32)
    for k, (hit, triangle) in enumerate(zip(found.hit, found.triangle, strict=True)):
        target, surface = hit[:, left].astype(np.float32), triangle[left]
        step = target - position
        way = np.sqrt(np.einsum("ij,ij->j", step, step))
        stretch = Illumination(-direction[k][:, left], way, np.ones((3, 1), np.float32))
        share, inside, owner = follow(scene, position, stretch, inside, owner, tally)
        # the beam was bent from index 1 to the object's; where other objects have it otherwise, it is not there
        beyond_inside = inside.copy()
        beyond = cross(beyond_inside, scene.slot_of_triangle[surface], np.zeros(len(left), bool))
        keep = np.flatnonzero((share > 0).any(axis=0) & (media.ior[owner] == ior) & (media.ior[beyond] == 1))
        left, passed = left[keep], (passed * share)[:, keep]
        last = k == len(found.hit) - 1
        inside, owner = (beyond_inside[:, keep], beyond[keep]) if last else (inside[:, keep], owner[keep])
        normal = np.take(scene.triangle_normal, surface[keep], axis=1)
        position = offset_from(target[:, keep], normal, np.full(len(keep), 1 if last else -1))
        if not len(left):
            return result
    light = beams.source.illuminate(position)
    result[:, left] = passed * transmittance(scene, position, light, inside, owner, tally)
    return result
