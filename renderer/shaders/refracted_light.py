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
from ..tracing.paths import Paths
from ..tracing.refracted_beams import FAR_CHANCE, Arrivals, RefractedBeams
from ..tracing.shadow import cross, follow, transmittance
from ..tracing.streams import Uniforms
from ..tracing.tally import Tally
from ..tracing.traced_scene import TracedScene, offset_from

Float32 = NDArray[np.float32]
_FAINT = np.float32(0.1)
"""Below this share of a full contribution, light is followed with a probability in proportion."""

_MIRRORED_CHANCE = 0.25
"""Probability with which a collision asks for light mirrored inside: what it adds is small, finding it is not cheap."""


def light_through_facets(
    scene: TracedScene,
    paths: Paths,
    index: NDArray[np.intp],
    slot: int,
    uniforms: Uniforms,
    tally: Tally,
    radiance: Float32,
) -> None:
    """Light the collisions of the paths ``index`` in the medium ``slot`` through smooth boundaries of its index.

    ``paths.direction`` must still be the one before the collision.
    """
    if not len(index):
        return
    position = paths.origin[:, index]
    for beams in scene.beams:
        if np.float32(beams.ior) != scene.media.ior[slot]:
            continue
        choice, play = uniforms.draw_at(paths.stream, index)
        _add(scene, paths, index, slot, beams, beams.near_arrivals(position), 1.0, play, tally, radiance)
        far = np.flatnonzero(choice < FAR_CHANCE)
        if len(far) and not beams.all_near:
            found = beams.far_arrivals(position[:, far])
            _add(scene, paths, index[far], slot, beams, found, 1 / FAR_CHANCE, play[far], tally, radiance)
        some = np.flatnonzero(choice >= 1 - _MIRRORED_CHANCE)
        for generation in range(1, len(beams.generations)) if len(some) else ():
            found = beams.near_arrivals(position[:, some], generation)
            _add(scene, paths, index[some], slot, beams, found, 1 / _MIRRORED_CHANCE, play[some], tally, radiance)


def _add(
    scene: TracedScene, paths: Paths, index: NDArray[np.intp], slot: int, beams: RefractedBeams, found: Arrivals,
    times: float, play: Float32, tally: Tally, radiance: Float32,
) -> None:  # fmt: skip
    """Add what ``found`` brings to the paths ``index``, ``times`` over; ``play`` (n,) uniforms for roulette."""
    media = scene.media
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
    arriving = _follow(scene, paths, path, beams, found, direction, tally)
    strength = beams.source.irradiance if isinstance(beams.source, DirectionalSource) else beams.source.intensity
    light = paths.throughput[:, path] * arriving * (strength * (phase * weight))
    sample, place = np.unique(paths.sample[path], return_inverse=True)
    for row, values in zip(radiance, light, strict=True):
        row[sample] += np.bincount(place, values).astype(np.float32)


def _follow(
    scene: TracedScene, paths: Paths, path: NDArray[np.intp], beams: RefractedBeams, found: Arrivals,
    direction: list[Float32], tally: Tally,
) -> Float32:  # fmt: skip
    """(3, c) share of the light that comes through from outside, with attenuation and shadows."""
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
