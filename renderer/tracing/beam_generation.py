"""Beams behind one object's facets: triangles swept along the light's directions, and their reflections inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .beam_grid import BeamGrid

Float64 = NDArray[np.float64]
Index = NDArray[np.intp]
_MOST_PAIRS = 4_000_000
_MOST_BEAMS = 400_000


@dataclass(frozen=True)
class Facets:
    """The triangles of one object.

    first    number of the first in the scene
    corners  (m, 3, 3) float64 as rays see them; normal (m, 3) unit, outward
    """

    first: int
    corners: Float64
    normal: Float64


class Generation:
    """Beams that have been mirrored equally often.

    base      (b,) facet at which each begins: where it enters, or is mirrored
    parent    (b,) beam of the generation before that is mirrored there; None in the first
    axis      (b, 3) direction of travel, the middle of the beam's
    spread    (b,) greatest distance of its directions from the axis
    reach     (b,) greatest length
    share     (b,) of the light that passes the entry and the mirrors (parallel light; 1 for others)
    focus     (b,) irradiance across the beam for light of strength 1 (parallel light; 1 for others)
    """

    def __init__(self, facets: Facets, base, parent, axis, spread, reach, share, focus, lower, upper):
        self.base, self.parent, self.axis, self.spread, self.reach = base, parent, axis, spread, reach
        self.share, self.focus = share, focus
        corners = facets.corners[base]
        normal = facets.normal[base]
        self.planes, self.forward = side_planes(corners, axis)
        slope = (normal * axis).sum(axis=1)
        height = -np.einsum("ij,ij->i", normal, corners[:, 0])
        # the last row tells the length of the way from the base
        self.planes[3, :, :3], self.planes[3, :, 3] = normal / slope[:, None], -height / slope
        self.diagonal = float(np.linalg.norm(upper - lower))
        self._stray = spread * np.linalg.norm(self.planes[:3, :, :3], axis=2)
        self._corners, self._lower, self._upper = corners, lower, upper

    def enter(self, split) -> None:
        """Build the grid; ``split`` of corners, axis and spread gives narrower parts of wide beams."""
        corners, axis, spread, name = split(self._corners, self.axis, self.spread, self.base)
        exact = self.planes if not self.spread.any() else None
        self.grid = BeamGrid(corners, axis, spread, self.reach[name], self._lower, self._upper, exact, name)

    def holding(self, position: Float64, beam: Index, farthest: float) -> tuple[Index, Float64]:
        """Which of the pairs of points (3, c) and beams (c,) meet, and the way from the base along the axis.

        Exact for parallel beams. Of others, where points stray from the axis by no more than the spread times the way
        (at most ``farthest``), some that do not meet are left in. Facets in one plane share no point and
        leave out none between them: a side that two have in common is computed from the same end, and belongs to one.
        """
        keep = np.arange(len(beam))
        for row in (0, 1, 2, 3):
            plane = np.take(self.planes[row], beam, axis=0)
            value = plane[:, 0] * position[0]
            value += plane[:, 1] * position[1]
            value += plane[:, 2] * position[2]
            value -= plane[:, 3]
            if row == 3:
                within = value > 0
            else:
                value += self._stray[row, beam] * farthest
                within = (value > 0) | ((value == 0) & self.forward[beam, row])
            some = np.flatnonzero(within)
            keep, beam, position = keep[some], beam[some], np.take(position, some, axis=1)
        return keep, value[some]


def side_planes(corners: Float64, direction: Float64) -> tuple[Float64, NDArray[np.bool_]]:
    """(4, m, 4) planes through the sides of triangles along directions, positive inside, the last row left open;
    (m, 3) whether a point on the plane itself counts as inside.

    Each side is taken from its lexicographically lesser end, whichever triangle asks.
    """
    planes, forward = np.zeros((4, len(corners), 4)), np.zeros((len(corners), 3), bool)
    for k in range(3):
        a, b, third = (corners[:, (k + i) % 3] for i in range(3))
        swap = _lexically_greater(a, b)[:, None]
        begin, end = np.where(swap, b, a), np.where(swap, a, b)
        normal = np.cross(direction, end - begin)
        offset = normal[:, 0] * begin[:, 0] + normal[:, 1] * begin[:, 1] + normal[:, 2] * begin[:, 2]
        forward[:, k] = (normal * third).sum(axis=1) > offset
        sign = np.where(forward[:, k], 1.0, -1.0)
        planes[k, :, :3], planes[k, :, 3] = normal * sign[:, None], offset * sign
    return planes, forward


def _lexically_greater(a: Float64, b: Float64) -> NDArray[np.bool_]:
    x, y, z = np.sign(a - b).T
    return (4 * x + 2 * y + z) > 0


def met(facets: Facets, before: Generation) -> tuple[Index, Index] | None:
    """Facets and beams, (c,) each, of all pairs in which light may meet a facet from inside; some do not.

    None where looking for them would take too long.
    """
    count = len(before.base)
    parts = [np.arange(first, min(first + 4096, len(facets.corners))) for first in range(0, len(facets.corners), 4096)]
    if sum(before.grid.pairs_within(facets.corners[part]) for part in parts) > _MOST_PAIRS:
        return None
    found = [np.empty(0, np.int64)]
    for part in parts:
        triangle, beam = before.grid.cells_of(facets.corners[part])
        triangle = part[triangle]
        leaving = (facets.normal[triangle] * before.axis[beam]).sum(axis=1) + before.spread[beam] > 1e-9
        leaving &= triangle != before.base[beam]
        pairs = np.unique(triangle[leaving] * np.int64(count) + beam[leaving])
        found.append(pairs[_overlapping(facets, before, *np.divmod(pairs, count))])
    pairs = np.concatenate(found)
    triangle, beam = np.divmod(pairs, count)
    return None if len(pairs) > _MOST_BEAMS else (triangle, beam)


def least_way(facets: Facets, before: Generation, triangle: Index, beam: Index) -> Float64:
    """(c,) bound of how far beams have come when they meet facets."""
    plane = before.planes[3][beam]
    length = np.einsum("ckj,cj->ck", facets.corners[triangle], plane[:, :3]) - plane[:, 3:]
    return np.where(before.spread[beam] > 0, 0, np.maximum(length.min(axis=1), 0))


def _overlapping(facets: Facets, before: Generation, triangle: Index, beam: Index) -> Index:
    """Which pairs of facets and beams may meet: no side of either, swept along the beam, parts them."""
    keep = np.arange(len(beam))
    corners = facets.corners
    stray = before.spread * np.minimum(before.reach, before.diagonal) + 1e-9
    for row in range(4):
        plane = before.planes[row][beam]
        value = np.einsum("ckj,cj->kc", corners[triangle], plane[:, :3]) - plane[:, 3]
        margin = 0 if row == 3 else stray[beam] * np.sqrt((plane[:, :3] ** 2).sum(axis=1))
        some = np.maximum.reduce(value) > -margin
        if row == 3:
            some &= np.minimum.reduce(value) < before.reach[beam]
        keep, triangle, beam = keep[some], triangle[some], beam[some]
    own, _ = side_planes(corners[triangle], before.axis[beam])
    value = np.einsum("ckj,scj->cks", corners[before.base[beam]], own[:3, :, :3]) - own[:3, :, 3].T[:, None]
    margin = stray[beam][:, None] * np.linalg.norm(own[:3, :, :3], axis=2).T
    return keep[(value.max(axis=1) > -margin).all(axis=1)]
