"""The statistical assertions themselves: they pass what is sound, catch what is not, and refuse to be blind."""

import numpy as np
import pytest
from scipy import stats

from tests.assertions import assert_distribution, assert_mean, shared_rate

RNG_SEED = 20261122


@pytest.fixture
def rng():
    return np.random.default_rng(RNG_SEED)


def test_sound_mean_passes(rng):
    assert_mean(rng.exponential(2.0, 100_000), 2.0, false_alarm=1e-4, detects=0.05)


def test_mean_off_by_one_percent_is_caught(rng):
    samples = rng.exponential(2.0, 400_000)
    assert_mean(samples, 2.0, false_alarm=1e-4, detects=0.02)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.01 * samples, 2.0, false_alarm=1e-4, detects=0.02)


def test_too_few_samples_are_refused_though_their_mean_is_right():
    samples = np.array([1.0, 3.0] * 10)
    with pytest.raises(AssertionError, match="too few samples"):
        assert_mean(samples, 2.0, false_alarm=1e-4, detects=0.1)


def test_summary_means_the_same_as_its_samples(rng):
    samples = rng.normal(5, 1, 1000)
    summary = samples.mean(), samples.std(ddof=1) / np.sqrt(1000), 1000
    messages = []
    for given in (samples, summary):
        with pytest.raises(AssertionError) as caught:
            assert_mean(given, 6.0, false_alarm=1e-3, detects=0.5)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]


def test_failure_says_all_there_is_to_know():
    with pytest.raises(AssertionError) as caught:
        assert_mean((1.5, 0.01, 400), 1.0, false_alarm=1e-4, detects=0.1, what="albedo")
    for part in ("albedo", "1.5", "0.01", "400 samples", "expected 1:", "z = 50.00", "0.0001", "0.1 must be"):
        assert part in str(caught.value)


@pytest.mark.parametrize("samples", [np.array([1.0, np.nan]), np.array([1.0]), (1.0, np.inf, 10)])
def test_what_is_not_finite_or_alone_is_refused(samples):
    with pytest.raises(AssertionError):
        assert_mean(samples, 1.0, false_alarm=1e-4, detects=1e9)


def test_samples_without_spread_pass_only_on_the_spot():
    assert_mean(np.ones(10), 1.0, false_alarm=1e-4, detects=1e-3)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(np.ones(10), 1.0 + 1e-9, false_alarm=1e-4, detects=1e-3)


def test_samples_of_two_dimensions_are_a_mistake_of_the_caller():
    with pytest.raises(ValueError, match=r"\(2, 2\)"):
        assert_mean(np.ones((2, 2)), 1.0, false_alarm=1e-4, detects=1)


def test_false_alarms_come_at_the_stated_rate(rng):
    """2000 tests at 0.05 of ten samples each: the normal quantile instead of Student's would raise 160 alarms."""
    alarms = 0
    for samples in rng.normal(size=(2000, 10)):
        try:
            assert_mean(samples, 0.0, false_alarm=0.05, detects=100)
        except AssertionError:
            alarms += 1
    # 100 +- 9.7; four standard deviations
    assert 60 < alarms < 140


def test_sound_distribution_passes(rng):
    counts = np.bincount(rng.integers(0, 16, 40_000), minlength=16)
    assert_distribution(counts, np.ones(16), false_alarm=1e-4, detects=0.05)


def test_tilted_distribution_is_caught(rng):
    tilt = 1 + 0.05 * np.linspace(-1, 1, 16)
    counts = rng.multinomial(100_000, tilt / tilt.sum())
    with pytest.raises(AssertionError, match="wrong distribution"):
        assert_distribution(counts, np.ones(16), false_alarm=1e-4, detects=0.03)


def test_few_counts_are_refused_though_they_fit():
    with pytest.raises(AssertionError, match="too few samples"):
        assert_distribution(np.full(16, 10), np.ones(16), false_alarm=1e-4, detects=0.05)


def test_samples_where_none_can_be_are_caught():
    with pytest.raises(AssertionError, match="where there can be none"):
        assert_distribution([500, 500, 1], [1, 1, 0], false_alarm=1e-4, detects=0.5)


def test_small_bins_are_pooled(rng):
    """A Poisson tail of hundreds of near-empty bins: unpooled, single counts there would raise alarms."""
    weights = stats.poisson.pmf(np.arange(200), 3.0)
    for _ in range(50):
        counts = np.bincount(rng.poisson(3.0, 5000), minlength=200)
        assert_distribution(counts, weights, false_alarm=1e-5, detects=0.15)


def test_one_bin_tells_nothing():
    with pytest.raises(AssertionError, match="tells nothing"):
        assert_distribution([100], [1.0], false_alarm=1e-4, detects=0.5)


def test_shared_rates_add_up_to_the_whole():
    assert 1 - (1 - shared_rate(1e-3, 50)) ** 50 == pytest.approx(1e-3, rel=1e-9)
