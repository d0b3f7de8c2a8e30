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
