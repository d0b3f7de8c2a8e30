"""Paths in flight: what is put in comes out, whatever dies in between."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.tracing.paths import OUTSIDE, WHOLE, Paths

COLUMNS = (
    *(
        "origin",
        "direction",
        "throughput",
        "faint",
        "axis",
        "stream",
        "sample",
        "triangle",
        "inside",
        "owner",
    ),
    *("density", "flown", "branch", "surfaces"),
)


def filled(capacity: int, count: int, translucent: int = 2) -> Paths:
    """Paths with something else in every entry."""
    paths = Paths(capacity, translucent)
    number = np.arange(count)
    coordinates = number + 1000.0 * np.arange(3)[:, None]
    paths.emit(coordinates, -coordinates, number.astype(np.uint64) + np.uint64(7), number)
    paths.throughput[:], paths.axis[:], paths.triangle[:] = coordinates / 7, coordinates / 3, 2 * number
    paths.faint[:] = number / 64
    paths.branch[:] = number % 4
    paths.inside[:] = number % 5 + np.arange(max(translucent, 1))[:, None]
    paths.owner[:], paths.surfaces[:] = number % 3 - 1, number % 11
    paths.density[:], paths.flown[:] = number / 5, number / 9
    return paths


def contents(paths: Paths) -> dict:
    return {name: getattr(paths, name).copy() for name in COLUMNS}


def test_new_paths_start_outside_with_all_their_light():
    paths = Paths(8, 2)
    paths.emit(np.ones((3, 1)), np.ones((3, 3)), np.arange(3, dtype=np.uint64), np.arange(3))
    assert (paths.count, paths.free) == (3, 5)
    assert_array_equal(paths.throughput, np.ones((3, 3)))
    assert_array_equal(paths.inside, np.zeros((2, 3)))
    assert_array_equal(paths.owner, [OUTSIDE] * 3)
    assert paths.alive.all()
    assert np.isinf(paths.density).all()
    assert not paths.flown.any()
    assert_array_equal(paths.surfaces, [0, 0, 0])


def by_sample(columns: dict) -> dict:
    """The columns ordered by sample: their order among the paths means nothing."""
    order = np.argsort(columns["sample"])
    return {name: column[..., order] for name, column in columns.items()}


@pytest.mark.parametrize("share", [0.0, 0.1, 0.4, 0.9, 1.0])
def test_burying_keeps_the_living_whole(share):
    paths = filled(50, 40)
    before = contents(paths)
    dead = np.random.default_rng(1).random(40) < share
    paths.alive[dead] = False
    paths.bury()
    assert paths.count == np.count_nonzero(~dead)
    assert paths.alive.all()
    after = by_sample(contents(paths))
    for name in COLUMNS:
        assert_array_equal(after[name], before[name][..., ~dead], err_msg=name)


@pytest.mark.parametrize("index", [[], [0], [39], [0, 1, 2], [37, 38, 39], [3, 20, 38], list(range(40))])
def test_moved_paths_are_in_the_other_place_and_no_longer_in_the_first(index):
    paths, others = filled(50, 40), filled(60, 5)
    before, there = contents(paths), contents(others)
    where = paths.move(np.array(index, np.intp), others)
    assert (where.start, where.stop) == (5, 5 + len(index))
    stays = np.setdiff1d(np.arange(40), index)
    after = by_sample(contents(paths))
    for name in COLUMNS:
        assert_array_equal(after[name], before[name][..., stays], err_msg=name)
        assert_array_equal(getattr(others, name)[..., :5], there[name], err_msg=name)
        assert_array_equal(getattr(others, name)[..., 5:], before[name][..., index], err_msg=name)


def test_appended_copies_leave_the_others_alone_and_may_be_of_the_same_paths():
    paths = filled(50, 20)
    before = contents(paths)
    where = paths.append(paths, np.array([2, 7, 19]))
    for name in COLUMNS:
        assert_array_equal(getattr(paths, name)[..., :20], before[name], err_msg=name)
        assert_array_equal(getattr(paths, name)[..., where], before[name][..., [2, 7, 19]], err_msg=name)


def test_emitting_after_a_burial_leaves_the_others_alone():
    paths = filled(20, 20)
    paths.alive[::2] = False
    paths.bury()
    before = contents(paths)
    paths.emit(np.zeros((3, 5)), np.ones((3, 5)), np.zeros(5, np.uint64), np.arange(5))
    assert paths.count == 15
    for name in COLUMNS:
        assert_array_equal(getattr(paths, name)[..., :10], before[name], err_msg=name)
    # what the dead left behind does not show in the new
    assert_array_equal(paths.inside[:, 10:], np.zeros((2, 5)))
    assert_array_equal(paths.owner[10:], [OUTSIDE] * 5)
    assert_array_equal(paths.branch[10:], [WHOLE] * 5)
    assert paths.alive.all()


def test_more_paths_than_slots_are_refused():
    paths = filled(10, 8)
    with pytest.raises(ValueError, match="3 new paths do not fit into 2 free columns"):
        paths.emit(np.zeros((3, 3)), np.ones((3, 3)), np.zeros(3, np.uint64), np.arange(3))


def test_cleared_paths_are_gone():
    paths = filled(10, 8)
    paths.clear()
    assert (paths.count, paths.free) == (0, 10)
    assert paths.origin.shape == (3, 0)


def test_scenes_without_media_work_too():
    paths = filled(4, 4, translucent=0)
    paths.alive[1] = False
    paths.bury()
    assert paths.count == 3
