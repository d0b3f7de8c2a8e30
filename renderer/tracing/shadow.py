"""How much light gets from a source to a point, straight on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from ..scene.lights import Illumination
from . import depth_roulette
from .tally import Tally
from .traced_scene import MISS, TracedScene, offset_from

Float32 = NDArray[np.float32]
_SHORT_OF_LIGHT = np.float32(1 - 1e-5)
"""Shadow rays end before the light's own geometry: a relative part, and some offsets of the ray's start."""


def transmittance(
    scene: TracedScene,
    position: Float32,
    light: Illumination,
    inside: NDArray[np.int8],
    owner: NDArray[np.int16],
    tally: Tally,
    deepest: Float32 | None = None,
) -> Float32:
    """(3, n) share of the light's beam that reaches ``position`` without being bent, scattered or absorbed.

    Surfaces between media of one index let the beam pass, and the medium behind them attenuates it; every other
    surface, light sources included, blocks it. ``position`` must already be offset off its surface; ``inside`` (k, n)
    and ``owner`` (n,) say where it is (see ``Paths``).

    deepest  (n,) optical depth of the first medium at which light is given up, see ``depth_roulette``
    """
    return follow(scene, position, light, inside, owner, tally, deepest)[0]


def follow(
    scene: TracedScene,
    position: Float32,
    light: Illumination,
    inside: NDArray[np.int8],
    owner: NDArray[np.int16],
    tally: Tally,
    deepest: Float32 | None = None,
) -> tuple[Float32, NDArray[np.int8], NDArray[np.int16]]:
    """``transmittance``, and ``inside`` and ``owner`` at the light's end, which mean nothing where it is 0."""
    media = scene.media
    limit = None
    if deepest is not None:
        limit = depth_roulette.reach(media.of(media.sigma_t, owner).min(axis=0), deepest)
    n = position.shape[1]
    result = np.zeros((3, n), np.float32)
    inside_there, owner_there = np.zeros((inside.shape[0], n), np.int8), np.zeros(n, np.int16)
    active = np.arange(n)
    origin, direction = position, light.direction
    remaining = np.where(np.isfinite(light.distance), light.distance * _SHORT_OF_LIGHT - 4 * RAY_OFFSET, MISS)
    remaining = np.maximum(remaining, 0).astype(np.float32)
    # what lies between the ray's end and the light is met by no ray, but attenuates
    short = np.where(np.isfinite(light.distance), light.distance - remaining, 0).astype(np.float32)
    depth = np.zeros((3, n), np.float32)
    inside, owner = inside.copy(), owner.copy()
    for sphere in scene.lights.spheres:
        if sphere is not light.ball:
            visible = sphere.distance(origin, direction) >= remaining
            active = active[visible[active]]
    origin, direction, remaining = origin[:, active], direction[:, active], remaining[active]
    depth, inside, owner = depth[:, active], inside[:, active], owner[active]
    if limit is not None:
        limit = limit[active]
    while len(active):
        reaches = remaining if limit is None else np.minimum(remaining, limit)
        distance, triangle = scene.closest(origin, direction, reaches)
        tally.rays += len(active)
        hit = triangle >= 0
        # a ray that ends inside an object without having met its surface leaked; attenuation takes it away
        reach = np.minimum(distance, np.float32(1e6))
        extinction = media.of(media.sigma_t, owner)
        depth += extinction * reach
        done = ~hit
        if limit is not None:
            depth -= depth_roulette.taken(extinction.min(axis=0), reach)
            done &= remaining <= limit
            limit = None
        there = active[done]
        result[:, there] = np.exp(-depth[:, done] - extinction[:, done] * short[there])
        inside_there[:, there], owner_there[there] = inside[:, done], owner[done]
        if not hit.any():
            break
        slot = np.take(scene.slot_of_triangle, triangle)
        crossed = np.flatnonzero(hit & (slot >= 0))
        triangle, inside = triangle[crossed], inside[:, crossed]
        normal = np.take(scene.triangle_normal, triangle, axis=1)
        cosine = np.einsum("ij,ij->j", normal, direction[:, crossed])
        beyond = cross(inside, slot[crossed], cosine < 0)
        # what matters is not whose surface it is but what changes there: nothing, say, where another object owns both
        straight = media.ior[beyond] == media.ior[owner[crossed]]
        keep = crossed[straight]
        inside, owner = inside[:, straight], beyond[straight]
        active, distance, direction, depth = active[keep], distance[keep], direction[:, keep], depth[:, keep]
        landing = scene.on_plane(origin[:, keep] + distance * direction, triangle[straight])
        origin = offset_from(landing, normal[:, straight], cosine[straight])
        remaining = np.where(remaining[keep] < MISS, np.maximum(remaining[keep] - distance, 0), MISS)
    return result, inside_there, owner_there


def cross(inside: NDArray[np.int8], slot: NDArray[np.intp], entering: NDArray[np.bool_]) -> NDArray[np.int16]:
    """Count the crossing of each path's surface into ``inside`` (k, n), in place; the new owners (n,).

    Entering adds one, leaving takes one away, so overlapping shells make a union and inward shells a cavity.
    The owner is the first object in the scene that the path is inside of, -1 outside all.
    """
    columns = np.arange(inside.shape[1])
    inside[slot, columns] += np.where(entering, np.int8(1), np.int8(-1))
    within = inside > 0
    return np.where(within.any(axis=0), within.argmax(axis=0), -1).astype(np.int16)
