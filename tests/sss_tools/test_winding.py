import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.winding import deepest_points, spread_by_area, winding_numbers


def winding(mesh, points):
    return winding_numbers(points, mesh.vertices, mesh.faces)


def test_winding_is_one_inside_and_zero_outside_a_closed_solid():
    # float64 sums of a thousand solid angles: a few hundred ulps
    assert winding(shapes.torus(), [[1, 0, 0], [0, 0, 0], [0, -1, 0.1], [5, 5, 5]]) == pytest.approx(
        [1, 0, 1, 0], abs=1e-12
    )


def test_winding_changes_sign_with_the_orientation():
    assert winding(shapes.inverted(shapes.box()), [[0, 0, 0]]) == pytest.approx([-1], abs=1e-12)


def test_winding_of_a_box_without_one_side_is_five_sixths_in_the_middle():
    box = shapes.box(2.0)
    open_box = shapes.punctured(box, [[1, -1 / 3, 1 / 3], [1, 1 / 3, -1 / 3], [1, 1 / 3, 1 / 3]], 0.4)
    removed = len(box.faces) - len(open_box.faces)
    assert removed == 2
    assert winding(open_box, [box.bounds.mean(axis=0)]) == pytest.approx([5 / 6], abs=1e-12)


def test_winding_counts_nested_solids():
    balls = shapes.joined(shapes.icosphere(1.0), shapes.icosphere(0.5))
    assert winding(balls, [[0, 0, 0], [0.75, 0, 0]]) == pytest.approx([2, 1], abs=1e-12)


def test_winding_far_from_the_origin_is_as_exact_as_near_it():
    # the offset leaves 1e-16 * 1e6 = 1e-10 of the positions
    offset = np.array([1e6, -1e6, 1e6])
    far = shapes.moved(shapes.icosphere(), offset)
    assert winding(far, [offset, offset + 2]) == pytest.approx([1, 0], abs=1e-8)


def test_blocks_do_not_change_the_sum(monkeypatch):
    from sss_tools import winding as module

    ball, points = shapes.icosphere(), np.random.default_rng(3).normal(size=(7, 3))
    whole = winding(ball, points)
    monkeypatch.setattr(module, "PAIRS_AT_ONCE", 100)
    # only the order of additions differs
    np.testing.assert_allclose(winding(ball, points), whole, atol=1e-12)


def test_winding_of_no_points_and_no_faces_is_empty_and_zero():
    box = shapes.box()
    assert winding(box, np.zeros((0, 3))).shape == (0,)
    assert winding_numbers([[0, 0, 0]], box.vertices, box.faces[:0]).tolist() == [0]


def test_deepest_points_of_a_ball_lie_near_its_centre():
    ball = shapes.moved(shapes.icosphere(2.0), [100, 0, 0])
    points = deepest_points(ball.vertices, ball.faces)
    assert len(points) == 12
    # the facets' normals miss the centre by less than a facet
    assert (np.linalg.norm(points - [100, 0, 0], axis=1) < 0.3).all()


def test_deepest_points_of_a_plate_lie_between_its_sides():
    plate = shapes.slab(1.0, 0.1)
    points = deepest_points(plate.vertices, plate.faces)
    middle = plate.bounds.mean(axis=0)
    assert len(points) and (np.abs(points - middle)[:, 2] < 0.02).all()


def test_a_flat_sheet_has_no_deep_points():
    sheet = shapes.box()
    assert deepest_points(sheet.vertices, sheet.faces[:2]).shape == (0, 3)


def test_faces_spread_by_area_prefer_large_ones_and_are_never_more_than_asked():
    areas = np.array([1e-6] * 50 + [1.0] * 10)
    assert (spread_by_area(areas, 10) >= 50).all()
    assert len(spread_by_area(areas, 7)) <= 7
    assert spread_by_area(np.zeros(5), 3).tolist() == [0, 1, 2]
