"""Parts of a surface that cannot meet themselves, because seen from one direction they cover nothing twice.

Faces that all turn the same way when seen along an axis cover each point of the view as often as the boundary of
the part winds round it: the degree of a map. Where the boundary, a few edges in a hundred, consists of simple curves
that do not touch each other and winds nowhere more than once, no two faces overlap in the view, and so none meet in
space but in what they share. Large meshes are mostly made of such parts; only what is left needs a closer look.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .box_tree import BoxTree, morton_keys
from .predicates import orient_2d
from .topology import Topology, connected_components

Indices = NDArray[np.int64]

LEAST_COSINE = 0.25
"""How much a face must face the direction it is seen from."""

FACES_A_CELL = 3000
"""Mesh faces over the square of cells a side: some hundred faces a part. Larger parts overlap themselves more
often, smaller ones have more boundary."""

LEAST_FACES = 32
"""Smaller parts are not worth their boundary."""

MARGIN = 2.0**-46
"""Least turn, over the size of the sides and coordinates of at most 1, that is one also before rounding."""

ROUNDS = 4
"""How often faces at points where a part touches itself are taken out of it before it is given up."""


def height_field_of_face(topology: Topology, centred, vectors, usable) -> tuple[Indices, NDArray[np.bool_]]:
    """(m,) the part each face belongs to, -1 for none, and (k,) which points lie on no part's boundary.

    centred  (3, k) coordinates of the points, at most 1, each off by half a unit in the last place at most
    vectors  (3, m) cross products of sides
    usable   (m,) faces to look at
    No two faces of a part meet elsewhere than in their common side or corner.
    """
    part, axis_of_part = _divide(topology, centred, vectors, usable)
    for attempt in range(ROUNDS):
        sides = _boundary_sides(topology, part)
        rims = _Rims(topology, centred, part, axis_of_part, sides)
        pinched = rims.pinched
        if len(pinched) == 0:
            break
        if attempt == ROUNDS - 1:
            part = _without(part, rims.part[pinched])
        else:
            at_pinch = np.zeros(len(topology.points), bool)
            at_pinch[rims.start[pinched]] = True
            part[at_pinch[topology.faces].any(axis=1)] = -1
    sides = _boundary_sides(topology, part)
    rims = _Rims(topology, centred, part, axis_of_part, sides)
    part = _without(part, np.union1d(rims.parts_that_touch_themselves(), rims.parts_covering_twice()))
    inner = np.ones(len(topology.points), bool)
    inner[rims.start] = inner[rims.end] = False
    inner[topology.faces[part < 0]] = False
    return part, inner


def _without(part: Indices, dropped: Indices) -> Indices:
    """The faces' parts with those in ``dropped`` given up."""
    keep = np.ones(part.max(initial=-1) + 2, bool)
    keep[dropped] = False
    return np.where(keep[part], part, -1)


def _divide(topology: Topology, centred, vectors, usable):
    """(m,) cells of space by axis-parallel view, and (p,) the view of each part: 2 * axis + (1 if from below).

    Each face goes to the view that most faces of its cell prefer, among those it faces well enough.
    """
    length = np.sqrt(vectors[0] ** 2 + vectors[1] ** 2 + vectors[2] ** 2)
    a, b, c = topology.faces.T
    middle = np.stack([row.take(a) + row.take(b) + row.take(c) for row in centred])
    bits = max(round(np.log2(max(len(length) / FACES_A_CELL, 1)) / 2), 0)
    cell = (morton_keys(middle, bits)).astype(np.int64)
    preferred = np.argmax(np.abs(vectors), axis=0)
    preferred = 2 * preferred + (np.take_along_axis(vectors, preferred[None], axis=0)[0] < 0)
    votes = np.bincount(6 * cell + preferred, minlength=6 * 8**bits)
    best, view = np.full(len(length), -1), np.zeros(len(length), np.int64)
    for candidate in range(6):
        sign = -1 if candidate % 2 else 1
        popularity = votes.take(6 * cell + candidate)
        better = (sign * vectors[candidate // 2] > LEAST_COSINE * length) & (popularity > best)
        best[better], view[better] = popularity[better], candidate
    block = 6 * cell + view
    block[~usable | (best < 0)] = -1
    # what is not connected may lie behind something else in the view
    left, right = (side // 3 for side in topology.side_pairs)
    same = (block.take(left) == block.take(right)) & (block.take(left) >= 0)
    label = connected_components(len(block), left[same], right[same])
    large = np.flatnonzero(np.bincount(label[block >= 0]) >= LEAST_FACES)
    block_of_label = np.zeros(label.max(initial=0) + 1, np.int64)
    block_of_label[label] = block
    # numbered along the curve, so that parts near in number are near in space
    large = large[np.argsort(block_of_label[large], kind="stable")]
    number = np.full(len(block_of_label), -1)
    number[large] = np.arange(len(large))
    return np.where(block >= 0, number[label], -1), block_of_label[large] % 6


def _boundary_sides(topology: Topology, part: Indices) -> Indices:
    """Sides 3 * face + k of faces in a part across which that part does not go on."""
    left, right = topology.side_pairs
    same = part.take(left // 3) == part.take(right // 3)
    boundary = np.repeat(part >= 0, 3)
    boundary[left[same]] = boundary[right[same]] = False
    return np.flatnonzero(boundary)


class _Rims:
    """The boundary sides of all parts in their views, as directed segments with the part on the left.

    part, start, end  (s,) the part of each side and its points
    tail, head        (2, s) places in the view
    """

    def __init__(self, topology: Topology, centred, part: Indices, axis_of_part: Indices, sides: Indices):
        corner = topology.faces.ravel()
        self.part = part[sides // 3]
        self.start = corner[sides]
        self.end = corner[sides // 3 * 3 + (sides + 1) % 3]
        view = axis_of_part[self.part]
        axis, below = view // 2, view % 2
        first, second = (axis + 1 + below) % 3, (axis + 2 - below) % 3
        self.tail = np.stack([centred[first, self.start], centred[second, self.start]])
        self.head = np.stack([centred[first, self.end], centred[second, self.end]])
        self._points = len(topology.points)

    @property
    def pinched(self) -> Indices:
        """Sides that start where another side of the same part does."""
        key = self.part * self._points + self.start
        order = np.argsort(key)
        same = key[order[1:]] == key[order[:-1]]
        return np.concatenate([order[1:][same], order[:-1][same]])

    def parts_that_touch_themselves(self) -> Indices:
        """Parts two of whose boundary segments are not clearly apart, or clearly turned at their common end."""
        count = max(int(self.part.max(initial=0)), 1)
        # parts lie in different storeys, so that only segments of one part can overlap
        storey = self.part / count
        lower = np.stack([*np.minimum(self.tail, self.head), storey], axis=1)
        upper = np.stack([*np.maximum(self.tail, self.head), storey], axis=1)
        tree = BoxTree(lower, upper)

        def visit(a, b):
            a, b = tree.order[a], tree.order[b]
            return self.part[a[self._touch(a, b)]]

        touching = tree.for_each_block(visit)
        return np.unique(np.concatenate(touching)) if touching else np.zeros(0, np.int64)

    def _touch(self, a: Indices, b: Indices) -> NDArray[np.bool_]:
        """(n,) whether segments are not surely apart. Those with a common end need only not lie on each other."""
        p, q, r, s = self.tail[:, a], self.head[:, a], self.tail[:, b], self.head[:, b]
        apart = _turn(p, q, r) * _turn(p, q, s) > 0
        apart |= _turn(r, s, p) * _turn(r, s, q) > 0
        follows = self.end[a] == self.start[b]
        precedes = self.start[a] == self.end[b]
        turned = np.where(follows, _turn(p, q, s), _turn(r, s, q)) != 0
        # straight on is no turn either, but not back
        turned |= ((q - p) * (s - r)).sum(axis=0) > 0
        return ~np.where(follows ^ precedes, turned, apart & ~follows)

    def parts_covering_twice(self) -> Indices:
        """Parts that have something beyond their boundary, or less than one layer within."""
        first = self._leftmost_of_each_loop()
        if len(first) == 0:
            return np.zeros(0, np.int64)
        # the side that ends where each of these starts
        ends = self.part * self._points + self.end
        by_end = np.argsort(ends)
        wanted = self.part[first] * self._points + self.start[first]
        place = np.minimum(np.searchsorted(ends[by_end], wanted), len(ends) - 1)
        into = by_end[place]
        wrong = ends[into] != wanted
        outer = orient_2d(self.tail[:, into], self.head[:, into], self.head[:, first]) > 0

        # how often the part covers what is just left of it: all its sides that cross the way from there to the left
        order = np.argsort(self.part, kind="stable")
        begin = np.searchsorted(self.part[order], self.part[first], "left")
        many = np.searchsorted(self.part[order], self.part[first], "right") - begin
        which = np.repeat(np.arange(len(first)), many)
        side = order[np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many) + np.repeat(begin, many)]
        here = self.tail[:, first[which]]
        tail, head = self.tail[:, side], self.head[:, side]
        down = (tail[1] > here[1]) & (head[1] <= here[1])
        up = (tail[1] <= here[1]) & (head[1] > here[1])
        other = (self.start[side] != self.start[first[which]]) & (self.end[side] != self.start[first[which]])
        near = np.flatnonzero((down | up) & other)
        turn = orient_2d(tail[:, near], head[:, near], here[:, near])
        crossed = np.zeros(len(which), np.int64)
        crossed[near] = np.where(down[near], turn > 0, 0) - np.where(up[near], turn < 0, 0)
        covered = np.bincount(which, crossed, len(first))
        return np.unique(self.part[first[wrong | (covered != np.where(outer, 0, 1))]])

    def _leftmost_of_each_loop(self) -> Indices:
        """Of each closed curve the side that starts leftmost, the lowest of these."""
        ends = np.concatenate([self.part * self._points + self.start, self.part * self._points + self.end])
        nodes, compact = np.unique(ends, return_inverse=True)
        a, b = compact.reshape(2, -1)
        loop = connected_components(len(nodes), a, b)[a]
        order = np.lexsort((self.tail[1], self.tail[0], loop))
        first = np.ones(len(order), bool)
        first[1:] = loop[order[1:]] != loop[order[:-1]]
        return order[first]


def _turn(a, b, c):
    """(n,) which way a, b, c (2, n) turn: 1 or -1 where that is sure, else 0."""
    (ux, uy), (vx, vy) = b - a, c - a
    turn = ux * vy - uy * vx
    margin = MARGIN * (np.abs(ux) + np.abs(uy) + np.abs(vx) + np.abs(vy))
    return np.where(np.abs(turn) > margin, np.sign(turn), 0)
