"""Light that crosses a body without a collision and is mirrored inside: how much there is, and whether to find it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET, RayCaster

from ..optics.dielectric import fresnel_reflectance
from ..optics.flat_refraction import bent
from ..scene.lights import PointSource
from .beam_generation import Facets
from .refracted_beams import RefractedBeams

Float64 = NDArray[np.float64]
NEGLIGIBLE = 1e-3
"""Share of the light entering a body that may be left out, and is reported."""

_SAMPLES = 16384
_MOST_MIRRORS = 3
_FOLLOWED = 24


def mirror_as_needed(caster: RayCaster, facets: Facets, beams: RefractedBeams, sigma_t: Float64) -> None:
    """Add generations to ``beams`` until what they leave out is negligible, or finding more is not feasible."""
    shares = mirrored_shares(caster, facets, beams, sigma_t)
    for found in range(_MOST_MIRRORS + 1):
        beams.missing = shares[:, found + 1 :].sum(axis=1)
        if beams.missing.max() < NEGLIGIBLE or found == _MOST_MIRRORS or not beams.mirror():
            return


def mirrored_shares(caster: RayCaster, facets: Facets, beams: RefractedBeams, sigma_t: Float64) -> Float64:
    """(3, k) share of the light entering through a smooth boundary that first collides after k = 0, 1, ... mirrorings.

    Rays from evenly spread points of the facets are followed; their number leaves an error of about a hundredth of
    each share. Other objects inside end them.
    """
    shares = np.zeros((3, _FOLLOWED))
    base = beams.generations[0].base
    if not len(base):
        return shares
    corners, normal = facets.corners[base], facets.normal[base]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    total = np.cumsum(area)
    step = np.arange(_SAMPLES)
    facet = np.searchsorted(total, (step + 0.5) / _SAMPLES * total[-1]).clip(max=len(base) - 1)
    # the additive recurrence of the plastic number (Roberts 2018), folded into the triangle
    u, v = (step * 0.7548776662466927) % 1, (step * 0.5698402909980532) % 1
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    a, b, c = corners[facet].transpose(1, 0, 2)
    position, normal = a + u[:, None] * (b - a) + v[:, None] * (c - a), normal[facet]
    weight = np.ones(_SAMPLES)
    if isinstance(beams.source, PointSource):
        towards = beams.source.position[:, 0].astype(float) - position
        distance = np.linalg.norm(towards, axis=1)
        towards, weight = towards / distance[:, None], 1 / distance**2
        reach = (distance * (1 - 1e-5)).astype(np.float32)
    else:
        towards, reach = np.broadcast_to(beams.source.towards[:, 0].astype(float), position.shape), None
    x = np.clip((towards * normal).sum(axis=1), 0, 1)
    weight = weight * x * (1 - fresnel_reflectance(x, beams.ior)[0])
    seen = ~caster.occluded(_rays(position + RAY_OFFSET * normal), _rays(towards), reach)
    weights = np.repeat((weight * seen)[None], 3, axis=0)
    entered = max(weights[0].sum(), 1e-300)
    direction = bent(towards, normal, beams.ior)
    position = position - RAY_OFFSET * normal
    last = len(facets.corners)
    for k in range(_FOLLOWED):
        way, triangle = caster.closest(_rays(position), _rays(direction))
        own = triangle - facets.first
        weights *= (own >= 0) & (own < last)
        left = np.exp(-np.outer(sigma_t, np.minimum(way, 1e6)))
        shares[:, k] = (weights * (1 - left)).sum(axis=1) / entered
        normal = facets.normal[own.clip(0, last - 1)]
        cosine = (normal * direction).sum(axis=1)
        reflected = fresnel_reflectance(np.clip(cosine, 0, 1), 1 / beams.ior)[0] * (cosine > 0)
        weights *= left * reflected
        position = position + way[:, None] * direction - RAY_OFFSET * normal
        direction = direction - 2 * cosine[:, None] * normal
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        # those that are done go on along with the others
        position = np.where((own >= 0)[:, None], position, 0)
    return shares


def _rays(vectors: Float64) -> NDArray[np.float32]:
    return np.ascontiguousarray(vectors.T, np.float32)
