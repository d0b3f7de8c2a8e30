"""Lights: what they send where, sampled and in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.description import (
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
    SphereLight,
)
from renderer.scene.lights import Environment, LightSet, RectangleSource, SphereSource, fibonacci_directions
from sss_tools.rays import UnitFrame

HERE = UnitFrame(np.zeros(3), 1.0)
ELSEWHERE = UnitFrame(np.array([3.0, -1.0, 0.5]), 7.0)


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def column(*coordinates) -> np.ndarray:
    return np.float32(coordinates).reshape(3, 1)


def stratified(n: int = 400):
    """(2, n * n) midpoints of a grid."""
    grid = (np.arange(n) + 0.5) / n
    return np.stack(np.meshgrid(grid, grid)).reshape(2, -1).astype(np.float32)


def irradiance(source, position, normal) -> float:
    """Mean over sampled beams of the irradiance on a surface at ``position`` facing ``normal``."""
    u1, u2 = stratified()
    beam = source.sample(np.repeat(column(*position), len(u1), axis=1), u1, u2)
    assert_allclose(np.linalg.norm(beam.direction, axis=0), 1, atol=1e-6)
    cosine = np.maximum(np.float32(normal) @ beam.direction, 0)
    return float((beam.irradiance[0].astype(float) * cosine).mean())


def polygon_irradiance(corners, position, normal) -> float:
    """E = L/2 sum_i angle_i (n . gamma_i), gamma_i the unit normal of the plane through an edge and the point.

    Lambert 1760, Photometria; for polygons wholly above the surface and seen from their front, L = 1.
    """
    rays = corners - np.array(position, float)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(rays, np.roll(rays, -1, axis=0), strict=True):
        gamma = np.cross(a, b)
        total += np.arccos(np.clip(a @ b, -1, 1)) * (np.array(normal, float) @ gamma) / np.linalg.norm(gamma)
    return abs(total) / 2


RECTANGLE = RectangleLight(vector(0.2, 1.0, -0.1), vector(0.1, 0.0, 0.2), vector(1.0, 0.2, 0.0), (0.4, 0.7), np.ones(3))


@pytest.mark.parametrize(
    ("position", "normal"),
    [((0, 0, 0), (0, 1, 0)), ((0.5, -1, 0.3), (0, 0.8, 0.6)), ((0.1, 0, 0.2), (0.6, 0.8, 0)), ((0, -9, 2), (0, 1, 0))],
)
def test_rectangle_lights_surfaces_as_lamberts_formula_says(position, normal):
    source = RectangleSource(RECTANGLE, HERE)
    expected = polygon_irradiance(source.vertices, position, normal)
    # the midpoint rule on 400 x 400 parts leaves 1e-6; the rest is single precision
    assert irradiance(source, position, normal) == pytest.approx(expected, rel=1e-4)


def test_small_rectangle_above_a_surface_is_area_over_squared_distance():
    """And a factor 1.01 on its area is seen."""
    light = RectangleLight(vector(0, 2, 0), vector(0, 0, 0), vector(1, 0, 0), (0.01, 0.02), np.full(3, 5.0))
    expected = 5 * 4 * 0.01 * 0.02 / 4
    got = irradiance(RectangleSource(light, HERE), (0, 0, 0), (0, 1, 0))
    assert got == pytest.approx(expected, rel=2e-4)
    assert 1.01 * got != pytest.approx(expected, rel=2e-4)


def test_rectangle_emits_from_its_front_alone():
    source = RectangleSource(RECTANGLE, HERE)
    assert irradiance(source, (0.3, 2.0, -0.3), (0, -1, 0)) == 0
    normal = np.cross(source.vertices[1] - source.vertices[0], source.vertices[2] - source.vertices[0])
    assert normal @ source.normal[:, 0] > 0  # its triangles face the same way


def test_rectangle_lies_where_it_is_said_to():
    source = RectangleSource(RECTANGLE, HERE)
    forward = vector(-0.1, -1.0, 0.3) / np.linalg.norm(vector(-0.1, -1.0, 0.3))
    sides = np.linalg.norm(np.diff(source.vertices, axis=0), axis=1)
    assert_allclose(sides, [0.8, 1.4, 0.8], rtol=1e-6)
    assert_allclose((source.vertices - RECTANGLE.center) @ forward, 0, atol=1e-12)
    # half[1] runs along up, as far as up lies in the plane
    upward = vector(1.0, 0.2, 0) - forward * (forward @ vector(1.0, 0.2, 0))
    assert_allclose(np.cross(source.vertices[2] - source.vertices[1], upward), 0, atol=1e-12)


@pytest.mark.parametrize(("radius", "height"), [(0.5, 2.0), (0.9, 1.0), (0.001, 3.0)])
def test_sphere_lights_a_surface_below_it_with_pi_L_r2_over_h2(radius, height):
    """Exact for any ball wholly above the surface (a Lambertian ball acts as if from its centre)."""
    source = SphereSource(SphereLight(vector(0, height, 0), radius, np.full(3, 2.0)), HERE)
    for normal, cosine in (((0, 1, 0), 1.0), ((0.28, 0.96, 0), 0.96)):
        if radius / height < cosine:
            expected = 2 * np.pi * (radius / height) ** 2 * cosine
            visible = np.arccos(cosine) + np.arcsin(radius / height) < np.pi / 2
            if visible:
                assert irradiance(source, (0, 0, 0), normal) == pytest.approx(expected, rel=1e-4)


def test_sampled_directions_end_on_the_ball():
    source = SphereSource(SphereLight(vector(1, 2, -1), 0.5, np.ones(3)), HERE)
    u1, u2 = stratified(60)
    beam = source.sample(np.zeros((3, 3600), np.float32), u1, u2)
    landing = beam.distance * beam.direction
    # at its rim the ball is met at a glancing angle: roundings of 1e-7 become their square root
    assert_allclose(np.linalg.norm(landing - source.center, axis=0), 0.5, atol=2e-3)
    assert (beam.distance < np.sqrt(6)).all()


def test_rays_meet_the_ball_where_geometry_says():
    source = SphereSource(SphereLight(vector(0, 0, -3), 1.0, np.ones(3)), HERE)
    origin = np.float32([[0, 0, 0], [0, 0.6, 0], [0, 1.01, 0], [0, 0, -6], [0, 0, -3], [0, 0, 1000]]).T
    towards = np.float32([[0, 0, -1]] * 6).T
    assert_allclose(source.distance(origin, towards), [2, 2.2, np.inf, np.inf, np.inf, 1002], rtol=1e-6)


def test_ball_of_a_thousandth_is_met_from_a_thousand_away():
    """Where the textbook's quadratic cancels."""
    source = SphereSource(SphereLight(vector(0, 0, 0), 1e-2, np.ones(3)), HERE)
    origin = np.float32([[0, 0.009, 0.011], [0, 0, 0], [1000, 1000, 1000]])
    distance = source.distance(origin, np.float32([[0] * 3, [0] * 3, [-1] * 3]))
    assert_allclose(distance, [1000, 1000, np.inf], rtol=1e-4)


def test_ball_sends_no_light_inwards():
    """Rays met by chance see nothing from inside; sampling must agree."""
    source = SphereSource(SphereLight(vector(0, 0, 0), 1.0, np.ones(3)), HERE)
    assert np.isinf(source.distance(column(0.2, 0, 0), column(0, 0, 1)))[0]
    assert irradiance(source, (0.2, 0, 0), (0, 0, 1)) == 0


def test_point_light_falls_off_with_the_square_in_scene_units_in_every_frame():
    light = PointLight(vector(1, 2, 3), vector(4, 8, 12))
    there = np.array([[1, 2, 0], [4, 6, 3]], float)
    for frame in (HERE, ELSEWHERE):
        beam = LightSet([light], frame).points[0].illuminate(np.float32(frame.points_in(there)).T)
        assert_allclose(beam.irradiance, np.outer([4, 8, 12], [1 / 9, 1 / 25]), rtol=1e-5)
        assert_allclose(beam.distance * frame.scale, [3, 5], rtol=1e-5)
        assert_allclose(beam.direction, [[0, -0.6], [0, -0.8], [1, 0]], atol=1e-6)


def test_area_lights_are_the_same_in_every_frame():
    position, normal = vector(0.5, -1.0, 0.3), (0, 0.8, 0.6)
    for kind, light in ((RectangleSource, RECTANGLE), (SphereSource, SphereLight(vector(0, 2, 1), 0.5, np.ones(3)))):
        values = [irradiance(kind(light, frame), frame.points_in(position), normal) for frame in (HERE, ELSEWHERE)]
        assert values[0] == pytest.approx(values[1], rel=1e-4)


def test_directional_light_arrives_against_its_direction_everywhere():
    light = DirectionalLight(vector(0, -2, 0), vector(1, 2, 3))
    beam = LightSet([light], ELSEWHERE).points[0].illuminate(np.zeros((3, 5), np.float32))
    assert_allclose(beam.direction, np.repeat(column(0, 1, 0), 5, axis=1))
    assert np.isinf(beam.distance).all()
    assert_allclose(beam.irradiance, column(1, 2, 3))


# ---- environments ----


def sky(rotation: float = 0.0) -> Environment:
    """8 x 16 pixels, red the row, green the column."""
    rows, columns = np.mgrid[0:8, 0:16]
    image = np.stack([rows, columns, np.ones((8, 16))], axis=-1).astype(np.float32)
    return Environment(EnvironmentLight(image=image, rotation=rotation))


def seen(environment: Environment, *direction):
    return environment.radiance(column(*direction) / np.float32(np.linalg.norm(direction)))[:, 0]


def test_rows_go_from_up_to_down():
    assert seen(sky(), 0.01, 1, 0)[0] == 0
    assert seen(sky(), 0.01, -1, 0)[0] == 7
    assert seen(sky(), 0, 0, -1)[0] == pytest.approx(3.5, abs=1e-4)


def test_centre_column_looks_along_minus_z_and_columns_grow_towards_plus_x():
    # the centre lies on the edge between columns 7 and 8
    assert seen(sky(), 0, 0, -1)[1] == pytest.approx(7.5, abs=1e-4)
    assert seen(sky(), 1, 0, 0)[1] == pytest.approx(11.5, abs=1e-4)
    assert seen(sky(), -1, 0, 0)[1] == pytest.approx(3.5, abs=1e-4)
    assert seen(sky(), 0.1, 0, -1)[1] > 7.6


def test_rotation_is_counter_clockwise_seen_from_above():
    """By 90 degrees what was at -z is at -x, and what was at +x is at -z."""
    turned = sky(90)
    assert seen(turned, -1, 0, 0)[1] == pytest.approx(7.5, abs=1e-4)
    assert seen(turned, 0, 0, -1)[1] == pytest.approx(11.5, abs=1e-4)
    assert seen(turned, 0, 0, -1)[0] == pytest.approx(3.5, abs=1e-4)


@pytest.mark.parametrize("rotation", [0, 37, -400])
def test_whole_turns_change_nothing(rotation):
    directions = fibonacci_directions(500)
    assert_allclose(sky(rotation).radiance(directions), sky(rotation + 720).radiance(directions), atol=1e-3)


def test_interpolation_is_seamless_at_the_back_and_hits_pixel_centres():
    left, right = seen(sky(), -1e-4, 0, 1), seen(sky(), 1e-4, 0, 1)
    assert_allclose(left, right, atol=0.01)
    assert left[1] == pytest.approx(7.5, abs=0.01)  # half of column 0, half of column 15
    azimuth, polar = 2 * np.pi * (11.5 / 16 - 0.5), np.pi * 2.5 / 8
    direction = np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    assert_allclose(seen(sky(), *direction), [2, 11, 1], atol=1e-4)


def test_image_of_one_colour_is_a_constant_sky():
    image = np.full((3, 5, 3), [0.1, 0.2, 0.3], np.float32)
    radiance = Environment(EnvironmentLight(image=image)).radiance(fibonacci_directions(300))
    assert_allclose(radiance, np.repeat(column(0.1, 0.2, 0.3), 300, axis=1), rtol=1e-6)


def test_background_is_the_sum_of_all_environments():
    lights = LightSet([EnvironmentLight(radiance=vector(1, 2, 3)), EnvironmentLight(radiance=vector(0.5, 0.5, 0.5)),
                       PointLight(vector(0, 0, 0), vector(9, 9, 9))], HERE)  # fmt: skip
    assert_allclose(lights.background(fibonacci_directions(4)), np.repeat(column(1.5, 2.5, 3.5), 4, axis=1))


# ---- directions ----


def test_fibonacci_directions_are_unit_and_even():
    directions = fibonacci_directions(1000).astype(float)
    assert_allclose(np.linalg.norm(directions, axis=0), 1, atol=1e-6)
    assert_allclose(directions.mean(axis=1), 0, atol=2e-3)
    assert_allclose(directions @ directions.T / 1000, np.eye(3) / 3, atol=2e-3)


@pytest.mark.parametrize("position", [(0, 0, 0), (0.4, -0.7, 0.2), (0, 0, -50), (3, 0, 0)])
def test_density_is_that_with_which_directions_are_drawn(position):
    """One over the solid angle, and 0 from where there is no light."""
    rectangle = RectangleLight(vector(0, 0, 1), vector(0, 0, 0), vector(1, 0, 0), (0.5, 0.3), np.ones(3))
    for source in (
        RectangleSource(rectangle, HERE),
        SphereSource(SphereLight(vector(0, 0, 1), 0.4, np.ones(3)), HERE),
    ):
        at = column(*position).astype(np.float32)
        beam = source.sample(at, np.float32([0.3]), np.float32([0.8]))
        assert_allclose(source.density(at), beam.density, rtol=1e-5)
        assert_allclose(beam.irradiance[0] * beam.density, beam.irradiance[0] > 0, rtol=1e-5)
    behind = column(0, 0, 2).astype(np.float32)
    assert RectangleSource(rectangle, HERE).density(behind)[0] == 0


def test_single_precision_is_enough_for_wide_rectangles():
    """Directions within 1e-5 radians, light within 1e-5 of it and 5e-6 of the light face to face."""
    light = RectangleLight(np.array([2.0, 3, 2]), np.zeros(3), np.array([0.0, 1, 0]), (1.0, 1.0), np.ones(3))
    source = RectangleSource(light, HERE)
    assert source.wide
    position = np.random.default_rng(3).uniform(-0.5, 0.5, (3, 20000)).astype(np.float32)
    share = np.array([0.3, 0.9])
    ours, exact = source.sample_at(position, share), source.sample(position, *share)
    assert ours.direction.dtype == ours.irradiance.dtype == ours.distance.dtype == np.float32
    assert_allclose(ours.direction, exact.direction, atol=1e-5)
    assert_allclose(ours.irradiance, exact.irradiance, rtol=1e-5, atol=5e-6)
    assert_allclose(ours.distance, exact.distance, rtol=1e-5)


def test_small_rectangles_are_sampled_in_double_precision():
    light = RectangleLight(np.array([20.0, 3, 2]), np.zeros(3), np.array([0.0, 1, 0]), (1.0, 1.0), np.ones(3))
    source = RectangleSource(light, HERE)
    assert not source.wide
    position, share = np.zeros((3, 1), np.float32), np.array([0.3, 0.9])
    assert_array_equal(source.sample_at(position, share).irradiance, source.sample(position, *share).irradiance)
