import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.thickness import inscribed_balls, wall_thickness


def diameters(mesh):
    return inscribed_balls(mesh, np.arange(len(mesh.faces)), wall_thickness(mesh))[0]


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3)])
def test_a_slab_is_as_thick_as_it_is_at_any_scale_and_place(scale, offset):
    slab = shapes.slab(1.0, 0.01)
    thickness = wall_thickness(Mesh(slab.vertices * scale + offset, slab.faces))
    flat = np.abs(slab.face_normals[:, 2]) > 0.5
    # rays are single precision in a frame of the slab's width: some ulps of 0.5, over a hundredth
    np.testing.assert_allclose(thickness[flat], 0.01 * scale, rtol=1e-4)
    np.testing.assert_allclose(thickness[~flat], scale, rtol=1e-5)


def test_a_ball_is_as_thick_as_its_diameter_by_ray_and_by_ball():
    ball = shapes.icosphere(1.0, 4)
    # facets cut off up to 1 - cos(half their width) of a radius, 0.2 %
    np.testing.assert_allclose(wall_thickness(ball), 2, rtol=0.004)
    # a ball that touches a facet's middle is held by the next facets, which are off the sphere: up to 13 % here
    np.testing.assert_allclose(diameters(ball), 2, rtol=0.15)


def test_a_ray_along_a_spindle_sees_its_length_and_a_ball_at_its_tip_fits_into_it():
    spindle = shapes.ellipsoid((0.1, 0.1, 2.0), 5)
    tip = np.argmax(spindle.vertices[spindle.faces][..., 2].mean(axis=1))
    assert wall_thickness(spindle)[tip] > 0.2
    # no ball in there is wider than the spindle
    assert diameters(spindle).max() < 0.2 * 1.02


def test_a_ball_in_a_wall_is_as_wide_as_the_wall_and_held_across_it():
    hollow = shapes.hollow_ball(1.0, 0.8, 5)
    faces = np.arange(0, len(hollow.faces), 50)
    diameter, wall = inscribed_balls(hollow, faces, np.full(len(faces), 0.5))
    assert wall.all()
    np.testing.assert_allclose(diameter, 0.2, rtol=0.05)
    # narrower balls touch nothing
    assert not inscribed_balls(hollow, faces, np.full(len(faces), 0.1))[1].any()


def test_a_hollow_ball_is_as_thick_as_its_wall():
    hollow = shapes.hollow_ball(1.0, 0.9, 4)
    np.testing.assert_allclose(wall_thickness(hollow), 0.1, rtol=0.06)


def test_faces_without_area_have_no_thickness():
    box = shapes.box()
    faces = np.concatenate([box.faces, [[0, 1, 0]]])
    assert wall_thickness(Mesh(box.vertices, faces))[-1] == np.inf


def balls_at(mesh, faces, widest):
    return inscribed_balls(mesh, np.asarray(faces), np.full(len(faces), widest))


@pytest.mark.parametrize("widest", [0.11, 0.2, 1.0])
def test_a_ball_in_a_slab_of_two_faces_a_side_is_as_wide_as_the_slab(widest):
    slab = shapes.slab(1.0, 0.1)
    flat = np.flatnonzero(np.abs(slab.face_normals[:, 2]) > 0.5)
    diameter, wall = balls_at(slab, flat, widest)
    # between points a sixth of a diameter apart a ball is too wide by 1 % at most
    np.testing.assert_allclose(diameter, 0.1, rtol=0.01)
    assert wall.all()


@pytest.mark.parametrize("angle", [10, 30])
def test_a_ball_in_a_wedge_is_as_wide_as_its_angle_says(angle):
    half = np.radians(angle / 2)
    x, z = 2 * np.cos(half), 2 * np.sin(half)
    points = [[0, 0, 0], [x, 0, -z], [x, 3, -z], [0, 3, 0], [x, 0, z], [x, 3, z]]
    wedge = Mesh(points, [[0, 2, 1], [0, 3, 2], [1, 2, 5], [1, 5, 4], [0, 1, 4], [3, 5, 2], [0, 4, 5], [0, 5, 3]])
    slopes = np.array([0, 1, 6, 7])
    middle = wedge.vertices[wedge.faces[slopes]].mean(axis=1)
    # the centre is on the plane half way; it touches where it is as far from the edge as the face's middle
    expected = 2 * np.hypot(middle[:, 0], middle[:, 2]) * np.tan(half)
    diameter, wall = balls_at(wedge, slopes, 1.0)
    np.testing.assert_allclose(diameter, expected, rtol=0.01)
    assert wall.all()


def test_a_ball_in_a_cone_is_as_wide_as_its_angle_says():
    half, count = np.radians(10), 64
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.stack([2 * np.tan(half) * np.cos(angle), 2 * np.tan(half) * np.sin(angle), np.full(count, 2.0)], axis=1)
    i, j = np.arange(count), (np.arange(count) + 1) % count
    sides = np.stack([0 * i, j + 1, i + 1], axis=1)
    lid = np.stack([0 * i + count + 1, i + 1, j + 1], axis=1)
    cone = Mesh(np.concatenate([[[0, 0, 0]], rim, [[0, 0, 2]]]), np.concatenate([sides, lid]))
    assert cone.volume > 0
    middle = np.linalg.norm(cone.vertices[sides].mean(axis=1), axis=1)
    diameter, _ = balls_at(cone, np.arange(count), 0.6)
    # 64 facets lie a thousandth within the cone
    np.testing.assert_allclose(diameter, 2 * middle * np.tan(half), rtol=0.01)


def test_balls_between_nested_spheres_are_as_wide_as_the_wall_at_its_thinnest_and_thickest():
    outer, inner = shapes.icosphere(1.0, 5), shapes.inverted(shapes.icosphere(0.6, 5))
    nested = shapes.joined(outer, shapes.moved(inner, [0, 0, 0.3]))
    height = nested.vertices[outer.faces].mean(axis=1)[:, 2]
    diameter, wall = balls_at(nested, [np.argmax(height), np.argmin(height)], 1.0)
    # and 1 - cos(half a facet) = 0.05 % of either radius
    np.testing.assert_allclose(diameter, [0.1, 0.7], rtol=0.02)
    assert wall.all()


def test_points_for_balls_are_few_where_balls_are_wide():
    """All of a sphere is as far from its middle: with many points the search there would take all of them."""
    from sss_tools import thickness

    ball = shapes.icosphere(1.0, 5)
    assert len(thickness._cloud(ball, 2 / thickness.RESOLUTION)[0]) < 2000
    place, face = thickness._cloud(ball, 1e-3)
    assert len(place) == thickness.CLOUD
    # each lies on its face
    height = np.einsum("ij,ij->i", place - ball.vertices[ball.faces[face, 0]], ball.face_normals[face])
    assert np.abs(height).max() < 1e-14


def test_rays_of_limited_length_see_the_same_walls_and_nothing_beyond():
    hollow = shapes.hollow_ball(1.0, 0.9, 4)
    far, near = wall_thickness(hollow), wall_thickness(hollow, 0.15)
    within = far < 0.15
    assert within.any() and (near[within] == far[within]).all() and np.isinf(near[~within]).all()
    assert np.isinf(wall_thickness(hollow, 0.05)).all()


def test_a_ball_stays_held_by_what_held_it_when_finer_points_find_nothing_nearer():
    hollow = shapes.hollow_ball(1.0, 0.9, 4)
    diameter, wall = balls_at(hollow, np.arange(len(hollow.faces)), 2.0)
    assert diameter.max() < 0.12 and wall.mean() > 0.99
