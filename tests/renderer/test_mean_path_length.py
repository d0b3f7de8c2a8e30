"""The mean length of ways through a body does not depend on how they scatter: 4V/S (Blanco & Fournier 2003,
Europhys. Lett. 61:168), times ior^2 behind a refracting boundary, where light lingers.

It is read from the picture: with an albedo of 1 - e in place of 1 a body under a white sky is darker by e times the
mean number of collisions, sigma_t times the length, up to e^2. So it is weights that are tested, and with them whatever
shortens walks. A first reflection outside is a way of no length.

Sees lost paths, leaks, bounce caps, flights of a wrong length, ior^2, weights of jumps and guides. Blind to g and
sigma_s, the chi-square tests of phase and free flight see those.
"""

from __future__ import annotations

import numpy as np
import pytest

from renderer.optics import ball_jump
from renderer.shaders import path
from renderer.tracing.acceleration import Acceleration
from renderer.tracing.distance_grid import DistanceGrid
from sss_tools.cache import FOLDER_VARIABLE
from sss_tools.mesh import Mesh
from sss_tools.shapes import icosphere
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import WHITE_SKY, bumpy_ball, camera, picture, placed, scene, translucent, wavefront

ABSORBED = 1e-4
"""At most 100 collisions: what is of second order, and float32, are below 1 % of what is absorbed."""
FAR, DIRECTIONS, SIGMA_T = 300.0, 24, 8.0
BALLS = [
    (1.0, 0.0, False),
    (1.0, 0.8, False),
    (1.5, 0.0, False),
    (1.5, -0.5, False),
    (1.0, 0.0, True),
    (1.5, 0.0, True),
]
ORGANIC = [(1.0, 0.8, False), (1.5, 0.0, False), (1.5, 0.0, True)]
"""ior, g, and whether walks jump."""
RATE = shared_rate(1e-3, len(BALLS) + len(ORGANIC))


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


def jumping(of) -> Acceleration:
    traced = wavefront(of).scene
    medium = traced.translucent[0].medium
    jumps = ball_jump.ball_jumps(medium.sigma_t, medium.single_scattering_albedo)
    return Acceleration(DistanceGrid(traced.vertices, traced.triangles, 48), (jumps,), (None,))


def lengths(mesh: Mesh, towards, ior: float, g: float, jumps: bool, passes: int, number: int):
    """(n,) lengths inside of ways across a plane that is seen from ``towards``, times the area of the plane."""
    half = float(np.linalg.norm(mesh.vertices, axis=1).max()) * 1.01
    angle = float(np.degrees(2 * np.arctan(half / FAR)))
    view = camera(FAR * np.asarray(towards), (0, 0, 0), np.roll(towards, 1), angle, (24, 24))
    material = translucent([1.0, 1 - ABSORBED, 1 - ABSORBED], SIGMA_T, g, ior)
    of = scene([placed(mesh, material)], [WHITE_SKY], view)
    shown = picture(of, passes, seed=seed(number), acceleration=jumping(of) if jumps else None, block=2**14)
    assert shown.tally.leaked <= 1
    # one channel absorbs nothing; that jumps are drawn for all channels alike makes its weight flicker
    np.testing.assert_allclose(shown.channel(0), 1, atol=0.05 if jumps else 1e-6)
    return (shown.channel(0) - shown.channel(1)) / (ABSORBED * SIGMA_T) * (2 * half) ** 2


def check_ball(ior: float, g: float, jumps: bool) -> None:
    """All directions are alike: 4V/S ior^2 of each way that meets the ball, which are S/4 of the plane."""
    ball = icosphere(1.0, 3)
    expected = ball.volume * ior**2
    found = lengths(ball, np.array([0.0, 0, 1]), ior, g, jumps, 24, 1)
    assert_mean(found, expected, false_alarm=RATE, detects=0.12 * expected)


@pytest.mark.parametrize(("ior", "g", "jumps"), BALLS)
def test_mean_path_length_in_a_ball_is_4V_over_S(ior, g, jumps):
    """Sees 12 %."""
    check_ball(ior, g, jumps)


@pytest.mark.parametrize(("ior", "g", "jumps"), ORGANIC)
def test_mean_path_length_in_an_organic_solid_is_4V_over_S(ior, g, jumps):
    """From random directions. Not convex: ways may enter more than once, all they do inside counts. Sees 12 %."""
    towards = np.random.default_rng(seed(2)).standard_normal((DIRECTIONS, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    mesh = bumpy_ball(3)
    found = [lengths(mesh, way, ior, g, jumps, 2, 10 + k).mean() for k, way in enumerate(towards)]
    expected = mesh.volume * ior**2
    assert_mean(found, expected, false_alarm=RATE, detects=0.12 * expected)


def test_flights_a_seventh_too_long_are_caught(monkeypatch):
    exponential = path.exponential
    monkeypatch.setattr(path, "exponential", lambda u, out: np.multiply(exponential(u, out), np.float32(1.16), out=out))
    with pytest.raises(AssertionError, match="wrong mean"):
        check_ball(1.0, 0.0, False)


def test_jumps_without_the_collisions_that_they_stand_for_are_caught(monkeypatch):
    monkeypatch.setattr(ball_jump.BallJumps, "jump", _weightless(ball_jump.BallJumps.jump))
    with pytest.raises(AssertionError, match="wrong mean"):
        check_ball(1.0, 0.0, True)


def _weightless(jump):
    return lambda *given: np.ones_like(jump(*given))
