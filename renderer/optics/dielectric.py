"""A smooth dielectric boundary: what it reflects, how it bends, and both averaged over diffuse light.

Pure functions of arrays. ``eta`` is always the index on the far side over the index on the near side, seen
along the light; a medium's ``ior`` is therefore ``eta`` on the way in and ``1 / eta`` on the way out.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_GRAZING = 1e-18
"""Least cosine used, so that 0/0 becomes the limit 1. Its square is still a normal float32, so that for
``eta = 1`` the root below returns the cosine itself, bit for bit, and the reflectance is exactly 0."""


def fresnel_reflectance(cos_incident: NDArray, eta: float | NDArray) -> tuple[NDArray, NDArray]:
    """Unpolarised reflectance of a smooth boundary, and the cosine of the refracted direction.

        g  = sqrt(eta^2 - 1 + c^2) = eta cos_transmitted
        Rs = ((c - g)/(c + g))^2,   Rp = ((eta^2 c - g)/(eta^2 c + g))^2,   F = (Rs + Rp)/2

    cos_incident  (...) float32 or float64, >= 0, cosine to the normal on the side the light comes from
    eta           n_transmitted / n_incident, a number or an array of the same shape

    Returns (reflectance, cos_transmitted), both shaped and typed like ``cos_incident``. Total internal reflection
    gives (1, 0). ``eta = 1`` gives a reflectance of exactly 0.

    Born & Wolf, Principles of Optics, section 1.5.2; the form with g avoids the cancellation in 1 - sin^2.
    """
    c = np.maximum(cos_incident, _GRAZING)
    # numpy's own float64 scalars would turn float32 arrays into float64
    eta = float(eta) if np.ndim(eta) == 0 else np.asarray(eta, dtype=c.dtype)
    g = c * c
    g += (eta - 1.0) * (eta + 1.0)
    g = np.maximum(g, 0.0)
    g = np.sqrt(g)
    senkrecht = (c - g) / (c + g)
    c *= eta * eta
    parallel = (c - g) / (c + g)
    senkrecht *= senkrecht
    parallel *= parallel
    senkrecht += parallel
    senkrecht *= 0.5
    g /= eta
    return senkrecht, g


def transmittance(cos_incident: NDArray, eta: float | NDArray) -> NDArray:
    """T = 1 - F, shaped and typed like ``cos_incident``; see ``fresnel_reflectance``."""
    return 1.0 - fresnel_reflectance(cos_incident, eta)[0]


@lru_cache(maxsize=256)
def diffuse_external_reflectance(eta: float) -> float:
    """Fe = 2 int_0^1 F(mu) mu dmu, the share of diffuse light that a boundary reflects.

    ``eta`` > 1 for light that meets the denser side. Gauss quadrature in mu = t^3, which resolves the layer of width
    sqrt(eta - 1) at grazing angles; for eta < 1, where total reflection puts a kink into F, by the identity of
    ``diffuse_internal_reflectance``.
    """
    if eta < 1:
        return 1.0 - (1.0 - diffuse_external_reflectance(1.0 / eta)) * eta * eta
    t, weight = np.polynomial.legendre.leggauss(128)
    t, weight = (t + 1) / 2, weight / 2
    reflectance, _ = fresnel_reflectance(t**3, eta)
    return float(np.sum(weight * 6 * t**5 * reflectance))


def diffuse_internal_reflectance(eta: float) -> float:
    """rho_i, the share of diffuse light from inside that a boundary sends back.

    ``eta`` is the index inside over the index outside. Exact by reciprocity: 1 - rho_i = (1 - Fe)/eta^2.
    """
    return 1.0 - (1.0 - diffuse_external_reflectance(eta)) / (eta * eta)


def boundary_mismatch(eta: float) -> float:
    """A = (1 + rho_i)/(1 - rho_i): the extrapolation distance is z_b = 2 A D. 1 for a matched boundary."""
    internal = diffuse_internal_reflectance(eta)
    return (1.0 + internal) / (1.0 - internal)
