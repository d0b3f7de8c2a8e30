"""How many passes are enough, told by the first ones."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.enough import FEW_PATHS, FIRST, next_round, noise_seen, passes_needed
from renderer.job import Budget, execute
from renderer.output.film import Film
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import DirectionalLight
from renderer.shaders.selection import passes_within, picture_passes
from sss_tools import shapes
from tests.renderer.scenes import camera, placed, scene, translucent

SUN = DirectionalLight(np.array([-1.0, -0.5, -0.6]), np.full(3, 3.0))


def ball_scene(**more):
    thing = placed(shapes.icosphere(1.0, 3), translucent(0.8, 4.0), normals="smooth", **more)
    return admit(scene([thing], [SUN], camera((0, 0, 8), fov=30, resolution=(20, 20))))[0]


def noisy_film(noise, passes=64, side=40, seed=3):
    """Samples of mean 1 and this standard deviation in every pixel."""
    film = Film.blank((side, side), "", 0)
    samples = np.random.default_rng(seed).normal(1, noise, (passes, side, side, 1)) * np.ones(3)
    film.sum[:], film.sum_of_squares[:] = samples.sum(axis=0), (samples**2).sum(axis=0)
    film.hits[:], film.ranges = passes, ((0, passes),)
    return film


def test_rounds_grow_fourfold_until_there_are_enough():
    assert next_round(0, 100) == FIRST and next_round(0, 2) == 2
    assert next_round(0, 1) == 2 == next_round(2, 1)  # a single pass would not tell its noise
    assert next_round(8, 100) == 32 and next_round(8, 11) == 11
    assert next_round(8, 8) == next_round(8, 3) == 8


def test_the_noise_seen_is_that_of_the_samples():
    """64 samples in each of 1600 pixels tell the standard deviation to sqrt(1 / (2 * 64 * 1600)) = 0.22 %; the mean is
    known to 0.7 / 320. Five of each."""
    film = noisy_film(0.7)
    seen = noise_seen(film, np.ones((40, 40), bool))
    assert seen.error == pytest.approx(0.7, rel=0.02)
    assert 0.7 < seen.bound < 1.03 * seen.error


def test_less_that_is_seen_is_a_higher_bound():
    """In 12 pixels of 4 passes the noise is known to a tenth."""
    film = noisy_film(0.7, passes=4)
    some = np.zeros((40, 40), bool)
    some[3, :12] = True
    few, many = (noise_seen(film, where) for where in (some, np.ones((40, 40), bool)))
    assert few.bound / few.error > 1.1 > 1.05 > many.bound / many.error


def test_nothing_is_told_where_nothing_is_seen():
    film = noisy_film(0.7)
    assert noise_seen(film, np.zeros((40, 40), bool)) is None
    two = np.arange(1600).reshape(40, 40) < 2
    assert noise_seen(film, two) is not None
    assert noise_seen(film, two, share=0.9 * FEW_PATHS / 128) is None


def test_the_most_demanding_object_decides_and_fast_shaders_keep_their_plan():
    renderer = Renderer(ball_scene(shader="path"), Settings(quality=0.7, threads=1))
    (plan,) = renderer.plans
    assert plan.shares == {"path": 1.0}
    film, everywhere = noisy_film(0.7, side=20), np.zeros((20, 20), int)
    told = passes_needed(film, everywhere, [plan])
    assert told == passes_within(noise_seen(film, everywhere == 0).bound, plan.tolerance)
    assert passes_needed(film, everywhere, [plan, replace(plan, noise_allowed=plan.tolerance / 100)]) == told
    demanding = replace(plan, noise_allowed=plan.tolerance / 2)
    assert passes_needed(film, everywhere, [demanding]) > 3 * told
    fast = replace(plan, shares={"plumb": 1.0}, noise_allowed=None, passes=5 * told)
    assert passes_needed(film, everywhere, [fast]) == 5 * told


def test_a_render_by_quality_stops_when_its_noise_is_within_the_tolerance(tmp_path):
    """One rendered case. The prediction said other than the picture itself tells, and the picture is right; it is the
    same bit for bit as one of as many passes asked for."""
    of = ball_scene(shader="path")
    renderer = Renderer(of, Settings(quality=0.35, threads=1))
    planned = picture_passes(renderer.plans)
    picture = execute(renderer, tmp_path / "a.npz", Budget(last=planned, by_noise=True))
    plan, film = renderer.plans[0], picture.film
    seen = noise_seen(film, renderer.object_id == 0)
    assert film.passes != planned
    assert seen.bound / film.passes**0.5 <= 1.01 * plan.tolerance
    # not many more than needed: the last round ends where the one before said
    assert film.passes <= 1.5 * passes_within(seen.bound, plan.tolerance)
    again = Renderer(of, Settings(quality=0.35, threads=2))
    other = execute(again, tmp_path / "b.npz", Budget(last=film.passes)).film
    assert np.array_equal(film.sum, other.sum)


def test_objects_near_a_threshold_go_by_the_noise_of_their_samples_too(tmp_path):
    """Scalar for some and path for others, of which the pixels show as much noise as there is, whoever made it."""
    of = ball_scene()
    renderer = Renderer(of, Settings(quality=0.45, threads=1))
    (plan,) = renderer.plans
    assert 0.05 < plan.shares["path"] < 0.95
    film = execute(renderer, tmp_path / "a.npz", Budget(last=plan.passes, by_noise=True)).film
    seen = noise_seen(film, renderer.object_id == 0, plan.shares["path"])
    assert film.passes != plan.passes
    assert seen.bound / film.passes**0.5 <= 1.01 * plan.noise_allowed
    assert film.passes <= 2 * passes_within(seen.bound, plan.noise_allowed)


def test_where_no_object_is_lit_by_path_the_plan_stands(tmp_path):
    renderer = Renderer(ball_scene(shader="plumb"), Settings(quality=0.6, threads=1))
    planned = picture_passes(renderer.plans)
    assert execute(renderer, tmp_path / "a.npz", Budget(last=planned, by_noise=True)).film.passes == planned
