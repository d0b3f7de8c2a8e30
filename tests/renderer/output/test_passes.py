"""Ranges of passes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.output import passes


def as_set(ranges) -> set[int]:
    return {index for start, stop in ranges for index in range(start, stop)}


def as_ranges(indices) -> passes.Ranges:
    ranges: passes.Ranges = ()
    for index in indices:
        ranges = passes.united(ranges, ((index, index + 1),))
    return ranges


@given(st.sets(st.integers(0, 30)), st.sets(st.integers(0, 30)))
def test_union_of_disjoint_ranges_holds_the_passes_of_both_once(first, second):
    both = passes.united(as_ranges(first - second), as_ranges(second))
    assert as_set(both) == first | second
    assert passes.count(both) == len(first | second)
    assert passes.checked(both) == both


@given(st.sets(st.integers(0, 30)), st.integers(0, 30), st.integers(0, 30))
def test_missing_passes_are_those_not_done(done, start, stop):
    missing = passes.missing(as_ranges(done), start, stop)
    assert as_set(missing) == set(range(start, stop)) - done
    assert passes.checked(missing) == missing


def test_adjacent_ranges_are_joined():
    assert passes.united(((0, 4), (8, 9)), ((4, 8),)) == ((0, 9),)


@pytest.mark.parametrize("other", [(3, 5), (0, 1), (0, 4), (1, 2), (-1, 9)])
def test_passes_in_common_are_refused(other):
    with pytest.raises(ValueError, match="twice"):
        passes.united(((0, 4),), (other,))


@pytest.mark.parametrize(
    "ranges", [[(3, 3)], [(4, 2)], [(-1, 2)], [(5, 6), (0, 1)], [(0, 2), (1, 3)], [(0, 1), (1, 2)]]
)
def test_what_are_no_ranges_is_refused(ranges):
    with pytest.raises(ValueError):
        passes.checked(ranges)
