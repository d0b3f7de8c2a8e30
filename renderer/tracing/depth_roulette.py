"""Russian roulette along rays to lights: light from deep inside is given up by chance, so that rays stay short.

Light is followed for the optical depth ``FREE_DEPTH`` and an exponential variate, in the medium's clearest channel.
What comes from less deep stands for what was given up: beyond ``FREE_DEPTH`` chance has attenuated it, and the mean is
the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.free_flight import exponential
from .traced_scene import MISS

Float32 = NDArray[np.float32]

FREE_DEPTH = np.float32(2)
"""Optical depth up to which light is always followed."""


def drawn_depth(uniform: Float32) -> Float32:
    """(n,) optical depths at which light is given up, from uniform variates (n,)."""
    return FREE_DEPTH + exponential(uniform, np.empty_like(uniform))


def reach(extinction: Float32, deepest: Float32) -> Float32:
    """(n,) distances at which light is given up, where the clearest channel's extinction is ``extinction`` (n,)."""
    distance = np.full(deepest.shape, MISS)
    return np.divide(deepest, extinction, out=distance, where=extinction > 1 / MISS)


def taken(extinction: Float32, distance: Float32) -> Float32:
    """(n,) optical depth that chance has attenuated light by on its way ``distance`` (n,)."""
    return np.maximum(extinction * distance - FREE_DEPTH, 0)
