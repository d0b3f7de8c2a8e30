"""Light through one flat boundary: Snell's law, Fermat's path, and how beams spread."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.optics.flat_refraction import bent, crossing, inner_cosine, spreading

ETAS = [0.7, 1.0, 1.33, 2.4]


def paths(eta: float, count: int = 500):
    """Random places of light and point: (above, below, apart, crossing)."""
    rng = np.random.default_rng(1)
    above, below = rng.uniform(0.01, 3, (2, count))
    apart = rng.uniform(0.01, 4, count)
    return above, below, apart, crossing(above, below, apart, eta)


@pytest.mark.parametrize("eta", ETAS)
def test_light_crosses_where_snell_says(eta):
    above, below, apart, r = paths(eta)
    sine, inner_sine = r / np.hypot(above, r), (apart - r) / np.hypot(below, apart - r)
    assert_allclose(sine, eta * inner_sine, atol=1e-12)


@pytest.mark.parametrize("eta", ETAS)
def test_crossing_is_found_in_extreme_places(eta):
    """Grazing, straight down, and with light or point a millionth from the plane."""
    above, below, apart = np.array(np.meshgrid([1e-6, 1, 1e4], [1e-6, 1, 30], [0, 1e-9, 1, 1e3])).reshape(3, -1)
    r = crossing(above, below, apart, eta)
    sine, inner_sine = r / np.hypot(above, r), (apart - r) / np.hypot(below, apart - r)
    assert_allclose(sine, eta * inner_sine, atol=1e-6)
    assert ((r >= 0) & (r <= apart)).all()


@pytest.mark.parametrize("eta", ETAS)
def test_spreading_is_the_solid_angle_over_the_area_across(eta):
    """Finite differences of the light's direction, as the point moves across the beam by e."""
    above, below, apart, r = paths(eta)
    rest = apart - r
    outside, inside = np.hypot(above, r), np.hypot(below, rest)
    x, inner, inner_sine = above / outside, below / inside, rest / inside

    def angle(along):
        moved = crossing(above, below - along * inner_sine, apart + along * inner, eta)
        return np.arctan2(moved, above)

    e = 1e-5
    radial = (angle(e) - angle(-e)) / (2 * e)
    tangential = (r / outside) / apart
    # differences of second order: e^2 = 1e-10, times third derivatives where the point is near the plane
    assert_allclose(spreading(outside, inside, x, inner, eta), radial * tangential, rtol=1e-6)


def test_spreading_has_the_known_limits():
    outside, inside, x = np.array([2.0, 3.0]), np.array([1.0, 0.5]), np.array([0.3, 1.0])
    assert_allclose(spreading(outside, inside, x, x, 1.0), 1 / (outside + inside) ** 2)
    inner = inner_cosine(x, 1.5)
    assert_allclose(1e12 * spreading(outside + 1e6, inside, x, inner, 1.5), x / inner, rtol=1e-5)


@pytest.mark.parametrize("eta", ETAS)
def test_bent_directions_obey_snell(eta):
    rng = np.random.default_rng(2)
    normal, towards = rng.normal(size=(2, 200, 3))
    normal, towards = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (normal, towards))
    towards *= np.sign((normal * towards).sum(axis=1))[:, None]
    x = (normal * towards).sum(axis=1)
    passes = inner_cosine(x, eta) > 0
    assert passes.all() or eta < 1
    d = bent(towards, normal, eta)[passes]
    assert_allclose(-(d * normal[passes]).sum(axis=1), inner_cosine(x, eta)[passes], atol=1e-12)
    assert_allclose(np.cross(d, normal[passes]), -np.cross(towards, normal)[passes] / eta, atol=1e-12)


def test_light_beyond_the_critical_angle_does_not_pass():
    critical = np.sqrt(1 - 0.7**2)
    assert inner_cosine(np.array([0.99 * critical, 0.1]), 0.7).max() == 0
    assert inner_cosine(np.array([1.01 * critical]), 0.7)[0] > 0
