import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.enclosure import PLACES, SHARE, enclosed_side
from sss_tools.mesh import Mesh


def part_of_ball(half_angle):
    """What is left of a ball without all within an angle of its pole, degrees."""
    ball = shapes.icosphere(1.0, 4)
    height = ball.vertices[ball.faces].mean(axis=1)[:, 2]
    return Mesh(ball.vertices, ball.faces[height < np.cos(np.radians(half_angle))])


def folded_sheet(angle, count=20):
    """A square sheet with a sharp fold in the middle, degrees between its halves."""
    x, y = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-1, 1, count)] * 2, indexing="ij"))
    half = np.radians(angle / 2)
    corner = np.arange(count * count).reshape(count, count)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    vertices = np.stack([x * np.sin(half), y, np.abs(x) * np.cos(half)], axis=1)
    return Mesh(vertices, quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))


def side(mesh):
    return enclosed_side(mesh.vertices, mesh.faces)


def test_a_bowl_encloses_what_is_near_its_bottom():
    bowl = part_of_ball(90)
    assert side(bowl) == 1
    assert side(shapes.inverted(bowl)) == -1


def test_a_saucer_a_sheet_and_a_blunt_fold_enclose_nothing():
    for mesh in (part_of_ball(125), folded_sheet(180), folded_sheet(100)):
        assert side(mesh) == 0


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_frame_and_order_do_not_decide(scale):
    random = np.random.default_rng(3)
    for mesh, expected in ((part_of_ball(105), 1), (part_of_ball(130), 0)):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        vertices = mesh.vertices @ turn.T * scale + 100 * scale
        assert enclosed_side(vertices, random.permutation(mesh.faces)) == expected


def test_a_dent_of_a_sheet_smaller_than_the_share_is_no_body():
    """A dent like a bowl, on 1 % of the area: it winds up to 0.85, but hardly anything is in it."""
    sheet = folded_sheet(180, 120)
    x, y, z = sheet.vertices.T
    room = 0.1**2 - x * x - y * y
    dented = Mesh(np.stack([x, y, z - np.sqrt(np.maximum(room, 0))], axis=1), sheet.faces)
    assert 0.1**2 * np.pi / 4 < SHARE < 1 / 10 and len(sheet.faces) > PLACES
    assert side(dented) == 0


def test_faces_without_area_enclose_nothing():
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    assert enclosed_side(line, np.array([[0, 1, 2], [1, 2, 3], [0, 1, 3]])) == 0


def test_vertices_that_no_face_uses_may_be_anything():
    bowl = part_of_ball(90)
    vertices = np.concatenate([bowl.vertices, [[np.nan, np.inf, 1e300]]])
    assert enclosed_side(vertices, bowl.faces) == 1
