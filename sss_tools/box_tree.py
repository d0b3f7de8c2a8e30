"""Which boxes overlap? All pairs among many boxes, through a binary tree laid out in arrays.

The boxes are put in an order that keeps neighbours together, some few to a leaf; node k of a level holds nodes 2k and
2k + 1 of the next. All pairs of overlapping nodes of one level are found from those of the level above, and for two
leaves that overlap all their boxes are compared: more comparisons than a tree down to single boxes would need, but of
whole rows of numbers, some ten times cheaper each. Cost n log n for surfaces, whose boxes overlap a bounded number of
others.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]
Item = TypeVar("Item")
Result = TypeVar("Result")

LEAF = 8
"""Boxes a leaf."""

BLOCK = 1 << 16
"""Pairs of nodes looked at together: more than the second-level cache holds, as threads wait for each other between
NumPy's calls. With a quarter as many a second thread brings next to nothing."""

LEAF_BLOCK = 1 << 13
"""Pairs of leaves looked at together."""

_ALL_TRUE = np.ones(8, bool).view(np.uint64)[0]

ODD_SIZE = 8.0
"""Boxes this many times larger than the median stand apart in the tree, lest they blow up the nodes of small ones."""


class BoxTree:
    """Boxes ready for queries.

    order   (n,) int64 the box at each place of the tree's lowest level
    """

    def __init__(self, lower, upper, group: Indices | None = None):
        """Take boxes from ``lower`` (3, n) to ``upper`` (3, n), finite.

        group  (n,) pairs within a group are of no interest; None for no groups
        They are kept in single precision: rounding never turns an overlap into a gap, as it is monotone.
        """
        lower, upper = np.asarray(lower, np.float32), np.asarray(upper, np.float32)
        self.order = _places(lower, upper, group)
        leaves = -(-len(self.order) // LEAF)
        self._depth = max(leaves - 1, 0).bit_length()
        # coordinate, place in the leaf, leaf: comparisons then run along the leaves. What fills the last leaf up
        # overlaps nothing
        self._lower = np.full((3, LEAF, leaves), np.inf, np.float32)
        self._upper = np.full((3, LEAF, leaves), -np.inf, np.float32)
        padded = np.zeros(leaves * LEAF, np.int64)
        padded[: len(self.order)] = self.order
        for place in range(LEAF):
            boxes = padded[place::LEAF]
            for axis in range(3):
                lower[axis].take(boxes, out=self._lower[axis, place], mode="clip")
                upper[axis].take(boxes, out=self._upper[axis, place], mode="clip")
        missing = leaves * LEAF - len(self.order)
        if missing:
            self._lower[:, LEAF - missing :, -1], self._upper[:, LEAF - missing :, -1] = np.inf, -np.inf
        # a node a row of 32 bytes, which numpy gathers fastest: lower corner, negated upper corner, two zeros.
        # Negated, so that one minimum serves both
        level = np.full((1 << self._depth, 8), np.inf, np.float32)
        level[:leaves, :3] = self._lower.min(axis=1).T
        level[:leaves, 3:6] = -self._upper.max(axis=1).T
        level[:, 6:] = 0
        self._levels = [level]
        while len(level) > 1:
            level = np.minimum(level[0::2], level[1::2])
            self._levels.append(level)
        self._levels.reverse()
        # the other way round: what the rows of a node that overlaps do not exceed
        self._limits = [-np.ascontiguousarray(level[:, [3, 4, 5, 0, 1, 2, 6, 7]]) for level in self._levels]
        self._group = None if group is None else group[padded]

    def for_each_block(self, visit: Callable[[Indices, Indices], Result]) -> list[Result]:
        """Call ``visit`` with the pairs of overlapping boxes, some thousands at a time, each pair once.

        It gets two arrays of places in ``order``. Blocks go to threads; the results come in a fixed order.
        """
        leaves = self._lower.shape[2]
        every = np.arange(leaves)
        blocks: list[tuple[int, Indices, Indices]] = [(-1, *pair) for pair in _split(every, every, LEAF_BLOCK)]
        first, second = np.zeros(0, np.int64), np.zeros(0, np.int64)
        for level in range(1, self._depth + 1):
            left = np.arange(0, len(self._levels[level]), 2)
            first, second = np.concatenate([first, left]), np.concatenate([second, left + 1])
            first, second = self._overlapping(level, first, second)
            if level == self._depth or len(first) > BLOCK:
                blocks += [(level, *pair) for pair in _split(first, second, BLOCK // 4)]
                first, second = first[:0], second[:0]
            else:
                first, second = _children(first, second)

        def search(block) -> list[Result]:
            level, a, b = block
            if level < 0:
                return [visit(*self._overlapping_boxes(a, b, same=True))]
            return [
                visit(*self._overlapping_boxes(*pair))
                for leaves in self._descend(level, a, b)
                for pair in _split(*leaves, LEAF_BLOCK)
            ]

        return [result for results in in_threads(search, blocks) for result in results]

    def _descend(self, level: int, a: Indices, b: Indices) -> Iterator[tuple[Indices, Indices]]:
        """Pairs of overlapping leaves below overlapping nodes."""
        if level == self._depth:
            yield a, b
            return
        for pair in _split(*_children(a, b), BLOCK):
            a, b = self._overlapping(level + 1, *pair)
            if len(a):
                yield from self._descend(level + 1, a, b)

    def _overlapping(self, level: int, a: Indices, b: Indices) -> tuple[Indices, Indices]:
        """Those of the pairs of nodes whose boxes overlap."""
        within = self._levels[level].take(a, axis=0) <= self._limits[level].take(b, axis=0)
        # eight truths at once
        hit = np.flatnonzero(within.view(np.uint64)[:, 0] == _ALL_TRUE)
        return a.take(hit), b.take(hit)

    def _overlapping_boxes(self, a: Indices, b: Indices, same: bool = False) -> tuple[Indices, Indices]:
        """Pairs of places of overlapping boxes, one from a leaf in ``a`` (p,), one from its partner in ``b``.

        same  the two leaves are one: each pair of its boxes once
        """
        # a power of two of columns: shifts are cheaper than divisions
        shift = max(len(a) - 1, 0).bit_length()
        table = np.zeros((LEAF, LEAF, 1 << shift), bool)
        within = table[:, :, : len(a)]
        within[:] = np.tri(LEAF, k=-1, dtype=bool)[:, :, None] if same else True
        below = np.empty(within.shape, bool)
        for lower, upper in zip(self._lower, self._upper, strict=True):
            np.less_equal(lower.take(a, axis=1)[:, None], upper.take(b, axis=1)[None], out=below)
            within &= below
            np.less_equal(lower.take(b, axis=1)[None], upper.take(a, axis=1)[:, None], out=below)
            within &= below
        hit = np.flatnonzero(table)
        pair, boxes = hit & ((1 << shift) - 1), hit >> shift
        a, b = a.take(pair) * LEAF + boxes // LEAF, b.take(pair) * LEAF + boxes % LEAF
        if self._group is not None:
            differ = self._group.take(a) != self._group.take(b)
            a, b = a[differ], b[differ]
        return a, b


def in_threads(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The function's results, in the order of the items, from as many threads as there are processors, up to 8."""
    workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if workers == 1 or len(items) < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(min(workers, len(items), 8)) as pool:
        return list(pool.map(function, items))


def _children(a: Indices, b: Indices) -> tuple[Indices, Indices]:
    """The four pairs of children of each pair of nodes, one after the other: neighbours stay together in memory."""
    first, second = np.empty((2, len(a), 4), np.int64)
    for child in range(4):
        np.add(2 * a, child // 2, out=first[:, child])
        np.add(2 * b, child % 2, out=second[:, child])
    return first.ravel(), second.ravel()


def _split(a: Indices, b: Indices, size: int) -> list[tuple[Indices, Indices]]:
    """Pairs in blocks."""
    return [(a[start : start + size], b[start : start + size]) for start in range(0, len(a), size)]


def _places(lower, upper, group) -> Indices:
    """(n,) boxes by group, then by size class, then along Hilbert's curve through their middles.

    A curve as the order of a tree: Lauterbach et al. 2009, Comput. Graph. Forum 28:375.
    """
    count = lower.shape[1]
    if count == 0:
        return np.zeros(0, np.int64)
    extent = upper - lower
    size = np.maximum(np.maximum(extent[0], extent[1]), extent[2])
    # fine enough that few boxes of a surface share a cell
    bits = min(int(count).bit_length() // 2 + 3, 14)
    keys = curve_keys(lower + upper, bits)
    median = float(np.median(size[:: count // 65536 + 1]))
    if median > 0 and size.max() > ODD_SIZE * median:
        odd = np.clip(np.ceil(np.log2(np.maximum(size / (ODD_SIZE * median), 1)) / 2), 0, 7)
        keys |= odd.astype(np.uint64) << np.uint64(3 * bits)
    if group is not None:
        keys |= group.astype(np.uint64) << np.uint64(3 * bits + 3)
    return np.argsort(keys)


def curve_keys(points, bits: int) -> NDArray[np.uint64]:
    """(n,) numbers along Hilbert's curve of the cells, 2**bits a side, at most 14, that hold points (3, n).

    Whatever follows each other on it lies together in space. Skilling 2004, AIP Conf. Proc. 707:381 (AxestoTranspose).
    """
    least = points.min(axis=1, keepdims=True)
    extent = float((points.max(axis=1, keepdims=True) - least).max())
    keys = np.zeros(points.shape[1], np.uint64)
    # a number below the least normal one has no reciprocal
    if extent < np.finfo(points.dtype).tiny * 2**bits or bits == 0:
        return keys
    spread = _spread_bits(np.arange(1 << bits, dtype=np.uint64))
    factor = points.dtype.type((2**bits - 0.5) / extent)
    for start in range(0, len(keys), BLOCK):
        x = ((points[:, start : start + BLOCK] - least) * factor).astype(np.int32)
        np.minimum(x, (1 << bits) - 1, out=x)
        for bit in range(bits - 1, 0, -1):
            below = (1 << bit) - 1
            x[0] ^= -(x[0] >> bit & 1) & below
            for axis in (1, 2):
                invert = -(x[axis] >> bit & 1)
                exchange = (x[0] ^ x[axis]) & below & ~invert
                x[0] ^= exchange | (invert & below)
                x[axis] ^= exchange
        x[1] ^= x[0]
        x[2] ^= x[1]
        flip = np.zeros_like(x[0])
        for bit in range(bits - 1, 0, -1):
            flip ^= -(x[2] >> bit & 1) & ((1 << bit) - 1)
        x ^= flip
        for axis in range(3):
            keys[start : start + BLOCK] |= spread.take(x[axis]) << np.uint64(2 - axis)
    return keys


def _spread_bits(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Bits, at most 16, with two zeros after each."""
    for shift, mask in ((16, 0xFF0000FF), (8, 0xF00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249)):
        values = (values | (values << np.uint64(shift))) & np.uint64(mask)
    return values
