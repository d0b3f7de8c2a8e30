"""Beams: a few in each pass, and over the passes the whole of every light."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.scene.beams import beams, rotation
from renderer.scene.description import (
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
    SphereLight,
)
from renderer.scene.lights import LightSet, RectangleSource
from sss_tools.rays import UnitFrame

FRAME = UnitFrame(np.array([3.0, -1.0, 0.5]), 7.0)
HERE = np.float32(FRAME.points_in([0.5, -1.5, 0.3])).reshape(3, 1)


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def irradiance(lights, normal, passes: int = 1) -> np.ndarray:
    """(3,) irradiance of a surface at HERE, the mean over the passes."""
    source, total = LightSet(lights, FRAME), np.zeros(3)
    for index in range(passes):
        for beam in beams(source, index):
            direction, _, across = beam.at(HERE)
            total += across[:, 0] * max(float(np.float32(normal) @ direction[:, 0]), 0) / passes
    return total


def test_rectangle_is_lit_whole_over_the_passes():
    """Against 400 x 400 parts of it; 64 points of an even sequence leave about 1 %, pass 0 is its middle."""
    light = RectangleLight(vector(0.2, 1, -0.1), vector(0.1, 0, 0.2), vector(1, 0.2, 0), (0.4, 0.7), vector(1, 2, 3))
    source = RectangleSource(light, FRAME)
    grid = (np.arange(400, dtype=np.float32) + 0.5) / 400
    u1, u2 = np.stack(np.meshgrid(grid, grid)).reshape(2, -1)
    part = source.sample(np.repeat(HERE, len(u1), axis=1), u1, u2)
    expected = (part.irradiance * np.maximum(part.direction[1], 0)).mean(axis=1, dtype=float)
    assert_allclose(irradiance([light], (0, 1, 0), 64), expected, rtol=0.015)
    (beam,) = beams(LightSet([light], FRAME), 0)
    middle = FRAME.points_in([0.2, 1, -0.1]) - HERE[:, 0]
    # the middle of the solid angle, which lies 1 degree beside the rectangle's own
    assert_allclose(beam.at(HERE)[0][:, 0], middle / np.linalg.norm(middle), atol=0.03)


def test_sphere_is_a_point_of_its_intensity():
    light = SphereLight(vector(0.5, 0.5, 0.3), 0.5, vector(1, 2, 3))
    assert_allclose(irradiance([light], (0, 1, 0)), np.pi / 16 * vector(1, 2, 3), rtol=1e-5)


def test_lights_without_extent_are_themselves():
    point, sun = PointLight(vector(0.5, 0.5, 0.3), vector(1, 2, 3)), DirectionalLight(vector(0, -1, 0), vector(1, 1, 1))
    assert_allclose(irradiance([point, sun], (0, 1, 0)), vector(1, 2, 3) / 4 + 1, rtol=1e-5)


@pytest.mark.parametrize("index", [0, 1, 17])
def test_every_pass_carries_all_light_of_an_environment_image(index):
    image = np.random.default_rng(1).random((16, 32, 3)).astype(np.float32)
    lights = LightSet([EnvironmentLight(image=image, rotation=20)], FRAME)
    z = (np.arange(400) + 0.5) / 200 - 1
    azimuth = 2 * np.pi * (np.arange(800) + 0.5) / 800
    radius = np.sqrt(1 - z * z)
    sphere = np.stack([np.outer(radius, np.cos(azimuth)), np.outer(radius, np.sin(azimuth)),
                       np.repeat(z[:, None], 800, 1)]).reshape(3, -1)  # fmt: skip
    mean = lights.environments[0].radiance(sphere.astype(np.float32)).mean(axis=1, dtype=float)
    total = sum(beam.at(HERE)[2][:, 0] for beam in beams(lights, index))
    # noise of 2048 directions in pixels of independent values
    assert_allclose(total, 4 * np.pi * mean, rtol=0.02)


def test_smooth_sky_lights_surfaces_as_its_integral_says():
    """Radiance 1 + y: E = pi + 2 pi / 3 on a level surface facing up, pi on an upright one.

    Each direction stands for the mean of a cell 90 degrees wide, so the sky's slope is seen 14 % too flat: 5.6 % of E.
    """
    y = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    light = EnvironmentLight(image=np.repeat((1 + y)[:, None, None] * np.ones(3), 128, axis=1).astype(np.float32))
    for normal, expected in (((0, 1, 0), np.pi + 2 * np.pi / 3), ((1, 0, 0), np.pi)):
        assert_allclose(irradiance([light], normal, 64), expected, rtol=0.06)


def test_constant_sky_is_one_ambient_beam():
    (beam,) = beams(LightSet([EnvironmentLight(radiance=vector(1, 2, 3))], FRAME), 3)
    assert beam.ambient
    assert_allclose(beam.radiance, [1, 2, 3])


def test_rotations_are_rotations():
    for share in np.random.default_rng(2).random((50, 3)):
        turned = rotation(share).astype(float)
        assert_allclose(turned @ turned.T, np.eye(3), atol=1e-6)
        assert np.linalg.det(turned) == pytest.approx(1, abs=1e-6)
