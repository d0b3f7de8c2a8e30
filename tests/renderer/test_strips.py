"""Which samples are traced next, and how strips become passes again."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer import strips
from renderer.columns import Columns
from renderer.strips import NOTHING, Assembly, Strip, Strips, TracedStrip


def taken(of: Strips) -> list[Strip]:
    found = []
    while (strip := of.take()) is not None:
        found.append(strip)
    return found


def painted(strip: Strip) -> TracedStrip:
    """Each sample is as bright as its pixel and pass say."""
    value = (1000 * strip.pass_index + strip.pixels).astype(np.float32)
    return TracedStrip(strip, np.stack([value] * 3), strip.pixels.astype(np.int16))


def test_passes_are_cut_into_strips_in_order():
    pixels = np.array([1, 2, 5, 8, 9])
    found = taken(Strips([7, 3], pixels, 1, 2))
    assert [(each.turn, each.pass_index, each.first) for each in found] == [
        (0, 7, 0), (0, 7, 2), (0, 7, 4), (1, 3, 0), (1, 3, 2), (1, 3, 4)]  # fmt: skip
    assert_array_equal(np.concatenate([each.pixels for each in found[:3]]), pixels)


def test_passes_come_whole_and_in_order_whichever_strip_ends_first():
    found = taken(Strips([4, 2, 9], np.arange(50), 1, 8))
    for seed in range(5):
        assembly, done = Assembly(50), []
        for k in np.random.default_rng(seed).permutation(len(found)):
            done += assembly.add(painted(found[k]))
        assert [index for index, _, _ in done] == [4, 2, 9]
        for index, radiance, first_object in done:
            assert_array_equal(radiance[:, 2], 1000 * index + np.arange(50))
            assert_array_equal(first_object, np.arange(50))


def test_whole_passes_after_one_that_is_not_are_the_rest():
    found = taken(Strips([4, 2, 9, 6], np.arange(20), 1, 10))
    assembly = Assembly(20)
    done = [index for k in (0, 2, 3, 4, 6, 7) for index, _, _ in assembly.add(painted(found[k]))]
    assert done == []
    assert [index for index, _, _ in assembly.rest()] == [2, 6]
    assert [index for index, _, _ in assembly.add(painted(found[1]))] == [4]


def test_a_pass_without_pixels_is_a_pass():
    (strip,) = taken(Strips([3], np.arange(0), 2, 8))
    ((index, radiance, _),) = Assembly(0).add(painted(strip))
    assert index == 3 and radiance.shape == (0, 3)


def test_no_more_is_begun_than_can_be_kept(monkeypatch):
    monkeypatch.setattr(strips, "_MOST_UNDER_WAY", 1000)
    of = Strips(range(100), np.arange(300), 1, 100)
    assert len(taken(of)) == 9 and not of.over
    of.note_added()
    assert len(taken(of)) == 3
    # but two passes, however large
    assert len(taken(Strips(range(9), np.arange(5000), 1, 5000))) == 2


def test_the_end_is_told_from_a_stop():
    of = Strips(range(2), np.arange(5), 1, 5)
    taken(of)
    assert of.over and of.exhausted
    of = Strips(range(2), np.arange(5), 1, 5)
    of.stop()
    assert of.take() is None and of.over and not of.exhausted


class Clock:
    """Tells the time that it is given."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr(strips.time, "monotonic", lambda: self.now)


@pytest.mark.parametrize("pixels", [10, 1000])
def test_passes_are_begun_as_long_as_they_will_end_in_time(monkeypatch, pixels):
    """A tracer of a thousand samples a second, each half a second under way, has ended all when the time is over, and
    has not waited for it long."""
    clock = Clock(monkeypatch)
    end = clock.now + 10
    of = Strips(range(10**6), np.arange(pixels), 1, pixels, lambda: end - clock.now)
    busy = clock.now
    in_flight: list[tuple[float, int]] = []
    while not of.over:
        while busy < clock.now + 0.5 and (strip := of.take()) is not None:
            busy = max(busy, clock.now) + len(strip.pixels) / 1000
            in_flight.append((busy + 0.5, len(strip.pixels)))
        clock.now += 0.01
        of.note(sum(count for ends, count in in_flight if ends <= clock.now), 10)
        in_flight = [(ends, count) for ends, count in in_flight if ends > clock.now]
    last = max(ends for ends, _ in in_flight)
    assert end - 3 < last <= end


def test_a_long_path_makes_the_end_come_sooner(monkeypatch):
    clock = Clock(monkeypatch)
    for steps, goes_on in ((100, True), (10_000, False)):
        of = Strips(range(100), np.arange(100), 1, 100, lambda: 5.0)
        of.take()
        clock.now += 1
        of.note(100, steps)
        assert (of.take() is not None) is goes_on


def test_the_first_pass_is_begun_however_little_time_there_is():
    of = Strips(range(100), np.arange(100), 1, 100, lambda: -1.0)
    assert len(taken(of)) == 1


def test_few_paths_are_in_flight_at_first_and_where_one_takes_long(monkeypatch):
    clock = Clock(monkeypatch)
    of = Strips(range(100), np.arange(100), 2, 100)
    most = 10**5
    assert of.room(most, 0, 0) == of.room(most, 1000, 0) == strips._FIRST_ROOM // 2
    assert of.room(most, 10**4, 0.2) == 10**4 and of.room(most, 10**6, 0.2) == most
    assert of.room(most, 10**6, 4) == strips._FIRST_ROOM // 2
    clock.now += 4
    assert strips._FIRST_ROOM // 2 < of.room(most, 10**6, 4) < most / 5
    clock.now += 4
    assert of.room(most, 10**6, 4) == most
    # a whole pass, where there is room for it
    of = Strips(range(100), np.arange(10**5), 2, 100)
    assert of.room(most, 0, 0) == 50_000 and of.room(10**4, 0, 0) == 10**4


def put(columns: Columns, number: int, pixels: int, step: int = 0) -> Strip:
    strip = Strip(number, number, 0, np.arange(pixels) + 100)
    columns.put(strip, step)
    return strip


def test_columns_are_given_out_piece_by_piece_and_come_back_when_their_paths_have_ended():
    columns = Columns(10)
    one = put(columns, 0, 10)
    parts = [columns.emit(4), columns.emit(100)]
    assert columns.emitting is None
    assert_array_equal(np.concatenate([part.pixels for part in parts]), one.pixels)
    other = put(columns, 1, 7)
    emitted = columns.emit(7)
    assert not set(emitted.columns) & set(np.concatenate([part.columns for part in parts]))
    columns.radiance[:, emitted.columns] += 1
    columns.radiance[:, emitted.columns + columns.count] += 2
    columns.first_object[emitted.columns[3]] = 5
    # a branch of the first strip is still alive
    branch = np.array([parts[1].columns[0] + columns.count], np.int32)
    ((ended, radiance, first_object),) = columns.ended([branch])
    assert ended is other
    assert_array_equal(radiance, np.full((3, 7), 3))
    assert_array_equal(first_object, [NOTHING] * 3 + [5] + [NOTHING] * 3)
    # the place is blank again for the next
    put(columns, 2, 10)
    again = columns.emit(10)
    assert set(emitted.columns) <= set(again.columns)
    found = {strip.turn: radiance for strip, radiance, _ in columns.ended([])}
    assert sorted(found) == [0, 2] and not found[0].any() and not found[2].any()


def test_a_strip_that_is_being_emitted_has_not_ended():
    columns = Columns(10)
    put(columns, 0, 10)
    columns.emit(4)
    assert list(columns.ended([])) == []


def test_columns_are_full_some_time_and_know_the_oldest():
    columns = Columns(2**18)
    for number in range(4):
        assert not columns.full
        put(columns, number, 2**18, step=10 * number)
        columns.emit(2**18)
    assert columns.full and columns.passes == set(range(4))
    assert columns.oldest(100)[0] == 100
    list(columns.ended([np.array([3 * 2**18])]))
    assert columns.oldest(100)[0] == 70 and not columns.full
