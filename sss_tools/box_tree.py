"""Which boxes overlap? All pairs among many boxes, through a binary tree laid out in arrays.

The boxes are put in an order that keeps neighbours together; node k of a level holds nodes 2k and 2k + 1 of the
next. All pairs of overlapping nodes of one level are found from those of the level above: cost n log n for
surfaces, whose boxes overlap a bounded number of others.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int32]
Result = TypeVar("Result")

BLOCK = 1 << 14
"""Pairs looked at together: their temporaries stay in the second-level cache."""

_ALL_TRUE = np.ones(8, bool).view(np.uint64)[0]

ODD_SIZE = 8.0
"""Boxes this many times larger than the median stand apart in the tree, lest they blow up the nodes of small ones."""


class BoxTree:
    """Boxes ready for queries.

    order   (n,) int64 the box at each place of the tree's lowest level
    """

    def __init__(self, lower, upper, group: NDArray[np.int64] | None = None):
        """Take boxes from ``lower`` (n, 3) to ``upper`` (n, 3), finite.

        group  (n,) pairs within a group are of no interest, but for group -1; None for no groups
        They are kept in single precision: rounding never turns an overlap into a gap, as it is monotone.
        """
        self.order = _places(lower, upper, group)
        count = len(self.order)
        depth = max(int(count - 1).bit_length(), 0)
        # a box a row of 32 bytes, which numpy gathers fastest: lower corner, negated upper corner, two zeros.
        # Negated, so that one minimum serves both
        level = np.full((1 << depth, 8), np.inf, np.float32)
        level[:count, :3] = lower.take(self.order, axis=0)
        level[:count, 3:6] = -upper.take(self.order, axis=0)
        level[:, 6:] = 0
        self._levels = [level]
        while len(level) > 1:
            level = np.minimum(level[0::2], level[1::2])
            self._levels.append(level)
        self._levels.reverse()
        # the other way round: what the rows of a box that overlaps do not exceed. numpy would copy all of an array
        # that is not contiguous each time it takes a few rows
        self._limits = [-np.ascontiguousarray(level[:, [3, 4, 5, 0, 1, 2, 6, 7]]) for level in self._levels]
        self._groups = None if group is None else _pure_groups(group[self.order], depth)

    def for_each_block(self, visit: Callable[[Indices, Indices], Result]) -> list[Result]:
        """Call ``visit`` with the pairs of overlapping boxes, some thousands at a time, each pair once.

        It gets two arrays of places in ``order``. Blocks go to threads; the results come in a fixed order.
        """
        last = len(self._levels) - 1
        blocks: list[tuple[int, Indices, Indices]] = []
        first, second = np.zeros(0, np.int32), np.zeros(0, np.int32)
        for level in range(1, last + 1):
            left = np.arange(0, len(self._levels[level]), 2, dtype=np.int32)
            first, second = np.concatenate([first, left]), np.concatenate([second, left + 1])
            first, second = self._overlapping(level, first, second)
            if level == last or len(first) > 4 * BLOCK:
                blocks += [(level, *pair) for pair in _split(first, second)]
                first, second = first[:0], second[:0]
            else:
                first, second = _children(first, second)

        def descend(block):
            found = []
            stack = [block]
            while stack:
                level, a, b = stack.pop()
                if level == last:
                    found.append((a, b))
                    continue
                for pair in _split(*_children(a, b)):
                    a, b = self._overlapping(level + 1, *pair)
                    if len(a):
                        stack.append((level + 1, a, b))
            pairs = [np.concatenate(side) for side in zip(*found, strict=True)] if found else [first, second]
            return visit(*pairs)

        workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        with ThreadPoolExecutor(min(workers, 8)) as pool:
            return list(pool.map(descend, blocks))

    def _overlapping(self, level: int, a: Indices, b: Indices) -> tuple[Indices, Indices]:
        """Those of the pairs of nodes whose boxes overlap."""
        a, b = self._of_interest(level, a, b)
        within = self._levels[level].take(a, axis=0) <= self._limits[level].take(b, axis=0)
        # eight truths at once
        hit = np.flatnonzero(within.view(np.uint64)[:, 0] == _ALL_TRUE)
        return a.take(hit), b.take(hit)

    def _of_interest(self, level: int, a: Indices, b: Indices) -> tuple[Indices, Indices]:
        """Those of the pairs of nodes that do not belong to one group."""
        if self._groups is None:
            return a, b
        group = self._groups[level].take(a)
        keep = np.flatnonzero((group < 0) | (group != self._groups[level].take(b)))
        return a.take(keep), b.take(keep)


def _children(a: Indices, b: Indices) -> tuple[Indices, Indices]:
    """The four pairs of children of each pair of nodes."""
    left, right = 2 * a, 2 * b
    return np.concatenate([left, left, left + 1, left + 1]), np.concatenate([right, right + 1, right, right + 1])


def _split(a: Indices, b: Indices) -> list[tuple[Indices, Indices]]:
    """Pairs in blocks."""
    return [(a[start : start + BLOCK], b[start : start + BLOCK]) for start in range(0, len(a), BLOCK)]


def _pure_groups(group: NDArray[np.int64], depth: int) -> list[Indices]:
    """For each level the group of all boxes below each node, -1 where they are of several or of none."""
    level = np.full(1 << depth, -1, np.int32)
    level[: len(group)] = group
    level[len(group) :] = group[-1] if len(group) else -1
    levels = [level]
    while len(level) > 1:
        level = np.where(level[0::2] == level[1::2], level[0::2], np.int32(-1))
        levels.append(level)
    return levels[::-1]


def _places(lower, upper, group) -> NDArray[np.int64]:
    """(n,) boxes by group, then by size class, then along a Z-shaped curve through their middles.

    Morton 1966; as the order of a tree: Lauterbach et al. 2009, Comput. Graph. Forum 28:375.
    """
    if len(lower) == 0:
        return np.zeros(0, np.int64)
    key = morton_keys(np.ascontiguousarray((lower.T + upper.T) / 2), 14)
    extent = upper.T - lower.T
    size = np.maximum(np.maximum(extent[0], extent[1]), extent[2])
    median = float(np.median(size))
    if median > 0 and size.max() > ODD_SIZE * median:
        odd = np.clip(np.ceil(np.log2(np.maximum(size / (ODD_SIZE * median), 1)) / 2), 0, 7)
        key |= odd.astype(np.uint64) << np.uint64(42)
    if group is not None:
        key |= (group + 1).astype(np.uint64) << np.uint64(45)
    return np.argsort(key)


def morton_keys(points, bits: int) -> NDArray[np.uint64]:
    """(n,) numbers of the cells along a Z-shaped curve, 2**bits cells a side, that hold points (3, n)."""
    least = points.min(axis=1, keepdims=True)
    extent = float((points.max(axis=1, keepdims=True) - least).max())
    keys = np.zeros(points.shape[1], np.uint64)
    # a number below the least normal one has no reciprocal
    if extent < np.finfo(float).tiny * 2**bits or bits == 0:
        return keys
    cells = ((points - least) * ((2**bits - 0.5) / extent)).astype(np.uint64)
    for axis in range(3):
        keys |= _spread_bits(cells[axis]) << np.uint64(axis)
    return keys


def _spread_bits(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Bits, at most 16, with two zeros after each."""
    for shift, mask in ((16, 0xFF0000FF), (8, 0xF00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249)):
        values = (values | (values << np.uint64(shift))) & np.uint64(mask)
    return values
