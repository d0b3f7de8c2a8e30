import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.closedness import assess
from sss_tools.mesh import Mesh


def roles(mesh):
    return [part.role for part in assess(mesh).components]


def shuffled(mesh, seed):
    """The faces of each of two equal halves in another order."""
    random, half = np.random.default_rng(seed), len(mesh.faces) // 2
    order = np.concatenate([random.permutation(half), half + random.permutation(half)])
    return Mesh(mesh.vertices, mesh.faces[order])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("offset", [0.2, 0.5])
def test_the_order_of_faces_does_not_decide_what_overlapping_balls_are(offset, seed):
    """40 % of each ball lie in the other at the least offset: five faces by chance would often find three of them."""
    balls = shapes.joined(shapes.icosphere(), shapes.moved(shapes.icosphere(), [offset, 0.05, 0.1]))
    assert roles(shuffled(balls, seed)) == ["solid", "solid"]


def test_most_of_the_area_decides_where_a_part_reaches_out():
    ball = shapes.icosphere()
    assert roles(shapes.joined(ball, shapes.moved(shapes.icosphere(0.5), [0.6, 0.05, 0.1]))) == ["solid", "internal"]
    assert roles(shapes.joined(ball, shapes.moved(shapes.icosphere(0.5), [1.2, 0.05, 0.1]))) == ["solid", "solid"]
    breaking_out = shapes.joined(ball, shapes.inverted(shapes.moved(shapes.icosphere(0.5), [0.6, 0.05, 0.1])))
    assert roles(breaking_out) == ["solid", "cavity"]


def test_a_box_that_touches_the_wall_it_is_in_is_internal():
    inner = shapes.moved(shapes.box(1.0), [0.5, 0.1, 0.2])
    assert roles(shapes.joined(shapes.box(2.0), inner)) == ["solid", "internal"]
    assert roles(shapes.joined(shapes.box(2.0), shapes.inverted(inner))) == ["solid", "cavity"]
