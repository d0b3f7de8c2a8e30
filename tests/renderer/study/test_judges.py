"""The judges themselves: right numbers, honest false alarms, and planted errors that they must find."""

import sys

import numpy as np
import pytest

from renderer.study.judges import (
    Estimate,
    compare_tiles,
    cross_half_bias,
    flip,
    relative_mse,
    sidak,
    symmetric_error,
    uniform_p,
    with_rare_samples,
)
from sss_tools.errors import InputError
from tests.assertions import assert_distribution, assert_mean, seed

SHAPE = (48, 64, 3)
NOISE = 0.3
"""Standard deviation of a sample, relative to the mean."""


def truth():
    """A smooth picture from 0.2 to 1.8."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] / 10
    return np.stack([1 + 0.8 * np.sin(x + k) * np.cos(y) for k in range(3)], axis=-1)


def observed(random, passes=64, factor=1.0):
    """A picture of ``truth`` from ``passes`` gamma distributed samples a pixel: skewed, and never negative."""
    samples = factor * truth() * random.gamma(NOISE**-2, NOISE**2, (passes, *SHAPE))
    return Estimate(samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(passes), passes)


@pytest.fixture
def random():
    return np.random.default_rng(seed(7))


# ---- errors ----


def test_relative_mse_of_known_differences():
    reference = np.full((2, 2, 3), 2.0)
    assert relative_mse(reference + 0.2, reference) == pytest.approx(0.04 / 4.01)
    assert relative_mse(reference + 0.2, reference, floor=0) == pytest.approx(0.01)
    corner = np.array([[True, False], [False, False]])
    assert relative_mse(reference + 0.2 * corner[..., None], reference, where=~corner) == 0


def test_relative_mse_net_of_the_references_noise_is_the_images_own(random):
    """60 pairs. Without the correction the result would be twice as large."""
    own, gross = [], []
    for _ in range(60):
        image, reference = observed(random, 128), observed(random, 128)
        own.append(relative_mse(image.mean, reference.mean, reference.stderr))
        gross.append(relative_mse(image.mean, reference.mean))
    expected = float((NOISE**2 / 128 * truth() ** 2 / (truth() ** 2 + 0.01)).mean())
    # the noise in the denominator and its correlation with the square add up to some four times the relMSE, 0.3 %
    assert_mean(own, expected, false_alarm=1e-4, detects=0.03 * expected)
    assert np.mean(gross) == pytest.approx(2 * expected, rel=0.05)


def test_symmetric_error_does_not_care_who_is_the_reference():
    one, other = np.full((2, 2, 3), 2.0), np.full((2, 2, 3), 1.0)
    assert symmetric_error(one, other) == symmetric_error(other, one) == pytest.approx(1 / 1.51)


def test_flip_is_zero_for_the_same_picture_and_sees_a_wrong_half():
    pytest.importorskip("flip_evaluator")
    reference = truth()
    assert flip(reference, reference) == 0
    image = reference.copy()
    image[:, :32] *= 1.5
    right = np.zeros(SHAPE[:2], bool)
    right[:, 48:] = True
    assert flip(image, reference) > 0.02
    assert flip(image, reference, right) < flip(image, reference, ~right) / 10


def test_flip_without_its_package_is_one_clear_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(InputError, match=r"sss-tools\[peers\]"):
        flip(truth(), truth())


def test_bias_comes_out_of_noise_much_larger_than_itself(random):
    """Two percent of bias in as much noise a pixel; without bias the same measurement gives nothing."""
    reference = observed(random, 256)
    halves = [observed(random, 256, 1.02) for _ in range(2)]
    bias = cross_half_bias(halves[0].mean, halves[1].mean, reference.mean, reference.stderr)
    expected = float(((0.02 * truth()) ** 2).mean())
    assert_mean((bias.squared, bias.stderr, 9216), expected, false_alarm=1e-4, detects=0.25 * expected)
    assert bias.squared > 5 * bias.stderr and bias.size == pytest.approx(0.02 * np.sqrt((truth() ** 2).mean()), rel=0.1)
    halves = [observed(random, 256) for _ in range(2)]
    nothing = cross_half_bias(halves[0].mean, halves[1].mean, reference.mean, reference.stderr)
    assert_mean((nothing.squared, nothing.stderr, 9216), 0, false_alarm=1e-4, detects=0.25 * expected)


def test_bias_estimate_that_forgets_the_references_noise_is_caught(random):
    reference, *halves = (observed(random, 256) for _ in range(3))
    naive = cross_half_bias(halves[0].mean, halves[1].mean, reference.mean)
    assert naive.squared > 5 * naive.stderr


# ---- tests ----


def test_sidak_levels_add_up_to_the_family():
    assert 1 - (1 - sidak(0.01, 57)) ** 57 == pytest.approx(0.01)
    assert sidak(0.01, 1) == pytest.approx(0.01)


def test_tiles_of_equal_pictures_agree_and_their_p_values_are_uniform(random):
    """2880 p-values from 20 pairs of few samples a pixel; sees 13 %, root mean square over the bins."""
    tests = [compare_tiles(observed(random, 12), observed(random, 24)) for _ in range(20)]
    assert all(len(test.p) == 48 for test in tests)
    counts, _ = np.histogram(np.concatenate([test.p.ravel() for test in tests]), 10, (0, 1))
    assert_distribution(counts, np.ones(10), false_alarm=1e-4, detects=0.13, what="p-values")


def test_family_raises_false_alarms_as_often_as_it_says(random):
    """300 pairs at 20 %: 60 alarms expected. Sees half and one and a half times as many."""
    alarms = sum(
        not compare_tiles(observed(random, 10), observed(random, 10), size=16, false_alarm=0.2).agrees
        for _ in range(300)
    )
    # binomial, 5 standard deviations: false alarms 1e-6
    assert abs(alarms - 60) < 5 * np.sqrt(300 * 0.2 * 0.8)


def test_picture_one_percent_too_bright_is_caught(random):
    test = compare_tiles(observed(random, 400, 1.01), observed(random, 400))
    assert not test.agrees
    assert test.difference.mean() == pytest.approx(0.01, rel=0.1)


def test_error_too_small_for_any_tile_shows_in_the_histogram(random):
    """Half a percent, where a tile's noise is 0.4 %: only all of them together tell."""
    test = compare_tiles(observed(random, 250, 1.005), observed(random, 250), size=6)
    assert (test.p >= test.level).all() and not test.agrees
    assert (test.uniformity < test.level).any()


def test_block_moved_by_a_pixel_is_caught(random):
    """The mean over the picture stays: only the tile knows."""
    image, reference = observed(random, 400), observed(random, 400)
    image.mean[16:24, 16:24] = np.roll(image.mean, 4, axis=1)[16:24, 16:24]
    test = compare_tiles(image, reference)
    assert not test.agrees
    np.testing.assert_array_equal(test.corner[np.argmin(test.p) // 3], [16, 16])
    assert "row 16, column 16" in test.summary()


def test_only_chosen_pixels_count(random):
    image, reference = observed(random), observed(random)
    where = np.ones(SHAPE[:2], bool)
    where[:10] = False
    image.mean[:10] *= 2
    assert compare_tiles(image, reference, where).agrees
    assert not compare_tiles(image, reference).agrees
    # the second row of tiles keeps six of its eight rows, the first none
    assert compare_tiles(image, reference, where).corner.min(axis=0).tolist() == [8, 0]


def test_what_is_not_finite_raises_the_alarm(random):
    image = observed(random)
    image.mean[3, 3, 1] = np.nan
    assert not compare_tiles(image, observed(random)).agrees


def rarely_lit(random, passes):
    """One sample in 20,000 carries a third of the light."""
    rare = random.binomial(passes, 5e-5, SHAPE) / 5e-5
    mean = truth() * (random.normal(2 / 3, 0.1 / np.sqrt(passes), SHAPE) + rare / 3 / passes)
    variance = truth() ** 2 * (0.01 + (rare / passes) * (1 - rare * 5e-5 / passes) / 9 / 5e-5)
    return Estimate(mean, np.sqrt(variance / passes), passes)


def test_rare_bright_samples_raise_no_false_alarms_once_they_are_reckoned_with(random):
    """100 samples a pixel have met one in every third tile. 20 pairs at 1e-3; without the remedy all raise alarms."""
    plain = cautious = 0
    for _ in range(20):
        image, reference = rarely_lit(random, 100), rarely_lit(random, 60000)
        plain += not compare_tiles(image, reference).agrees
        cautious += not compare_tiles(with_rare_samples(image, 100, reference, 60000), reference).agrees
    assert plain == 20
    assert cautious <= 1


def test_pictures_without_noise_are_compared_exactly():
    flat = Estimate(np.ones(SHAPE), np.zeros(SHAPE), 8)
    other = Estimate(np.ones(SHAPE), np.zeros(SHAPE), 8)
    assert (compare_tiles(flat, other).z == 0).all()
    other.mean[20, 20, 0] = 1.001
    assert not compare_tiles(flat, other).agrees


def test_pictures_that_do_not_fit_are_refused(random):
    image = observed(random)
    with pytest.raises(ValueError, match="shapes"):
        compare_tiles(image, Estimate(image.mean[1:], image.stderr[1:], 64))
    with pytest.raises(ValueError, match="no tile"):
        compare_tiles(image, image, np.zeros(SHAPE[:2], bool))


def test_histogram_needs_enough_values_and_sees_a_slope(random):
    assert np.isnan(uniform_p(random.random(49)))
    assert uniform_p(random.random(500)) > 1e-4
    assert uniform_p(random.random(500) ** 1.5) < 1e-4
