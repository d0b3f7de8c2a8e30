"""Triangles across a closed curve in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FLAT = 1e-4
"""Greatest distance from its plane, as a share of its width, of a loop that counts as flat."""

LONGEST = 300
"""Points up to which the best triangulation is searched in full: the cost grows with the third power."""


def triangulate_loop(points, taken) -> tuple[NDArray[np.int64], bool] | None:
    """Triangles over a simple closed curve, running round it as the points do; None where there are none.

    points  (n, 3) the curve, in order
    taken   (n, n) pairs that must not be joined
    Returns (n - 2, 3) indices into points, and whether the curve is flat. Flat curves of many points are cut
    by manifold3d's ear clipping, others so that the area is least: Barequet & Sharir, "Filling gaps in the
    boundary of a polyhedron", CAGD 12:207, 1995.
    """
    points = points - points.mean(axis=0)
    count = len(points)
    if count < 3:
        return None
    spokes = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    size = np.linalg.norm(spokes)
    width = np.linalg.norm(points, axis=1).max()
    normal = spokes / size if size > 0 else np.array([0.0, 0.0, 1.0])
    flat = size > 1e-9 * width**2 and bool(np.abs(points @ normal).max() <= FLAT * width)
    if count == 3:
        return np.array([[0, 1, 2]]), flat
    if flat and count > 8:
        triangles = _cut_flat(points, normal, float(size) / 2)
        if triangles is not None and not _joins(triangles, taken):
            return triangles, True
    ears, rest = _clip_ears(points, taken, count - LONGEST)
    best = _least_area(points[rest], taken[np.ix_(rest, rest)])
    if best is None:
        best = _least_area(points[rest], np.zeros((len(rest), len(rest)), bool))
    assert best is not None
    return np.concatenate([ears, rest[best]]), flat


def _cut_flat(points, normal, area: float) -> NDArray[np.int64] | None:
    """A flat curve cut by manifold3d; None where the triangles overlap (a curve that crosses itself)."""
    from manifold3d import triangulate

    helper = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(helper, normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    triangles = np.asarray(triangulate([np.stack([points @ u, points @ v], axis=1)]), np.int64)
    if len(triangles) != len(points) - 2:
        return None
    a, b, c = (points[triangles[:, k]] for k in range(3))
    total = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return triangles if total <= area * (1 + 1e-6) else None


def _joins(triangles, taken) -> bool:
    """Whether the triangles use a chord that must not be (rim edges are always there)."""
    count = len(taken)
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    apart = np.abs(pairs[:, 0] - pairs[:, 1])
    chords = pairs[(apart != 1) & (apart != count - 1)]
    return bool(taken[chords[:, 0], chords[:, 1]].any())


def _least_area(points, taken) -> NDArray[np.int64] | None:
    """The triangulation of least area, by dynamic programming over stretches of the curve."""
    count = len(points)
    # by where a stretch starts and how long it is, so that all of one length are slices; costs by where it ends, too
    end = np.minimum(np.arange(count)[:, None] + np.arange(count), count - 1)
    ways = [column[end] - column[:, None] for column in points.T]
    cost, cost_by_end = np.zeros((count, count)), np.zeros((count, count))
    split = np.zeros((count, count), np.int64)
    for gap in range(2, count):
        i = np.arange(count - gap)
        j = i + gap
        (ux, uy, uz), (vx, vy, vz) = zip(*((way[:-gap, 1:gap], way[:-gap, gap, None]) for way in ways), strict=True)
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = np.sqrt(x * x + y * y + z * z)
        total = cost[:-gap, 1:gap] + cost_by_end[gap:, gap - 1 : 0 : -1] + area
        best = np.argmin(total, axis=1)
        least = total[i, best]
        split[i, j] = i + 1 + best
        if gap < count - 1:
            least = np.where(taken[i, j], np.inf, least)
        cost[i, gap] = cost_by_end[j, gap] = least
    if not np.isfinite(cost[0, count - 1]):
        return None
    triangles, stretches = [], [(0, count - 1)]
    while stretches:
        first, last = stretches.pop()
        if last - first >= 2:
            middle = int(split[first, last])
            triangles.append((first, middle, last))
            stretches += [(first, middle), (middle, last)]
    return np.array(triangles)


def _clip_ears(points, taken, number: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """``number`` ears cut off, least area first, and the points that are left."""
    rest, ears = list(range(len(points))), []
    for _ in range(max(number, 0)):
        here = np.array(rest)
        before, after = np.roll(here, 1), np.roll(here, -1)
        area = np.linalg.norm(np.cross(points[here] - points[before], points[after] - points[before]), axis=1)
        area[taken[before, after]] = np.inf
        ear = int(np.argmin(area))
        ears.append((before[ear], here[ear], after[ear]))
        del rest[ear]
    return np.array(ears, np.int64).reshape(-1, 3), np.array(rest)
