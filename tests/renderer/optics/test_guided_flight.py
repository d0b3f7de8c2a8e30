"""Guided flights: what is drawn has the density that the weights undo."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import integrate

from renderer.optics.guided_flight import Guide, decay_length
from tests.assertions import assert_distribution, assert_mean, seed

GUIDE = Guide.of(0.8, 4.0, 0.6)
SAMPLES = 400_000


def density(cosine, guide=GUIDE):
    return 1 / ((guide.nu0 - cosine) * np.log((guide.nu0 + 1) / (guide.nu0 - 1)))


@pytest.mark.parametrize("albedo", [0.3, 0.6, 0.9, 0.99, 0.999])
def test_decay_length_solves_the_dispersion_relation(albedo):
    """1 = (a nu0 / 2) ln((nu0 + 1)/(nu0 - 1)), Case & Zweifel 1967, eq. 4.2.8; the fit is good to 1e-3 in 1/nu0."""
    nu0 = decay_length(albedo)
    assert_allclose(albedo * nu0 / 2 * np.log((nu0 + 1) / (nu0 - 1)), 1, atol=2e-3)


def test_a_white_medium_has_a_finite_decay_length():
    assert 1e3 < decay_length(1.0) < np.inf


def test_cosines_have_the_stated_density():
    """Sees relative errors of the density of 5 %."""
    u = np.random.default_rng(seed(1)).random(SAMPLES, np.float32)
    edges = np.linspace(-1, 1, 33)
    counts, _ = np.histogram(GUIDE.sample_cosine(u), edges)
    expected = [integrate.quad(density, low, high)[0] for low, high in pairwise(edges)]
    assert_allclose(sum(expected), 1, rtol=1e-9)
    assert_distribution(counts, np.array(expected), false_alarm=1e-4, detects=0.05)


def walks(guide: Guide, thickness: float, number: int, exponent_sign: float = 1.0):
    """Weights of flights from depth 0 in a layer between -thickness and thickness along the axis, and how they end.

    Directions and lengths are drawn as the path shader draws them.
    """
    rng = np.random.default_rng(seed(number))
    u, flight = rng.random(SAMPLES, np.float32), rng.standard_exponential(SAMPLES, np.float32)
    guided = u < guide.share
    rest = np.where(guided, u * guide.inverse_share, (u - guide.share) * guide.inverse_rest).astype(np.float32)
    cosine = np.where(guided, guide.sample_cosine(rest), 2 * rest - 1)
    flight /= np.where(guided, guide.rate(cosine), 1) * np.float32(guide.sigma_t)
    limit = np.float32(thickness) / np.abs(cosine)
    at_surface = flight >= limit
    flight = np.minimum(flight, limit)
    weight = guide.weight(np.float32(exponent_sign) * cosine, flight, np.flatnonzero(at_surface))
    return weight.astype(float), cosine, flight, at_surface


def exact(thickness: float, moment):
    """Mean over isotropic directions of the share that reaches the walls, times ``moment`` of the cosine."""
    return integrate.quad(lambda c: moment(c) * np.exp(-GUIDE.sigma_t * thickness / abs(c)) / 2, -1, 1, points=[0])[0]


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_weighed_flights_reach_walls_and_collide_as_plain_ones_do(share):
    """Sees 2 % of what reaches either wall, of its mean cosine, and of collisions."""
    guide = Guide.of(0.8, 4.0, share)
    weight, cosine, _, at_surface = walks(guide, 0.1, 2)
    for moment in (lambda c: 1.0, lambda c: np.where(np.asarray(c) > 0, 1.0, 0.0), np.abs):
        expected = exact(0.1, moment)
        assert_mean(weight * at_surface * moment(cosine), expected, false_alarm=1e-5, detects=0.02 * expected)
    collides = 1 - exact(0.1, lambda c: 1.0)
    assert_mean(weight * ~at_surface, collides, false_alarm=1e-5, detects=0.02 * collides)


def test_weights_for_the_other_direction_are_caught():
    weight, _, _, at_surface = walks(GUIDE, 0.1, 2, exponent_sign=-1.0)
    expected = exact(0.1, lambda c: 1.0)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(weight * at_surface, expected, false_alarm=1e-5, detects=0.05 * expected)


def test_no_weight_exceeds_that_of_plain_flights_alone():
    weight, *_ = walks(GUIDE, 10.0, 3)
    assert weight.max() <= 1 / (1 - GUIDE.share) * (1 + 1e-6)
    assert np.isfinite(weight).all()


def test_directions_of_guided_and_plain_flights_together_have_the_stated_density():
    plain = (1 - GUIDE.share) / (4 * np.pi)
    for cosine in (-1.0, -0.2, 0.9, 1.0):
        expected = plain + GUIDE.share * density(cosine) / (2 * np.pi)
        assert GUIDE.density(np.float32([cosine]))[0] == pytest.approx(expected, rel=1e-5)


def counted(share_claimed: float, flights: int = SAMPLES):
    """Counts of free flights by cosine and length, and what the weights say they must be: plain density over weight.

    A weight is the plain density over that of the mixture; so the mixture's is the plain one over the weight.
    """
    guide = Guide.of(0.8, 4.0, 0.6)
    rng = np.random.default_rng(seed(5))
    u, flight = rng.random(flights, np.float32), rng.standard_exponential(flights, np.float32)
    guided = u < guide.share
    rest = np.where(guided, u * guide.inverse_share, (u - guide.share) * guide.inverse_rest).astype(np.float32)
    cosine = np.where(guided, guide.sample_cosine(rest), 2 * rest - 1)
    flight /= np.where(guided, guide.rate(cosine), 1) * np.float32(guide.sigma_t)
    bins, fine, longest = 12, 32, 1.0
    counts, *_ = np.histogram2d(cosine, flight, bins, [[-1, 1], [0, longest]])
    middles = (np.arange(bins * fine) + 0.5) / (bins * fine)
    c, s = (np.float32(values).ravel() for values in np.meshgrid(2 * middles - 1, longest * middles, indexing="ij"))
    weight = Guide.of(0.8, 4.0, share_claimed).weight(c.copy(), s, np.zeros(0, np.intp))
    density = (np.exp(-guide.sigma_t * s.astype(float)) * guide.sigma_t / 2 / weight).reshape(bins, fine, bins, fine)
    expected = density.mean(axis=(1, 3)) * 2 * longest / bins**2
    beyond = max(1 - expected.sum(), 0)
    return np.append(counts.ravel(), flights - counts.sum()), np.append(expected.ravel(), beyond)


def test_flights_have_the_joint_density_that_their_weights_undo():
    """Cosine and length together. Sees relative errors of 3 %."""
    assert_distribution(*counted(0.6), false_alarm=1e-4, detects=0.03)


def test_weights_of_another_mixture_are_caught():
    with pytest.raises(AssertionError, match="wrong distribution"):
        assert_distribution(*counted(0.55), false_alarm=1e-4, detects=0.03)
