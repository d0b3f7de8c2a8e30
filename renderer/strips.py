"""Which camera samples are traced next: passes, cut into strips of pixels, stream through the tracers.

Tracers take strips as they have room and give them back in whatever order they end; ``Assembly`` puts them together to
passes, in the order in which those were begun. So no tracer waits for the last long paths of a strip while there is
more to do.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .tracing.tally import Tally

Float32 = NDArray[np.float32]

NOTHING = np.int16(-1)
"""In place of an object."""
_FIRST_ROOM = 2**13
"""Paths in flight, over all tracers, at the start of pictures with fewer pixels; later as many as have ended, so that
the first passes come soon."""
_LONG = 1.5
"""Times that paths in flight have still to go as far as the mean path, to be on the safe side."""
_LONGEST, _STEP_SECONDS = 2.0, 5e-4
"""Times that the longest path to come is longer than all before, and what a step takes when few paths are left."""
_PATIENCE, _PATIENT_SHARE = 0.25, 0.5
"""Seconds, and share of the run so far, that the oldest path may take before fewer keep it company."""
_MOST_UNDER_WAY = 2**22
"""Camera samples begun and not yet in the film, at most: 14 bytes each."""


@dataclass(frozen=True)
class Strip:
    """Some pixels of a pass.

    turn        of the pass, among those of a run
    pass_index  its number
    first       place of the first pixel among those that take part in the pass
    pixels      (n,) int64, counted along the rows of the picture
    """

    turn: int
    pass_index: int
    first: int
    pixels: NDArray[np.int64]


@dataclass
class TracedStrip:
    """A strip with what its camera samples found.

    radiance      (3, n) float32
    first_object  (n,) int16 object that the sample met first, or ``NOTHING``
    tally         what its tracer counted since the last one
    """

    strip: Strip
    radiance: Float32
    first_object: NDArray[np.int16]
    tally: Tally = field(default_factory=Tally)


class Strips:
    """Gives out the strips of ``passes``, one after the other; shared by all tracers of a run.

    passes        their numbers, in the order in which they are to be begun
    pixels        (n,) int64 that take part
    tracers       that share the work
    longest       pixels of a strip, at most
    seconds_left  how long the caller wants to go on: none is begun that would hardly end in time; None: for ever
    """

    def __init__(
        self,
        passes: Iterable[int],
        pixels: NDArray[np.int64],
        tracers: int,
        longest: int,
        seconds_left: Callable[[], float] | None = None,
    ):
        self.longest = min(longest, max(len(pixels), 1))
        self._passes, self._pixels, self._tracers, self._seconds_left = iter(passes), pixels, tracers, seconds_left
        self._turn, self._pass_index, self._first = -1, 0, len(pixels)
        self._ended = self._most_steps = self._added = 0
        self._started = time.monotonic()
        self._changed = threading.Condition()
        self.stopped = self.over = self.exhausted = False

    def room(self, most: int, ended: int, age: float) -> int:
        """Paths that a tracer should have in flight, who has room for ``most``.

        ended  of its own
        age    seconds since the oldest that is in flight was emitted
        """
        least = max(_FIRST_ROOM, len(self._pixels)) // self._tracers
        patience = max(_PATIENCE, _PATIENT_SHARE * (time.monotonic() - self._started))
        return min(max(least, int(min(ended, most) * (patience / max(age, patience)) ** 3)), most)

    def note(self, ended: int, steps: int) -> None:
        """So many more paths have ended, and some have gone so many steps."""
        with self._changed:
            self._ended += ended
            self._most_steps = max(self._most_steps, steps)

    def take(self) -> Strip | None:
        """The next; None where there is none now, or, where it is ``over``, none any more."""
        with self._changed:
            if self._first >= len(self._pixels) and not self._begin():
                return None
            first = self._first
            self._first += self.longest
            return Strip(self._turn, self._pass_index, first, self._pixels[first : self._first])

    def _begin(self) -> bool:
        """Begin the next pass, if there is one and it is time."""
        if self.over:
            return False
        pixels = len(self._pixels)
        begun = (self._turn + 1) * pixels
        if begun - self._added + pixels > max(_MOST_UNDER_WAY, 2 * pixels):
            return False
        if self._seconds_left is not None and begun and self._seconds_to_end(begun) > self._seconds_left():
            self.over = True
            return False
        index = next(self._passes, None)
        if index is None:
            self.over = self.exhausted = True
            return False
        self._turn, self._pass_index, self._first = self._turn + 1, index, 0
        return True

    def _seconds_to_end(self, begun: int) -> float:
        """What another pass, and all that is in flight, will hardly exceed."""
        in_flight = begun - self._ended
        # those in flight are half done, in the mean
        rate = max(begun - in_flight / 2, 1) / max(time.monotonic() - self._started, 1e-6)
        return (len(self._pixels) + _LONG * in_flight) / rate + _LONGEST * self._most_steps * _STEP_SECONDS

    def note_added(self) -> None:
        """A pass is in the film."""
        with self._changed:
            self._added += len(self._pixels)
            self._changed.notify_all()

    def wait(self) -> None:
        """Until passes are added, or some milliseconds."""
        with self._changed:
            self._changed.wait(0.005)

    def stop(self) -> None:
        """No more is wanted, neither what is under way."""
        with self._changed:
            self.stopped = self.over = True
            self._changed.notify_all()


class WholePass(NamedTuple):
    """Number of a pass, (n, 3) float32 radiance of its samples, (n,) int16 objects that they met first."""

    number: int
    radiance: Float32
    first_object: NDArray[np.int16]


class Assembly:
    """Passes of ``pixels`` pixels under way."""

    def __init__(self, pixels: int):
        self._pixels, self._next = pixels, 0
        self._passes: dict[int, list[TracedStrip]] = {}
        self._missing: dict[int, int] = {}

    def add(self, traced: TracedStrip) -> Iterator[WholePass]:
        """Passes that are now whole, as are all before them."""
        turn = traced.strip.turn
        self._passes.setdefault(turn, []).append(traced)
        self._missing[turn] = self._missing.get(turn, self._pixels) - len(traced.strip.pixels)
        while self._missing.get(self._next) == 0:
            yield self._whole(self._next)
            self._next += 1

    @property
    def any_whole(self) -> bool:
        """Whether there are passes that wait only for others."""
        return 0 in self._missing.values()

    def rest(self) -> Iterator[WholePass]:
        """As ``add``, the other whole passes, although some before them are not."""
        for turn in sorted(turn for turn, missing in self._missing.items() if missing == 0):
            yield self._whole(turn)

    def _whole(self, turn: int) -> WholePass:
        del self._missing[turn]
        parts = sorted(self._passes.pop(turn), key=lambda part: part.strip.first)
        radiance = np.concatenate([part.radiance.T for part in parts])
        return WholePass(parts[0].strip.pass_index, radiance, np.concatenate([part.first_object for part in parts]))


class Tracer(Protocol):
    """What traces strips."""

    def trace(self, strips: Strips) -> Iterator[TracedStrip]:
        """Until there are no more, or they are stopped."""


def traced_passes(
    tracer: Tracer, passes: range, pixels: NDArray[np.int64], longest: int
) -> tuple[list[WholePass], Tally]:
    """Whole passes by one tracer alone, in strips of at most ``longest`` pixels, and what it counted."""
    assembly, tally = Assembly(len(pixels)), Tally()
    done: list[WholePass] = []
    for strip in tracer.trace(Strips(passes, pixels, 1, longest)):
        tally.add(strip.tally)
        done += assembly.add(strip)
    return done, tally
