"""The media of a scene as tables, looked up by a path's owner; the last row is the vacuum outside (owner -1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sss_tools.medium import Medium

Float32 = NDArray[np.float32]


class MediaTable:
    """Coefficients per unit of the frame, (3, k + 1) a row a channel, column -1 the vacuum.

    sigma_t, sigma_s, albedo  (3, k + 1) float32
    ior                       (k + 1,) float32
    g                         k mean cosines
    achromatic                whether in each medium all channels have one extinction
    """

    def __init__(self, media: Sequence[Medium]):
        def table(values, vacuum: float) -> Float32:
            return np.array([*values, np.full(3, vacuum)], np.float32).T.copy()

        self.sigma_t = table([medium.sigma_t for medium in media], 0)
        self.sigma_s = table([medium.sigma_s for medium in media], 0)
        self.albedo = table([medium.single_scattering_albedo for medium in media], 1)
        self.ior = np.array([*(medium.ior for medium in media), 1], np.float32)
        self.g = [float(medium.g) for medium in media]
        self.achromatic = all(medium.is_achromatic for medium in media)
        self.count = len(media)

    @staticmethod
    def of(table: Float32, owner: NDArray[np.int16]) -> Float32:
        """The table's columns for each owner, (..., n)."""
        return np.take(table, owner, axis=-1)
