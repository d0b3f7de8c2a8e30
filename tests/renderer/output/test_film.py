"""Sums over camera samples."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.output.film import Film

from .conftest import HEIGHT, WIDTH, film_of, random_samples


def test_mean_and_standard_error_are_numpys(samples, film):
    radiance = samples[0].astype(np.float64)
    assert_allclose(film.mean(), radiance.mean(axis=0), rtol=1e-14)
    # the variance loses what mean^2 / variance costs: here below a hundred, of 1e-16 times a few roundings
    assert_allclose(film.stderr(), radiance.std(axis=0, ddof=1) / np.sqrt(len(radiance)), rtol=1e-12)


def test_hits_are_counted(samples, film):
    assert_array_equal(film.hits, samples[1].sum(axis=0))
    assert film.object_pixels()[1:3, 2:5].all()
    assert_array_equal(film.object_pixels(), samples[1].all(axis=0))


def test_mean_relative_standard_error_is_over_object_pixels_and_channels(samples, film):
    radiance, hits = samples[0].astype(np.float64), samples[1].all(axis=0)
    relative = radiance.std(axis=0, ddof=1) / np.sqrt(len(radiance)) / radiance.mean(axis=0)
    assert film.mean_relative_stderr() == pytest.approx(relative[hits].mean(), rel=1e-12)


def test_zero_means_are_left_out_of_the_relative_error(samples):
    radiance, hits = samples
    radiance[:, 1, 2, 0] = 0
    samples64 = radiance.astype(np.float64)
    relative = samples64.std(axis=0, ddof=1) / np.sqrt(len(radiance)) / samples64.mean(axis=0).clip(1e-9)
    kept = np.repeat(hits.all(axis=0)[..., None], 3, axis=2)
    kept[1, 2, 0] = False
    assert film_of(radiance, hits).mean_relative_stderr() == pytest.approx(relative[kept].mean(), rel=1e-9)


def test_relative_error_is_nan_where_nothing_can_be_said(samples):
    radiance, hits = samples
    assert np.isnan(Film.blank((3, 2)).mean_relative_stderr())
    assert np.isnan(film_of(radiance, hits, 0, 1).mean_relative_stderr())
    assert np.isnan(film_of(radiance, np.zeros_like(hits)).mean_relative_stderr())


def test_standard_error_is_nan_below_two_passes(samples):
    assert np.isnan(film_of(*samples, 0, 1).stderr()).all()
    assert np.isfinite(film_of(*samples, 0, 2).stderr()).all()
    assert_array_equal(film_of(*samples, 0, 1).mean(), samples[0][0])


def test_blank_film_has_no_mean():
    film = Film.blank((3, 2))
    assert film.mean().shape == (2, 3, 3)
    assert np.isnan(film.mean()).all()
    assert film.passes == 0


def test_biased_pixels_have_no_standard_error_from_their_first_biased_sample_on(samples):
    radiance, hits = samples
    film = film_of(radiance, hits, 0, 5)
    biased = np.zeros((HEIGHT, WIDTH), bool)
    biased[1, 2] = True
    film.add_pass(5, radiance[5], hits[5], biased)
    film.add_pass(6, radiance[6], hits[6])
    assert np.isnan(film.stderr()[1, 2]).all()
    assert np.isfinite(film.stderr()[~biased]).all()
    assert np.isfinite(film.mean()).all()
    assert np.isfinite(film.mean_relative_stderr())


def test_equal_samples_have_no_error_at_all():
    radiance = np.full((10, HEIGHT, WIDTH, 3), np.float32(0.1))
    film = film_of(radiance, np.ones((10, HEIGHT, WIDTH), bool))
    assert_allclose(film.stderr(), 0, atol=1e-9)  # the root of a few 1e-18 of rounding
    assert not np.isnan(film.stderr()).any()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_sample_that_is_not_finite_is_counted_and_left_out(samples, value):
    radiance, hits = samples
    expected = np.delete(radiance[:, 1, 2], 7, axis=0).astype(float)
    radiance[7, 1, 2, 1] = value
    film = film_of(radiance, hits)
    assert film.non_finite == 1
    assert film.left_out[1, 2] == 1
    # all its channels are, so that the pixel's colour stays that of whole samples
    assert_allclose(film.mean()[1, 2], expected.mean(axis=0), rtol=1e-14)
    assert_allclose(film.stderr()[1, 2], expected.std(axis=0, ddof=1) / np.sqrt(39), rtol=1e-12)
    assert film.hits[1, 2] == 40


def test_pixel_without_a_finite_sample_is_nan_not_zero(samples):
    radiance, hits = samples
    radiance[:, 0, 0] = np.nan
    film = film_of(radiance, hits)
    assert np.isnan(film.mean()[0, 0]).all()
    assert film.non_finite == 40


@pytest.mark.parametrize("cuts", [(0, 40), (0, 1, 40), (0, 13, 14, 29, 40)])
def test_split_passes_merge_to_the_whole(samples, film, cuts):
    parts = [film_of(*samples, start, stop) for start, stop in itertools.pairwise(cuts)]
    merged = Film.blank((WIDTH, HEIGHT), "abc", 3)
    for part in reversed(parts):
        merged.merge(part)
    assert merged.ranges == film.ranges == ((0, 40),)
    assert_allclose(merged.sum, film.sum, rtol=1e-12, atol=0)
    assert_allclose(merged.sum_of_squares, film.sum_of_squares, rtol=1e-12, atol=0)
    assert_array_equal(merged.hits, film.hits)


def test_many_passes_in_any_order_sum_to_one_part_in_1e12():
    radiance, hits = random_samples(3000, seed=2)
    forward, backward = Film.blank((WIDTH, HEIGHT)), Film.blank((WIDTH, HEIGHT))
    for index in range(3000):
        forward.add_pass(index, radiance[index], hits[index])
        backward.add_pass(2999 - index, radiance[2999 - index], hits[2999 - index])
    assert_allclose(forward.sum, backward.sum, rtol=1e-12, atol=0)
    assert_allclose(forward.sum_of_squares, backward.sum_of_squares, rtol=1e-12, atol=0)


def test_going_on_gives_the_same_bits_as_going_through(samples, film):
    resumed = Film.from_arrays(film_of(*samples, 0, 17).arrays())
    for index in range(17, 40):
        resumed.add_pass(index, samples[0][index], samples[1][index])
    assert_array_equal(resumed.sum, film.sum)
    assert_array_equal(resumed.stderr(), film.stderr())


def test_merging_counts_what_was_left_out_and_what_is_biased(samples):
    radiance, hits = samples
    radiance[3, 0, 0] = np.nan
    first, second = film_of(radiance, hits, 0, 20), film_of(radiance, hits, 20, 39)
    second.add_pass(39, radiance[39], hits[39], np.ones((HEIGHT, WIDTH), bool))
    first.merge(second)
    assert first.non_finite == 1
    assert np.isnan(first.stderr()).all()


@pytest.mark.parametrize(
    ("other", "said"),
    [
        pytest.param(Film.blank((WIDTH, HEIGHT), "other", 3), "scene hash differs: abc and other", id="scene"),
        pytest.param(Film.blank((WIDTH, HEIGHT), "abc", 4), "seed differs: 3 and 4", id="seed"),
        pytest.param(Film.blank((HEIGHT, WIDTH), "abc", 3), "resolution differs", id="size"),
    ],
)
def test_films_that_do_not_belong_together_are_not_merged(film, other, said):
    before = film.sum.copy()
    with pytest.raises(ValueError, match=said):
        film.merge(other)
    assert_array_equal(film.sum, before)


def test_films_with_a_pass_in_common_are_not_merged(samples, film):
    before = film.sum.copy()
    with pytest.raises(ValueError, match="pass 39 is there twice"):
        film.merge(film_of(*samples, 39, 40))
    assert_array_equal(film.sum, before)


def test_pass_is_not_added_twice(samples, film):
    with pytest.raises(ValueError, match="pass 5 is there twice"):
        film.add_pass(5, samples[0][5], samples[1][5])


def test_pass_of_another_shape_is_refused(samples, film):
    with pytest.raises(ValueError, match="radiance has shape"):
        film.add_pass(40, samples[0][0].transpose(1, 0, 2), samples[1][0])
    with pytest.raises(ValueError, match="hit has shape"):
        film.add_pass(40, samples[0][0], samples[1][0].T)


def test_arrays_hold_the_whole_film(film):
    again = Film.from_arrays(film.arrays())
    assert (again.scene_hash, again.seed, again.ranges) == ("abc", 3, ((0, 40),))
    for name in ("sum", "sum_of_squares", "hits", "left_out", "biased"):
        assert_array_equal(getattr(again, name), getattr(film, name))


@pytest.mark.parametrize(
    ("name", "array"),
    [
        pytest.param("film_sum", np.zeros((HEIGHT, WIDTH, 3), np.float32), id="dtype"),
        pytest.param("film_sum", np.zeros((HEIGHT, WIDTH)), id="shape"),
        pytest.param("film_hits", np.zeros(3, np.int32), id="dimensions"),
        pytest.param("film_ranges", np.array([[0, 5], [3, 40]]), id="overlapping-ranges"),
        pytest.param("film_seed", np.array("x"), id="seed"),
    ],
)
def test_arrays_of_no_film_are_refused(film, name, array):
    with pytest.raises(ValueError):
        Film.from_arrays({**film.arrays(), name: array})
