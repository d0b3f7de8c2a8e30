"""Jumps: table look-ups, what is drawn from them, and whole walks with and without the exact weight."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.optics import ball_jump
from renderer.optics.ball_exit import ball_exit
from renderer.optics.ball_jump import BINS, ball_jumps, table_radii
from renderer.optics.free_flight import channel_probabilities, choose_channel, collision_weight, surface_weight
from sss_tools.cache import FOLDER_VARIABLE
from tests.assertions import assert_distribution, assert_mean, seed, shared_rate

GREY = ([50.0] * 3, [0.99] * 3)
COLOURED = ([50.0] * 3, [0.999, 0.99, 0.9])
CHROMATIC = ([50.0, 30.0, 10.0], [0.99, 0.95, 0.9])
MEDIA = {"grey": GREY, "coloured": COLOURED, "chromatic": CHROMATIC}
RATE = shared_rate(1e-3, 9)


@pytest.fixture(scope="module", autouse=True)
def small_tables(tmp_path_factory):
    """Up to 16 mean free paths: enough here, and quick to build."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(tmp_path_factory.mktemp("cache")))
        patch.setattr(ball_jump, "_COUNT", 17)
        patch.setattr(ball_jump, "LARGEST", 16.0)
        ball_jump._tables.cache_clear()
        yield
    ball_jump._tables.cache_clear()


def test_radii_are_rounded_down_to_the_table():
    jumps = ball_jumps(*GREY)
    radius = np.exp(np.random.default_rng(1).uniform(np.log(0.005), np.log(2), 20_000)).astype(np.float32)
    # and where it matters: on the table's radii and a rounding to either side
    around = [jumps.radius, np.nextafter(jumps.radius, np.float32(0)), np.nextafter(jumps.radius, np.float32(9))]
    radius = np.concatenate([radius, *around])
    index = jumps.index_of(radius)
    jumping = index >= 0
    assert (jumps.radius[index[jumping]] <= radius[jumping]).all()
    assert (radius[~jumping] < jumps.radius[0] * (1 + 1e-6)).all()
    inner = jumping & (index < len(jumps.radius) - 1)
    assert (radius[inner] < jumps.radius[index[inner] + 1] * (1 + 1e-6)).all()
    assert jumps.index_of(np.float32([0, -1])).max() < 0
    assert_allclose(jumps.radius, table_radii() / 50, rtol=1e-7)
    assert table_radii()[1:] / table_radii()[:-1] == pytest.approx(1.2, abs=0.06)


@pytest.mark.parametrize("name", MEDIA)
def test_stratified_exits_have_the_exact_weights_and_cosines(name):
    """No noise: the midpoint rule over u, some two thousand in each bin, whose ends it misses by one in places."""
    sigma_t, albedo = MEDIA[name]
    jumps = ball_jumps(sigma_t, albedo)
    n = 1 << 20
    u = ((np.arange(n) + 0.5) / n).astype(np.float32)
    for k in (0, 5, 16):
        mu, weights = jumps.sample_exit(np.full(n, k, np.int32), u)
        assert mu.min() >= 0
        assert mu.max() <= 1
        assert weights.max() <= 3.0001 * jumps.weight[k].mean()
        for channel in range(3):
            ball = ball_exit(table_radii()[k] * sigma_t[channel] / 50, [albedo[channel]])
            assert weights[channel].mean(dtype=float) == pytest.approx(ball.weight[0], rel=1e-4)
            assert jumps.weight[k, channel] == pytest.approx(ball.weight[0], rel=2e-6)
            cosine = np.cos(ball.angle)
            moment = ball.unscattered + np.sum((cosine[1:] + cosine[:-1]) / 2 * np.diff(ball.share[0]))
            assert (weights[channel] * mu).mean(dtype=float) == pytest.approx(moment, rel=2e-4)
            # unscattered light apart
            straight = u < jumps._straight[k]
            assert (mu[straight] == 1).all()
            assert weights[channel][straight].sum(dtype=float) / n == pytest.approx(ball.unscattered, abs=3 / n)


def escape(sigma_t, albedo, radius: float, n: int, number: int, spoil: float = 1.0):
    """(3, n) weights with which walks leave a ball, from its centre, after a collision; jumps wherever they fit.

    ``spoil`` multiplies the weight of each jump.
    """
    jumps, draw = ball_jumps(sigma_t, albedo), np.random.default_rng(seed(number))
    sigma_t, albedo = np.float32(sigma_t)[:, None], np.float32(albedo)[:, None]
    position, direction = np.zeros((3, n), np.float32), np.zeros((3, n), np.float32)
    weight, left = np.ones((3, n), np.float32), []
    while position.shape[1]:
        room = np.float32(radius) - np.sqrt(np.einsum("ij,ij->j", position, position))
        index = jumps.index_of(room)
        near, far = np.flatnonzero(index < 0), np.flatnonzero(index >= 0)
        uniform = draw.random((4, position.shape[1]), dtype=np.float32)
        cosine = 2 * uniform[0, near] - 1
        turn = 2 * np.pi * uniform[1, near]
        sine = np.sqrt(1 - cosine**2)
        direction[:, near] = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine])
        place, heading = position[:, far], np.empty((3, len(far)), np.float32)
        weight[:, far] *= spoil * jumps.jump(index[far], uniform[:, far], place, heading)
        position[:, far], direction[:, far] = place, heading
        chances = channel_probabilities(weight, albedo)
        channel = choose_channel(chances, draw.random(position.shape[1], dtype=np.float32))
        flight = (draw.exponential(size=position.shape[1]) / sigma_t[channel, 0]).astype(np.float32)
        along = np.einsum("ij,ij->j", position, direction)
        square = np.einsum("ij,ij->j", position, position)
        reach = np.sqrt(np.maximum(along**2 + np.float32(radius**2) - square, 0)) - along
        out = flight >= reach
        collided = collision_weight(flight, albedo * sigma_t, sigma_t, chances)
        weight *= np.where(out, surface_weight(reach, sigma_t, chances), collided)
        left.append(weight[:, out])
        position = (position + direction * flight)[:, ~out]
        direction, weight = direction[:, ~out], weight[:, ~out]
    return np.concatenate(left, axis=1)


@pytest.mark.parametrize("name", MEDIA)
def test_walks_with_jumps_leave_a_ball_with_the_exact_weight(name):
    """Sees three per cent of the total, less of each jump's weight: one from the centre, smaller ones thereafter."""
    sigma_t, albedo = MEDIA[name]
    weights = escape(sigma_t, albedo, 6 / 50, 40_000, 3)
    for channel in range(3):
        expected = ball_exit(6 * sigma_t[channel] / 50, [albedo[channel]]).weight[0]
        assert_mean(weights[channel], expected, false_alarm=RATE, detects=0.03 * expected, what=f"channel {channel}")


def test_jumps_four_per_cent_too_bright_are_caught():
    """What the closed form errs by at an albedo of .95."""
    weights = escape([50.0] * 3, [0.95] * 3, 6 / 50, 40_000, 4, spoil=1.04)
    expected = ball_exit(6, [0.95]).weight[0]
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(weights[0], expected, false_alarm=RATE, detects=0.03 * expected)


def test_jumps_land_on_the_sphere_and_leave_it():
    jumps, draw = ball_jumps(*GREY), np.random.default_rng(5)
    n = 1000
    index = draw.integers(0, 17, n).astype(np.int32)
    start = draw.uniform(-1, 1, (3, n)).astype(np.float32)
    position, direction = start.copy(), np.empty_like(start)
    uniforms = draw.random((4, n), dtype=np.float32)
    jumps.jump(index, uniforms, position, direction)
    radial = (position - start) / jumps.radius[index]
    # positions near 1 are rounded by 6e-8, radii are 0.02
    assert_allclose(np.linalg.norm(radial, axis=0), 1, atol=2e-5)
    assert_allclose(np.linalg.norm(direction, axis=0), 1, atol=1e-6)
    cosine, _ = jumps.sample_exit(index, uniforms[2])
    assert_allclose(np.einsum("ij,ij->j", radial, direction), cosine, atol=2e-5)


def test_a_jump_pays_where_it_stands_for_more_collisions_than_it_costs():
    jumps = ball_jumps(*GREY)
    assert jumps.pays_from(2.0) == jumps.radius[np.argmax(jumps.collisions > 2)]
    assert jumps.pays_from(3.0) > jumps.pays_from(2.0)
    assert ball_jumps([1.0] * 3, [0.1] * 3).pays_from(2.0) == np.inf


def test_a_clear_channel_and_a_black_one_do_no_harm():
    jumps = ball_jumps([10.0, 5.0, 0.0], [0.0, 0.9, 0.5])
    u = ((np.arange(1 << 16) + 0.5) / (1 << 16)).astype(np.float32)
    _, weights = jumps.sample_exit(np.full(len(u), 8, np.int32), u)
    means = weights.mean(axis=1, dtype=float)
    assert_allclose(means, [np.exp(-4), ball_exit(2, [0.9]).weight[0], 1], rtol=1e-4)
    with pytest.raises(ValueError, match="extinguishes"):
        ball_jumps([0, 0, 0], [0.5] * 3)


def test_entries_do_not_depend_on_the_unit_of_length():
    coarse, fine = ball_jumps([1.0] * 3, [0.9] * 3), ball_jumps([1000.0] * 3, [0.9] * 3)
    assert_array_equal(coarse.weight, fine.weight)
    assert_allclose(coarse.radius, 1000 * fine.radius, rtol=1e-6)
    assert coarse._lower.shape == (17 * (BINS + 1),)


def exits(k: int, n: int = 200_000):
    """Jumps of the k-th radius from the origin: place on the unit sphere, cosine of leaving and its azimuth."""
    jumps, draw = ball_jumps(*GREY), np.random.default_rng(seed(6))
    position, direction = np.zeros((3, n), np.float32), np.empty((3, n), np.float32)
    jumps.jump(np.full(n, k, np.int32), draw.random((4, n), dtype=np.float32), position, direction)
    radial = position.astype(float) / jumps.radius[k]
    cosine = np.einsum("ij,ij->j", radial, direction)
    # azimuth about the radius, from the meridian
    east = np.stack([-radial[1], radial[0], np.zeros(n)]) / np.maximum(np.hypot(*radial[:2]), 1e-12)
    azimuth = np.arctan2(np.einsum("ij,ij->j", np.cross(radial, east, axis=0), direction),
                         np.einsum("ij,ij->j", east, direction))  # fmt: skip
    return radial, cosine, azimuth


def check_exit_cosines(k: int, radius: float) -> None:
    """Weight that leaves in each of 16 bins of the cosine, against the exact share; straight exits apart.

    What is drawn is broader than that, so it is weight that is counted: from a stratified grid of 2^18, without noise.
    """
    jumps, n = ball_jumps(*COLOURED), 1 << 18
    u = ((np.arange(n) + 0.5) / n).astype(np.float32)
    cosine, weights = jumps.sample_exit(np.full(n, k, np.int32), u)
    scattered, edges = u >= jumps._straight[k], np.linspace(0, 1, 17)
    for channel, albedo in enumerate(COLOURED[1]):
        ball = ball_exit(radius, [albedo])
        found, _ = np.histogram(cosine[scattered], edges, weights=weights[channel][scattered].astype(float) / n)
        # the table is cumulative in the angle
        expected = -np.diff(np.interp(np.arccos(edges), ball.angle, ball.share[0]))
        # within the flattest of 512 equally likely bins cosines are drawn evenly: 7e-4 of the light move by 0.05
        assert_allclose(found, expected, rtol=0.01, atol=1e-3 * expected.sum())


@pytest.mark.parametrize("k", [3, 10])
def test_exit_cosines_follow_the_exact_density(k):
    check_exit_cosines(k, float(table_radii()[k]))


def test_exits_of_the_next_larger_ball_are_caught():
    with pytest.raises(AssertionError, match="Not equal"):
        check_exit_cosines(3, float(table_radii()[4]))


def test_exits_are_even_over_the_sphere_and_about_the_radius():
    """In height and longitude, and in azimuth. Sees 5 %."""
    radial, cosine, azimuth = exits(10)
    turns = np.linspace(-np.pi, np.pi, 13)
    counts, *_ = np.histogram2d(
        radial[2], np.arctan2(radial[1], radial[0]), (np.linspace(-1 - 1e-5, 1 + 1e-5, 13), turns)
    )
    assert_distribution(counts, np.ones((12, 12)), false_alarm=1e-4, detects=0.05)
    # apart from those that leave along the radius
    around, _ = np.histogram(azimuth[cosine < 0.999], turns)
    assert_distribution(around, np.ones(12), false_alarm=1e-4, detects=0.05)
