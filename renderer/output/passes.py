"""Which passes are done: sorted, disjoint, half-open ranges."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable

Ranges = tuple[tuple[int, int], ...]


def count(ranges: Ranges) -> int:
    """How many passes the ranges hold."""
    return sum(stop - start for start, stop in ranges)


def united(first: Ranges, second: Ranges) -> Ranges:
    """The passes of both, adjacent ranges joined.

    Raises ValueError where the two have a pass in common: its samples would count twice.
    """
    merged: list[tuple[int, int]] = []
    for start, stop in sorted(first + second):
        if merged and start < merged[-1][1]:
            raise ValueError(f"pass {start} is there twice")
        if merged and start == merged[-1][1]:
            merged[-1] = merged[-1][0], stop
        else:
            merged.append((start, stop))
    return tuple(merged)


def missing(done: Ranges, start: int, stop: int) -> Ranges:
    """What is left to do of the passes from ``start`` up to, not including, ``stop``."""
    left = []
    for begin, end in (*done, (stop, stop)):
        if start < min(begin, stop):
            left.append((start, min(begin, stop)))
        start = max(start, end)
    return tuple(left)


def checked(ranges: Iterable[Iterable[int]]) -> Ranges:
    """Ranges as they come from a file. Raises ValueError for what are no sorted, disjoint ranges of passes."""
    result = tuple((int(start), int(stop)) for start, stop in ranges)
    if any(not 0 <= start < stop for start, stop in result) or united(result, ()) != result:
        raise ValueError(f"{reprlib.repr(result)} are no ranges of passes")
    return result
