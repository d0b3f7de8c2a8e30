"""The reference shader against exact solutions: the white furnace, adding-doubling slabs, channels one by one."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.scene.description import DirectionalLight, EnvironmentLight, PointLight
from renderer.scene.lights import fibonacci_directions
from renderer.shaders import boundary, path
from sss_tools.shapes import box, hollow_ball, icosphere, moved, torus
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import (
    WHITE_SKY,
    bumpy_ball,
    camera,
    diffuse,
    half_white_sky,
    picture,
    placed,
    scene,
    translucent,
)

LEAKS_ALLOWED = 1e-5
"""Share of paths that may slip between two triangles: what Mitsuba loses (shared/reference/ANALYTIC.md, 4)."""


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


# ---- the white furnace: without absorption, in a sky of radiance 1, everything vanishes ----

SHAPES = {"ball": lambda: icosphere(1.0, 4), "bumpy ball": bumpy_ball, "ring": torus,
          "box": lambda: box((2, 0.5, 1)), "ball with a cavity": lambda: hollow_ball(1, 0.6, 4)}  # fmt: skip


def furnace(*objects, passes: int = 4, resolution: int = 100):
    view = camera((0.8, 1.1, 4), (0, 0, 0), fov=32, resolution=(resolution, resolution))
    return picture(scene(objects, [WHITE_SKY], view), passes, seed=seed(1))


def assert_vanished(shown, which: str):
    """Every sample is 1, and no path took a short cut: a leaked one returns the material's colour, which is 1 too."""
    # a path's weight is a product of albedos of exactly 1; float32 leaves room for a dozen roundings
    assert_allclose(shown.samples, 1, atol=1e-6, err_msg=which)
    assert (shown.first_object >= 0).mean() > 0.1, "the object fills too little of the picture to tell"
    assert shown.tally.collisions > 0.2 * shown.tally.samples
    # 40 000 paths: at the rate allowed 0.4 leak, and two or more in one run of six
    assert shown.tally.leaked <= max(LEAKS_ALLOWED * shown.tally.samples, 1), which
    assert shown.tally.terminated == shown.tally.non_finite == 0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ior", [1.0, 1.5])
@pytest.mark.parametrize("g", [0.0, -0.4, 0.85])
def test_white_body_in_a_white_sky_vanishes(shape, ior, g):
    """Blind to sigma_t, g and Fresnel's exact value; sees leaks, lost paths, bounce caps and wrong weights."""
    body = placed(SHAPES[shape](), translucent(1.0, 4.0, g, ior))
    assert_vanished(furnace(body), f"{shape}, ior {ior}, g {g}")


def test_leaks_of_half_a_million_paths_stay_within_budget():
    """Through a fine mesh, where edges are met most often."""
    body = placed(bumpy_ball(6), translucent(1.0, 3.0, 0.0, 1.3))
    view = camera((0.3, 0.2, 4), fov=26, resolution=(256, 256))
    shown = picture(scene([body], [WHITE_SKY], view), 8, seed=seed(2))
    assert shown.tally.samples == 8 * 256**2
    assert shown.tally.leaked < LEAKS_ALLOWED * shown.tally.samples
    assert_allclose(shown.samples, 1, atol=1e-6)


def leaks_of_a_ball_of_ten_thousand_mean_free_paths() -> int:
    """How many of 300 thousand paths leak."""
    ball = placed(icosphere(0.5, 4), translucent(0.9, 1e4))
    tally = picture(scene([ball], [WHITE_SKY], camera((0, 0.1, 3), fov=20, resolution=(64, 64))), 75).tally
    return tally.leaked


def test_collisions_beside_the_surface_stay_inside_the_densest_bodies():
    """Rounding would take some of them through it. Allowed are 1e-5, which means 3; 9 are seen one time in 300."""
    assert leaks_of_a_ball_of_ten_thousand_mean_free_paths() < 9


def test_collisions_that_rounding_takes_outside_are_caught(monkeypatch):
    """Measured: 3.5e-5 of some million paths, so 11 are expected of these, 8 seen; below 2 one time in 5000."""
    monkeypatch.setattr(path, "_CLEAR", np.float32(0))
    assert leaks_of_a_ball_of_ten_thousand_mean_free_paths() >= 2


def test_furnace_sees_a_missing_one_percent():
    body = placed(icosphere(1.0, 4), translucent(0.99, 4.0))
    with pytest.raises(AssertionError):
        assert_vanished(furnace(body), "albedo 0.99")


def nested(*materials):
    """Balls one inside the other, the innermost first: the first owns the overlap."""
    count = len(materials)
    return [placed(icosphere(0.4 + 0.6 * k / (count - 1), 4), material) for k, material in enumerate(materials)]


GLASSY, DENSE = translucent(1.0, 2.0, 0.3, 1.5), translucent(1.0, 6.0, 0.0, 1.8)
WHITE = diffuse(1)
CLOUD, HAZE = translucent(1.0, 3.0, 0.5, 1.0), translucent(1.0, 5.0, 0.0, 1.0)
GATHERINGS = {
    "cloud in glass": lambda: nested(CLOUD, GLASSY),
    "glass in cloud": lambda: nested(GLASSY, CLOUD),
    "dense glass in glass": lambda: nested(DENSE, GLASSY),
    "glass in glass of the same index": lambda: nested(translucent(1.0, 9.0, 0.0, 1.5), GLASSY),
    "three in one": lambda: nested(CLOUD, DENSE, GLASSY),
    "hidden: the outer one is listed first": lambda: nested(GLASSY, CLOUD)[::-1],
    "overlapping": lambda: [placed(icosphere(0.8, 4), GLASSY), placed(moved(icosphere(0.8, 4), (0.7, 0.1, 0)), DENSE)],
    "overlapping clouds": lambda: [placed(icosphere(0.8, 4), HAZE), placed(moved(box(1), (0.6, 0.1, 0)), CLOUD)],
    "white wall through a glass ball": lambda: [placed(icosphere(0.8, 4), GLASSY), placed(box((3, 0.2, 3)), WHITE)],
    "two and a white floor": lambda: [*nested(CLOUD, GLASSY), placed(moved(box((4, 0.2, 4)), (0, -1.2, 0)), WHITE)],
}


@pytest.mark.parametrize("name", GATHERINGS)
def test_white_bodies_inside_and_across_each_other_vanish(name):
    """Three indices, media of which some are matched, in all kinds of overlap."""
    assert_vanished(furnace(*GATHERINGS[name]()), name)


def test_white_body_with_a_chromatic_medium_vanishes_on_average():
    """One flight for three extinctions: weights fluctuate, their mean is 1. Sees 2 %."""
    body = placed(bumpy_ball(3), translucent(1.0, [1.0, 2.0, 5.0], 0.3, 1.3))
    shown = furnace(body, passes=32, resolution=64)
    for k in range(3):
        assert_mean(shown.pass_means(k), 1, false_alarm=shared_rate(1e-3, 3), detects=0.02, what=f"channel {k}")
    assert np.ptp(shown.samples) > 0.1  # the weights do fluctuate


def test_rough_boundary_loses_light_but_makes_none():
    """Single scattering loses about a tenth at each encounter from inside, of which there are several."""
    body = placed(icosphere(1.0, 4), translucent(1.0, 4.0, 0.0, 1.5, roughness=0.3))
    shown = furnace(body)
    inside = shown.first_object[0] >= 0
    mean = shown.samples[:, 0][:, inside].mean()
    assert 0.5 < mean < 0.95
    assert shown.samples.max() <= 1 + 1e-6


def test_nearly_smooth_boundary_is_the_smooth_one():
    """alpha = 0.01 against 0: means of the picture agree; sees 2 %."""
    means = []
    for roughness in (0.0, 0.01):
        body = placed(icosphere(1.0, 4), translucent(0.8, 4.0, 0.0, 1.5, roughness))
        view = camera((0, 0, 4), fov=20, resolution=(64, 64))
        means.append(picture(scene([body], [WHITE_SKY], view), 80, seed=seed(3)).pass_means())
    assert_mean(means[1] - means[0], 0, false_alarm=1e-4, detects=0.02 * means[0].mean())


# ---- slabs and half-spaces ----


def slab_radiance(width, thickness, medium, *, from_below: bool, samples: int, number: int):
    """Radiance seen straight down on (or up through) a slab in a sky that is white above the horizon.

    By reciprocity R_normal and T_normal of a slab without edges. Lengths in mean free paths.
    """
    height = -width if from_below else width
    view = camera((0, height, 0), (0, 0, 0), (0, 0, 1), fov=0.01, resolution=(256, 128))
    slab = placed(box((width, thickness, width)), medium)
    return picture(scene([slab], [half_white_sky()], view), -(-samples // 32768), seed=seed(number)).channel()


def reference(shared, **case):
    rows = json.loads((shared / "reference" / "analytic.json").read_text())["slabs_iadpython"]
    (row,) = [row for row in rows if all(row[key] == value for key, value in case.items())]
    return row


SLABS = [
    # albedo, tau, g, n, width in mean free paths; samples for R and for T that bring the standard error to 0.29 %
    (0.9, 1.0, 0.0, 1.0, 100, 260_000, 80_000),
    (0.99, 4.0, 0.5, 1.33, 300, 150_000, 150_000),
    (0.9, 1.0, 0.9, 1.5, 60, 1_250_000, 35_000),
    (0.9, 4.0, 0.0, 1.5, 100, 230_000, 680_000),
    (0.99, 16.0, 0.9, 1.5, 500, 220_000, 180_000),
]
SLAB_RATE = shared_rate(1e-3, 2 * len(SLABS) + 6)


@pytest.mark.parametrize(("albedo", "tau", "g", "n", "width", "above", "below"), SLABS)
@pytest.mark.parametrize("side", ["R_normal", "T_normal"])
def test_slab_reflects_and_transmits_as_adding_doubling_says(shared, albedo, tau, g, n, width, above, below, side):
    """Sees 1.7 % (standard error 0.3 %): a wrong g, extinction, albedo, Fresnel or angle of refraction.

    Widths are such that less than 1e-3 of the light comes through the sides. The table is good to 1e-4.
    """
    expected = reference(shared, albedo=albedo, tau=tau, g=g, n=n)[side]
    transmitted = side == "T_normal"
    radiance = slab_radiance(width, tau, translucent(albedo, 1.0, g, n), from_below=transmitted,
                             samples=below if transmitted else above, number=4)  # fmt: skip
    assert_mean(radiance, expected, false_alarm=SLAB_RATE, detects=0.017 * expected, what=side)


def test_half_space_agrees_with_chandrasekhar(shared):
    rows = json.loads((shared / "reference" / "analytic.json").read_text())["isotropic_half_space_matched"]
    (expected,) = [row["R_normal"] for row in rows if row["albedo"] == 0.9]
    radiance = slab_radiance(100, 60, translucent(0.9, 1.0, 0.0, 1.0), from_below=False, samples=380_000, number=5)
    assert_mean(radiance, expected, false_alarm=SLAB_RATE, detects=0.01 * expected)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.012 * radiance, expected, false_alarm=SLAB_RATE, detects=0.01 * expected)


@pytest.mark.parametrize(("albedo", "g", "n", "width", "depth"), [(0.9, 0.0, 1.5, 100, 40), (0.9, 0.5, 1.33, 120, 60)])
def test_half_space_behind_glass_agrees_with_adding_doubling(shared, albedo, g, n, width, depth):
    rows = json.loads((shared / "reference" / "analytic.json").read_text())["half_space_iadpython"]
    (expected,) = [row["R_normal"] for row in rows if (row["albedo"], row["g"], row["n"]) == (albedo, g, n)]
    radiance = slab_radiance(width, depth, translucent(albedo, 1.0, g, n), from_below=False, samples=380_000, number=6)
    assert_mean(radiance, expected, false_alarm=SLAB_RATE, detects=0.017 * expected)


def test_slab_of_van_de_hulst(shared):
    """g = 0.75, albedo 0.9, tau 2 (1980, table 35): the one number of this list that no code has computed."""
    medium = translucent(0.9, 1.0, 0.75, 1.0)
    for below, expected, samples in ((False, 0.09739, 800_000), (True, 0.66096, 100_000)):
        radiance = slab_radiance(80, 2.0, medium, from_below=below, samples=samples, number=7)
        assert_mean(radiance, expected, false_alarm=SLAB_RATE, detects=0.017 * expected)


# ---- planted errors: each of the tests above can fail ----


def reflectance(**how):
    """Samples of R_normal of the slab of albedo 0.9, tau 4, n 1.5."""
    medium = translucent(0.9, 1.0, how.pop("g", 0.0), 1.5)
    return slab_radiance(100, 4.0, medium, from_below=False, samples=250_000, number=8)


def test_albedo_lower_by_one_percent_is_caught(shared):
    expected = reference(shared, albedo=0.9, tau=4.0, g=0.0, n=1.5)["R_normal"]
    radiance = slab_radiance(100, 4.0, translucent(0.89, 1.0, 0.0, 1.5), from_below=False, samples=250_000, number=8)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(radiance, expected, false_alarm=SLAB_RATE, detects=0.015 * expected)


def test_wrong_mean_cosine_is_caught(shared):
    expected = reference(shared, albedo=0.9, tau=4.0, g=0.0, n=1.5)["R_normal"]
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(reflectance(g=0.05), expected, false_alarm=SLAB_RATE, detects=0.015 * expected)


def test_boundary_that_reflects_a_little_less_is_caught(shared, monkeypatch):
    """Reflectance times 0.95, most of which is total reflection from inside."""
    sound = boundary.fresnel_reflectance

    def weak(cosine, eta):
        share, refracted = sound(cosine, eta)
        return share * np.float32(0.95), refracted

    expected = reference(shared, albedo=0.9, tau=4.0, g=0.0, n=1.5)["R_normal"]
    monkeypatch.setattr(boundary, "fresnel_reflectance", weak)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(reflectance(), expected, false_alarm=SLAB_RATE, detects=0.015 * expected)


# ---- channels ----


def test_chromatic_medium_equals_three_achromatic_ones():
    """Object means of one picture with three extinctions against three with one each. Sees 3.5 % of each."""
    mesh, albedo, sigma_t = bumpy_ball(3), (0.95, 0.9, 0.85), (2.0, 5.0, 12.0)
    view = camera((0, 0.5, 4), fov=30, resolution=(64, 64))

    def means(medium, number):
        return picture(scene([placed(mesh, medium)], [WHITE_SKY], view), 48, seed=seed(number))

    together = means(translucent(albedo, sigma_t, 0.3, 1.3), 9)
    on_object = (together.first_object >= 0).all(axis=0)
    for k in range(3):
        alone = means(translucent(albedo[k], sigma_t[k], 0.3, 1.3), 10 + k).pass_means(0, on_object)
        difference = together.pass_means(k, on_object) - alone
        assert_mean(difference, 0, false_alarm=shared_rate(1e-3, 3), detects=0.035 * alone.mean(), what=f"channel {k}")


def test_chromatic_flights_without_their_weights_are_caught(monkeypatch):
    """The companion: each channel takes the hero's flight as its own."""
    monkeypatch.setattr(path, "surface_weight", lambda distance, sigma_t, chances: np.ones_like(chances))
    with pytest.raises(AssertionError, match="wrong mean"):
        test_chromatic_medium_equals_three_achromatic_ones()


def test_grey_medium_is_the_same_through_the_chromatic_code():
    """The unequal extinctions of another body switch the whole scene over; this one must not notice.

    The same random numbers make the same paths, so all that is left is rounding.
    """
    view = camera((0, 0, 4), fov=20, resolution=(48, 48))
    grey, other = placed(icosphere(1, 4), translucent(0.8, 4.0)), moved(icosphere(0.1, 2), (50, 0, 0))
    pictures = [picture(scene([grey, placed(other, translucent(0.8, sigma_t))], [WHITE_SKY], view), 4, seed=seed(13))
                for sigma_t in (2.0, [2.0, 2.1, 2.2])]  # fmt: skip
    assert_allclose(pictures[1].pass_means(1), pictures[0].pass_means(1), rtol=1e-4)


# ---- lights without extent ----


def object_mean(objects, lights, passes: int = 32, number: int = 14):
    view = camera((0.5, 0.4, 4), fov=28, resolution=(48, 48))
    return picture(scene(objects, lights, view), passes, seed=seed(number)).pass_means()


SUN = DirectionalLight(vector(-1, -1, -0.5), vector(3, 3, 3))


def test_single_scattering_in_a_thin_matched_slab_is_the_textbooks():
    """Albedo small: L = E0 p w mu0/(...) of the first order; the slab is seen from above, the sun is slanted.

        L = albedo E0 / (4 pi) (1 - exp(-tau (1 + 1/mu0))) / (1 + 1/mu0)

    Chandrasekhar 1950, section 2, for an exit along the normal. Albedo 0.01: the second order adds under 1 % of
    the first, here bounded by 2 albedo of it, and 3 % is seen.
    """
    tau, mu0 = 1.0, 0.6
    view = camera((0, 60, 0), (0, 0, 0), (0, 0, 1), fov=0.01, resolution=(128, 128))
    slab = placed(box((60, tau, 60)), translucent(0.01, 1.0, 0.0, 1.0))
    sun = DirectionalLight(vector(0.8, -mu0, 0), vector(1, 1, 1))
    shown = picture(scene([slab], [sun], view), 8, seed=seed(15)).channel()
    factor = 1 + 1 / mu0
    expected = 0.01 / (4 * np.pi) * (1 - np.exp(-tau * factor)) / factor
    assert_mean(shown, 1.005 * expected, false_alarm=1e-4, detects=0.03 * expected)


def test_phase_function_towards_the_light_looks_the_right_way():
    """As above with g = 0.8 and the sun straight behind the camera, then behind the slab: p(-1) and p(+1)."""
    tau, g = 0.5, 0.8
    view = camera((0, 60, 0), (0, 0, 0), (0, 0, 1), fov=0.01, resolution=(128, 128))
    slab = placed(box((60, tau, 60)), translucent(0.01, 1.0, g, 1.0))
    for down, shape in ((True, (1 - np.exp(-2 * tau)) / 2), (False, tau * np.exp(-tau))):
        # not quite along the view, where the camera's own ray would meet the light
        sun = DirectionalLight(vector(1e-3, -1.0 if down else 1.0, 0), vector(1, 1, 1))
        shown = picture(scene([slab], [sun], view), 8, seed=seed(16)).channel()
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * (-1 if down else 1)) ** 1.5)
        expected = 0.01 * phase * shape
        # the second order adds up to 1 %, 3 % backwards where the first is faint
        assert shown.mean() == pytest.approx(expected, rel=0.05)


def test_far_point_light_is_a_sun():
    far = 1e3 * vector(1, 1, 0.5) / 1.5
    point = PointLight(far, 3 * vector(1, 1, 1) * (far @ far))
    for ior, roughness in ((1.0, 0.0), (1.5, 0.3), (1.5, 0.0)):
        body = [placed(bumpy_ball(3), translucent(0.9, 5.0, 0.0, ior, roughness))]
        # the same random numbers: all that differs is the light's angle and distance, by a thousandth
        sun, lamp = (object_mean(body, [light], passes=8).mean() for light in (SUN, point))
        assert lamp == pytest.approx(sun, rel=4e-3)


SKY_SUNS = 64


@pytest.mark.parametrize(("ior", "detects"), [(1.0, 0.08), (1.5, 0.18)])
def test_light_met_by_chance_and_suns_connected_to_give_the_same_picture(ior, detects):
    """A sky of radiance y^2 above the horizon, and the same sky as 32 suns: collisions in a matched medium, and
    reflection and refraction at a rough boundary (alpha 0.5). Sees a missing eta^2, a wrong Jacobian, a side or a
    shadow that is forgotten; the suns' own error is 0.5 %.
    """
    y = np.cos(np.pi * (np.arange(128) + 0.5) / 128)
    sky = EnvironmentLight(image=np.repeat((np.maximum(y, 0) ** 2)[:, None, None] * np.ones(3, np.float32), 4, axis=1))
    towards = fibonacci_directions(SKY_SUNS).astype(float)[[0, 2, 1]].T
    suns = [DirectionalLight(-d, np.full(3, d[1] ** 2 * 4 * np.pi / SKY_SUNS)) for d in towards if d[1] > 0]
    body = [placed(icosphere(1.0, 3), translucent(0.9, 3.0, 0.0, ior, 0.5))]
    view = camera((0.5, 0.4, 4), fov=24, resolution=(24, 24))
    by_chance = picture(scene(body, [sky], view), 200, seed=seed(16))
    by_connection = picture(scene(body, suns, view), 16, seed=seed(17))
    # the sky behind the body is in one of the pictures alone
    hit = (by_chance.first_object >= 0).all(axis=0)
    met, connected = by_chance.pass_means(0, hit), by_connection.pass_means(0, hit)
    spread = np.hypot(met.std(ddof=1) / np.sqrt(len(met)), connected.std(ddof=1) / np.sqrt(len(connected)))
    assert_mean((connected.mean() / met.mean(), spread / met.mean(), 16), 1, false_alarm=1e-4, detects=detects)


@pytest.mark.parametrize("roughness", [0.0, 0.3])
def test_body_wrapped_in_clear_haze_is_lit_as_if_without(roughness):
    """A matched medium a millionth of a mean free path thick around a body: light comes through it, straight on."""
    body = placed(icosphere(0.5, 4), translucent(0.9, 10.0, 0.0, 1.5, roughness))
    haze = placed(icosphere(1.0, 4), translucent(0.5, 1e-6, 0.0, 1.0))
    alone, wrapped = object_mean([body], [SUN]), object_mean([body, haze], [SUN])
    assert_mean(wrapped - alone, 0, false_alarm=1e-4, detects=0.5 * alone.mean())


def test_body_hidden_in_the_first_ones_overlap_is_not_seen():
    outer = placed(icosphere(1, 4), translucent(0.9, 2.0, ior=1.0))
    inner = placed(icosphere(0.5, 4), translucent(0.5, 2.0))
    difference = object_mean([outer, inner], [SUN]) - object_mean([outer], [SUN])
    assert_mean(difference, 0, false_alarm=1e-4, detects=0.05 * object_mean([outer], [SUN]).mean())
