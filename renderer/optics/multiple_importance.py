"""How two ways to find the same light share it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def power_heuristic(mine, other) -> NDArray[np.float32]:
    """(n,) weight of light found by one way that another could have found too; both ways' weights add up to 1.

        mine^2 / (mine^2 + other^2)

    mine, other  densities per steradian with which the two ways draw the direction. An infinite one, of mirrors and of
                 lights without extent, leaves nothing to the other; not both may be infinite

    Veach & Guibas 1995, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH, section 4.
    """
    with np.errstate(over="ignore"):
        ratio = np.asarray(other, np.float32) / np.maximum(mine, np.float32(1e-30))
        return 1 / (1 + ratio * ratio)
