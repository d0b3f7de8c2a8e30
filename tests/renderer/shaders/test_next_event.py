"""Lights that are sampled where paths scatter and met by chance too: both together show what chance alone shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from renderer.optics.guided_flight import Guide
from renderer.render import Renderer, Settings
from renderer.scene.description import EnvironmentLight, Light, RectangleLight, Scene, SphereLight
from renderer.shaders import boundary, direct_light, point_light
from renderer.tracing.acceleration import Acceleration
from renderer.tracing.depth_roulette import drawn_depth
from renderer.wavefront import Wavefront
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, icosphere, moved
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import camera, diffuse, placed, scene, traced, translucent, wavefront

FALSE_ALARM = 1e-3
VIEW = camera((0, 0, 5), fov=20, resolution=(40, 40))
BALL = icosphere(1, 2)


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def rectangle(center, half: float, target=(0, 0, 0)) -> RectangleLight:
    return RectangleLight(vector(*center), vector(*target), vector(0.3, 0.2, 1), (half, half), vector(2, 2, 2))


def shining_ball(center, radius: float) -> SphereLight:
    return SphereLight(vector(*center), radius, vector(2, 2, 2))


def uneven_sky() -> EnvironmentLight:
    image = np.full((16, 32, 3), 0.2, np.float32)
    image[2:6, 18:24] = 3.0
    return EnvironmentLight(image=image, rotation=20)


def ball_in(light: Light, *more, mesh: Mesh = BALL, normals="flat", **material) -> Scene:
    return scene([placed(mesh, translucent(**material), normals=normals)], [light, *more], VIEW)


def slab() -> Scene:
    thing = placed(box((2, 0.6, 2)), translucent([0.9, 0.8, 0.7], [2.0, 4.0, 6.0], 0.5, 1.0))
    return scene([thing], [rectangle((0, 1.2, -0.5), 1.8)], camera((0, 3, 4), fov=22, resolution=(40, 40)))


def ball_in_haze(light: Light) -> Scene:
    """Straight ways through several boundaries, and lights between them."""
    ball = placed(icosphere(0.6, 2), translucent(0.9, 5.0, 0.5, 1.4, 0.4), name="ball")
    haze = placed(box((2, 2, 2)), translucent(0.8, 0.3, 0.3, 1.0), name="haze")
    return scene([ball, haze], [light], VIEW)


def floor(light: Light) -> Scene:
    ground = placed(box((4, 0.2, 4)), diffuse([0.8, 0.6, 0.4]))
    return scene([ground], [light], camera((0, 0.25, 2.5), (0, 0.1, 0), fov=20, resolution=(40, 40)))


@dataclass(frozen=True)
class Case:
    """A scene, how many passes, the error that must be seen, the least factor by which the variance falls.

    fewer  of the passes that chance needs, the share that sampled lights get, which have less noise
    """

    scene: Callable[[], Scene]
    passes: int
    detects: float
    gain: float
    guided: bool = False
    fewer: float = 1.0


ROOF, MOON = rectangle((0, 2.2, 0), 2.5), shining_ball((0, 3.6, 0), 2.4)
CASES = {
    "matched slab, rectangle": Case(slab, 250, 0.04, 4, fewer=1 / 3),
    "matched ball, shining ball": Case(lambda: ball_in(MOON, ior=1.0, sigma_t=4.0), 170, 0.04, 4, fewer=1 / 3),
    "matched ball, guided, rectangle": Case(
        lambda: ball_in(ROOF, ior=1.0, sigma_t=4.0), 160, 0.035, 3, guided=True, fewer=1 / 2
    ),
    "matched ball, sky": Case(lambda: ball_in(uneven_sky(), ior=1.0, sigma_t=4.0, g=-0.4), 145, 0.02, 4, fewer=1 / 3),
    "haze around a lamp": Case(lambda: ball_in(shining_ball((0.3, 0.2, 0), 0.3), ior=1.0, g=0.3), 150, 0.04, 1.6),
    "rough ball, rectangle": Case(lambda: ball_in(ROOF, g=0.7, sigma_t=4.0, roughness=0.3), 150, 0.045, 0.9),
    "rough ball, shining ball": Case(
        lambda: ball_in(MOON, sigma_t=4.0, ior=1.3, roughness=0.5, normals="smooth"), 140, 0.06, 0.9
    ),
    "rough ball, sky": Case(lambda: ball_in(uneven_sky(), sigma_t=4.0, roughness=0.4), 115, 0.03, 1.1),
    "rough ball in matched haze": Case(lambda: ball_in_haze(rectangle((0, 2, 0), 2.5)), 125, 0.045, 1.8),
    "floor, near rectangle": Case(lambda: floor(rectangle((0, 0.55, 0), 0.9)), 300, 0.01, 3),
    "floor, sky": Case(lambda: floor(uneven_sky()), 400, 0.015, 3),
}


def samples(case: Case, number: int) -> np.ndarray:
    """(passes, pixels) of the first channel."""
    of = case.scene()
    chosen = None
    if case.guided:
        chosen = Acceleration(None, (None,), (Guide.of(0.9, float(wavefront(of).scene.media.sigma_t[0, 0])),))
    made = traced(wavefront(of, seed=seed(number), acceleration=chosen), 1600, 0, case.passes)
    return made.radiance[:, 0].astype(float)


def both_ways(case: Case, number: int) -> np.ndarray:
    """Samples with lights sampled, of the fewer passes that the case has for them."""
    return samples(replace(case, passes=round(case.fewer * case.passes)), number)


def samples_by_chance(case: Case, number: int) -> np.ndarray:
    """Samples of a renderer that only meets lights."""
    with pytest.MonkeyPatch.context() as patch:
        by_chance_alone(patch)
        return samples(case, number)


def by_chance_alone(patch: pytest.MonkeyPatch) -> None:
    """Nothing is left to sampled lights."""
    patch.setattr("renderer.wavefront.power_heuristic", lambda mine, other: np.float32(1))
    patch.setattr("renderer.scene.lights.light_set.power_heuristic", lambda mine, other: np.float32(1))
    patch.setattr(direct_light, "power_heuristic", lambda mine, other: np.zeros_like(mine))


@pytest.fixture(scope="module")
def by_chance():
    """Samples by chance alone, by case."""
    found: dict[str, np.ndarray] = {}

    def of(name: str) -> np.ndarray:
        if name not in found:
            found[name] = samples_by_chance(CASES[name], 1)
        return found[name]

    return of


def assert_same_mean(one, other, detects: float, false_alarm: float) -> None:
    """Of two pictures (passes, pixels) with independent noise; ``detects`` is a share of the mean.

    Numbers of passes may differ: degrees of freedom by Welch 1947, Biometrika 34, eq. 28.
    """
    means = [picture.mean(axis=1) for picture in (one, other)]
    squares = np.array([mean.var(ddof=1) / len(mean) for mean in means])
    freedom = squares.sum() ** 2 / (squares**2 / [len(mean) - 1 for mean in means]).sum()
    difference = (means[0].mean() - means[1].mean(), squares.sum() ** 0.5, freedom + 1)
    assert_mean(difference, 0, false_alarm=false_alarm, detects=detects * one.mean())


@pytest.mark.parametrize("name", CASES)
def test_sampled_lights_change_the_noise_and_not_the_mean(by_chance, name):
    """Large lights, which chance finds too; the means to 1-6 %, and the least gain."""
    case = CASES[name]
    both = both_ways(case, 2)
    assert_same_mean(both, by_chance(name), case.detects, shared_rate(FALSE_ALARM, len(CASES)))
    assert both.var(axis=0).mean() < by_chance(name).var(axis=0).mean() / case.gain


@pytest.mark.parametrize("name", ["matched ball, shining ball", "floor, near rectangle"])
def test_light_that_is_counted_both_ways_in_full_is_caught(by_chance, name, monkeypatch):
    monkeypatch.setattr("renderer.wavefront.power_heuristic", lambda mine, other: np.float32(1))
    monkeypatch.setattr("renderer.scene.lights.light_set.power_heuristic", lambda mine, other: np.float32(1))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_same_mean(both_ways(CASES[name], 2), by_chance(name), CASES[name].detects, FALSE_ALARM)


SMALL = {
    "matched, lamp": (lambda: ball_in(shining_ball((1.5, 2, 1.5), 0.3), ior=1.0, sigma_t=4.0), 30),
    "rough, lamp": (lambda: ball_in(shining_ball((1.5, 2, 1.5), 0.3), sigma_t=8.0, g=0.7, roughness=0.3), 3),
}


@pytest.mark.parametrize("name", SMALL)
def test_small_lamps_lose_most_of_their_noise(name):
    """Measured: variance falls 100-fold at collisions, 4- to 5-fold behind rough boundaries."""
    of, gain = SMALL[name]
    case = Case(of, 60, 1, gain)
    both, alone = (found.var(axis=0).mean() for found in (samples(case, 3), samples_by_chance(case, 4)))
    assert alone > gain * both


# ---- a white sky, sampled as if it were uneven: chance has next to no noise here, so that little is seen ----

WHITE_IMAGE = EnvironmentLight(image=np.ones((8, 16, 3), np.float32))
BODIES = {
    "matched": (translucent(1.0, 4.0, 0.5, 1.0), 60, 0.01),
    "matched, chromatic": (translucent(1.0, [4.0, 6.0, 9.0], 0.0, 1.0), 60, 0.02),
    "rough": (translucent(1.0, 3.0, 0.0, 1.5, 0.4), 60, 0.012),
    "floor": (diffuse(1.0), 30, 0.01),
}


def under_white_sky(name: str, number: int, *, sampled: bool) -> np.ndarray:
    material, passes, _ = BODIES[name]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("renderer.scene.lights.environment.UNEVEN_SKY", 0.0 if sampled else np.inf)
        return samples(Case(lambda: scene([placed(BALL, material)], [WHITE_IMAGE], VIEW), passes, 0, 0), number)


@cache
def met_alone(name: str) -> np.ndarray:
    """Where the sky is only met: the companion of the body's test needs it again."""
    return under_white_sky(name, 6, sampled=False)


@pytest.mark.parametrize("name", BODIES)
def test_white_bodies_stay_what_they_are_where_the_white_sky_is_sampled(name):
    """Matched ones and white surfaces vanish; what a rough boundary loses is the same as without. Sees 1 % (chromatic
    2 %)."""
    shown = under_white_sky(name, 5, sampled=True).mean(axis=1)
    expected = met_alone(name).mean(axis=1)
    rate = shared_rate(FALSE_ALARM, len(BODIES))
    assert_mean(shown - expected, 0, false_alarm=rate, detects=BODIES[name][2])
    if "rough" not in name:
        assert_mean(shown, 1, false_alarm=rate, detects=BODIES[name][2])


def test_rough_boundary_whose_paths_mistake_their_own_density_is_caught(monkeypatch):
    """Twice the density leaves paths that meet the sky more of it than they should have."""

    def doubled(*of):
        density, share = sound(*of)
        return 2 * density, share

    sound = boundary.turned_density
    expected = met_alone("rough").mean(axis=1)
    monkeypatch.setattr(boundary, "turned_density", doubled)
    shown = under_white_sky("rough", 5, sampled=True).mean(axis=1)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(shown - expected, 0, false_alarm=FALSE_ALARM, detects=0.012)


def test_light_given_up_in_the_depth_and_not_made_up_for_is_caught(monkeypatch):
    monkeypatch.setattr(point_light, "drawn_depth", lambda uniform: drawn_depth(uniform) - np.float32(0.5))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(under_white_sky("matched", 5, sampled=True).mean(axis=1), 1, false_alarm=FALSE_ALARM, detects=0.01)


def test_even_skies_cost_no_samples():
    """Constant ones, and images without bright spots."""
    for sky in (EnvironmentLight(radiance=np.ones(3)), WHITE_IMAGE):
        tracer = wavefront(ball_in(sky, ior=1.0))
        assert not tracer.scene.lights.sampled
        taken = traced(tracer, 1600)
        # no ray but the walk's own
        assert taken.tally.rays <= 3 * 1600 + taken.tally.collisions
    assert wavefront(ball_in(uneven_sky(), ior=1.0)).scene.lights.sampled


def test_highlights_of_fast_shaders_keep_their_mean():
    """Of a rough ball lit by plumb, the reflection of a rectangle; sees 2 % of the whole light.

    Passes are paired: what plumb makes of the rectangle in a pass is the same in both.
    """

    def film(number: int) -> np.ndarray:
        of = ball_in(ROOF, sigma_t=10.0, roughness=0.4)
        renderer = Renderer(of, Settings(shader="plumb", threads=1))
        tracer = Wavefront(renderer.traced, renderer.camera, renderer._fast_bodies, seed(number))
        return traced(tracer, 1600, 0, 40).radiance[:, 0].astype(float)

    both = film(7)
    with pytest.MonkeyPatch.context() as patch:
        by_chance_alone(patch)
        alone = film(8)
    difference = both.mean(axis=1) - alone.mean(axis=1)
    assert_mean(difference, 0, false_alarm=FALSE_ALARM, detects=0.02 * both.mean())


def test_surfaces_inside_dense_media_find_a_lamp_that_is_there_too():
    """Paths that leave the surface collide before they meet the lamp: then it counts whole. Sees 3 %."""
    inner = placed(moved(box(0.8), (0, -0.4, 0)), diffuse(0.9), name="inner")
    outer = placed(box(2.0), translucent(0.95, 1.0, 0.0, 1.5), name="outer")
    of = scene([inner, outer], [shining_ball((0, 0.55, 0), 0.35)], VIEW)
    case = Case(lambda: of, 250, 0.03, 1)
    assert_same_mean(samples(case, 9), samples_by_chance(case, 10), case.detects, FALSE_ALARM)
