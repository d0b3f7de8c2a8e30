"""Where a surface passes through itself: pairs of faces that meet elsewhere than in their common side or corner.

Exact on the coordinates as they are. Most of a surface is made of parts that cannot meet themselves; a tree of boxes
names the candidates among the rest. Of these, many share a corner round which the surface spreads out like a fan and
cannot meet itself either; most others are separated by an axis; what is left goes to predicates that do not round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .box_tree import BoxTree
from .height_fields import height_field_of_face
from .topology import Topology
from .triangle_pairs import apart, fold_over_side, meet, meet_beyond_corner, without_area

Indices = NDArray[np.int64]

SMALL = 2000
"""Up to so many faces nothing is gained by dividing the surface first."""


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
    found = search.tree.for_each_block(search.visit)
    if not found:
        return np.zeros((0, 2), np.int64)
    pairs = np.sort(search.face[np.concatenate(found)], axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


class _Search:
    """The arrays that candidates are looked up in, in the order of the tree.

    face    (n,) the face at each place
    points  (3, n) its corners
    """

    def __init__(self, topology: Topology):
        self.exact = _scaled_exactly(topology.points)
        self.centred = _centred(topology.points, topology.faces)
        a, b, c = topology.faces.T
        corners = np.stack([[row.take(side) for row in self.centred] for side in (a, b, c)])
        measures = _Measures(corners)
        flat = np.flatnonzero(~measures.sound & topology.live)
        takes_part = topology.live.copy()
        takes_part[flat] = ~without_area(self._exactly(topology.faces[flat].T))

        count = len(topology.faces)
        part, inner = np.full(count, -1), np.zeros(len(topology.points), bool)
        if count > SMALL:
            usable = takes_part & measures.sound
            part, inner = height_field_of_face(topology, self.centred, measures.vectors, usable)
        self.spread = _spreads_out(topology, self.centred, measures, inner)

        chosen = np.flatnonzero(takes_part)
        # pairwise, as reducing three rows is several times slower
        lower = np.minimum(np.minimum(corners[0], corners[1]), corners[2])[:, chosen].T
        upper = np.maximum(np.maximum(corners[0], corners[1]), corners[2])[:, chosen].T
        self.tree = BoxTree(lower, upper, part[chosen])
        self.face = chosen[self.tree.order]
        self.points = np.ascontiguousarray(topology.faces[self.face].T, np.int32)
        self.all_spread = self.spread[self.points].all(axis=0)

    def visit(self, a, b) -> Indices:
        """(p, 2) those of the candidate pairs, places in the tree, that meet where they should not."""
        mine, theirs = ([row.take(side) for row in self.points] for side in (a, b))
        shared = np.zeros(len(a), np.int8)
        for p in mine:
            for q in theirs:
                shared += p == q
        disjoint = np.flatnonzero(shared == 0)
        touching = np.flatnonzero((shared > 0) & (shared < 3) & ~(self.all_spread.take(a) | self.all_spread.take(b)))
        found = [self._disjoint(a[disjoint], b[disjoint])]
        for count, test in ((1, self._at_corner), (2, self._at_side)):
            chosen = touching[shared[touching] == count]
            found.append(test(a[chosen], b[chosen]))
        return np.concatenate(found)

    def _disjoint(self, a, b) -> Indices:
        """Pairs without a common point."""
        first, second = ([self.centred.take(row.take(side), axis=1) for row in self.points] for side in (a, b))
        keep = ~apart(np.stack(first), np.stack(second))
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


def _shared_first(mine, theirs):
    """(3, n) corners with those that ``theirs`` has, too, in front, in the order of their numbers."""
    own = np.stack([(corner != theirs).all(axis=0) for corner in mine])
    return np.take_along_axis(mine, np.lexsort((mine, own), axis=0), axis=0)


class _Measures:
    """Of triangles with corners (3, 3, m), each coordinate at most 1 and off by up to 2**-54.

    vectors  (3, m) cross products of two sides
    slack    (m,) more than any component of them, or of a product of two sides, is off by
    sound    (m,) whether the triangle is so large and fat that its normal is that of the exact corners, nearly
    """

    def __init__(self, corners):
        u, v = corners[1] - corners[0], corners[2] - corners[0]
        self.vectors = np.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
        longest = np.maximum(np.abs(u).max(axis=0), np.abs(v).max(axis=0)) * 2
        self.slack = 2.0**-44 * longest * longest + 2.0**-47 * longest
        self.sound = np.abs(self.vectors).max(axis=0) > 16 * self.slack


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


def _spreads_out(topology: Topology, centred, measures: _Measures, known):
    """(k,) whether the faces round a point lie side by side when seen along their mean normal.

    Then no two of them meet elsewhere than in their common sides and in that point. It takes a closed fan of
    two-faced edges, every face turning the same way, and one turn in all: a single face over any direction.

    known  (k,) points of which that need not be asked; they come out as True
    """
    count = len(topology.points)
    asked = topology.live & ~known[topology.faces].all(axis=1)
    faces = np.flatnonzero(asked)
    corner = [topology.faces[faces, k] for k in range(3)]
    vectors = measures.vectors[:, faces]
    length = np.sqrt((vectors * vectors).sum(axis=0))
    unit = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    mean = np.stack([sum(np.bincount(point, row, count) for point in corner) for row in unit])
    size = np.sqrt((mean * mean).sum(axis=0))
    # some direction across the mean normal, to count turns against
    x, y, z = mean
    upright = np.abs(z) > 0.5 * size
    across = np.stack([np.where(upright, -z, -y), np.where(upright, 0, x), np.where(upright, x, 0)])

    spreads = np.ones(count, bool)
    spreads[topology.edges[topology.faces_per_edge != 2]] = False
    turns = np.zeros(count, np.int64)
    place = [centred.take(point, axis=1) for point in corner]
    for k in range(3):
        point = corner[k]
        rise = (vectors * mean.take(point, axis=1)).sum(axis=0)
        spreads[point[rise <= measures.slack[faces] * size[point]]] = False
        reference = across.take(point, axis=1)
        start = ((place[(k + 1) % 3] - place[k]) * reference).sum(axis=0)
        end = ((place[(k + 2) % 3] - place[k]) * reference).sum(axis=0)
        turns += np.bincount(point[(start < 0) & (end >= 0)], minlength=count)
    return known | (spreads & (turns == 1))
