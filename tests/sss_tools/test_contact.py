import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.contact import common_faces, lies_within, near_faces
from sss_tools.mesh import Mesh


def beside(gap, shift=0.25):
    return shapes.moved(shapes.box(), [1 + gap, shift, shift])


def test_boxes_that_touch_have_common_faces_also_where_their_corners_coincide():
    for shift in (0.25, 0.0):
        touching = common_faces(shapes.box(), beside(0.0, shift))
        right = np.flatnonzero(shapes.box().face_normals[:, 0] > 0.5)
        assert set(right) <= set(touching)
    assert len(common_faces(shapes.box(), beside(2.0**-50))) == 0


def test_a_ball_lies_within_a_box_and_not_the_other_way_round():
    box = shapes.box(4.0)
    ball = shapes.moved(shapes.icosphere(0.5), box.bounds.mean(axis=0))
    assert lies_within(ball, box) and not lies_within(box, ball)


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 100.0)])
def test_the_gap_between_boxes_is_measured(scale, offset):
    box, other = (Mesh(part.vertices * scale + offset, part.faces) for part in (shapes.box(), beside(1e-3)))
    faces, gap = near_faces(box, other, 2e-3 * scale)
    # coordinates of up to 101 in double precision
    assert gap == pytest.approx(1e-3 * scale, rel=1e-10)
    assert set(np.flatnonzero(box.face_normals[:, 0] > 0.5)) <= set(faces)
    assert near_faces(box, other, 0.9e-3 * scale) == (pytest.approx([]), np.inf)


@pytest.mark.parametrize("seed", range(5))
def test_the_gap_of_two_triangles_is_the_least_distance_of_their_points(seed):
    random = np.random.default_rng(seed)
    first, second = random.random((3, 3)), random.random((3, 3)) + np.array([1.2, 0, 0])
    weight = np.array([(i, j, 60 - i - j) for i in range(61) for j in range(61 - i)]) / 60
    a, b = weight @ first, weight @ second
    nearest = np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2)).min()
    faces = [[0, 1, 2]]
    _, gap = near_faces(Mesh(first, faces), Mesh(second, faces), 10.0)
    # the samples lie on a lattice of a sixtieth of the sides, up to 1.7 long
    assert gap <= nearest <= gap + 0.03


def test_what_passes_through_has_no_gap():
    faces, gap = near_faces(shapes.box(), beside(-0.5), 1e-3)
    assert gap == 0 and len(faces)


def test_boxes_that_share_one_corner_touch_there():
    touching = common_faces(shapes.box(), shapes.moved(shapes.box(), [1, 1, 1]))
    corner = shapes.box().bounds[1]
    at_corner = (shapes.box().vertices[shapes.box().faces] == corner).all(axis=2).any(axis=1)
    assert touching.tolist() == np.flatnonzero(at_corner).tolist()


def test_a_ball_lies_within_a_box_that_is_turned_inside_out():
    box = shapes.box(4.0)
    assert lies_within(shapes.moved(shapes.icosphere(0.5), box.bounds.mean(axis=0)), shapes.inverted(box))


def test_a_tip_that_pokes_through_the_middle_of_a_face_leaves_no_gap():
    face = Mesh(np.array([[-4.0, -4, 0], [4, -4, 0], [0, 4, 0]]), [[0, 1, 2]])
    tip = Mesh(np.array([[-0.1, 0, 1], [0.1, 0, 1], [0, 0, -5e-4]]), [[0, 1, 2]])
    assert near_faces(face, tip, 1e-3) == (pytest.approx([0]), 0.0)
