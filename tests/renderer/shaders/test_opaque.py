"""Floors, walls and mirrors against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.scene.camera import CameraRays
from renderer.scene.description import DirectionalLight, EnvironmentLight, PointLight, RectangleLight
from renderer.scene.lights import Environment
from renderer.shaders.opaque import cosine_direction
from sss_tools.rays import UnitFrame
from sss_tools.shapes import box, icosphere, inverted, moved
from tests.assertions import assert_distribution, assert_mean, seed, shared_rate
from tests.renderer.scenes import (
    WHITE_SKY,
    camera,
    diffuse,
    half_white_sky,
    mirror,
    picture,
    placed,
    scene,
    translucent,
)

FLOOR = box((2, 0.02, 2))
OVER_THE_FLOOR = camera((0.3, 0.8, 0.1), (0, 0.01, 0), fov=0.01, resolution=(64, 64))


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def test_cosine_directions_follow_the_cosine():
    """In cos^2 they are even; azimuths too."""
    n = 200_000
    u = np.random.default_rng(seed(1)).random((2, n), dtype=np.float32)
    turned = cosine_direction(np.repeat(np.float32([[0], [0], [1]]), n, axis=1), u[0], u[1]).astype(float)
    counts, *_ = np.histogram2d(turned[2] ** 2, np.arctan2(turned[1], turned[0]),
                                (np.linspace(0, 1 + 1e-6, 17), np.linspace(-np.pi, np.pi, 17)))  # fmt: skip
    assert_distribution(counts, np.ones((16, 16)), false_alarm=1e-4, detects=0.03)


def test_lone_floor_under_a_white_sky_has_its_reflectance():
    """Every sample: the floor is convex, each path escapes after one reflection."""
    shown = picture(scene([placed(FLOOR, diffuse([0.2, 0.5, 1.0]))], [WHITE_SKY], OVER_THE_FLOOR), 2)
    assert_allclose(shown.samples, np.broadcast_to([[[0.2], [0.5], [1.0]]], shown.samples.shape), rtol=1e-6)
    assert (shown.first_object == 0).all()


def test_point_light_on_a_floor_gives_lamberts_law():
    light = PointLight(vector(1.0, 0.76, 0), vector(1, 2, 3))
    shown = picture(scene([placed(FLOOR, diffuse(0.5))], [light], OVER_THE_FLOOR), 1)
    r2 = 1 + 0.75**2
    expected = 0.5 / np.pi * np.array([1, 2, 3]) / r2 * 0.75 / np.sqrt(r2)
    # the picture is 2e-4 of a unit wide
    assert_allclose(shown.samples[0], np.repeat(expected[:, None], 64 * 64, axis=1), rtol=5e-4)


def test_sun_on_a_floor_gives_lamberts_law_and_a_wall_its_shadow():
    light = DirectionalLight(vector(-3, -4, 0), vector(2, 2, 2))
    floor, wall = placed(FLOOR, diffuse(0.5)), placed(moved(box((0.02, 0.6, 1)), (0.2, 0.31, 0)), diffuse(0.0))
    lit = picture(scene([floor], [light], OVER_THE_FLOOR), 1)
    assert_allclose(lit.samples, 0.5 / np.pi * 2 * 0.8, rtol=1e-5)
    behind = camera((-0.3, 0.8, 0.1), (0, 0.01, 0), fov=0.01, resolution=(64, 64))
    dark = picture(scene([floor, wall], [light], behind), 1)
    assert_allclose(dark.samples, 0)


def test_matched_slab_dims_the_sun_on_the_floor_by_its_optical_depth():
    """Without scattering: what is left over the floor is Beer's law twice, on the sun's way and on the camera's."""
    light = DirectionalLight(vector(0, -1, 0), vector(1, 1, 1))
    slab = placed(moved(box((2, 0.5, 2)), (0, 0.36, 0)), translucent(0.0, 1.5, ior=1.0))
    view = camera((0, 5, 0), (0, 0, 0), (0, 0, 1), fov=0.01, resolution=(128, 128))
    shown = picture(scene([placed(FLOOR, diffuse(0.5)), slab], [light], view), 4, seed=seed(2))
    expected = 0.5 / np.pi * np.exp(-1.5)
    assert_mean(shown.channel(), expected, false_alarm=1e-4, detects=0.03 * expected)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.03 * shown.channel(), expected, false_alarm=1e-4, detects=0.03 * expected)


def test_lamp_behind_glass_lights_the_floor_like_the_sky_there():
    """No straight line leads through glass: what a path meets beyond it counts, sampled though the lamp was.

    The lamp fills 99.9 % of what the floor's cosine weighs; 3 % is seen.
    """
    floor = placed(FLOOR, diffuse(0.5))
    glass = placed(moved(box((40, 0.2, 40)), (0, 1, 0)), translucent(1.0, 1e-3, ior=1.5))
    lamp = RectangleLight(vector(0, 2, 0), vector(0, 0, 0), vector(0, 0, 1), (60, 60), vector(1, 1, 1))
    view = camera((0.3, 0.4, 0.1), (0, 0.01, 0), fov=0.01, resolution=(64, 64))
    lit, open_sky = (picture(scene([floor, glass], [light], view), 8, seed=seed(5)).channel()
                     for light in (lamp, half_white_sky()))  # fmt: skip
    assert_mean(lit - open_sky, 0, false_alarm=1e-4, detects=0.03 * open_sky.mean())


def test_rectangle_in_view_shows_its_radiance_in_front_and_black_behind():
    light = RectangleLight(vector(0, 1, 0), vector(0, 0, 0), vector(0, 0, 1), (0.5, 0.5), vector(1, 2, 3))
    floor = placed(FLOOR, diffuse(0.0))
    up = camera((0, 0.5, 0), (0, 1, 0), (0, 0, 1), fov=10, resolution=(8, 8))
    front = picture(scene([floor], [light, WHITE_SKY], up), 1)
    assert_allclose(front.samples[0], np.repeat([[1.0], [2.0], [3.0]], 64, axis=1))
    assert (front.first_object == -1).all()
    down = camera((0, 2, 0), (0, 1, 0), (0, 0, 1), fov=10, resolution=(8, 8))
    assert_allclose(picture(scene([floor], [light, WHITE_SKY], down), 1).samples, 0)


def test_shell_around_a_point_light_is_an_integrating_sphere():
    """E = 4 pi I / area / (1 - rho) on the whole wall: sees lost bounces, roulette without weights, light counted
    twice; 0.7 % is seen, and the facets' own unevenness is 0.03 %.
    """
    room = inverted(icosphere(1.0, 5))
    shell = placed(room, diffuse([0.5, 0.8, 0.2]))
    light = PointLight(vector(0, 0, 0), vector(1, 1, 1))
    view = camera((0.3, 0.1, 0.2), (1, 0.2, 0.3), fov=90, resolution=(96, 96))
    shown = picture(scene([shell], [light], view), 10, seed=seed(3))
    rate = shared_rate(1e-3, 3)
    for k, rho in enumerate((0.5, 0.8, 0.2)):
        expected = 4 / room.area * rho / (1 - rho)
        samples = shown.channel(k)
        # the camera sees a part of the facets, whose own irradiance varies by 3e-4
        error = np.hypot(samples.std() / np.sqrt(len(samples)), 1e-4 * expected)
        assert_mean(
            (samples.mean(), error, len(samples)),
            expected,
            false_alarm=rate,
            detects=0.007 * expected,
            what=f"rho {rho}",
        )
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(1.01 * shown.channel(1), 16 / room.area, false_alarm=rate, detects=0.1 / room.area)


def test_mirror_shows_the_sky_turned_over():
    """Each pixel within what the mirrored rays of its corners and centre see; the sky itself is another picture."""
    image = np.random.default_rng(4).random((16, 32, 3)).astype(np.float32)
    sky = EnvironmentLight(image=image, rotation=25)
    view = camera((0.5, 1.0, 0.2), (0, 0.01, 0), fov=20, resolution=(12, 12))
    shown = picture(scene([placed(FLOOR, mirror([1.0, 0.5, 0.25]))], [sky], view), 1)
    rays = CameraRays(view, UnitFrame(np.zeros(3), 1.0))
    direct = [rays.directions(np.arange(144), np.full((2, 144), j, np.float32)) for j in (0, 0.5, 1)]
    mirrored = np.stack([Environment(sky).radiance(d * np.float32([[1], [-1], [1]])) for d in direct])
    spread = 0.05 + np.ptp(mirrored, axis=0)
    got = shown.samples[0] / np.array([[1.0], [0.5], [0.25]])
    assert (np.abs(got - mirrored[1]) <= spread).all()
    assert (np.abs(got - Environment(sky).radiance(direct[1])) > spread).any()


def test_ball_of_mirror_in_a_white_sky_vanishes():
    shown = picture(scene([placed(icosphere(1, 4), mirror(1.0))], [WHITE_SKY], camera((0, 0, 4))), 4)
    assert_allclose(shown.samples, 1, rtol=1e-6)


def test_white_room_of_diffuse_boxes_in_a_white_sky_vanishes():
    """Furnace: reflectance 1, not convex; paths go on for long, no roulette plays at weight 1."""
    boxes = [placed(moved(box((0.5, 1, 0.5)), (0.6 * k, 0, 0.1 * k)), diffuse(1.0)) for k in range(-1, 2)]
    shown = picture(scene(boxes, [WHITE_SKY], camera((0, 1, 4))), 4)
    assert_allclose(shown.samples, 1, rtol=1e-6)
