"""Free flights: the exponential law, and the weights that make one flight serve three channels."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from renderer.optics.free_flight import (
    ALBEDO_FLOOR,
    channel_probabilities,
    choose_channel,
    collision_weight,
    exponential,
    surface_weight,
)
from tests.assertions import assert_distribution, assert_mean, seed, shared_rate

SAMPLES = 400_000
SIGMA_T = np.float32([[1.0], [2.0], [6.0]])
SIGMA_S = np.float32([[0.95], [1.6], [1.5]])
THICKNESS = 0.5


def uniforms(number: int, n: int = SAMPLES):
    bits = np.random.default_rng(seed(number)).integers(0, 2**24, (2, n))
    return (bits * 2.0**-24).astype(np.float32)


def test_flights_are_exponential():
    """Sees relative errors of the density of 2.5 %; of means, 1 %. Blind beyond 16 mean free paths (1e-7)."""
    flights = exponential(uniforms(1)[0], np.empty(SAMPLES, np.float32))
    edges = np.append(np.linspace(0, 8, 65), np.inf)
    counts, _ = np.histogram(flights, edges)
    assert_distribution(counts, np.diff(stats.expon.cdf(edges)), false_alarm=1e-4, detects=0.025)
    assert_mean(flights, 1.0, false_alarm=1e-4, detects=0.01)


def test_flights_one_percent_long_are_caught():
    flights = 1.01 * exponential(uniforms(1)[0], np.empty(SAMPLES, np.float32))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(flights, 1.0, false_alarm=1e-4, detects=0.01)


def test_all_flights_are_finite_and_none_is_negative():
    extremes = np.float32([0, 2.0**-24, 1 - 2.0**-24])
    flights = exponential(extremes, np.empty(3, np.float32))
    assert_allclose(flights, [0, 2.0**-24, 24 * np.log(2)], rtol=1e-6)
    assert flights.min() >= 0


def test_probabilities_follow_weight_and_floored_albedo():
    throughput = np.float32([[1, 0, 0.5], [0, 0, 0.5], [1, 0, 0]])
    albedo = np.float32([[0.9], [0.5], [0.0]])
    chances = channel_probabilities(throughput, albedo)
    floor = float(ALBEDO_FLOOR)
    assert_allclose(chances[:, 0], np.array([0.9, 0, floor]) / (0.9 + floor), rtol=1e-6)
    assert_allclose(chances[:, 1], 1 / 3, rtol=1e-6)  # a dark path: any choice, but finite
    assert_allclose(chances[:, 2], np.array([0.45, 0.25, 0]) / 0.7, rtol=1e-6)


def test_channels_are_chosen_with_their_probabilities():
    chances = np.repeat(np.float32([[0.2], [0.5], [0.3]]), SAMPLES, axis=1)
    counts = np.bincount(choose_channel(chances, uniforms(2)[1]), minlength=3)
    assert_distribution(counts, chances[:, 0], false_alarm=1e-4, detects=0.02)


def flown_through_slab(throughput, *, chosen_with=None, seed_number: int = 3):
    """(3, n) weights of surface hits and (3, n) of collisions, 0 where the other happened, in a slab.

    chosen_with  (3,) probabilities with which channels are really chosen; by default those that the weights assume
    """
    u, choice = uniforms(seed_number)
    throughput = np.repeat(np.float32(throughput)[:, None], SAMPLES, axis=1)
    chances = channel_probabilities(throughput, SIGMA_S / SIGMA_T)
    really = chances if chosen_with is None else np.repeat(np.float32(chosen_with)[:, None], SAMPLES, axis=1)
    channel = choose_channel(really, choice)
    flight = exponential(u, np.empty_like(u)) / SIGMA_T[channel, 0]
    through = flight > THICKNESS
    distance = np.minimum(flight, np.float32(THICKNESS))
    surface = throughput * np.where(through, surface_weight(distance, SIGMA_T, chances), 0)
    collision = throughput * np.where(through, 0, collision_weight(distance, SIGMA_S, SIGMA_T, chances))
    return surface, collision


def analog(throughput):
    """What each channel's own flights give: shares of light through the slab, and scattered in it."""
    sigma_t, sigma_s, throughput = SIGMA_T[:, 0].astype(float), SIGMA_S[:, 0].astype(float), np.array(throughput)
    through = np.exp(-sigma_t * THICKNESS)
    return throughput * through, throughput * sigma_s / sigma_t * (1 - through)


@pytest.mark.parametrize("throughput", [(1, 1, 1), (1.0, 0.2, 0.05), (0.0, 1.0, 1.0)])
def test_every_channel_has_the_mean_of_its_own_analog_flights(throughput):
    """Transmission of a slab and scattering in it; 1.5 % of each is seen."""
    rate = shared_rate(1e-3, 18)
    for weights, expected in zip(flown_through_slab(throughput), analog(throughput), strict=True):
        for k in range(3):
            assert_mean(weights[k], expected[k], false_alarm=rate, detects=max(0.015 * expected[k], 1e-9),
                        what=f"channel {k}")  # fmt: skip


def test_channels_chosen_otherwise_than_the_weights_assume_are_caught():
    """The companion: uniform choices under weights for p_c; transmission would be off by tens of per cent."""
    throughput = (1, 0.2, 0.05)
    surface, _ = flown_through_slab(throughput, chosen_with=(1 / 3, 1 / 3, 1 / 3))
    expected = analog(throughput)[0]
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(surface[0], expected[0], false_alarm=1e-4, detects=0.015 * expected[0])


def test_planted_error_of_two_percent_is_caught():
    surface, _ = flown_through_slab((1, 1, 1))
    expected = analog((1, 1, 1))[0]
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.02 * surface[0], expected[0], false_alarm=1e-4, detects=0.015 * expected[0])


def test_one_extinction_for_all_needs_no_weights():
    sigma_t, sigma_s = np.full((3, 1), 2, np.float32), np.float32([[2.0], [1.0], [0.5]])
    distance, chances = np.float32([0.1, 1.0, 5.0]), np.float32([[0.5] * 3, [0.3] * 3, [0.2] * 3])
    assert_allclose(surface_weight(distance, sigma_t, chances), 1, rtol=1e-6)
    albedo = np.broadcast_to(sigma_s / sigma_t, (3, 3))
    assert_allclose(collision_weight(distance, sigma_s, sigma_t, chances), albedo, rtol=1e-6)


def test_weights_stay_finite_where_every_exponential_underflows():
    sigma_t = np.float32([[1e4], [2e4], [3e4]])
    chances = np.full((3, 1), 1 / 3, np.float32)
    for weights in (surface_weight(np.float32([1]), sigma_t, chances),
                    collision_weight(np.float32([1]), sigma_t, sigma_t, chances)):  # fmt: skip
        assert np.isfinite(weights).all()
