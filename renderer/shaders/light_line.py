"""The line of the light through a scene: how far inside a body, what comes before, what blocks it.

A counter of windings says what is inside: a front face adds one, a back face takes one away, and only between 0
and 1 is there a surface. Overlapping shells are a union and cavities with inward shells are hollow. Only the body's
own faces count for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from .surface import BodyOptics, Caster

Float32 = NDArray[np.float32]

MOST_SURFACES = 8
"""Surfaces met along a line before it is given up; what lies beyond is taken for open."""

_SHORT_OF_LIGHT = np.float32(1 - 1e-4)
"""Rays stop short of a light by this factor, so that its own geometry does not shade it."""


@dataclass(frozen=True)
class LightLine:
    """What lies between n points and their light.

    chord    (n,) length of the first stretch inside the body, for lines that start inside; NaN where the surface does
             not close it
    depth    (n,) length inside bodies after that, weighed by ``BodyOptics.depth_weights``
    blocked  (n,) bool, whether something opaque stands in the way
    """

    chord: Float32
    depth: Float32
    blocked: NDArray[np.bool_]


def follow(
    caster: Caster,
    body: BodyOptics,
    origin: Float32,
    direction: Float32,
    distance: Float32,
    inside: NDArray[np.bool_],
    chord_only: bool = False,
) -> LightLine:
    """Walk from surface to surface towards the light.

    origin, direction  (3, n) float32, the origin already off its face
    distance           (n,) to the light, inf if far
    inside             (n,) bool, whether the line starts inside the body
    chord_only         stop where the first stretch ends; ``depth`` and ``blocked`` then mean nothing
    """
    n = origin.shape[1]
    chord, depth = np.zeros(n, np.float32), np.zeros(n, np.float32)
    blocked = np.zeros(n, bool)
    # all of them, as long as none has ended: a slice is far cheaper to add to
    at: slice | NDArray[np.intp] = slice(None)
    left = distance * _SHORT_OF_LIGHT
    winding = inside.astype(np.int8)
    first = inside.copy()
    weight = np.zeros(n, np.float32)
    for _ in range(MOST_SURFACES):
        length, triangle = caster.closest(origin, direction, np.minimum(left, np.float32(1e37)))
        hit = triangle >= 0
        # a stretch that nothing ends, neither surface nor light, has no length
        endless = ~hit & np.isinf(left)
        if endless.any():
            length = np.where(endless, np.float32(0), length)
            chord[at] += np.where(first, np.where(endless, np.float32(np.nan), length), np.float32(0))
        else:
            chord[at] += np.where(first, length, np.float32(0))
        if not chord_only:
            share = np.where(winding > 0, np.float32(1), weight)
            depth[at] += np.where(first, np.float32(0), length * share)

        go = np.flatnonzero(hit)
        if len(go) == 0:
            break
        triangle, heading = triangle.take(go), direction.take(go, axis=1)
        normal = caster.triangle_normal.take(triangle, axis=1)
        owner = caster.triangle_object.take(triangle)
        leaving = np.einsum("ij,ij->j", heading, normal) > 0
        own = owner == body.object_index
        at = go if isinstance(at, slice) else at[go]
        winding = winding[go] + np.where(own, np.where(leaving, np.int8(-1), np.int8(1)), np.int8(0))
        # a line that starts on a face may meet that face once more
        np.maximum(winding, 0, out=winding)
        first = first[go] & (winding > 0)
        if chord_only:
            keep = np.flatnonzero(first)
        else:
            other = body.weight_of(owner)
            weight = np.where(own, weight[go], np.where(leaving, np.float32(0), other))
            stop = ~own & np.isinf(other)
            blocked[at] = stop
            keep = np.flatnonzero(~stop)
            weight = weight[keep]
        if len(keep) == 0:
            break
        go, at, first, winding, leaving = go[keep], at[keep], first[keep], winding[keep], leaving[keep]
        direction, length = heading.take(keep, axis=1), length[go]
        left = left[go] - length
        origin = origin.take(go, axis=1)
        origin += length * direction
        # on to the far side of the face
        origin += normal.take(keep, axis=1) * np.where(leaving, RAY_OFFSET, -RAY_OFFSET)
    else:
        chord[np.arange(n)[at][first]] = np.nan
    return LightLine(chord, depth, blocked)
