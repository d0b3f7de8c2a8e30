"""Flights guided towards an axis: sampling that prefers what leads out of a medium, with weights that undo the bias.

Of the solutions of the transport equation in a medium without boundary, exp(c-direction z sigma_t / nu0)/(nu0 - c)
is the one that decays slowest. Taken as the importance of leaving through a plane whose normal is the axis, it gives
Dwivedi's scheme: directions with cosine c to the axis have density

    p(c) = 1 / [(nu0 - c) ln((nu0 + 1)/(nu0 - 1))],      c in [-1, 1]

and flights have extinction sigma_t (1 - c/nu0). Dwivedi 1982; Krivanek & d'Eon 2014, "A zero-variance-based sampling
scheme for Monte Carlo subsurface scattering", SIGGRAPH talks; Meng, Hanika & Dachsbacher 2016, "Improving the Dwivedi
sampling scheme", EGSR, eq. 9-10.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

_LARGEST_EXPONENT = np.float32(80)


def decay_length(albedo: float) -> float:
    """nu0 > 1 in mean free paths: far from sources, light in a medium that scatters isotropically falls as exp(-z/nu0).

        1/nu0 = sqrt(1 - a^(2.44294 - 0.0215813 a + 0.578637/a))

    d'Eon & Krivanek 2020, "Zero-variance theory for efficient subsurface scattering", eq. 67.
    """
    exponent = 2.44294 - 0.0215813 * albedo + 0.578637 / albedo
    return float(1 / np.sqrt(max(1 - albedo**exponent, 1e-12)))


@dataclass(frozen=True)
class Guide:
    """Mixes guided and plain flights; the balance heuristic over both, direction and length together, weighs them.

    With m the share of guided flights, a flight of length s in a direction with cosine c to the axis has the weight

        1 / [1 - m + m r (1 - c/nu0) e^(sigma_t s c/nu0)]   if it ends in a collision,
        1 / [1 - m + m r e^(sigma_t s c/nu0)]               if it ends at a surface,

    r = 2 p(c), the density over that of isotropic scattering; the caller multiplies with the albedo. No weight exceeds
    1/(1 - m).

    nu0      decay length in mean free paths, see ``decay_length``
    share    m, in (0, 1)
    sigma_t  extinction, 1/length
    """

    nu0: float
    share: float
    sigma_t: float

    @classmethod
    def of(cls, albedo: float, sigma_t: float, share: float = 0.5) -> Guide:
        """The guide of a medium."""
        return cls(decay_length(albedo), share, sigma_t)

    @property
    def inverse_share(self) -> float:
        """1/m."""
        return 1 / self.share

    @property
    def inverse_rest(self) -> float:
        """1/(1 - m)."""
        return 1 / (1 - self.share)

    @cached_property
    def _log(self) -> float:
        return float(np.log((self.nu0 + 1) / (self.nu0 - 1)))

    def sample_cosine(self, u: Float32) -> Float32:
        """(n,) cosines to the axis with density p, by inversion."""
        cosine = self.nu0 - (self.nu0 + 1) * np.exp(-self._log * u)
        return np.clip(cosine, -1, 1, out=cosine)

    def density(self, cosine: Float32) -> Float32:
        """(n,) density per steradian of directions with these cosines to the axis, guided and plain ones together."""
        plain = np.float32((1 - self.share) / (4 * np.pi))
        return plain + np.float32(self.share / (2 * np.pi * self._log)) / (np.float32(self.nu0) - cosine)

    def rate(self, cosine: Float32) -> Float32:
        """(n,) extinction of guided flights over that of plain ones."""
        return 1 - cosine * np.float32(1 / self.nu0)

    def weight(self, cosine: Float32, flight: Float32, at_surface: NDArray[np.intp]) -> Float32:
        """(n,) weights of flights (n,); ``at_surface`` are those that end at surfaces, the others end in collisions."""
        exponent = cosine * np.float32(self.sigma_t / self.nu0)
        exponent *= flight
        growth = np.exp(np.minimum(exponent, _LARGEST_EXPONENT, out=exponent), out=exponent)
        # at collisions r (1 - c/nu0) does not depend on c
        growth *= np.float32(self.share * 2 / (self.nu0 * self._log))
        growth[at_surface] /= self.rate(cosine[at_surface])
        growth += np.float32(1 - self.share)
        return np.reciprocal(growth, out=growth)
