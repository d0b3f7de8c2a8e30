"""Henyey-Greenstein: density, sampler and the frame in which directions turn."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.optics.phase import around, henyey_greenstein, sample_henyey_greenstein, spherical
from tests.assertions import assert_distribution, assert_mean, seed, shared_rate

MEAN_COSINES = [-0.9, -0.3, 0.0, 5e-4, 2e-3, 0.5, 0.9, 0.99]
SAMPLES = 200_000
RATE = shared_rate(1e-3, len(MEAN_COSINES))


def uniforms(number: int, n: int = SAMPLES):
    """(2, n) float32 in [0, 1) with 24 bits, as the streams give."""
    bits = np.random.default_rng(seed(number)).integers(0, 2**24, (2, n))
    return (bits * 2.0**-24).astype(np.float32)


def share_below(mu, g: float):
    """The distribution function: the closed integral of the density over all cosines below ``mu``."""
    if g == 0:
        return (1 + mu) / 2
    return (1 - g * g) / (2 * g) * (1 / np.sqrt(1 + g * g - 2 * g * mu) - 1 / (1 + g))


@pytest.mark.parametrize("g", MEAN_COSINES)
def test_density_integrates_to_one_and_its_mean_cosine_is_g(g):
    # panels that halve towards both ends, where the peak of g = 0.99 is 5e-5 wide
    ends = np.concatenate([[0], 1 - 0.5 ** np.arange(1, 17), [1]])
    edges = np.concatenate([-ends[:0:-1], ends])
    node, share = np.polynomial.legendre.leggauss(16)
    half = np.diff(edges)[:, None] / 2
    mu, weight = (edges[:-1, None] + half * (1 + node)).ravel(), (half * share).ravel()
    density = 2 * np.pi * henyey_greenstein(mu, g)
    assert np.sum(weight * density) == pytest.approx(1, abs=1e-10)
    assert np.sum(weight * density * mu) == pytest.approx(g, abs=1e-10)


@pytest.mark.parametrize("g", MEAN_COSINES)
def test_stratified_cosines_have_mean_g(g):
    """No noise: the midpoint rule over u, whose error is below 1e-6 here; the rest is single precision."""
    u = ((np.arange(200_000) + 0.5) / 200_000).astype(np.float32)
    cosines = sample_henyey_greenstein(g, u)
    # above its switch at |g| = 1e-3 the quotient rounds a number near 1, then divides by 2 g
    rounding = 6e-8 / (2 * abs(g)) if abs(g) > 1e-3 else 0
    assert cosines.astype(float).mean() == pytest.approx(g, abs=1e-6 + rounding)
    assert np.abs(cosines).max() <= 1


@pytest.mark.parametrize("g", MEAN_COSINES)
def test_sampled_cosines_follow_the_density(g):
    """Sees relative errors of the density of 2 % (rms); blind to the azimuth and to bins of a 64th."""
    edges = np.linspace(-1, 1, 65)
    counts, _ = np.histogram(sample_henyey_greenstein(g, uniforms(1)[0]), edges)
    assert_distribution(counts, np.diff(share_below(edges, g)), false_alarm=RATE, detects=0.025)


def test_mean_cosine_one_percent_off_is_caught():
    """The companion: cosines of g = 0.909 against the density of 0.9."""
    edges = np.linspace(-1, 1, 65)
    cosines = sample_henyey_greenstein(0.909, uniforms(1)[0])
    counts, _ = np.histogram(cosines, edges)
    with pytest.raises(AssertionError, match="wrong distribution"):
        assert_distribution(counts, np.diff(share_below(edges, 0.9)), false_alarm=RATE, detects=0.025)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(cosines, 0.9, false_alarm=RATE, detects=0.009)


def test_scattered_directions_fill_the_sphere_as_the_density_says():
    """Cosine and azimuth together, about a slanted axis: a wrong frame or reused uniform shows here."""
    g, axis = 0.6, np.float32([[2], [-1], [-2]]) / 3
    n = SAMPLES
    u = uniforms(2)
    local = spherical(sample_henyey_greenstein(g, u[0]), u[1], np.empty((3, n), np.float32))
    turned = around(np.repeat(axis, n, axis=1), local).astype(float)
    mu = axis[:, 0] @ turned
    across = np.cross(axis[:, 0], [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    azimuth = np.arctan2(np.cross(axis[:, 0], across) @ turned, across @ turned)
    edges = np.linspace(-1, 1, 17), np.linspace(-np.pi, np.pi, 9)
    counts, *_ = np.histogram2d(mu, azimuth, edges)
    expected = np.diff(share_below(edges[0], g))[:, None] * np.ones(8)
    assert_distribution(counts, expected, false_alarm=1e-4, detects=0.03)


def test_frame_around_any_axis_is_orthonormal_and_right_handed():
    special = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1e-7, 0, -1], [0, 1e-20, 1], [0, 0.6, -0.8]])
    drawn = np.random.default_rng(3).normal(size=(1000, 3))
    axes = np.concatenate([special, drawn / np.linalg.norm(drawn, axis=1)[:, None]]).astype(np.float32).T
    first, second, third = (around(axes, np.repeat(np.float32(unit)[:, None], axes.shape[1], 1)) for unit in np.eye(3))
    frame = np.stack([first, second, third]).transpose(2, 0, 1).astype(float)
    # a handful of float32 roundings
    assert_allclose(frame @ frame.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frame.shape), atol=5e-7)
    assert_allclose(np.linalg.det(frame), 1, atol=1e-6)
    assert_allclose(third, axes, atol=1e-7)


@pytest.mark.parametrize("g", [0.5, 0.9, 0.99])
def test_directions_stay_unit_over_a_thousand_collisions(g):
    direction = np.zeros((3, 500), np.float32)
    direction[2] = 1
    draw = np.random.default_rng(4)
    for _ in range(1000):
        u = draw.random((2, 500), dtype=np.float32)
        direction = around(direction, spherical(sample_henyey_greenstein(g, u[0]), u[1], np.empty_like(direction)))
    # forward scattering keeps the axis, so roundings of 1e-7 add up over some 1/(1 - g) collisions
    assert_allclose(np.linalg.norm(direction.astype(float), axis=0), 1, atol=1e-5)
