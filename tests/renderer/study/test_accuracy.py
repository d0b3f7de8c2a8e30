"""Pictures judged by two halves of an exact one, on pictures whose errors are known."""

import numpy as np
import pytest

from renderer.study.accuracy import Truth
from renderer.study.judges import FLOOR
from tests.assertions import assert_mean, seed

SHAPE = (40, 50, 3)
WHERE = np.ones(SHAPE[:2], bool)


def noise(number: int, size: float = 0.3) -> np.ndarray:
    return size * np.random.default_rng(seed(number)).normal(size=SHAPE)


def truth(level: float = 1.0, size: float = 0.3) -> Truth:
    return Truth((level + noise(1, size), level + noise(2, size)), WHERE)


def test_relative_mse_is_the_pictures_own_whatever_the_noise_of_the_halves():
    """A picture with noise 0.1 has relMSE 0.01 / 1.01; halves three times as noisy do not add to it. Sees 3e-3."""
    found = np.array([truth().relative_mse(1 + noise(number, 0.1)) for number in range(10, 34)])
    assert_mean(found, 0.01 / (1 + FLOOR), false_alarm=1e-4, detects=3e-3)


def test_bias_of_noisy_pictures_is_found_without_their_noise():
    """5 % too bright under 30 % noise: the estimate is within four of its stated errors, which are small enough."""
    bias = truth().bias([1.05 + noise(3), 1.05 + noise(4)])
    assert abs(bias.squared - 0.05**2 / (1 + FLOOR)) < 4 * bias.stderr < 0.05**2 * 4
    assert abs(truth().bias([1 + noise(3), 1 + noise(4)]).squared) < 4 * bias.stderr


def test_errors_do_not_depend_on_the_brightness_of_the_scene():
    bright, dark = truth(), Truth(tuple(0.01 * half for half in truth().halves), WHERE)
    picture = 1.1 + noise(5, 0.1)
    assert dark.relative_mse(0.01 * picture) == pytest.approx(bright.relative_mse(picture), rel=1e-9)
    assert dark.bias([0.01 * picture, 0.011 * picture]).squared == pytest.approx(
        bright.bias([picture, 1.1 * picture]).squared, rel=1e-9
    )


def test_difference_of_means_is_signed():
    low, error = truth().difference(0.9 + noise(6, 0.1))
    assert abs(low + 0.1) < 4 * error < 0.04


def test_only_chosen_pixels_are_judged():
    where = WHERE.copy()
    where[:, 25:] = False
    picture = np.where(where[..., None], 1.0, 77.0)
    assert Truth((np.ones(SHAPE), np.ones(SHAPE)), where).relative_mse(picture) == 0
