"""Camera samples under way of one tracer: which column of the radiance is whose."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .strips import NOTHING, Strip

_USUAL, _MOST_STRIPS = 2**20, 2**12
"""Columns, and strips. Half of what streams through a dense body waits here for the longest path of its strip. Lowest
ones are used first: memory that was never touched costs nothing."""


class Emitted(NamedTuple):
    """Camera samples to emit, (n,) int64 each: columns, pixels, numbers of passes."""

    columns: NDArray[np.int64]
    pixels: NDArray[np.int64]
    passes: NDArray[np.int64]


class _Place(NamedTuple):
    """A strip under way, and when it was begun: after how many steps, and by the clock."""

    strip: Strip
    step: int
    time: float


class Columns:
    """Strips of at most ``longest`` samples.

    count          of columns
    radiance       (3, 2 count) float32; the second half is for the branches of paths that split
    first_object   (count,) int16 object that the sample met first
    first_unknown  (count,) bool, whether it has met none yet
    """

    def __init__(self, longest: int):
        self._longest = longest
        self._bits = max(longest - 1, 1).bit_length()
        self.count = min(max(_USUAL >> self._bits, 1), _MOST_STRIPS) << self._bits
        self.radiance = np.empty((3, 2 * self.count), np.float32)
        self.first_object, self.first_unknown = np.empty(self.count, np.int16), np.empty(self.count, bool)
        self._passes = np.zeros(self.count >> self._bits, np.int64)
        self.clear()

    def fit(self, longest: int) -> bool:
        """Whether they were made for strips of this length."""
        return longest == self._longest

    def clear(self) -> None:
        """Forget all strips."""
        self._free = list(range(self.count >> self._bits))
        self._under_way: dict[int, _Place] = {}
        self._emitting: tuple[int, int] | None = None

    @property
    def full(self) -> bool:
        """Whether there is no place for another strip."""
        return not self._free

    @property
    def emitting(self) -> Strip | None:
        """The strip whose samples are next to be emitted."""
        return None if self._emitting is None else self._under_way[self._emitting[0]].strip

    @property
    def passes(self) -> set[int]:
        """Numbers of those under way."""
        return {place.strip.pass_index for place in self._under_way.values()}

    def passes_of(self, column: NDArray[np.int32]) -> NDArray[np.int64]:
        """(n,) number of the pass that each column (n,) belongs to, branches or not."""
        return self._passes[(column & (self.count - 1)) >> self._bits]

    def oldest(self, step: int) -> tuple[int, float]:
        """Steps and seconds since the oldest strip under way was begun, ``step`` being that of now."""
        if not self._under_way:
            return 0, 0.0
        first = next(iter(self._under_way.values()))
        return step - first.step, time.monotonic() - first.time

    def put(self, strip: Strip, step: int) -> None:
        """Make place for a strip, to be emitted."""
        place = heappop(self._free)
        self._under_way[place], self._emitting = _Place(strip, step, time.monotonic()), (place, 0)
        self._passes[place] = strip.pass_index
        mine = self._columns(place)
        self.radiance[:, mine] = 0
        self.radiance[:, mine.start + self.count : mine.stop + self.count] = 0
        self.first_object[mine], self.first_unknown[mine] = NOTHING, True

    def emit(self, room: int) -> Emitted:
        """At most so many samples of the strip that is to be emitted."""
        assert self._emitting is not None
        place, done = self._emitting
        strip = self._under_way[place].strip
        pixels = strip.pixels[done : done + room]
        first = (place << self._bits) + done
        self._emitting = (place, done + room) if done + room < len(strip.pixels) else None
        return Emitted(np.arange(first, first + len(pixels)), pixels, np.full(len(pixels), strip.pass_index))

    def ended(self, alive: Iterable[NDArray[np.int32]]) -> Iterator[tuple[Strip, NDArray, NDArray]]:
        """Take out the strips to which none of the columns ``alive`` belongs: with their samples' radiance (3, n) and
        first objects (n,)."""
        lives = np.zeros(self.count >> self._bits, bool)
        for columns in alive:
            lives[(columns & (self.count - 1)) >> self._bits] = True
        if self._emitting is not None:
            lives[self._emitting[0]] = True
        for place in [place for place in self._under_way if not lives[place]]:
            mine = self._columns(place)
            branches = slice(mine.start + self.count, mine.stop + self.count)
            strip = self._under_way.pop(place).strip
            heappush(self._free, place)
            yield strip, self.radiance[:, mine] + self.radiance[:, branches], self.first_object[mine].copy()

    def _columns(self, place: int) -> slice:
        first = place << self._bits
        return slice(first, first + len(self._under_way[place].strip.pixels))
