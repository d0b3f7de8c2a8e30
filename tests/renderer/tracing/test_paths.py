"""Paths in flight: what is put in comes out, whatever dies in between."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.tracing.paths import OUTSIDE, Paths

COLUMNS = ("origin", "direction", "throughput", "stream", "sample", "inside", "owner", "scattered", "lit", "surfaces")


def filled(capacity: int, count: int, translucent: int = 2) -> Paths:
    """Paths with something else in every entry."""
    paths = Paths(capacity, translucent)
    number = np.arange(count)
    coordinates = number + 1000.0 * np.arange(3)[:, None]
    paths.emit(coordinates, -coordinates, number.astype(np.uint64) + np.uint64(7), number)
    paths.throughput[:] = coordinates / 7
    paths.inside[:] = number % 5 + np.arange(max(translucent, 1))[:, None]
    paths.owner[:], paths.surfaces[:] = number % 3 - 1, number % 11
    paths.scattered[:], paths.lit[:] = number % 2, number % 3 == 0
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
    assert not (paths.scattered | paths.lit).any()
    assert_array_equal(paths.surfaces, [0, 0, 0])


def test_compacting_keeps_the_living_in_their_order():
    paths = filled(50, 40)
    before = contents(paths)
    dead = np.random.default_rng(1).random(40) < 0.4
    paths.alive[dead] = False
    paths.compact()
    assert paths.count == np.count_nonzero(~dead)
    assert paths.alive.all()
    for name in COLUMNS:
        assert_array_equal(getattr(paths, name), before[name][..., ~dead], err_msg=name)


def test_emitting_after_compacting_leaves_the_others_alone():
    paths = filled(20, 20)
    paths.alive[::2] = False
    paths.compact()
    before = contents(paths)
    paths.emit(np.zeros((3, 5)), np.ones((3, 5)), np.zeros(5, np.uint64), np.arange(5))
    assert paths.count == 15
    for name in COLUMNS:
        assert_array_equal(getattr(paths, name)[..., :10], before[name], err_msg=name)
    # what the dead left behind does not show in the new
    assert_array_equal(paths.inside[:, 10:], np.zeros((2, 5)))
    assert_array_equal(paths.owner[10:], [OUTSIDE] * 5)
    assert paths.alive.all()


@pytest.mark.parametrize("alive", [True, False])
def test_all_or_none_may_live(alive):
    paths = filled(10, 10)
    before = contents(paths)
    paths.alive[:] = alive
    paths.compact()
    assert paths.count == (10 if alive else 0)
    if alive:
        for name in COLUMNS:
            assert_array_equal(getattr(paths, name), before[name])


def test_changes_to_the_columns_are_changes_to_the_paths():
    paths = filled(10, 6)
    paths.origin[:, 2] = 5
    paths.alive[0] = False
    paths.compact()
    assert_array_equal(paths.origin[:, 1], [5, 5, 5])


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
    paths.compact()
    assert paths.count == 3
