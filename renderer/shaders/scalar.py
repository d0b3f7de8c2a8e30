"""Scalar: the lit ball of the surface's own curvature, with one shadow feeler.

    B(N.L; R = 1/H)

with H the mean curvature, R between a quarter of a transport mean free path and the bounding radius.

Good when: the body is round, or the unlit side does not show.
Wrong when: the curvature says nothing of the thickness. On ellipsoids of 2:1 to 4:1 the lit side is as good as the
plumb's, the unlit side off by 3 to 15 times. Sharp edges glow, planes are dark behind however thin they are.
Constant environments cast no rays: folds get as much of them as open ground.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from .surface import Beam, BodyOptics, Caster, SurfacePoints, cosine_to, sum_in_blocks

NAME = "scalar"

Float32 = NDArray[np.float32]


def exitance(caster: Caster, points: SurfacePoints, body: BodyOptics, beams: Iterable[Beam]) -> Float32:
    """(3, n) float32 exitance of scattered light at ``points`` of ``body`` under ``beams``."""
    return sum_in_blocks(points, beams, lambda block, beam: _shade(caster, block, body, beam))


def _shade(caster: Caster, points: SurfacePoints, body: BodyOptics, beam: Beam) -> Float32:
    radius = body.curvature_radius(points.curvature)
    if beam.ambient:
        return body.uniform_exitance(radius) * np.asarray(beam.radiance, np.float32)[:, None]
    direction, distance, irradiance = beam.at(points.position)
    x = cosine_to(points.normal, direction)
    arriving = _arriving(caster, points, body, direction, distance, x, radius)
    at = body.places(x, radius)
    found = body.ball_exitance(x, radius, at)
    body.seen(found, x, radius, points, direction, at)
    return found * (arriving * irradiance)


def _arriving(caster, points: SurfacePoints, body: BodyOptics, direction, distance, x, radius) -> Float32:
    """(n,) share of the light that reaches the point's ball.

    The feeler starts a transport mean free path out along the normal, so that what is finer than the light's own
    blur casts no shadow. Where the surface faces away from the light, it starts where the light entered the ball,
    2 R |x| on, along the normal there: what lies between is the ball itself, and a fold that is dark just before the
    terminator is dark just behind it. Further round, the ball says less and less about where that place is: a fold
    of the same body then shades by 1 - |x| only. If the place is inside the body, which is then longer than the ball,
    the feeler meets the far wall from within, and the light is taken to arrive.
    """
    along = np.maximum(-2 * x, 0) * radius
    lift = np.float32(min(float(body.transport_length.mean()), body.bounding_radius))
    origin = points.position + along * direction
    # the normal where the light enters is the point's own mirrored across the light
    origin += lift * (points.normal - np.minimum(2 * x, 0) * direction)
    # from there to the same place of the light: a parallel ray would end in the light's plane too soon, and be shaded
    left = distance
    if np.isfinite(distance).all():
        direction = points.position + distance * direction - origin
        left = np.sqrt(np.einsum("ij,ij->j", direction, direction))
        direction /= np.maximum(left, np.float32(1e-20))
    limit = np.clip(left * np.float32(1 - 1e-4), 0, np.float32(1e37))
    arriving = np.ones(len(points), np.float32)
    lit = np.flatnonzero(x >= 0)
    if len(lit):
        shaded = caster.occluded(origin.take(lit, axis=1), direction.take(lit, axis=1), limit.take(lit))
        arriving[lit] = ~shaded
    dark = np.flatnonzero(x < 0)
    if len(dark):
        heading = direction.take(dark, axis=1)
        _, triangle = caster.closest(origin.take(dark, axis=1), heading, limit.take(dark))
        normal = caster.triangle_normal.take(triangle, axis=1)
        leaves = np.einsum("ij,ij->j", normal, heading) > 0
        own = caster.triangle_object.take(triangle) == body.object_index
        through = np.where(own, np.where(leaves, np.float32(1), -x[dark]), np.float32(0))
        arriving[dark] = np.where(triangle >= 0, through, np.float32(1))
    return arriving
