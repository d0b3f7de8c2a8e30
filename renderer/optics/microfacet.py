"""The rough dielectric boundary: GGX microfacets (Walter, Marschner, Li & Torrance 2007, EGSR).

Directions are (3, n) unit vectors pointing away from the surface, in a local frame whose z axis is the normal
on the viewer's side. ``alpha`` is the GGX width, not squared. Masking is Smith's, separable; light that would
meet a second facet is lost, as in the model.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .dielectric import fresnel_reflectance

Float32 = NDArray[np.float32]


def facet_density(cosine, alpha: float):
    """D(m), facets per steradian, by the cosine of facet normal and surface normal. Walter et al. 2007, eq. 33."""
    cosine2 = cosine * cosine
    scale = cosine2 * (alpha * alpha - 1) + 1
    return np.where(cosine > 0, alpha * alpha / (np.pi * scale * scale), 0).astype(np.asarray(cosine).dtype)


def unmasked(cosine, alpha: float):
    """G1, the visible share of the facets from a direction with this |cosine|. Walter et al. 2007, eq. 34."""
    cosine2 = np.clip(cosine * cosine, 1e-12, 1)  # at grazing 1e-6 G1 is 2e-6 / alpha: nothing is lost
    return 2 / (1 + np.sqrt(1 + alpha * alpha * (1 - cosine2) / cosine2))


def sample_visible_facet(view: Float32, alpha: float, u1: Float32, u2: Float32) -> Float32:
    """(3, n) facet normals in proportion to what ``view`` sees of them.

    Heitz 2018, "Sampling the GGX distribution of visible normals", JCGT 7(4), listing 1.
    """
    stretched = np.stack([alpha * view[0], alpha * view[1], view[2]])
    stretched /= np.sqrt(np.einsum("ij,ij->j", stretched, stretched))
    across = stretched[0] ** 2 + stretched[1] ** 2
    flat = across > 0
    inverse = 1 / np.sqrt(np.where(flat, across, 1))
    first = np.stack([np.where(flat, -stretched[1] * inverse, 1), np.where(flat, stretched[0] * inverse, 0)])
    second = np.stack([-stretched[2] * first[1], stretched[2] * first[0],
                       stretched[0] * first[1] - stretched[1] * first[0]])  # fmt: skip
    radius, turn = np.sqrt(u1), np.float32(2 * np.pi) * u2
    t1, t2 = radius * np.cos(turn), radius * np.sin(turn)
    share = (1 + stretched[2]) / 2
    t2 = (1 - share) * np.sqrt(np.maximum(1 - t1 * t1, 0)) + share * t2
    t3 = np.sqrt(np.maximum(1 - t1 * t1 - t2 * t2, 0))
    facet = np.stack([
        alpha * (t1 * first[0] + t2 * second[0] + t3 * stretched[0]),
        alpha * (t1 * first[1] + t2 * second[1] + t3 * stretched[1]),
        np.maximum(t2 * second[2] + t3 * stretched[2], 1e-6),
    ])  # fmt: skip
    facet /= np.sqrt(np.einsum("ij,ij->j", facet, facet))
    return facet


def scatter(view: Float32, to_light: Float32, eta, alpha: float) -> Float32:
    """(n,) scattering function times the light's |cosine|, for radiance divided by the squared index.

        reflection    F D G / (4 |v.n|)
        transmission  |v.h| |l.h| / |v.n| * eta_l^2 (1 - F) D G / (eta_v v.h + eta_l l.h)^2

    eta  index on the other side over the index on the viewer's side, (n,) or a number

    Walter et al. 2007, eq. 20 and 21, with the index of the light's side (not the viewer's) squared in the
    numerator: a path that starts and ends outside carries radiance over squared index, whose value no
    boundary changes but by 1 - F.
    """
    density, share = turning(view, to_light, eta, alpha)
    return density * share * unmasked(to_light[2], alpha)


def turning(view: Float32, to_light: Float32, eta, alpha: float) -> tuple[Float32, Float32]:
    """(n,) density per steradian of ``to_light`` when a facet that ``view`` sees is drawn and turns the path there, by
    reflection if ``to_light`` is above the surface, else by refraction; (n,) share of that facet's light that it
    reflects or refracts, F or 1 - F.

        reflection    Dv / (4 v.h),   Dv = G1(v) D (v.h) / v.n
        transmission  Dv eta_l^2 |l.h| / (eta_v v.h + eta_l l.h)^2

    ``scatter`` is the product of both and G1(l). Heitz 2018, eq. 2 and 17; Walter et al. 2007, eq. 17.
    """
    cos_view, cos_light = view[2], to_light[2]
    reflected = cos_light > 0
    half = np.where(reflected, view + to_light, -(view + eta * to_light))
    half /= np.sqrt(np.maximum(np.einsum("ij,ij->j", half, half), 1e-20))
    half *= np.copysign(np.float32(1), half[2])
    view_half = np.einsum("ij,ij->j", view, half)
    light_half = np.einsum("ij,ij->j", to_light, half)
    # a facet must be seen from its own side by both
    possible = (view_half > 0) & (light_half * cos_light > 0) & (cos_view > 0)
    fresnel, _ = fresnel_reflectance(np.clip(view_half, 0, 1), eta)
    seen = facet_density(half[2], alpha) * unmasked(cos_view, alpha) / np.maximum(cos_view, 1e-6)
    denominator = view_half + eta * light_half
    bent = eta * eta * np.abs(view_half * light_half) / np.maximum(denominator**2, 1e-12)
    density = np.where(possible, seen * np.where(reflected, np.float32(0.25), bent), 0).astype(np.float32)
    return density, np.where(reflected, fresnel, 1 - fresnel).astype(np.float32)
