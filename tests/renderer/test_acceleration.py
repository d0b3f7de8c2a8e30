"""Grids, jumps, guides and splits: they change what a picture costs, and never what it shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.optics.ball_jump import BallJumps, ball_jumps
from renderer.optics.guided_flight import Guide
from renderer.scene.description import DirectionalLight, PointLight, Scene, SphereLight
from renderer.shaders import boundary
from renderer.tracing.acceleration import Acceleration
from renderer.tracing.distance_grid import DistanceGrid
from sss_tools.shapes import box, icosphere
from tests.assertions import assert_mean, seed
from tests.renderer.scenes import (
    WHITE_SKY,
    camera,
    half_white_sky,
    picture,
    placed,
    scene,
    traced,
    translucent,
    wavefront,
)

SIGMA_T = 25.0
VIEW = camera((0, 0, 5), fov=20, resolution=(40, 40))  # shows nothing but the ball
PASSES = 120


def dense(albedo=(0.99, 0.97, 0.93), sigma_t=SIGMA_T, g=0.0, ior=1.4):
    ball = placed(icosphere(1, 3), translucent(list(albedo), sigma_t, g, ior))
    return scene([ball], [half_white_sky()], VIEW)


def means(of, number: int, acceleration=None, passes: int = PASSES):
    """(passes,) means over the picture of the first and last channel, and what was counted."""
    made = traced(wavefront(of, seed=seed(number), acceleration=acceleration), 1600, 0, passes)
    radiance = made.radiance.astype(float).mean(axis=2)
    return radiance[:, 0], radiance[:, 2], made.tally


def options(of) -> dict[str, Acceleration]:
    traced = wavefront(of).scene
    medium = traced.translucent[0].medium
    grid = DistanceGrid(traced.vertices, traced.triangles, 64)
    jumps = ball_jumps(medium.sigma_t, medium.single_scattering_albedo)
    guide = Guide.of(0.985, float(medium.sigma_t[0]))
    return {
        "grid": Acceleration(grid, (None,), (None,)),
        "jumps": Acceleration(grid, (jumps,), (None,)),
        "guide": Acceleration(None, (None,), (guide,)),
        "all": Acceleration(grid, (jumps,), (guide,)),
    }


@pytest.fixture(scope="module")
def plain():
    return means(dense(), 1)


def test_a_grid_changes_no_bit_and_saves_rays():
    of = dense()
    with_grid = picture(of, 2, seed=5, acceleration=options(of)["grid"])
    without = picture(of, 2, seed=5)
    assert_array_equal(with_grid.samples, without.samples)
    assert with_grid.tally.rays < 0.6 * without.tally.rays
    assert with_grid.tally.collisions == without.tally.collisions


@pytest.mark.parametrize("name", ["jumps", "guide", "all"])
def test_options_leave_the_mean_alone(plain, name):
    """Sees 3 % in the channel that scatters most and in the one that scatters least."""
    of = dense()
    *channels, tally = means(of, 2, options(of)[name])
    assert tally.collisions < 0.8 * plain[2].collisions
    assert tally.leaked == plain[2].leaked == 0
    for one, other in zip(channels, plain[:2], strict=True):
        assert_mean(one - other, 0, false_alarm=1e-4, detects=0.03 * other.mean())


def lit_by_lamps(roughness: float, ior: float = 1.4, at=(1.0, 1, 3)):
    """A dense ball, and beside it a point and a sphere that shine."""
    ball = placed(icosphere(1, 3), translucent([0.99, 0.97, 0.93], SIGMA_T, 0.0, ior, roughness))
    point = PointLight(np.array([-1.0, 1, 4]), np.full(3, 5.0))
    return scene([ball], [point, SphereLight(np.array(at), 0.5, np.full(3, 5.0))], VIEW)


def test_jumps_leave_the_mean_alone_where_lamps_shine_on_a_rough_boundary():
    """Sees 6 %."""
    of = lit_by_lamps(0.4)
    plain, *_ = means(of, 6, None, 100)
    jumping, _, tally = means(of, 7, options(of)["jumps"], 100)
    assert tally.leaked == 0
    assert_mean(jumping - plain, 0, false_alarm=1e-4, detects=0.06 * plain.mean())


def test_jumps_that_forget_the_weight_are_caught(plain, monkeypatch):
    of, jump = dense(), BallJumps.jump
    monkeypatch.setattr(BallJumps, "jump", lambda *given: np.ones_like(jump(*given)))
    *channels, _ = means(of, 2, options(of)["jumps"])
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(channels[1] - plain[1], 0, false_alarm=1e-4, detects=0.03 * plain[1].mean())


def test_a_guide_with_a_wrong_weight_is_caught(plain, monkeypatch):
    of, weight = dense(), Guide.weight
    monkeypatch.setattr(Guide, "weight", lambda self, cosine, *rest: weight(self, 0.9 * cosine, *rest))
    *channels, _ = means(of, 2, options(of)["guide"])
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(channels[0] - plain[0], 0, false_alarm=1e-4, detects=0.03 * plain[0].mean())


def backlit(sun: bool = True, **of_the_medium) -> Scene:
    """A ball of 20 mean free paths, lit from behind by nothing but a sun or a lamp."""
    ball = placed(icosphere(1, 3), translucent(**{"albedo": 0.95, "sigma_t": 10.0, "ior": 1.0, **of_the_medium}))
    light = DirectionalLight(np.array([0.5, -0.5, 1]), np.full(3, 3.0))
    return scene([ball], [light if sun else PointLight(np.array([-1.0, 1, -2]), np.full(3, 9.0))], VIEW)


LED = {
    "matched": backlit(albedo=[0.95, 0.93, 0.9]),
    "a lamp": backlit(sun=False, albedo=[0.95, 0.93, 0.9]),
    "smooth": backlit(albedo=[0.95, 0.93, 0.9], ior=1.4),
}


def assert_led_flights_change_nothing(of: Scene, detects: float) -> None:
    leading = chosen(of)
    assert leading.guides[0] is not None
    for led, plain in zip(means(of, 8, leading)[:2], means(of, 9)[:2], strict=True):
        assert_mean(led - plain, 0, false_alarm=1e-4, detects=detects * plain.mean())


@pytest.mark.parametrize("name", LED)
def test_flights_that_are_led_to_the_only_light_leave_the_mean_alone(name):
    """Sees 25 % in the channel that scatters most and in the one that scatters least."""
    assert_led_flights_change_nothing(LED[name], 0.25)


def test_led_flights_with_a_wrong_weight_are_caught(monkeypatch):
    weight = Guide.weight
    monkeypatch.setattr(Guide, "weight", lambda self, cosine, *rest: weight(self, 0.7 * cosine, *rest))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_led_flights_change_nothing(LED["matched"], 0.25)


def test_only_paths_from_the_dark_side_are_led_and_towards_the_light():
    """On their first flight. Seen from one side the ball is dark but for a narrow rim, from the other it is lit."""
    for of, dark in ((backlit(), True), (replace(backlit(), camera=camera((0, 0, -5), fov=20)), False)):
        tracer = wavefront(of, acceleration=chosen(of))
        walk, seen = tracer._walks[0], []
        step = walk.step

        def watched(standing, walk=walk, seen=seen, step=step):
            paths = walk.paths
            seen.append((paths.led.copy(), paths.axis.copy()))
            step(standing)

        walk.step = watched
        traced(tracer, 256)
        led, axis = seen[0]
        assert (led.mean() > 0.7) == dark and (led.mean() < 0.3) == (not dark)
        assert_allclose(axis.T, np.broadcast_to(np.array([-0.5, 0.5, -1]) / np.sqrt(1.5), axis.T.shape), atol=1e-6)


def test_a_white_body_still_vanishes_in_a_white_sky_when_paths_jump():
    """Every sample: for white media the tables' weights are 1 but for rounding, over a hundred jumps."""
    of = scene([placed(icosphere(1, 3), translucent([1.0] * 3, SIGMA_T, 0.0, 1.4))], [WHITE_SKY], VIEW)
    shown = picture(of, 4, seed=3, acceleration=options(of)["jumps"])
    assert_allclose(shown.samples, 1, rtol=1e-5)


def test_splitting_saves_noise_and_leaves_the_mean_alone(monkeypatch):
    """Against leaving the first boundary to chance, on a dark ball. Sees 4 %."""
    of = dense((0.6, 0.6, 0.6))
    split, *_ = means(of, 4)
    monkeypatch.setattr(boundary, "WHOLE", np.int8(99))
    chance, *_ = means(of, 5)
    assert_mean(split - chance, 0, false_alarm=1e-4, detects=0.04 * chance.mean())
    assert split.var() < 0.7 * chance.var()  # the ratio of two variances of 120 passes is known to 13 %


def chosen(of, pixels: int = 250_000) -> Acceleration:
    return Acceleration.chosen(wavefront(of).scene, pixels)


def test_jumps_and_their_grid_are_chosen_for_dense_bright_bodies_only():
    assert chosen(dense()).grid is not None
    assert chosen(dense()).jumps[0] is not None
    for other in (dense((0.9, 0.9, 0.9)), dense(sigma_t=3.0), dense(g=0.5), dense(sigma_t=[25.0, 26.0, 27.0])):
        assert chosen(other).grid is None
        assert chosen(other).jumps == (None,)
    assert chosen(dense(), pixels=16).grid is None, "a tiny picture does not pay for a grid"


def test_paths_jump_beside_lamps_unless_their_collisions_are_lit():
    assert chosen(lit_by_lamps(0.4)).jumps[0] is not None
    # smooth facets bend the light of the point to the collisions; nothing bends it on its way into a matched medium
    assert chosen(lit_by_lamps(0.0)).jumps == chosen(lit_by_lamps(0.4, ior=1.0)).jumps == (None,)
    # a sphere that paths may meet inside
    assert chosen(lit_by_lamps(0.4, at=(0.0, 0.9, 0.9))).grid is None


def test_guides_are_chosen_where_absorption_shapes_the_light():
    assert chosen(dense((0.8, 0.8, 0.8))).guides[0].share == 0.75
    assert chosen(dense((0.8, 0.8, 0.8), sigma_t=3.0)).guides[0].share == 0.5
    assert chosen(dense((0.999, 0.999, 0.999))).guides == (None,)
    assert chosen(dense((0.8, 0.8, 0.8), g=0.3)).guides == (None,)


def test_flights_are_led_to_a_light_outside_a_large_body_that_is_alone():
    assert chosen(backlit()).guides[0].share == 0.75
    beside_a_sky = replace(backlit(), lights=(*backlit().lights, WHITE_SKY))
    inside = replace(backlit(), lights=(PointLight(np.zeros(3), np.ones(3)),))
    for other in (beside_a_sky, inside, backlit(sigma_t=3.0), backlit(albedo=0.8), backlit(g=0.3)):
        assert chosen(other).guides == (None,)


def test_flights_are_guided_by_the_brightest_channel():
    """By a darker one's guide the weights of its long paths grow without end: seven times the noise in a ball of these
    albedos under an even sky."""
    colourful, bright = (chosen(dense(albedo)).guides[0] for albedo in ((0.989, 0.9, 0.85), (0.989,) * 3))
    assert (colourful.nu0, colourful.share) == (bright.nu0, bright.share) and bright.share == 0.5


def test_what_is_chosen_does_not_depend_on_the_number_of_passes():
    """There is no way to ask for it: parts of a render must agree bit for bit."""
    of = scene([placed(box((1, 1, 1)), translucent([0.9] * 3, 5.0, 0.0, 1.3))], [WHITE_SKY], VIEW)
    assert chosen(of) == chosen(of)


@pytest.mark.parametrize("albedo", [0.001, 0.05, 0.1, 0.2])
def test_dark_media_are_rendered_without_a_complaint(albedo):
    """The guide's pole is next to 1, below what float32 and at last float64 can tell from it."""
    of = scene([placed(icosphere(1.0, 1), translucent(albedo, 40.0))], [WHITE_SKY], camera((0, 0, 5)))
    traced = wavefront(of).scene
    shown = picture(of, 16, acceleration=Acceleration.chosen(traced, 256))
    assert np.isfinite(shown.samples).all()
