import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sss_tools.predicates import orient_2d, orient_3d
from tests.sss_tools.exact_triangles import exactly, orientation

# near a plane everything cancels: small integers, and neighbours of them in double precision
NEARLY = st.builds(lambda n, ulps: n * (1 + ulps * 2.0**-52) / 16, st.integers(-6, 6), st.integers(-3, 3))
POINT = st.tuples(NEARLY, NEARLY, NEARLY)


def columns(*points):
    return (np.array([point]).T for point in points)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(POINT, POINT, POINT, POINT)
def test_orientation_in_space_is_that_of_rational_arithmetic(a, b, c, d):
    assert orient_3d(*columns(a, b, c, d))[0] == orientation(*map(exactly, (a, b, c, d)))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(POINT, POINT, POINT)
def test_orientation_in_the_plane_is_that_of_rational_arithmetic(a, b, c):
    (ax, ay, _), (bx, by, _), (cx, cy, _) = map(exactly, (a, b, c))
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    assert orient_2d(*columns(a[:2], b[:2], c[:2]))[0] == (turn > 0) - (turn < 0)


@pytest.mark.parametrize("tiny", [1e-30, 1e-100, 1e-300, 5e-324])
def test_numbers_far_below_rounding_still_decide(tiny):
    on_the_plane = [(0, 0, 0), (1, 0, 1), (0.3, 1, 0.3), (0.7, 0.1, 0.7)]
    assert orient_3d(*columns(*on_the_plane))[0] == 0
    off = [(0, 0, -tiny), *on_the_plane[1:]]
    assert orient_3d(*columns(*off))[0] == orientation(*map(exactly, off)) != 0


def test_many_points_at_once_keep_their_order():
    random = np.random.default_rng(5)
    a, b, c, d = random.integers(-2, 3, (4, 3, 500)).astype(float)
    expected = [orientation(*map(exactly, quad)) for quad in zip(a.T, b.T, c.T, d.T, strict=True)]
    assert orient_3d(a, b, c, d).tolist() == expected
    assert 0 in expected and 1 in expected and -1 in expected
