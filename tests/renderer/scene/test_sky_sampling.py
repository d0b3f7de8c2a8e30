"""Directions drawn from where the sky is bright."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.scene import sky_sampling
from renderer.scene.description import EnvironmentLight
from renderer.scene.lights import Environment, fibonacci_directions
from renderer.scene.sky_sampling import SkySampler
from tests.assertions import assert_distribution, assert_mean, seed

SAMPLES = 200_000


def uniforms(number: int, n: int = SAMPLES):
    return np.random.default_rng(seed(number)).random((2, n), np.float32)


def speckled(height=9, width=14) -> np.ndarray:
    """Dark rows, dark pixels, bright ones, and one very bright."""
    rng = np.random.default_rng(3)
    image = rng.random((height, width, 3)) * (rng.random((height, width, 1)) < 0.4)
    image[height // 3, width // 2] = 40
    image[-2:] = 0
    return image.astype(np.float32)


def environment(image, rotation=0.0) -> Environment:
    return Environment(EnvironmentLight(image=image, rotation=rotation))


@pytest.mark.parametrize("most_rows", [1024, 4])
def test_directions_have_the_stated_density(monkeypatch, most_rows):
    """Bins of azimuth and height; sees 3.5 % (rms). Large images take pixels together."""
    monkeypatch.setattr(sky_sampling, "_MOST_ROWS", most_rows)
    sky = environment(speckled(), 50.0)
    light = sky.sample(np.zeros((3, SAMPLES), np.float32), *uniforms(1))
    assert_allclose(np.linalg.norm(light.direction, axis=0), 1, atol=1e-6)
    even = fibonacci_directions(400_000)
    density = sky.density(even).astype(float)
    assert density.mean() * 4 * np.pi == pytest.approx(1, abs=2e-3)
    edges = np.linspace(-np.pi, np.pi, 13), np.linspace(-1, 1, 9)

    def bins(d, weights=None):
        return np.histogram2d(np.arctan2(d[0], d[2]), d[1], edges, weights=weights)[0]

    counts, expected = bins(light.direction), bins(even, density)
    assert_distribution(counts, expected, false_alarm=1e-3, detects=0.035)
    with pytest.raises(AssertionError, match="wrong distribution"):
        assert_distribution(np.roll(counts, 1, axis=0), expected + 1e-9, false_alarm=1e-3, detects=0.035)


def test_stated_and_looked_up_densities_are_one():
    sky = environment(speckled(), -77.0)
    light = sky.sample(np.zeros((3, 5000), np.float32), *uniforms(2, 5000))
    same = np.isclose(light.density, sky.density(light.direction), rtol=1e-5)
    assert same.mean() > 0.999  # the others lie on the edge of a cell, by rounding


def test_all_light_of_the_sky_is_found():
    """The interpolated picture reaches into dark pixels beside bright ones. Sees 1.5 %."""
    sky = environment(speckled(), 50.0)
    light = sky.sample(np.zeros((3, SAMPLES), np.float32), *uniforms(3))
    expected = sky.radiance(fibonacci_directions(400_000)).astype(float).mean(axis=1) * 4 * np.pi
    for k in range(3):
        assert_mean(light.irradiance[k].astype(float), expected[k], false_alarm=3e-4, detects=0.015 * expected[k])
    where = sky.radiance(fibonacci_directions(100_000)).sum(axis=0) > 0
    assert (sky.density(fibonacci_directions(100_000))[where] > 0).all()


def test_unevenness_is_the_mean_square_over_the_squared_mean():
    assert SkySampler(np.full((3, 6, 8), 0.3, np.float32)).unevenness == pytest.approx(1)
    half = np.zeros((3, 512, 4), np.float32)
    half[:, :256] = 1
    assert SkySampler(half).unevenness == pytest.approx(2, rel=5e-3)
    assert environment(speckled()).sampled


def test_black_skies_are_not_sampled():
    black = SkySampler(np.zeros((3, 4, 8), np.float32))
    assert black.dark
    assert not environment(np.zeros((4, 8, 3), np.float32)).sampled


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1)])
def test_skies_of_a_single_row_or_column_work(shape):
    sky = environment(np.random.default_rng(4).random((*shape, 3)).astype(np.float32))
    light = sky.sample(np.zeros((3, 1000), np.float32), *uniforms(5, 1000))
    assert np.isfinite(light.irradiance).all()
    assert (light.density > 0).all()


def test_ends_of_the_unit_interval_are_drawn_too():
    u = np.float32([0, 1 - 2.0**-24, 0.5])
    light = environment(speckled()).sample(np.zeros((3, 9), np.float32), *(a.ravel() for a in np.meshgrid(u, u)))
    assert (light.density > 0).all()
    assert np.isfinite(light.direction).all()
