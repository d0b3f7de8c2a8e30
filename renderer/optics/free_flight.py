"""How far light flies before it meets the medium, and the weights that make one flight serve three channels.

With one extinction for all channels the flight is exponential and weights stay as they are. With one per channel
the flight is drawn for a channel chosen with probability p_c, and each channel k takes the one-sample balance
weight over all choices (Wilkie et al. 2014, "Hero wavelength spectral sampling", CGF 33(4), eq. 4 and 5):

    collision after s   w_k <- w_k sigma_s,k exp(-sigma_t,k s) / sum_c p_c sigma_t,c exp(-sigma_t,c s)
    surface after s     w_k <- w_k exp(-sigma_t,k s) / sum_c p_c exp(-sigma_t,c s)

p_c follows w_c max(albedo_c, 1/4): uniform choices multiply the variance of the brightest channel, and the floor
keeps a clear, absorbing channel alive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
ALBEDO_FLOOR = np.float32(0.25)


def exponential(u: Float32, out: Float32) -> Float32:
    """(n,) optical distances -log(1 - u); with 24-bit uniforms at most 16.6 mean free paths (e^-16.6 is 6e-8)."""
    np.subtract(1, u, out=out)
    np.log(out, out=out)
    return np.negative(out, out=out)


def channel_probabilities(throughput: Float32, albedo: Float32) -> Float32:
    """(3, n) probabilities p_c of drawing the flight for channel c; ``albedo`` (3, n) or (3, 1)."""
    weight = throughput * np.maximum(albedo, ALBEDO_FLOOR)
    total = weight.sum(axis=0)
    return np.where(total > 0, weight / np.maximum(total, np.float32(1e-30)), np.float32(1 / 3))


def choose_channel(probabilities: Float32, u: Float32) -> NDArray[np.intp]:
    """(n,) channel indices drawn with the probabilities (3, n)."""
    first = probabilities[0]
    return (u >= first).astype(np.intp) + (u >= first + probabilities[1])


def collision_weight(distance: Float32, sigma_s: Float32, sigma_t: Float32, probabilities: Float32) -> Float32:
    """(3, n) factors of the throughput at a collision after ``distance`` (n,)."""
    through = np.exp(-sigma_t * distance)
    density = np.einsum("ij,ij->j", probabilities * sigma_t, through)
    return sigma_s * through / np.maximum(density, np.float32(1e-30))


def surface_weight(distance: Float32, sigma_t: Float32, probabilities: Float32) -> Float32:
    """(3, n) factors of the throughput where a surface is met after ``distance`` (n,) without collision."""
    through = np.exp(-sigma_t * distance)
    chance = np.einsum("ij,ij->j", probabilities, through)
    return through / np.maximum(chance, np.float32(1e-30))
