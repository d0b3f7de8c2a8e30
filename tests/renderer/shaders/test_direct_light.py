"""Light straight from its source, as floors receive it: pictures against closed forms."""

import numpy as np
import pytest

from renderer.scene.description import RectangleLight, SphereLight
from sss_tools.shapes import box
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import camera, diffuse, picture, placed, scene

FLOOR_TOP = 0.01
REFLECTANCE = 0.5


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def floor_radiance(light):
    """Samples of the radiance of a floor of side 2 at the origin, under the light alone."""
    view = camera((0.9, 0.05, 0), (0, FLOOR_TOP, 0), fov=1e-3, resolution=(128, 128))
    floor = placed(box((2, 2 * FLOOR_TOP, 2)), diffuse(REFLECTANCE))
    return picture(scene([floor], [light], view), 2, seed=seed(1)).channel()


def rectangle(height: float, half: float) -> RectangleLight:
    at = vector(0, FLOOR_TOP + height, 0)
    return RectangleLight(at, vector(0, 0, 0), vector(0, 0, 1), (half, half), np.ones(3))


def under_rectangle(height: float, half: float) -> float:
    """Irradiance under the centre of a square, L = 1: four corners' view factors (Hamilton & Morgan 1952)."""
    a = half / height
    return 4 * a / np.sqrt(1 + a * a) * np.arctan(a / np.sqrt(1 + a * a))


def floor_mean(light, expected: float):
    """(mean, standard error, n); rounding in single precision counts as an error of 1e-5."""
    samples = floor_radiance(light)
    return samples.mean(), np.hypot(samples.std() / np.sqrt(len(samples)), 1e-5 * expected), len(samples)


@pytest.mark.parametrize("height", [1.0, 0.5, 0.2, 0.05])
def test_floor_under_a_rectangle(height):
    """Sees 1 % of the light. The floor's side is 2: a shadow ray's start matters from a height of 0.2 down."""
    half = min(0.1, height / 4)
    expected = REFLECTANCE / np.pi * under_rectangle(height, half)
    summary = floor_mean(rectangle(height, half), expected)
    assert_mean(summary, expected, false_alarm=shared_rate(1e-3, 8), detects=0.01 * expected)


@pytest.mark.parametrize(("height", "radius"), [(1.0, 0.3), (0.2, 0.1)])
def test_floor_under_a_sphere(height, radius):
    """Rays along the rim of the ball are the most sensitive to where they start. Sees 0.6 % of the light."""
    expected = REFLECTANCE * (radius / height) ** 2
    light = SphereLight(vector(0, FLOOR_TOP + height, 0), radius, np.ones(3))
    assert_mean(floor_mean(light, expected), expected, false_alarm=shared_rate(1e-3, 8), detects=0.006 * expected)


def test_planted_error_of_one_percent_is_caught():
    expected = REFLECTANCE / np.pi * under_rectangle(1.0, 0.1)
    samples = 1.01 * floor_radiance(rectangle(1.0, 0.1))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(samples, expected, false_alarm=shared_rate(1e-3, 8), detects=0.01 * expected)
