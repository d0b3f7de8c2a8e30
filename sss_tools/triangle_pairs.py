"""Do two triangles meet? Closed triangles, exact verdicts, many pairs at a time.

Corners are (3, 3, n) float64 arrays: corner, coordinate, pair; coordinates no larger than about 1. Triangles must
have an area: one whose corners lie on a line takes part in nothing here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .predicates import orient_2d, orient_3d

Corners = NDArray[np.float64]
Verdicts = NDArray[np.bool_]

SEPARATION = 2.0**-47
"""How far apart two projections on an axis of unit length must be to be taken for disjoint, coordinates up to 1.

Centring rounds each coordinate by at most 2**-54 and a dot product with a unit vector by at most
3 * sqrt(3) * 2**-53, on both triangles: less than 2**-49 together."""


def apart(first, second) -> Verdicts:
    """(n,) whether an axis separates two triangles, (3, 3, n) each, for certain; False where that is not sure.

    Tries the normals, the way from middle to middle, and the normals of the sides in each triangle's plane.
    An axis need not be accurate to separate: only the projections are bounded.
    """
    result = np.zeros(len(first[0][0]), bool)
    todo = np.arange(len(result))
    for axis_of in _axes():
        x, y, z = axis_of(first, second)
        margin = SEPARATION * (np.abs(x) + np.abs(y) + np.abs(z))
        (a, b, c), (d, e, f) = ([p[0] * x + p[1] * y + p[2] * z for p in corners] for corners in (first, second))
        gap = np.minimum(np.minimum(a, b), c) - np.maximum(np.maximum(d, e), f)
        np.maximum(gap, np.minimum(np.minimum(d, e), f) - np.maximum(np.maximum(a, b), c), out=gap)
        keep = np.flatnonzero(gap <= margin)
        result[todo] = True
        todo = todo[keep]
        result[todo] = False
        first, second = ([corner.take(keep, axis=1) for corner in corners] for corners in (first, second))
    return result


def _axes():
    """The axes tried, one function of the two triangles each."""
    yield lambda first, second: _normal(first)
    yield lambda first, second: _normal(second)
    yield lambda first, second: second[0] + second[1] + second[2] - first[0] - first[1] - first[2]
    for k in range(3):
        yield lambda first, second, k=k: _cross(_normal(first), first[(k + 1) % 3] - first[k])
        yield lambda first, second, k=k: _cross(_normal(second), second[(k + 1) % 3] - second[k])


def _normal(corners):
    return _cross(corners[1] - corners[0], corners[2] - corners[0])


def _cross(u, v):
    return np.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def meet(first: Corners, second: Corners) -> Verdicts:
    """(n,) whether triangles without a common corner have a point in common, be it only one.

    If they do, a side of one meets the other, unless both lie in one plane.
    """
    result = np.zeros(first.shape[2], bool)
    # corners of each triangle against the plane of the other: strictly on one side, and nothing meets
    over_second = np.stack([orient_3d(second[0], second[1], second[2], corner) for corner in first])
    open_ = np.flatnonzero(~(np.abs(over_second.sum(axis=0)) == 3))
    first, second, over_second = first[:, :, open_], second[:, :, open_], over_second[:, open_]
    over_first = np.stack([orient_3d(first[0], first[1], first[2], corner) for corner in second])
    near = np.abs(over_first.sum(axis=0)) != 3
    open_, first, second = open_[near], first[:, :, near], second[:, :, near]
    over_first, over_second = over_first[:, near], over_second[:, near]

    coplanar = (over_second == 0).all(axis=0)
    result[open_[coplanar]] = _meet_in_plane(first[:, :, coplanar], second[:, :, coplanar])
    cross = ~coplanar
    open_, first, second = open_[cross], first[:, :, cross], second[:, :, cross]
    over_first, over_second = over_first[:, cross], over_second[:, cross]
    # how each side of one turns about each side of the other; exchanging the two does not change the sign
    turns = np.empty((3, 3, len(open_)), np.int8)
    for i in range(3):
        for j in range(3):
            turns[i, j] = orient_3d(first[i], first[(i + 1) % 3], second[j], second[(j + 1) % 3])
    hit = np.zeros(len(open_), bool)
    for k in range(3):
        hit |= _pierces(over_second[k], over_second[(k + 1) % 3], turns[k])
        hit |= _pierces(over_first[k], over_first[(k + 1) % 3], turns[:, k])
    result[open_] = hit
    return result


def meet_beyond_corner(shared, first, second) -> Verdicts:
    """(n,) whether triangles with one common corner meet anywhere else.

    shared         (3, n) the common corner
    first, second  (2, 3, n) the other two corners of each
    If they do, the side across from the corner of one meets the other.
    """
    (a, b), (c, d) = first, second
    over_second = orient_3d(shared, c, d, a), orient_3d(shared, c, d, b)
    over_first = orient_3d(shared, a, b, c), orient_3d(shared, a, b, d)
    across = orient_3d(a, b, c, d)
    hit = _pierces(*over_second, np.stack([over_first[0], across, -over_first[1]]))
    hit |= _pierces(*over_first, np.stack([over_second[0], across, -over_second[1]]))
    flat = np.flatnonzero((over_second[0] == 0) & (over_second[1] == 0))
    if len(flat):
        v, a, b, c, d = (x[:, flat] for x in (shared, a, b, c, d))
        v, a, b, c, d = _project((v, a, b), v, a, b, c, d)
        hit[flat] = _sectors_overlap(v, a, b, c, d)
    return hit


def fold_over_side(start, end, first, second) -> Verdicts:
    """(n,) whether triangles with the common side start - end (3, n) lie on each other.

    first, second  (3, n) the third corner of each
    """
    hit = orient_3d(start, end, first, second) == 0
    flat = np.flatnonzero(hit)
    s, e, f, g = (x[:, flat] for x in (start, end, first, second))
    s, e, f, g = _project((s, e, f), s, e, f, g)
    hit[flat] = orient_2d(s, e, f) * orient_2d(s, e, g) > 0
    return hit


def without_area(corners: Corners) -> Verdicts:
    """(n,) whether the corners lie on a line, exactly."""
    return np.logical_and.reduce([orient_2d(*np.delete(corners, axis, axis=1)) == 0 for axis in range(3)])


def _pierces(start, end, turns) -> Verdicts:
    """Whether a segment meets a triangle in whose plane it does not lie.

    start, end  (n,) sides of the triangle's plane its ends are on
    turns       (3, n) how it turns about the triangle's sides
    """
    crosses = (start * end <= 0) & ((start != 0) | (end != 0))
    return crosses & ((turns >= 0).all(axis=0) | (turns <= 0).all(axis=0))


def _meet_in_plane(first: Corners, second: Corners) -> Verdicts:
    """Triangles in a common plane are disjoint where the line of a side has the other strictly outside."""
    if first.shape[2] == 0:
        return np.zeros(0, bool)
    flat = _project(tuple(second), *first, *second)
    first, second = np.stack(flat[:3]), np.stack(flat[3:])
    separated = np.zeros(first.shape[2], bool)
    for one, other in ((first, second), (second, first)):
        inwards = orient_2d(*one)
        for k in range(3):
            start, end = one[k], one[(k + 1) % 3]
            separated |= np.logical_and.reduce([orient_2d(start, end, corner) * inwards < 0 for corner in other])
    return ~separated


def _sectors_overlap(v, a, b, c, d) -> Verdicts:
    """Whether the angles a v b and c v d in a plane, sides included, have a direction in common."""
    first, second = orient_2d(v, a, b), orient_2d(v, c, d)
    ac, ad, bc, bd = orient_2d(v, a, c), orient_2d(v, a, d), orient_2d(v, b, c), orient_2d(v, b, d)
    hit = (ac * first >= 0) & (bc * first <= 0)
    hit |= (ad * first >= 0) & (bd * first <= 0)
    hit |= (ac * second <= 0) & (ad * second >= 0)
    hit |= (bc * second <= 0) & (bd * second >= 0)
    return hit


def _project(triangle, *points):
    """Points (3, n) without the coordinate along which ``triangle`` has no shadow: (2, n) each.

    Of the three shadows the first with area is taken, which is exact whatever its size.
    """
    shadows = np.stack([orient_2d(*(np.delete(corner, axis, axis=0) for corner in triangle)) for axis in range(3)])
    dropped = np.argmax(shadows != 0, axis=0)
    kept = np.array([[1, 2], [0, 2], [0, 1]])[dropped].T
    columns = np.arange(len(dropped))
    return [point[kept, columns] for point in points]
