"""How much light gets from a source to a point, straight on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.lights import Illumination
from .media import MediaTable
from .tally import Tally
from .traced_scene import MISS, TracedScene, offset_from

Float32 = NDArray[np.float32]
_SHORT_OF_LIGHT = np.float32(1 - 1e-5)


def transmittance(
    scene: TracedScene,
    media: MediaTable,
    position: Float32,
    light: Illumination,
    inside: NDArray[np.int8],
    owner: NDArray[np.int16],
    tally: Tally,
) -> Float32:
    """(3, n) share of the light's beam that reaches ``position`` without being bent, scattered or absorbed.

    Index-matched surfaces let the beam pass, and the medium behind them attenuates it; every other surface,
    light sources included, blocks it. ``position`` must already be offset off its surface; ``inside`` (k, n) and
    ``owner`` (n,) say where it is (see ``Paths``).
    """
    n = position.shape[1]
    result = np.zeros((3, n), np.float32)
    active = np.arange(n)
    origin, direction = position, light.direction
    remaining = np.where(np.isfinite(light.distance), light.distance * _SHORT_OF_LIGHT, MISS).astype(np.float32)
    depth = np.zeros((3, n), np.float32)
    inside, owner = inside.copy(), owner.copy()
    for sphere in scene.lights.spheres:
        visible = sphere.distance(origin, direction) >= remaining
        active = active[visible[active]]
    origin, direction, remaining = origin[:, active], direction[:, active], remaining[active]
    depth, inside, owner = depth[:, active], inside[:, active], owner[active]
    while len(active):
        distance, triangle = scene.closest(origin, direction, remaining)
        tally.rays += len(active)
        hit = triangle >= 0
        # a ray that ends inside an object without having met its surface leaked; attenuation takes it away
        reach = np.minimum(distance, np.float32(1e6))
        depth += media.of(media.sigma_t, owner) * reach
        done = ~hit
        result[:, active[done]] = np.exp(-depth[:, done])
        if not hit.any():
            break
        passes = hit & _lets_pass(scene, triangle)
        keep = np.flatnonzero(passes)
        active, triangle, distance = active[keep], triangle[keep], distance[keep]
        direction, depth, inside, owner = direction[:, keep], depth[:, keep], inside[:, keep], owner[keep]
        normal = np.take(scene.triangle_normal, triangle, axis=1)
        cosine = np.einsum("ij,ij->j", normal, direction)
        landing = scene.on_plane(origin[:, keep] + distance * direction, triangle)
        origin = offset_from(landing, normal, cosine)
        remaining = np.maximum(np.where(remaining[keep] < MISS, remaining[keep] - distance, MISS), 0).astype(np.float32)
        owner = cross(inside, scene.slot_of_triangle[triangle], cosine < 0)
    return result


def _lets_pass(scene: TracedScene, triangle: NDArray[np.int32]) -> NDArray[np.bool_]:
    slot = np.take(scene.slot_of_triangle, triangle)
    return (slot >= 0) & np.take(scene.slot_is_matched, slot)


def cross(inside: NDArray[np.int8], slot: NDArray[np.intp], entering: NDArray[np.bool_]) -> NDArray[np.int16]:
    """Count the crossing of each path's surface into ``inside`` (k, n), in place; the new owners (n,).

    Entering adds one, leaving takes one away, so overlapping shells make a union and inward shells a cavity.
    The owner is the first object in the scene that the path is inside of, -1 outside all.
    """
    columns = np.arange(inside.shape[1])
    inside[slot, columns] += np.where(entering, np.int8(1), np.int8(-1))
    within = inside > 0
    return np.where(within.any(axis=0), within.argmax(axis=0), -1).astype(np.int16)
