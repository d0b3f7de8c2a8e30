"""Normals at points of a mesh."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from renderer.tracing.normals import corner_normals, point_normals
from sss_tools.mesh import Mesh
from sss_tools.shapes import box


def test_seams_do_not_show_in_smooth_normals():
    """A box whose every face has vertices of its own: its corners' normals are still the diagonals."""
    cube = box(2)
    torn = Mesh(cube.vertices[cube.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    expected = torn.vertices[torn.faces] / np.sqrt(3)
    assert_allclose(corner_normals(torn), expected, atol=1e-6)


def test_normals_are_weighted_by_the_corners_angle():
    """A side of a cube is cut in two at some corners: weights by area or count would tilt the normals there."""
    assert_allclose(corner_normals(box(1)), box(1).vertices[box(1).faces] * 2 / np.sqrt(3), atol=1e-6)


def test_faces_without_area_change_no_normal():
    """A face with two equal corners, and a needle along an edge: no normals of their own, and NaN nowhere."""
    cube = box(1)
    faces = np.concatenate([cube.faces, [[0, 0, 1]], [[*cube.faces[0, :2], cube.faces[0, 0]]]])
    assert_allclose(point_normals(Mesh(cube.vertices, faces)), point_normals(cube), atol=1e-12)


def test_points_without_faces_that_have_area_have_no_normal():
    assert_array_equal(point_normals(Mesh(np.zeros((3, 3)), [[0, 1, 2]])), np.zeros((1, 3)))
