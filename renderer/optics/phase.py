"""Scattering in a medium: how the direction of travel changes.

``mu`` is the cosine between the directions of travel before and after, +1 straight on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
_TWO_PI = np.float32(2 * np.pi)


def henyey_greenstein(mu, g: float):
    """Phase function, per steradian.

        p(mu) = (1 - g^2) / (4 pi (1 + g^2 - 2 g mu)^1.5)

    mu  (n,) cosine between travel directions
    g   mean cosine, in (-1, 1)

    Henyey & Greenstein 1941, ApJ 93:70, eq. 2. With g = 0 it is 1 / (4 pi).
    """
    return (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * mu) ** 1.5)


def sample_henyey_greenstein(g: float, u: Float32) -> Float32:
    """(n,) cosines distributed as ``henyey_greenstein``, by inversion.

        mu = [1 + g^2 - ((1 - g^2) / (1 - g + 2 g u))^2] / (2 g),   2 u - 1 for g = 0

    Witt 1977, ApJS 35:1, eq. 19. For small g the difference cancels in single precision; there it is multiplied out,

        mu = [s (1 + g^2) + g (3 + s^2 + g^2 (s^2 - 1)) / 2] / (1 + g s)^2,   s = 2 u - 1.
    """
    s = 2 * u - 1
    if abs(g) < 0.5:
        across = s * s
        mu = (s * (1 + g * g) + g * (3 + across + g * g * (across - 1)) / 2) / (1 + g * s) ** 2
        return np.clip(mu, -1, 1)
    ratio = (1 - g * g) / (1 + g * s)
    return np.clip((1 + g * g - ratio * ratio) / (2 * g), -1, 1)


def spherical(mu: Float32, azimuth: Float32, out: Float32) -> Float32:
    """(3, n) unit vectors with cosine ``mu`` to the z axis and the azimuth given as a share of the turn."""
    np.multiply(azimuth, _TWO_PI, out=out[2])
    np.cos(out[2], out=out[0])
    np.sin(out[2], out=out[1])
    sine = np.multiply(mu, mu)
    np.subtract(1, sine, out=sine)
    np.maximum(sine, 0, out=sine)
    np.sqrt(sine, out=sine)
    out[:2] *= sine
    out[2] = mu
    return out


def around(axis: Float32, local: Float32) -> Float32:
    """(3, n) local vectors turned so that their z axis becomes the unit ``axis``, (3, n).

    Duff et al. 2017, "Building an orthonormal basis, revisited", JCGT 6(1), listing 3.
    """
    x, y, z = axis
    sign = np.copysign(np.float32(1), z)
    a = -1 / (sign + z)
    b = x * y * a
    first = (1 + sign * x * x * a, sign * b, -sign * x)
    second = (b, sign + y * y * a, -y)
    return np.stack([first[k] * local[0] + second[k] * local[1] + axis[k] * local[2] for k in range(3)])
