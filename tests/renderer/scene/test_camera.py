"""Camera rays."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.camera import CameraRays
from renderer.scene.description import Camera
from renderer.scene.scene_file import load_scene
from sss_tools.rays import RayCaster, UnitFrame

FRAME = UnitFrame(np.zeros(3), 1.0)


def camera(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov=90.0, size=(4, 2)) -> Camera:
    return Camera(np.array(position), np.array(target), np.array(up), fov, size)


def direction(rays: CameraRays, pixel, a, b):
    jitter = np.array([[a], [b]], np.float32)
    return rays.directions(np.array([pixel], np.int32), jitter)[:, 0]


def unit(vector):
    return np.array(vector) / np.linalg.norm(vector)


def test_directions_at_the_corners_of_a_picture_by_hand():
    # fov 90: half the height is 1 at distance 1, half the width 2. Looking along -z with +y up, +x is right.
    rays = CameraRays(camera(), FRAME)
    assert_allclose(direction(rays, 0, 0, 0), unit([-2, 1, -1]), atol=2e-7)  # row 0, column 0: the top left corner
    assert_allclose(direction(rays, 3, 0.5, 0), unit([1.5, 1, -1]), atol=2e-7)
    assert_allclose(direction(rays, 4, 0, 0.5), unit([-2, -0.5, -1]), atol=2e-7)  # row 1, column 0
    assert_allclose(direction(rays, 7, 0.5, 0.5), unit([1.5, -0.5, -1]), atol=2e-7)


def test_every_direction_follows_the_formula_in_double_precision():
    view = camera((1.0, 2.0, 3.0), (-0.5, 0.2, 0.1), (0.1, 1.0, -0.3), 40.0, (70, 30))
    f = unit(view.target - view.position)
    left = unit(np.cross(view.up, f))
    v = np.cross(f, left)
    generator = np.random.default_rng(3)
    pixel = generator.integers(0, 70 * 30, 20_000, dtype=np.int32)  # several chunks
    jitter = generator.random((2, len(pixel)), dtype=np.float32)
    row, column = np.divmod(pixel, 70)
    t = math.tan(math.radians(20))
    x = (1 - 2 * (column + jitter[0].astype(float)) / 70) * t * 70 / 30
    y = (1 - 2 * (row + jitter[1].astype(float)) / 30) * t
    expected = f[:, None] + x * left[:, None] + y * v[:, None]
    expected /= np.linalg.norm(expected, axis=0)
    # a few roundings of float32 (6e-8 each) in the sum and the norm
    assert_allclose(CameraRays(view, FRAME).directions(pixel, jitter), expected, atol=4e-7)


def test_directions_are_float32_unit_vectors_in_the_array_given():
    rays = CameraRays(camera(size=(50, 40)), FRAME)
    pixel = np.arange(2000, dtype=np.int32)
    out = np.full((3, 2000), 9, np.float32)
    assert rays.directions(pixel, np.zeros((2, 2000), np.float32), out) is out
    assert_allclose(np.linalg.norm(out.astype(float), axis=0), 1, atol=3e-7)


def test_roll_follows_up():
    rolled = CameraRays(camera(up=(1.0, 0.0, 0.0), size=(2, 2)), FRAME)
    # +x is on top: the top left pixel looks to +x and to the left of it, which is +y
    assert_allclose(direction(rolled, 0, 0, 0), unit([1, 1, -1]), atol=2e-7)


def test_origin_is_in_the_frame():
    rays = CameraRays(camera(position=(12.0, 0.0, 5.0)), UnitFrame(np.array([10.0, 0, 0]), 4.0))
    assert rays.origin.dtype == np.float32
    assert_array_equal(rays.origin, [0.5, 0, 1.25])


def test_centre_directions_go_row_by_row():
    rays = CameraRays(camera(), FRAME)
    directions = rays.centre_directions()
    assert directions.shape == (3, 8)
    for pixel in range(8):
        assert_array_equal(directions[:, pixel], direction(rays, pixel, 0.5, 0.5))


def test_pixel_footprint_is_the_side_of_a_pixel():
    # at distance 5 the picture is 10 high, over 2 pixels
    assert CameraRays(camera(), FRAME).pixel_footprint(5.0) == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["p1_sphere", "p2_bunny_marble", "p4_slab", "p5_spot_matched"])
def test_silhouette_agrees_with_the_reference(shared, name):
    """The share of each pixel on the object, against the reference's, from 64 random samples a pixel.

    Ours is a grid of 8 x 8. At the edge the reference's standard deviation is at most sqrt(1/4/64) = 0.0625 and
    the grid's error is far below. A picture shifted by a quarter of a pixel would differ by some 0.16, a
    mirrored one by 0.3 or more (not the sphere, whose silhouette is symmetric).
    """
    scene = load_scene(shared / "reference" / "scenes" / f"{name}.toml")
    with np.load(shared / "reference" / "public" / f"{name}.npz") as file:
        expected = file["coverage"]
    mesh = scene.objects[0].mesh
    frame = UnitFrame.around(*mesh.bounds)
    caster = RayCaster(frame.points_in(mesh.vertices), mesh.faces)
    rays = CameraRays(scene.camera, frame)
    width, height = rays.resolution
    grid = (np.arange(8, dtype=np.float32) + np.float32(0.5)) / 8
    jitter = np.tile(np.stack(np.meshgrid(grid, grid)).reshape(2, 64), width * height)
    directions = rays.directions(np.repeat(np.arange(width * height, dtype=np.int32), 64), jitter)
    origins = np.broadcast_to(rays.origin[:, None], directions.shape).copy()
    _, triangle = caster.closest(origins, directions)
    coverage = (triangle >= 0).reshape(height, width, 64).mean(axis=-1)
    edge = (expected > 0) & (expected < 1)
    assert edge.sum() > 200
    assert np.sqrt(((coverage - expected)[edge] ** 2).mean()) < 0.0625
    assert np.abs(coverage - expected)[~edge].max() < 0.15  # e^-10 of the binomial with 64 samples
