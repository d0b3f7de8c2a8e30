"""Which way scattered light leaves the lit ball: radiance, where ``ball`` has exitance.

Looked at from where the light comes, a ball's terminator is dark; from behind, the same place glows: light crosses the
rim and is scattered once, on towards the viewer. So the exitance B alone is not enough. Radiance is found in two parts,

    L = T(mu)/eta^2 L_1 + T(mu)/(pi (1 - Fe)) (B - B_1) S,

lengths in transport mean free paths, mu the cosine to the viewer and mu' inside.

*Light scattered once* is known along the refracted way v' to the viewer, backwards from the surface point R n,

    L_1 = a'/(4 pi) int_0^{2 R mu'} dt exp(-t) E(R n - t v'),

with E the irradiance that reaches a point unscattered. Exact for a matched boundary. For others the light is followed
as if it ran straight, and its flux and way are those of the refracted beam at the place x_q where it enters,

    E = E0 T(x_q) (x_q/x_q') exp(-s x_q/x_q'),

which is exact near the surface, where it is bright. B_1 is the exitance of L_1.

*Light scattered more often* comes from a field that changes slowly. To first order in the change over one path the
source along the way to the viewer is 1 + t d ln(phi)/dt, and

    S = (1 + mu'/z_b)/N (1 - g),   g = (v'.L - mu' x)/R d ln(B)/dx:

inwards the field rises as the boundary condition phi = z_b dphi/dz says (Eddington's limb darkening; Chandrasekhar
1960, Radiative Transfer, section 27), and sideways as B does; (1 - g) is 1/(1 + g) for g > 0, as for a field that falls
exponentially. N makes 2 int mu T S dmu = 1 - Fe.

Against path on the ball: see docs/fast_shaders.md. Where the body is thinner than a transport mean free path, S is a
guess, but L_1 is most of the light.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import lookup
from .ball import ball_table
from .dielectric import diffuse_external_reflectance, fresnel_reflectance
from .slab import diffusion
from .table_cache import cached

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]

_FORMULA = "emergence 2"
"""Part of the key of cached tables: raise the number when the numbers change."""
NODES = 4
"""Gauss points along the way to the viewer, in exp(-t)."""
_EVERY = 4
"""B_1 is computed at every so many cosines of the table: it is as smooth as B."""
_VIEWS, _AZIMUTHS = 12, 8
"""Directions that B_1 is summed over."""
_ENTRIES = 512
"""Steps of the table of what enters at a cosine."""
_STEEPEST = 40.0
"""Largest |d ln(B)/dx|: further round, where the series has lost its digits, light comes the other way round."""
_RESOLVED = 1e-6
_GRAZING = 1e-3


@dataclass(frozen=True)
class EmergenceTable:
    """Directions of the light from balls of one reduced albedo and index.

    share  (48, 201) float32 B_1/B, at the radii and cosines of ``lookup``
    slope  (48, 201) float32 d ln(B)/dx
    unit   the factor pi (1 - Fe)/eta^2 that turns L_1 into exitance of the same radiance
    depth  1/z_b, ``norm`` 1/N
    """

    share: Float32
    slope: Float32
    unit: float
    depth: float
    norm: float


@lru_cache(maxsize=64)
def emergence_table(reduced_albedo: float, eta: float) -> EmergenceTable:
    """The table of a medium: from memory, from disk, or built (some 0.5 s beyond the ball's)."""
    rows, columns = len(lookup.RADII), len(lookup.COSINES)
    key = f"{_FORMULA} nodes {NODES} radii {lookup.RADII[0]!r} {lookup.RADII[-1]!r} "
    key += f"albedo {float(reduced_albedo).hex()} eta {float(eta).hex()}"
    values = cached("emergence", key, (rows, 2 * columns), lambda: _build(float(reduced_albedo), float(eta)))
    share, slope = (np.ascontiguousarray(part) for part in np.split(values, 2, axis=1))
    _, z_b = diffusion(reduced_albedo, eta)
    node, weight = _gauss(64)
    reflectance, refracted = fresnel_reflectance(node, eta)
    weight = weight * node * (1 - reflectance)
    norm = weight.sum() / (weight * (1 + refracted / z_b)).sum()
    unit = np.pi * (1 - diffuse_external_reflectance(eta)) / eta**2
    return EmergenceTable(share, slope, float(unit), float(1 / z_b), float(norm))


def _build(reduced_albedo: float, eta: float) -> Float64:
    """(48, 402): B_1/B and d ln(B)/dx side by side."""
    ball = ball_table(reduced_albedo, eta).ball.astype(float)
    # below what the series resolves there is nothing to divide by
    sound = ball > _RESOLVED * ball.max(axis=1, keepdims=True)
    ball = np.where(sound, ball, 1e-30)
    coarse = lookup.COSINES[::_EVERY]
    once = np.stack([np.interp(lookup.COSINES, coarse, _exitance(radius, coarse, reduced_albedo, eta))
                     for radius in lookup.RADII])  # fmt: skip
    slope = np.gradient(np.log(ball), lookup.COSINES, axis=1)
    share = np.where(sound, np.clip(once / ball, 0, 1), 0)
    return np.concatenate([share, np.where(sound, np.clip(slope, -_STEEPEST, _STEEPEST), 0)], axis=1)


def _exitance(radius: float, x: Float64, reduced_albedo: float, eta: float) -> Float64:
    """(n,) B_1 at cosines (n,)."""
    node, weight = _gauss(_VIEWS)
    mu, weight = node[:, None], weight[:, None]
    reflectance, refracted = fresnel_reflectance(mu, eta)
    azimuth = (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS * np.pi
    x = x[:, None, None]
    to_light = refracted * x + np.sqrt(1 - mu * mu) / eta * np.sqrt(1 - x * x) * np.cos(azimuth)
    single = [part.astype(np.float32) for part in np.broadcast_arrays(x, refracted, to_light)]
    seen = reduced_albedo * scattered_once(single[0], radius, single[1], single[2], eta)
    return 2 * np.pi / eta**2 / _AZIMUTHS * (weight * mu * (1 - reflectance) * seen).sum(axis=(1, 2))


def scattered_once(x: Float32, radius: ArrayLike, inside: Float32, to_light: Float32, eta: float) -> Float32:
    """(...) L_1/(E0 a') inside the boundary.

    x         N.L
    radius    transport mean free paths
    inside    mu', cosine of the refracted way to the viewer
    to_light  v'.L, cosine between that and the way to the light
    """
    radius = np.asarray(radius, np.float32)
    way = -np.expm1(-2 * radius * inside)
    total = np.zeros_like(way)
    high = radius * x
    bent = eta != 1
    if bent:
        flux, stretch = _entering(eta)
    for node, weight in zip(*_gauss(NODES), strict=True):
        t = -np.log1p(np.float32(-node) * way)
        along = high - t * to_light
        # half the chord on the light's line through the point: R^2 - |p|^2 + (p.L)^2
        half = np.sqrt(np.maximum(along * along + t * (2 * radius * inside - t), np.float32(1e-12)))
        s = np.maximum(half - along, 0)
        if bent:
            entry = np.minimum(half / radius, 1) * np.float32(_ENTRIES)
            entry = entry.astype(np.intp)
            total += np.float32(weight) * flux.take(entry) * np.exp(-s * stretch.take(entry))
        else:
            total += np.float32(weight) * np.exp(-s)
    total *= way
    total *= np.float32(1 / (4 * np.pi))
    return total


@lru_cache(maxsize=16)
def _entering(eta: float) -> tuple[Float32, Float32]:
    """T(x) x/x' and x/x' at the middles of _ENTRIES steps of x, and at x = 1."""
    x = np.append((np.arange(_ENTRIES) + 0.5) / _ENTRIES, 1.0)
    reflectance, refracted = fresnel_reflectance(x, eta)
    stretch = np.maximum(x, _GRAZING) / refracted
    return ((1 - reflectance) * stretch).astype(np.float32), stretch.astype(np.float32)


@lru_cache(maxsize=8)
def _gauss(nodes: int) -> tuple[Float64, Float64]:
    """Points and weights on [0, 1]."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    return (node + 1) / 2, weight / 2
