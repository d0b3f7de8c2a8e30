"""Light without extent behind smooth boundaries: against slabs solved otherwise, and against lights met by chance."""

import json

import numpy as np
import pytest

from renderer.optics.dielectric import fresnel_reflectance
from renderer.scene.description import DirectionalLight, PointLight, SphereLight
from renderer.shaders import refracted_light
from renderer.tracing import traced_scene
from sss_tools.shapes import box, icosphere, moved
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import camera, diffuse, picture, placed, scene, translucent

RATE = shared_rate(1e-3, 8)


def suns_above(nodes: int) -> list[DirectionalLight]:
    """A sky of radiance 1 above the horizon as suns at Gauss's nodes of the cosine, at scattered azimuths."""
    t, w = np.polynomial.legendre.leggauss(nodes)
    mu, turn = (t + 1) / 2, 2.4 * np.arange(nodes)
    sine = np.sqrt(1 - mu * mu)
    down = -np.stack([sine * np.cos(turn), mu, sine * np.sin(turn)], axis=1)
    return [DirectionalLight(d, np.full(3, np.pi * weight)) for d, weight in zip(down, w, strict=True)]


def slab_radiance(albedo, tau, width, *, from_below: bool, passes: int = 3):
    """As seen straight down on, or up through, a slab of index 1.5 under ``suns_above``."""
    view = camera((0, -width if from_below else width, 0), (0, 0, 0), (0, 0, 1), fov=0.01, resolution=(128, 64))
    slab = placed(box((width, tau, width)), translucent(albedo, 1.0, 0.0, 1.5))
    return picture(scene([slab], suns_above(6), view), passes, seed=seed(1)).channel()


def unscattered(tau: float) -> tuple[float, float]:
    """R and T of a clear slab of index 1.5 and optical thickness tau at normal incidence, which no sun shows."""
    f = float(fresnel_reflectance(np.ones(1), 1.5)[0][0])
    through, around = (1 - f) ** 2 * np.exp(-tau), f * f * np.exp(-2 * tau)
    return f + f * np.exp(-tau) * through / (1 - around), through / (1 - around)


@pytest.mark.slow
@pytest.mark.parametrize(("albedo", "tau", "width"), [(0.9, 1.0, 80), (0.9, 4.0, 100)])
@pytest.mark.parametrize("from_below", [False, True])
def test_slab_under_suns_is_adding_doublings(shared, albedo, tau, width, from_below):
    """By reciprocity a sky of radiance 1 shows R_normal and T_normal. Sees 4.5 %: Fresnel, eta^2, x/x', attenuation.

    Six suns are good to 0.1 %; light through the sides is below 1e-3.
    """
    rows = json.loads((shared / "reference" / "analytic.json").read_text())["slabs_iadpython"]
    case = {"albedo": albedo, "tau": tau, "g": 0.0, "n": 1.5}
    (row,) = [row for row in rows if all(row[key] == value for key, value in case.items())]
    expected = row["T_normal" if from_below else "R_normal"] - unscattered(tau)[from_below]
    radiance = slab_radiance(albedo, tau, width, from_below=from_below)
    assert_mean(radiance, expected, false_alarm=RATE, detects=0.045 * expected)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.07 * radiance, expected, false_alarm=RATE, detects=0.05 * expected)


AXIS = np.array([1, 1, 0.5]) / 1.5
HALF_ANGLE = 0.35
SUNS = 16


def ball_lamp() -> SphereLight:
    return SphereLight(100 * AXIS, 100 * np.sin(HALF_ANGLE), np.ones(3))


def suns_of_the_lamp() -> list[DirectionalLight]:
    """The lamp's cone in equal parts along a spiral."""
    k = np.arange(SUNS)
    cosine = 1 - (1 - np.cos(HALF_ANGLE)) * (k + 0.5) / SUNS
    turn, sine = k * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - cosine**2)
    across = np.cross(AXIS, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across)
    beside = np.cross(AXIS, across)
    towards = cosine[:, None] * AXIS + sine[:, None] * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * beside)
    strength = np.full(3, 2 * np.pi * (1 - np.cos(HALF_ANGLE)) / SUNS)
    return [DirectionalLight(-d, strength) for d in towards]


def means(mesh, albedo, lights, passes: int, number: int, sigma_t: float):
    view = camera((0.5, 0.4, 4), fov=34, resolution=(32, 32))
    body = placed(mesh, translucent(albedo, sigma_t))
    return picture(scene([body], lights, view), passes, seed=seed(number)).pass_means()


def ratio_to_chance(mesh, sigma_t: float, passes: int) -> tuple[float, float, int]:
    """Light of suns over that of a lamp of their directions met by chance; what never scatters is taken away."""
    found, clear = (means(mesh, albedo, [ball_lamp()], passes, 2 + k, sigma_t) for k, albedo in enumerate((0.9, 0.0)))
    connected = means(mesh, 0.9, suns_of_the_lamp(), 4, 4, sigma_t)
    noise = np.sqrt((found.var(ddof=1) + clear.var(ddof=1)) / passes + connected.var(ddof=1) / 4)
    chance = found.mean() - clear.mean()
    return connected.mean() / chance, noise / chance, passes


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["ball", "box"])
def test_suns_connected_to_and_a_lamp_met_by_chance_give_the_same_light(shape):
    """Two mean free paths of radius. Sees 13 %; long runs agreed to 1 %, their standard error."""
    mesh = {"ball": icosphere(1.0, 2), "box": box(1.4)}[shape]
    assert_mean(ratio_to_chance(mesh, 2.0, 240), 1, false_alarm=RATE, detects=0.13)


@pytest.mark.slow
def test_light_mirrored_inside_is_missed_where_it_is_left_out(monkeypatch):
    """The companion: in a box much of it is reflected by the sides before it collides, 13 % of the picture."""
    monkeypatch.setattr(traced_scene, "mirror_as_needed", lambda *_: None)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(ratio_to_chance(box(1.4), 2.0, 240), 1, false_alarm=RATE, detects=0.13)


SUN = DirectionalLight(np.array([-1.0, -1, -0.5]), np.full(3, 3.0))


@pytest.mark.slow
def test_playing_for_faint_light_does_not_change_it(monkeypatch):
    """Roulette, the chance of far beams and that of mirrored ones against none of them."""
    mesh, number = icosphere(1.0, 2), 6
    played = means(mesh, 0.9, [SUN], 40, number, 6.0)
    monkeypatch.setattr(refracted_light, "_FAINT", np.float32(1e-6))
    monkeypatch.setattr(refracted_light, "_MIRRORED_CHANCE", 1.0)
    every = means(mesh, 0.9, [SUN], 40, number, 6.0)
    assert_mean(played - every, 0, false_alarm=RATE, detects=0.06 * every.mean())


def test_shadow_of_another_body_falls_into_the_body():
    mesh = box(1.0)
    view = camera((0, 0, 4), fov=20, resolution=(16, 16))
    body = placed(mesh, translucent(0.9, 3.0))
    wall = placed(moved(box((3, 0.1, 3)), (0, 1.5, 0)), diffuse(0.5), name="wall")
    above = DirectionalLight(np.array([0.0, -1, 0]), np.ones(3))
    assert picture(scene([body], [above], view), 1).samples.max() > 0.01
    assert picture(scene([body, wall], [above], view), 1).samples[:, 0].max() < 1e-6


def test_lamp_inside_a_body_is_seen():
    """Straight on: at a thousandth of the strength far from a dense ball's middle, but not black."""
    lamp = PointLight(np.array([0.0, 0.0, 0.5]), np.ones(3))
    assert means(icosphere(1.0, 3), 0.99, [lamp], 2, 7, 5.0).mean() > 0.01
