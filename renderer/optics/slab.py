"""The lit slab: how much of a beam a plane layer sends back and lets through after scattering.

Lengths are in transport mean free paths (sigma_t' = 1), fluxes in shares of the flux that entered through the
boundary. Diffusion with exact first flight: along the refracted beam light scatters first at depth z with
density s exp(-s z), and then leaves through the far side with probability psi(z),

    psi(z) = [sinh kz + k z_b cosh kz] / [(1 + k^2 z_b^2) sinh kd + 2 k z_b cosh kd],
    T_d = int_0^d a' s exp(-s z) psi(z) dz,   R_d the same with psi(d - z),

with k = sqrt(sigma_a/D) and D = (2 sigma_a + sigma_s')/(3 sigma_t'^2) (Grosjean 1956; d'Eon & Irving 2011) and the
extrapolation distance z_b = 2 A D. Light that never scattered is not included: it crosses with exp(-s d).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dielectric import boundary_mismatch

_NODES = 48


def first_flights(length: NDArray, nodes: int) -> tuple[NDArray, NDArray]:
    """Points and weights for int_0^length exp(-t) f(t) dt, on a new last axis.

    Gauss points in w^(1/3), w = exp(-t): in w itself the density of flights would be constant, but f, smooth in t,
    has a logarithm at w = 0, which the cube smooths away.
    """
    node, weight = np.polynomial.legendre.leggauss(nodes)
    shallow = np.exp(-length[..., None] / 3)
    root = shallow + (1 - shallow) * (node + 1) / 2
    return -3 * np.log(root), 3 * root * root * (1 - shallow) * (weight / 2)


def diffusion(reduced_albedo: ArrayLike, eta: float) -> tuple[NDArray, NDArray]:
    """Attenuation k (per transport mean free path) and extrapolation distance z_b (in them) of a medium.

    reduced_albedo  sigma_s'/sigma_t'
    eta             index inside over index outside
    """
    albedo = np.asarray(reduced_albedo, dtype=np.float64)
    coefficient = (2.0 - albedo) / 3.0
    return np.sqrt((1.0 - albedo) / coefficient), 2.0 * boundary_mismatch(float(eta)) * coefficient


def slab_transmittance(thickness: ArrayLike, slant: ArrayLike, reduced_albedo: float, eta: float) -> NDArray:
    """T_d, the share of the entered flux that leaves scattered through the far side.

    thickness  d, transport mean free paths
    slant      s = 1/mu', mu' the cosine of the refracted beam; broadcasts with ``thickness``

    Against adding-doubling: within 4 % for albedos of .99 and more and d from 1 to 16, 5 % at 64; up to 17 % at .9.
    """
    return _first_flight_average(thickness, slant, reduced_albedo, eta, through=True)


def slab_reflectance(thickness: ArrayLike, slant: ArrayLike, reduced_albedo: float, eta: float) -> NDArray:
    """R_d, the share of the entered flux that leaves scattered through the near side; as above."""
    return _first_flight_average(thickness, slant, reduced_albedo, eta, through=False)


def _first_flight_average(thickness, slant, reduced_albedo: float, eta: float, through: bool) -> NDArray:
    d = np.asarray(thickness, dtype=np.float64)[..., None]
    s = np.asarray(slant, dtype=np.float64)[..., None]
    attenuation, z_b = diffusion(reduced_albedo, eta)
    # without absorption k = 0 and sinh(kz)/k = z; below, expm1 gets there smoothly
    k = np.maximum(attenuation, 1e-9)
    flight, weight = first_flights((s * d)[..., 0], _NODES)
    z = flight / s
    towards = z if through else d - z
    # both sides of the fraction times exp(-kd)/k
    near, far = np.exp(-k * (d - towards)), -np.expm1(-2 * k * d)
    gone = -np.expm1(-2 * k * towards)
    leaving = near * (gone / (2 * k) + z_b * (1 - gone / 2))
    total = (1 + (k * z_b) ** 2) * far / (2 * k) + z_b * (2 - far)
    return reduced_albedo * np.sum(weight * leaving / total, axis=-1)
