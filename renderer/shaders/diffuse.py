"""Diffuse fallback: for bodies without an interior, and for those too far away for their translucence to show.

    B = E0 x T(x) A_eta/(1 - Fe)

with A_eta the diffuse reflectance of a half-space of the medium (Saunderson 1942), so that diffuse light is answered
with A_eta exactly. Light enters where it leaves: sharp terminator, dark unlit sides.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from ..optics.dielectric import diffuse_external_reflectance, transmittance
from .surface import Beam, BodyOptics, Caster, SurfacePoints, cosine_to, sum_in_blocks

NAME = "diffuse"

Float32 = NDArray[np.float32]


def exitance(caster: Caster, points: SurfacePoints, body: BodyOptics, beams: Iterable[Beam]) -> Float32:
    """(3, n) float32 exitance of scattered light at ``points`` of ``body`` under ``beams``."""
    return sum_in_blocks(points, beams, lambda block, beam: _shade(caster, block, body, beam))


def _shade(caster: Caster, points: SurfacePoints, body: BodyOptics, beam: Beam) -> Float32:
    albedo = body.diffuse_albedo[:, None]
    if beam.ambient:
        return albedo * np.pi * np.asarray(beam.radiance, np.float32)[:, None] * np.ones(len(points), np.float32)
    direction, distance, irradiance = beam.at(points.position)
    x = cosine_to(points.normal, direction)
    answered = np.zeros_like(x)
    lit = np.flatnonzero(x > 0)
    if len(lit):
        heading, ior = direction.take(lit, axis=1), body.ior
        origin = points.position.take(lit, axis=1) + RAY_OFFSET * points.normal.take(lit, axis=1)
        limit = np.minimum(distance[lit] * np.float32(1 - 1e-4), np.float32(1e37))
        open_ = ~caster.occluded(origin, heading, limit)
        answered[lit] = x[lit] * transmittance(x[lit], ior) * open_ / (1 - diffuse_external_reflectance(ior))
    return albedo * answered * irradiance
