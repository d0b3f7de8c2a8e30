"""The scene as rays see it: whose triangle, where on it, which normal."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.description import RectangleLight
from renderer.tracing.traced_scene import TracedScene, offset_from
from sss_tools.rays import RAY_OFFSET
from sss_tools.shapes import box, icosphere, moved
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, mirror, placed, scene, translucent


def traced(*objects, lights=(WHITE_SKY,), shaders=None) -> TracedScene:
    shaders = shaders or ["path"] * len(objects)
    return TracedScene(scene(objects, lights, camera((0, 0, 5))), shaders, ["strict"] * len(objects))


@pytest.fixture(scope="module")
def several() -> TracedScene:
    """Opaque, translucent, opaque, translucent matched, and a rectangle light; the longest side is 8."""
    light = RectangleLight(np.array([0.0, 9, 0]), np.zeros(3), np.array([1.0, 0, 0]), (1, 2), np.ones(3))
    return traced(
        placed(box((8, 1, 8)), diffuse([0.1, 0.2, 0.3])),
        placed(moved(icosphere(1, 1), (0, 3, 0)), translucent(0.8, 2.0, 0.3, 1.4)),
        placed(moved(box(1), (2, 3, 0)), mirror(0.9)),
        placed(moved(icosphere(1, 1), (-3, 3, 0)), translucent(0.5, 4.0, 0.0, 1.0)),
        lights=(light, WHITE_SKY),
        shaders=["opaque", "path", "mirror", "path"],
    )


def test_each_triangle_knows_its_object(several):
    counts = [12, 80, 12, 80, 2]
    assert_array_equal(several.triangle_object, np.repeat([0, 1, 2, 3, -1], counts))
    assert_array_equal(several.slot_of_triangle, np.repeat([-1, 0, -1, 1, -1], counts))
    assert several.first_light_triangle == 184
    assert [thing.first_triangle for thing in several.objects] == [0, 12, 92, 104]
    assert_allclose(several.reflectance[:, 0], [0.1, 0.2, 0.3], rtol=1e-6)


def test_media_are_per_unit_of_the_frame(several):
    assert several.frame.scale == 8
    assert_allclose(several.media.sigma_t[0], [2 * 8, 4 * 8, 0])
    assert_allclose(several.media.albedo[0], [0.8, 0.5, 1], rtol=1e-6)
    assert_allclose(several.media.ior, [1.4, 1, 1], rtol=1e-6)


def test_rays_meet_the_object_they_should(several):
    origin = several.frame.points_in([[0, 3, 4], [2, 3, 4], [-3, 3, 4], [3, 8, 3], [0, 7, 0]]).T.astype(np.float32)
    towards = np.float32([[0, 0, -1], [0, 0, -1], [0, 0, -1], [0, -1, 0], [0, 1, 0]]).T
    _, triangle = several.closest(np.ascontiguousarray(origin), np.ascontiguousarray(towards))
    assert_array_equal(several.triangle_object[triangle], [1, 2, 3, 0, -1])
    assert triangle[4] >= several.first_light_triangle


def test_normals_point_outwards(several):
    centres = several._corner + several._edges.sum(axis=0) / 3
    for thing in several.objects:
        mine = several.triangle_object == thing.index
        middle = (thing.lower + thing.upper) / 2
        assert (np.einsum("ij,ij->j", several.triangle_normal[:, mine], centres[:, mine] - middle) > 0).all()
    assert_allclose(several.triangle_normal[:, -2:], [[0, 0], [-1, -1], [0, 0]], atol=1e-7)


def random_points(scene_, n: int = 4000):
    """Corner weights (3, n), points (3, n) and triangles of an object's surface."""
    draw = np.random.default_rng(1)
    triangle = draw.integers(0, scene_.first_light_triangle, n).astype(np.int32)
    weights = draw.dirichlet(np.ones(3), n).T
    corner, (first, second) = scene_._corner[:, triangle], (edge[:, triangle] for edge in scene_._edges)
    return weights, (corner + weights[1] * first + weights[2] * second).astype(np.float32), triangle


def test_barycentric_weights_give_the_point_back(several):
    weights, point, triangle = random_points(several)
    # points are rounded by 3e-8, the shortest edges are 0.07 long; needles of the box cost another factor
    assert_allclose(several.barycentric(point, triangle), weights, atol=5e-6)


def test_barycentric_weights_off_the_triangle_stay_weights(several):
    _, point, triangle = random_points(several)
    weights = several.barycentric(point + np.float32(0.01), triangle)
    assert weights.min() >= 0
    assert_allclose(weights.sum(axis=0), 1, atol=1e-6)


def test_hit_points_of_a_distant_camera_are_moved_onto_their_plane():
    """From 300 sizes away the hit's own rounding is 3e-5, thirty times the ray offset."""
    world = traced(placed(icosphere(1, 4), translucent()))
    draw = np.random.default_rng(2)
    aim = draw.normal(size=(3, 3000)) * 0.15
    away = draw.normal(size=(3, 3000))
    origin = (300 * away / np.linalg.norm(away, axis=0)).astype(np.float32)
    direction = aim - origin
    direction = (direction / np.linalg.norm(direction, axis=0)).astype(np.float32)
    distance, triangle = world.closest(origin, direction)
    hit = triangle >= 0
    point = (origin + distance * direction)[:, hit]
    triangle = triangle[hit]
    assert len(triangle) > 2000

    def height(of):
        """Over the plane, in double precision."""
        corner = world._corner[:, triangle].astype(float)
        first, second = (edge[:, triangle].astype(float) for edge in world._edges)
        normal = np.cross(first.T, second.T)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return np.einsum("ij,ji->i", normal, of.astype(float) - corner)

    assert np.abs(height(point)).max() > 10 * RAY_OFFSET  # there is something to mend
    # coordinates to 0.5, products to 0.5: a few roundings of 3e-8
    assert np.abs(height(world.on_plane(point, triangle))).max() < 2e-7 < RAY_OFFSET / 4


def test_flat_objects_have_flat_normals_beside_smooth_ones():
    world = traced(placed(icosphere(1, 2), translucent(), normals="smooth"),
                   placed(moved(icosphere(1, 2), (3, 0, 0)), translucent()))  # fmt: skip
    _, point, triangle = random_points(world)
    normal = world.shading_normal(point, triangle)
    flat = world.triangle_object[triangle] == 1
    assert_array_equal(normal[:, flat], world.triangle_normal[:, triangle[flat]])
    assert (np.abs(normal[:, ~flat] - world.triangle_normal[:, triangle[~flat]]).max(axis=0) > 1e-3).mean() > 0.9


def test_smooth_normals_of_a_ball_point_from_its_centre():
    world = traced(placed(icosphere(2, 3), translucent(), normals="smooth"))
    _, point, triangle = random_points(world)
    radial = point / np.linalg.norm(point, axis=0)
    cosine = np.einsum("ij,ij->j", world.shading_normal(point, triangle), radial)
    flat = np.einsum("ij,ij->j", world.triangle_normal[:, triangle], radial)
    # facets are 8 degrees wide; interpolation leaves a tenth of a degree
    assert cosine.min() > np.cos(np.radians(0.3))
    assert flat.min() < np.cos(np.radians(3))


def test_offset_goes_to_the_side_that_is_asked_for():
    normal = np.float32([[0, 0], [0, 0], [1, 1]])
    moved_ = offset_from(np.zeros((3, 2), np.float32), normal, np.float32([0.3, -5]))
    assert_array_equal(moved_[2], [RAY_OFFSET, -RAY_OFFSET])
