"""Where a surface passes through itself: pairs of faces that meet elsewhere than in their common side or corner.

Exact on the coordinates as they are. A tree of boxes names the candidates. Most of these share a corner round which the
surface spreads out like a fan and cannot meet itself; most others are separated by an axis; what is left goes to
predicates that do not round.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from .box_tree import BoxTree, in_threads
from .topology import Topology
from .triangle_pairs import apart, fold_over_side, meet, meet_beyond_corner, without_area

Indices = NDArray[np.int64]

BLOCK = 1 << 15
"""Faces looked at together."""


def self_intersections(topology: Topology) -> Indices:
    """(p, 2) pairs of faces that meet where they should not, lesser face first, in lexicographic order.

    Faces over the same three points are not paired (they are duplicates), nor are faces with a repeated corner or
    all three corners on a line. Raises ValueError for coordinates that are not finite.
    """
    if np.count_nonzero(topology.live) < 2:
        return np.zeros((0, 2), np.int64)
    if not np.isfinite(topology.points).all() and not np.isfinite(topology.points[topology.faces]).all():
        raise ValueError("self-intersections need finite coordinates")
    search = _Search(topology)
    pairs = np.sort(search.face[search.pairs()], axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


class _Search:
    """The arrays that candidates are looked up in, in the order of the tree.

    face    (n,) the face at each place
    points  (3, n) its corners
    """

    def __init__(self, topology: Topology):
        self.exact = _scaled_exactly(topology.points)
        self.centred = _centred(topology.points, topology.faces)
        faces = np.ascontiguousarray(topology.faces.T)
        measures = _Measures(self.centred, faces)
        takes_part = topology.live.copy()
        flat = np.flatnonzero(~measures.sound & topology.live)
        takes_part[flat] = ~without_area(self._exactly(faces[:, flat]))
        self.spread = _spreads_out(topology, self.centred, faces, measures)

        self.face, lower, upper = np.arange(len(takes_part)), measures.lower, measures.upper
        if not takes_part.all():
            self.face = np.flatnonzero(takes_part)
            lower, upper = lower[:, self.face], upper[:, self.face]
        self.tree = BoxTree(lower, upper)
        self.face = self.face.take(self.tree.order)
        self.points = np.stack([row.astype(np.int32).take(self.face) for row in faces])
        self.all_spread = np.logical_and.reduce([self.spread.take(row) for row in self.points])

    def pairs(self) -> Indices:
        """(p, 2) pairs of places in the tree whose faces meet where they should not."""
        sieved = self.tree.for_each_block(self._sieve)
        found = [np.zeros((0, 2), np.int64)]
        if not sieved:
            return found[0]
        for test, *candidates in zip((self._disjoint, self._at_corner, self._at_side), *sieved, strict=True):
            a, b = (np.concatenate(side) for side in zip(*candidates, strict=True))
            # together, as each test takes a hundred steps that cost more than a few pairs do
            blocks = [(a[block], b[block]) for block in _blocks(len(a))]
            found += in_threads(partial(_apply, test), blocks)
        return np.concatenate(found)

    def _sieve(self, a, b) -> list[tuple[Indices, Indices]]:
        """Of pairs of places with overlapping boxes those that may meet, by how many points they share: 0, 1, 2."""
        mine, theirs = ([row.take(side) for row in self.points] for side in (a, b))
        common = [p == q for p in mine for q in theirs]
        touching = np.logical_or.reduce(common)
        disjoint = np.flatnonzero(~touching)
        touching &= ~(self.all_spread.take(a) | self.all_spread.take(b))
        chosen = np.flatnonzero(touching)
        shared = sum(truth.take(chosen).view(np.int8) for truth in common)
        choices = (disjoint, chosen[shared == 1], chosen[shared == 2])
        return [(a.take(choice), b.take(choice)) for choice in choices]

    def _disjoint(self, a, b) -> Indices:
        """Pairs without a common point."""
        keep = ~apart(*([self.centred.take(row.take(side), axis=1) for row in self.points] for side in (a, b)))
        a, b = a[keep], b[keep]
        keep = meet(self._exactly(self.points[:, a]), self._exactly(self.points[:, b]))
        return np.stack([a[keep], b[keep]], axis=1)

    def _at_corner(self, a, b) -> Indices:
        """Pairs with one common point."""
        mine, theirs = self.points[:, a], self.points[:, b]
        mine, theirs = _shared_first(mine, theirs), _shared_first(theirs, mine)
        keep = ~self.spread[mine[0]]
        a, b, mine, theirs = a[keep], b[keep], mine[:, keep], theirs[:, keep]
        mine, theirs = self._exactly(mine), self._exactly(theirs)
        keep = meet_beyond_corner(mine[0], mine[1:], theirs[1:])
        return np.stack([a[keep], b[keep]], axis=1)

    def _at_side(self, a, b) -> Indices:
        """Pairs with two common points."""
        mine, theirs = self.points[:, a], self.points[:, b]
        mine, theirs = _shared_first(mine, theirs), _shared_first(theirs, mine)
        mine, theirs = self._exactly(mine), self._exactly(theirs)
        keep = fold_over_side(mine[0], mine[1], mine[2], theirs[2])
        return np.stack([a[keep], b[keep]], axis=1)

    def _exactly(self, points):
        """(corners, 3, n) exact coordinates of points (corners, n)."""
        return np.stack([self.exact.take(row, axis=1) for row in points])


def _apply(test, pairs):
    """A test's verdict on two arrays of places, handed over as one."""
    return test(*pairs)


def _shared_first(mine, theirs):
    """(3, n) corners with those that ``theirs`` has, too, in front, in the order of their numbers."""
    own = np.stack([(corner != theirs).all(axis=0) for corner in mine])
    return np.take_along_axis(mine, np.lexsort((mine, own), axis=0), axis=0)


class _Measures:
    """Of faces (3, m), corners first, over points (3, k), each coordinate at most 1 and off by up to 2**-54.

    lower, upper  (3, m) float32 the boxes round them
    vectors       (3, m) cross products of two sides
    slack         (m,) more than any component of them, or of a product of two sides, is off by
    sound         (m,) whether the face is so large and fat that its normal is that of the exact corners, nearly
    """

    def __init__(self, points, faces):
        count = faces.shape[1]
        self.lower, self.upper = np.empty((3, count), np.float32), np.empty((3, count), np.float32)
        self.vectors, self.slack, self.sound = np.empty((3, count)), np.empty(count), np.empty(count, bool)

        def measure(block):
            a, b, c = (points.take(row, axis=1) for row in faces[:, block])
            # rounds each to nearest, which keeps their order
            np.minimum(np.minimum(a, b), c, out=self.lower[:, block], casting="same_kind")
            np.maximum(np.maximum(a, b), c, out=self.upper[:, block], casting="same_kind")
            u, v = b - a, c - a
            vectors = self.vectors[:, block]
            for axis in range(3):
                i, j = (axis + 1) % 3, (axis + 2) % 3
                np.subtract(u[i] * v[j], u[j] * v[i], out=vectors[axis])
            longest = 2 * _largest(np.maximum(np.abs(u), np.abs(v)))
            np.add(2.0**-44 * longest * longest, 2.0**-47 * longest, out=self.slack[block])
            np.greater(_largest(np.abs(vectors)), 16 * self.slack[block], out=self.sound[block])

        in_threads(measure, _blocks(count))


def _largest(rows):
    """(n,) largest of (3, n); pairwise, as reducing three rows is several times slower."""
    return np.maximum(np.maximum(rows[0], rows[1]), rows[2])


def _blocks(count: int):
    """Slices, long enough that threads seldom wait for each other between NumPy's calls."""
    return [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]


def _scaled_exactly(points):
    """(3, k) scaled to at most 1 by a power of two, which does not round."""
    largest = np.abs(points).max(initial=0.0, where=np.isfinite(points))
    exponent = int(np.frexp(largest)[1])
    # in two steps, as the factor alone may be out of range
    half = -exponent // 2
    return np.ascontiguousarray(points.T * 2.0**half * 2.0 ** (-exponent - half))


def _centred(points, faces):
    """(3, k) moved to the middle of what ``faces`` use and scaled to at most 1 by a power of two: rounds once."""
    used = np.zeros(len(points), bool)
    used[faces] = True
    places = np.ascontiguousarray(points.T)
    lower, upper = (bound(places[:, used], axis=1, keepdims=True) / 2 for bound in (np.min, np.max))
    exponent = int(np.frexp((upper - lower).max())[1])
    half = -exponent // 2
    return (places - (lower + upper)) * 2.0**half * 2.0 ** (-exponent - half)


def _spreads_out(topology: Topology, centred, faces, measures: _Measures):
    """(k,) whether the faces round a point lie side by side when seen along their mean normal.

    Then no two of them meet elsewhere than in their common sides and in that point. It takes a closed fan of
    two-faced edges, every face turning the same way, and one turn in all: a single face over any direction.
    """
    count = len(topology.points)
    vectors, slack = measures.vectors, measures.slack
    if not topology.live.all():
        live = np.flatnonzero(topology.live)
        faces, vectors, slack = faces[:, live], vectors[:, live], slack[live]
    unit = np.empty_like(vectors)
    for block in _blocks(len(slack)):
        x, y, z = vectors[:, block]
        length = np.sqrt(x * x + y * y + z * z)
        np.divide(vectors[:, block], length, out=unit[:, block], where=length > 0)
        unit[:, block][:, length == 0] = 0
    mean = np.stack([sum(np.bincount(point, row, count) for point in faces) for row in unit])

    spreads = np.ones(count, bool)
    spreads[topology.edges[topology.faces_per_edge != 2]] = False

    def look(block):
        """Points at which a face of the block turns past the direction that turns are counted at."""
        turned = []
        places = [centred.take(row, axis=1) for row in faces[:, block]]
        vector, allowed = vectors[:, block], slack[block]
        for k in range(3):
            point = faces[k, block]
            x, y, z = mean.take(point, axis=1)
            rise = vector[0] * x + vector[1] * y + vector[2] * z
            spreads[point[rise <= allowed * (np.abs(x) + np.abs(y) + np.abs(z))]] = False
            # turns are counted where they cross a direction across the mean: -z, 0, x or -y, x, 0
            upright = np.abs(z) > np.abs(y)
            minus = np.where(upright, z, y)
            (ux, uy, uz), (vx, vy, vz) = places[(k + 1) % 3] - places[k], places[(k + 2) % 3] - places[k]
            start = x * np.where(upright, uz, uy) - minus * ux
            end = x * np.where(upright, vz, vy) - minus * vx
            turned.append(point[(start < 0) & (end >= 0)])
        return np.concatenate(turned)

    turns = np.bincount(np.concatenate(in_threads(look, _blocks(len(slack)))), minlength=count)
    return spreads & (turns == 1)
