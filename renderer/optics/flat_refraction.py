"""Light without extent through one flat smooth boundary: where it crosses, how it bends, how it spreads.

Pure functions of float64 arrays. ``eta`` is the index on the far side over the index on the light's side; ``x`` is the
cosine to the normal on the light's side, ``inner`` the one beyond.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
_ROUNDS = 60
"""Bound of the root search: a bisection to the last bit, were Newton's step never any use."""


def inner_cosine(x: Float64, eta: float) -> Float64:
    """Cosine beyond the boundary, 0 where all light is reflected: sqrt(1 - (1 - x^2)/eta^2)."""
    return np.sqrt(np.maximum(1 - (1 - x * x) / (eta * eta), 0))


def bent(towards: Float64, normal: Float64, eta: float) -> Float64:
    """(n, 3) unit direction of travel beyond the boundary.

    towards  (n, 3) or (3,) unit, to the light
    normal   (n, 3) unit, on the light's side

        d = -L/eta + (x/eta - x') N

    Snell's law as a vector; where all light is reflected the direction means nothing.
    """
    x = (normal * towards).sum(axis=-1)
    direction = -towards / eta + (x / eta - inner_cosine(x, eta))[..., None] * normal
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def crossing(above: Float64, below: Float64, apart: Float64, eta: float) -> Float64:
    """(n,) how far from the light's foot point light crosses the plane on its way to a point beyond.

    above, below  (n,) distances of light and point from the plane, > 0
    apart         (n,) distance between their foot points, >= 0

    By Fermat the optical length sqrt(above^2 + r^2) + eta sqrt(below^2 + (apart - r)^2) is least. It is strictly convex
    in r, so the root of its slope is the only one, and lies in [0, apart]. Newton's steps; where one leaves the
    bracket, its middle.
    """
    low, high = np.zeros_like(apart), apart.copy()
    r = apart * (above / (above + below / eta))
    for _ in range(_ROUNDS):
        rest = apart - r
        out, inn = np.sqrt(above * above + r * r), np.sqrt(below * below + rest * rest)
        slope = r / out - eta * rest / inn
        curvature = above * above / out**3 + eta * below * below / inn**3
        np.copyto(high, r, where=slope > 0)
        np.copyto(low, r, where=slope <= 0)
        new = r - slope / curvature
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        moved = np.abs(new - r)
        r = new
        if (moved <= 1e-13 * (apart + below)).all():
            break
    return r


def spreading(outside: Float64, inside: Float64, x: Float64, inner: Float64, eta: float) -> Float64:
    """(n,) solid angle at a point light per area across its refracted beam, 1/length^2.

    outside, inside  (n,) lengths of the path on either side of the plane

        d omega / dA = (x/x') / [(a + t/eta) (a + t x^2/(eta x'^2))]

    Take cylinder coordinates about the light's normal: the point is r = h tan(theta) + z tan(theta') from the axis,
    with h = a x, z = t x', sin(theta) = eta sin(theta'). A cone of d omega = sin(theta) dtheta dphi cuts the plane
    through the point in r dphi dr, of which x' lies across the beam. Around the axis r/sin(theta) = a + t/eta. Along
    the radius dtheta'/dtheta = x/(eta x'), so dr/dtheta = h/x^2 + (z/x'^2) x/(eta x') = (a + t x^2/(eta x'^2))/x.
    Without refraction (eta = 1) it is 1/(a + t)^2; from afar a^2 times it is x/x', as for parallel light.
    """
    return (x / inner) / ((outside + inside / eta) * (outside + inside * x * x / (eta * inner * inner)))
