import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sss_tools.triangle_pairs import apart, fold_over_side, meet, meet_beyond_corner, without_area
from tests.sss_tools.exact_triangles import common_points, exactly, has_area, meet_wrongly

# few places, so that corners on sides, crossing sides and common planes are frequent
COORDINATE = st.integers(-2, 2).map(lambda n: n / 2)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)
FLAT_POINT = st.tuples(COORDINATE, COORDINATE, st.just(0.5))


def column(points):
    return np.array(points, float)[:, :, None]


def triangles(*corners):
    result = [tuple(exactly(corner) for corner in triangle) for triangle in corners]
    assume(all(map(has_area, result)))
    return result


@pytest.mark.parametrize("point", [POINT, FLAT_POINT], ids=["in space", "in a plane"])
def test_triangles_meet_exactly_where_rational_arithmetic_says_so(point):
    @settings(max_examples=150, deadline=None, derandomize=True)
    @given(st.lists(point, min_size=6, max_size=6, unique=True))
    def check(corners):
        first, second = triangles(corners[:3], corners[3:])
        expected = bool(common_points(first, second))
        assert meet(column(corners[:3]), column(corners[3:]))[0] == expected
        # what is called apart is apart; the reverse need not be seen
        assert not (expected and apart(column(corners[:3]), column(corners[3:]))[0])

    check()


@pytest.mark.parametrize("point", [POINT, FLAT_POINT], ids=["in space", "in a plane"])
def test_triangles_at_a_corner_meet_exactly_where_rational_arithmetic_says_so(point):
    @settings(max_examples=150, deadline=None, derandomize=True)
    @given(st.lists(point, min_size=5, max_size=5, unique=True))
    def check(corners):
        v, a, b, c, d = corners
        expected = meet_wrongly(*triangles((v, a, b), (v, c, d)))
        v, a, b, c, d = (np.array([x], float).T for x in corners)
        assert meet_beyond_corner(v, np.stack([a, b]), np.stack([c, d]))[0] == expected

    check()


@pytest.mark.parametrize("point", [POINT, FLAT_POINT], ids=["in space", "in a plane"])
def test_triangles_at_a_side_meet_exactly_where_rational_arithmetic_says_so(point):
    @settings(max_examples=150, deadline=None, derandomize=True)
    @given(st.lists(point, min_size=4, max_size=4, unique=True))
    def check(corners):
        u, v, a, b = corners
        expected = meet_wrongly(*triangles((u, v, a), (u, v, b)))
        assert fold_over_side(*(np.array([x], float).T for x in (u, v, a, b)))[0] == expected

    check()


def test_a_gap_of_one_unit_in_the_last_place_is_a_gap():
    floor = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    for height, expected in ((0.0, True), (5e-324, False), (-5e-324, True)):
        tip = [(0.25, 0.25, height), (0.25, 0.5, 1), (0.5, 0.25, 1)]
        assert meet(column(floor), column(tip))[0] == expected


def test_corners_on_a_line_have_no_area_even_off_the_grid():
    third = np.array([1.0, 3.0, 7.0]) / 8
    assert without_area(column([0 * third, third, 2 * third]))[0]
    assert not without_area(column([0 * third, third, 2 * third + [0, 0, 1e-15]]))[0]
