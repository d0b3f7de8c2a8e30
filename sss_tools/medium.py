"""What light meets inside: absorption, scattering, the phase function's mean cosine, the index of refraction.

Coefficients are per unit of length, three linear RGB channels each. Presets are in millimetres; this is the
only module that knows what a millimetre is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Channels = NDArray[np.float64]

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
"""Millimetres in one unit of length."""


@dataclass(frozen=True, eq=False)
class Medium:
    """A homogeneous scattering medium; each coefficient (3,), a single number serving all channels.

    sigma_a  absorption coefficient, 1/length, >= 0
    sigma_s  scattering coefficient, 1/length, >= 0
    g        mean cosine of the Henyey-Greenstein phase function, -1 < g < 1
    ior      index of refraction inside, relative to 1 outside, >= 1; 1 means the surface is invisible

    Raises ValueError for values outside these ranges, and where a channel neither absorbs nor scatters.
    """

    sigma_a: Channels
    sigma_s: Channels
    g: float = 0.0
    ior: float = 1.5

    def __post_init__(self) -> None:
        for name in ("sigma_a", "sigma_s"):
            values = _channels(name, getattr(self, name))
            if (values < 0).any():
                raise ValueError(f"{name} is {_shown(values)}, but a coefficient cannot be negative")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if not (self.sigma_t > 0).all():
            raise ValueError("sigma_a and sigma_s are both 0 in a channel, but every channel must absorb or scatter")
        g, ior = float(self.g), float(self.ior)
        if not -1 < g < 1:
            raise ValueError(f"g is {g:g}, but a mean cosine lies between -1 and 1, both excluded")
        if not (np.isfinite(ior) and ior >= 1):
            raise ValueError(f"ior is {ior:g}, but it must be a finite number of at least 1")
        object.__setattr__(self, "g", g)
        object.__setattr__(self, "ior", ior)

    @classmethod
    def from_coefficients(cls, sigma_a: ArrayLike, sigma_s: ArrayLike, g: float = 0.0, ior: float = 1.5) -> Medium:
        """From absorption and scattering coefficients, 1/length."""
        return cls(_channels("sigma_a", sigma_a), _channels("sigma_s", sigma_s), g, ior)

    @classmethod
    def from_albedo(cls, albedo: ArrayLike, sigma_t: ArrayLike, g: float = 0.0, ior: float = 1.5) -> Medium:
        """From the single-scattering albedo, in [0, 1], and the extinction coefficient, 1/length, > 0."""
        albedo, sigma_t = _channels("albedo", albedo), _channels("sigma_t", sigma_t)
        if ((albedo < 0) | (albedo > 1)).any():
            raise ValueError(f"albedo is {_shown(albedo)}, but an albedo lies between 0 and 1")
        if (sigma_t <= 0).any():
            raise ValueError(f"sigma_t is {_shown(sigma_t)}, but it must be greater than 0")
        return cls((1 - albedo) * sigma_t, albedo * sigma_t, g, ior)

    @classmethod
    def from_color(cls, color: ArrayLike, radius: ArrayLike, g: float = 0.0, ior: float = 1.5) -> Medium:
        """From the diffuse reflectance, in [0, 1), and the transport mean free path, length, > 0.

        sigma_t' = 1 / radius;  sigma_s' = alpha' sigma_t' with alpha' from ``reduced_albedo_of_color``;
        sigma_s = sigma_s' / (1 - g). The color is that of a thick body under diffuse light with a matched
        boundary; a dielectric boundary darkens it (``diffuse_reflectance``).
        """
        radius = _channels("radius", radius)
        if (radius <= 0).any():
            raise ValueError(f"radius is {_shown(radius)}, but a mean free path must be greater than 0")
        if not -1 < float(g) < 1:
            raise ValueError(f"g is {float(g):g}, but a mean cosine lies between -1 and 1, both excluded")
        reduced_albedo = reduced_albedo_of_color(color)
        return cls((1 - reduced_albedo) / radius, reduced_albedo / radius / (1 - g), g, ior)

    @classmethod
    def preset(cls, name: str, unit: str = "mm") -> Medium:
        """A measured material of ``PRESETS`` with coefficients per ``unit``, a key of ``UNITS``.

        The paper gives reduced coefficients, so g is 0. Raises ValueError for an unknown name or unit.
        """
        if name not in PRESETS:
            raise ValueError(f"there is no preset '{name}', only {', '.join(PRESETS)}")
        if unit not in UNITS:
            raise ValueError(f"there is no unit '{unit}', only {', '.join(UNITS)}")
        measured = PRESETS[name]
        per_mm = cls.from_coefficients(measured.sigma_a, measured.reduced_scattering, 0.0, measured.ior)
        return per_mm.scaled(UNITS[unit])

    def scaled(self, units_per_new_unit: float) -> Medium:
        """The same medium in coefficients per new unit, which is ``units_per_new_unit`` old ones long."""
        return Medium(self.sigma_a * units_per_new_unit, self.sigma_s * units_per_new_unit, self.g, self.ior)

    @property
    def sigma_t(self) -> Channels:
        """(3,) extinction coefficient sigma_a + sigma_s, 1/length."""
        return self.sigma_a + self.sigma_s

    @property
    def single_scattering_albedo(self) -> Channels:
        """(3,) share of collisions that scatter, alpha = sigma_s / sigma_t."""
        return self.sigma_s / self.sigma_t

    @property
    def reduced_scattering(self) -> Channels:
        """(3,) sigma_s' = (1 - g) sigma_s, 1/length: isotropic scattering that spreads light alike."""
        return (1 - self.g) * self.sigma_s

    @property
    def reduced_extinction(self) -> Channels:
        """(3,) sigma_t' = sigma_a + sigma_s', 1/length."""
        return self.sigma_a + self.reduced_scattering

    @property
    def reduced_albedo(self) -> Channels:
        """(3,) alpha' = sigma_s' / sigma_t'."""
        return self.reduced_scattering / self.reduced_extinction

    @property
    def mean_free_path(self) -> Channels:
        """(3,) mean distance between collisions, 1 / sigma_t, length."""
        return 1 / self.sigma_t

    @property
    def transport_mean_free_path(self) -> Channels:
        """(3,) mean distance after which light has forgotten its direction, 1 / sigma_t', length."""
        return 1 / self.reduced_extinction

    @property
    def is_achromatic(self) -> bool:
        """Whether sigma_t is the same in all channels but for rounding, so that one path serves all three."""
        # sigma_a + sigma_s of an authored sigma_t differs from it by an ulp or two
        return bool(np.ptp(self.sigma_t) <= 1e-12 * self.sigma_t.max())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Medium):
            return NotImplemented
        same = np.array_equal(self.sigma_a, other.sigma_a) and np.array_equal(self.sigma_s, other.sigma_s)
        return same and self.g == other.g and self.ior == other.ior

    def __hash__(self) -> int:
        return hash((self.sigma_a.tobytes(), self.sigma_s.tobytes(), self.g, self.ior))


def reduced_albedo_of_color(color: ArrayLike) -> Channels:
    """(3,) the reduced albedo alpha' of a thick body with diffuse reflectance ``color``, each in [0, 1).

        alpha' = 1 - [4.20863 A - sqrt(9.59217 + 41.6808 A + 17.7126 A^2) + 4.09712]^2

    d'Eon, "A Hitchhiker's Guide to Multiple Scattering", eq. 53.7: diffuse light, matched boundary, isotropic
    scattering. Off by at most 0.007 in alpha'; right in the whites (0.929 gives 0.9990). A = 1 would be a medium
    without absorption, of which no finite body is that white: it is refused; say ``albedo = 1`` for that.
    Raises ValueError for colors outside [0, 1).
    """
    a = _channels("color", color)
    if ((a < 0) | (a >= 1)).any():
        raise ValueError(f"color is {_shown(a)}, but a diffuse reflectance lies between 0 and 1, 1 excluded")
    root = np.sqrt(9.59217 + 41.6808 * a + 17.7126 * a**2)
    return 1 - (4.20863 * a - root + 4.09712) ** 2


def diffuse_reflectance(medium: Medium) -> Channels:
    """(3,) share of diffuse light that a thick body returns, without the specular reflection of its surface.

        A = (1 - s)(1 - 0.139 s) / (1 + 1.17 s),  s = sqrt(1 - alpha')
        A_eta = (1 - Fe)(1 - rho_i) A / (1 - rho_i A)

    A: van de Hulst 1980, matched boundary, error at most 0.003. A_eta: the boundary after Saunderson, J. Opt.
    Soc. Am. 32:727 (1942), error at most 0.03 at alpha' = 0.9 and 0.014 at 0.99.
    """
    s = np.sqrt(1 - medium.reduced_albedo)
    matched = (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s)
    external = _diffuse_fresnel_reflectance(medium.ior)
    internal = 1 - (1 - external) / medium.ior**2
    return (1 - external) * (1 - internal) * matched / (1 - internal * matched)


def _diffuse_fresnel_reflectance(ior: float) -> float:
    """Fe = 2 int_0^1 F(mu) mu dmu of unpolarised light from outside, by Gauss-Legendre quadrature."""
    node, weight = np.polynomial.legendre.leggauss(64)
    # mu = u^2 gathers the nodes at grazing light, where F turns sharply
    u = (node + 1) / 2
    mu, d_mu = u**2, weight * u
    inside = np.sqrt(1 - (1 - mu**2) / ior**2)
    parallel = (ior * mu - inside) / (ior * mu + inside)
    perpendicular = (mu - ior * inside) / (mu + ior * inside)
    return float(np.sum((parallel**2 + perpendicular**2) * mu * d_mu))


class Measured(NamedTuple):
    """A row of a table of measurements: RGB, 1/mm, and the index of refraction."""

    reduced_scattering: tuple[float, float, float]
    sigma_a: tuple[float, float, float]
    ior: float


# Jensen, Marschner, Levoy & Hanrahan, "A Practical Model for Subsurface Light Transport", SIGGRAPH 2001,
# Table 1. Fitted through the dipole, in RGB of no stated primaries. Some copies have sigma_a of red chicken a
# tenth of what is here; the paper's own reflectances (0.31, 0.32) follow from 0.015 and 0.018 alone.
PRESETS = {
    "apple": Measured((2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046), 1.3),
    "chicken1": Measured((0.15, 0.21, 0.38), (0.015, 0.077, 0.19), 1.3),
    "chicken2": Measured((0.19, 0.25, 0.32), (0.018, 0.088, 0.20), 1.3),
    "cream": Measured((7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163), 1.3),
    "ketchup": Measured((0.18, 0.07, 0.03), (0.061, 0.97, 1.45), 1.3),
    "marble": Measured((2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071), 1.5),
    "potato": Measured((0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12), 1.3),
    "skimmilk": Measured((0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142), 1.3),
    "skin1": Measured((0.74, 0.88, 1.01), (0.032, 0.17, 0.48), 1.3),
    "skin2": Measured((1.09, 1.59, 1.79), (0.013, 0.070, 0.145), 1.3),
    "spectralon": Measured((11.6, 20.4, 14.9), (0.0, 0.0, 0.0), 1.3),
    "wholemilk": Measured((2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014), 1.3),
}
"""Measured materials by name."""


def _channels(name: str, value: ArrayLike) -> Channels:
    """(3,) from one number or three; ValueError for anything else and for NaN and infinities."""
    try:
        values = np.asarray(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {value!r}, but must be one number or three") from None
    if values.shape not in ((), (1,), (3,)):
        raise ValueError(f"{name} has {values.size} values, but must be one number or three")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} is {_shown(np.atleast_1d(values))}, but must be finite")
    return np.broadcast_to(values, (3,)).copy()


def _shown(values: Channels) -> str:
    return ", ".join(f"{value:g}" for value in values)
