"""Which of many beams may pass a point? A uniform grid whose cells list the beams that touch them.

A beam is a triangle swept along one direction, or along the directions of a narrow cone.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
MOST_ENTRIES = 16_000_000
_MOST_CELLS = 4_000_000
_CHUNK_ENTRIES = 100_000
_CHUNK_PAIRS = 400_000
"""Some 100 MB of temporaries where pairs are looked at."""
_LARGE = 12
STEEPEST = 0.1
"""Least component of a beam's directions along its main axis; wider cones are not entered but tried everywhere."""


class BeamGrid:
    """Lists of beams by cell; ``candidates`` finds those that may pass points.

    corners     (m, 3, 3) float64 triangles, corner then coordinate
    direction   (m, 3) unit axes of the beams' cones of directions
    spread      (m,) greatest distance of their directions from the axis, 0 for parallel beams
    reach       (m,) their length; what lies beyond the box is left out
    lower, upper  (3,) the box
    planes      (4, m, 4) or None: parallel beams lie where ``planes[..., :3] @ p >= planes[..., 3]`` in all four rows
    name        (m,) what ``candidates`` calls each beam; rows may share one
    """

    def __init__(self, corners, direction, spread, reach, lower, upper, planes=None, name=None):
        self._name = np.arange(len(corners), dtype=np.int32) if name is None else np.asarray(name, np.int32)
        self._lower = np.asarray(lower, float)
        extent = np.maximum(np.asarray(upper, float) - self._lower, 1e-6)
        self.cell = _cell_size(corners, reach, extent)
        self.shape = np.maximum(np.ceil(extent / self.cell).astype(np.int64), 1)
        axis = np.abs(direction).argmax(axis=1)
        along = np.abs(direction[np.arange(len(axis)), axis])
        wide = along - spread < STEEPEST
        self.everywhere = np.unique(self._name[wide])
        cells, beams = [np.empty(0, np.int32)], [np.empty(0, np.int32)]
        for k in range(3):
            rows = np.flatnonzero((axis == k) & ~wide)
            for part in _parts(self._columns_estimate(corners[rows], reach[rows]), _CHUNK_ENTRIES):
                cell, beam = self._enter(k, rows[part], corners, direction, spread, reach, planes)
                cells.append(cell)
                beams.append(self._name[beam])
        self._start, self._beam = _by_cell(np.concatenate(cells), np.concatenate(beams), int(self.shape.prod()))

    @property
    def entries(self) -> int:
        """Number of beams in all lists."""
        return len(self._beam)

    @property
    def memory(self) -> int:
        """Bytes of the lists."""
        return self._start.nbytes + self._beam.nbytes

    def candidates(self, position: Float64) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Points and beams, (c,) each, of all pairs that may meet, some ``_CHUNK_PAIRS`` at a time; position (3, n)."""
        at = ((position - self._lower[:, None]) / self.cell).astype(np.int64)
        for row, size in zip(at, self.shape, strict=True):
            np.clip(row, 0, size - 1, out=row)
        cell = (at[0] * self.shape[1] + at[1]) * self.shape[2] + at[2]
        start = self._start[cell]
        count = self._start[cell + 1] - start
        for part in _parts(count + len(self.everywhere), _CHUNK_PAIRS):
            some = np.arange(part.start, part.stop)
            point = np.repeat(some, count[part])
            beam = self._beam[_ranges(start[part], count[part])]
            if len(self.everywhere):
                point = np.concatenate([point, np.repeat(some, len(self.everywhere))])
                beam = np.concatenate([beam, np.tile(self.everywhere, len(some))])
            yield point, beam.astype(np.intp)

    def cells_of(self, corners: Float64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Triangles and beams, (c,) each, of all pairs that share a cell (with repeats); corners (m, 3, 3)."""
        triangle, start, count = self._lists_of(corners)
        triangle, beam = np.repeat(triangle, count), self._beam[_ranges(start, count)]
        if len(self.everywhere):
            triangle = np.concatenate([triangle, np.repeat(np.arange(len(corners)), len(self.everywhere))])
            beam = np.concatenate([beam, np.tile(self.everywhere, len(corners))])
        return triangle, beam.astype(np.intp)

    def pairs_within(self, corners: Float64) -> int:
        """How many pairs ``cells_of`` would return."""
        return int(self._lists_of(corners)[2].sum()) + len(corners) * len(self.everywhere)

    def _lists_of(self, corners: Float64):
        first, last = (
            np.clip(((edge - self._lower) / self.cell).astype(np.int64), 0, self.shape - 1)
            for edge in (corners.min(axis=1) - 1e-9, corners.max(axis=1) + 1e-9)
        )
        triangle, cell = _boxes(first.T, (last - first + 1).T, self.shape)
        start = self._start[cell]
        return triangle, start, self._start[cell + 1] - start

    def _columns_estimate(self, corners, reach):
        return _entries_of(corners, reach, self.cell, self.cell * self.shape)

    def _enter(self, k, rows, corners, direction, spread, reach, planes):
        """Cells and beams of the beams ``rows``, whose main axis is ``k``.

        Layer by layer of cells along that axis. With r = d_j/d_k in an interval, the beam's points at height z are
        y_j + (z - y_k) r: linear in y and z for fixed r and in r for fixed (y, z), so over a layer the extremes are at
        the corners of triangle, layer and interval.
        """
        corner, axis, wide = corners[rows], direction[rows], spread[rows]
        sign = np.sign(axis[:, k])
        least, most = np.abs(axis[:, k]) - wide, np.minimum(np.abs(axis[:, k]) + wide, 1)
        height, origin, cell = corner[:, :, k], self._lower[k], self.cell
        top = reach[rows] * most
        low = height.min(axis=1) - np.where(sign < 0, top, 0)
        high = height.max(axis=1) + np.where(sign > 0, top, 0)
        first, last = (
            np.clip(np.floor((edge - origin) / cell + nudge), 0, self.shape[k] - 1).astype(np.int64)
            for edge, nudge in ((low, -1e-6), (high, 1e-6))
        )
        layers = last - first + 1
        beam = np.repeat(np.arange(len(rows)), layers)
        layer = _ranges(first, layers)
        # no farther than the beam's own ends, which makes short ones tight
        floor = np.maximum(origin + layer * cell, low[beam])
        ceiling = np.minimum(origin + (layer + 1) * cell, high[beam])
        start, size = np.empty((3, len(beam)), np.int64), np.ones((3, len(beam)), np.int64)
        start[k] = layer
        parallel = not wide.any()
        for j in ((k + 1) % 3, (k + 2) % 3):
            lower, upper = np.full(len(beam), np.inf), np.full(len(beam), -np.inf)
            for slope in _slopes(axis[:, j], wide, least, most, sign)[: 1 if parallel else 2]:
                across = [corner[:, i, j] - corner[:, i, k] * slope for i in range(3)]
                near, far = floor * slope[beam], ceiling * slope[beam]
                np.minimum(lower, np.minimum.reduce(across)[beam] + np.minimum(near, far), out=lower)
                np.maximum(upper, np.maximum.reduce(across)[beam] + np.maximum(near, far), out=upper)
            begin, end = ((edge - self._lower[j]) / cell for edge in (lower, upper))
            outside = (end < -1e-6) | (begin > self.shape[j] + 1e-6)
            start[j] = np.clip(begin - 1e-6, 0, self.shape[j] - 1)
            size[j] = np.where(outside, 0, np.clip(end + 1e-6, 0, self.shape[j] - 1).astype(np.int64) - start[j] + 1)
        if planes is None:
            box, where = _boxes(start, size, self.shape)
            return where.astype(np.int32), rows[beam[box]]
        # only where a list is much longer than the beam is wide is a closer look worth its time
        large = size[0] * size[1] * size[2] > _LARGE
        box, where = _boxes(start[:, ~large], size[:, ~large], self.shape)
        found = [(where.astype(np.int32), rows[beam[~large][box]])]
        if large.any():
            box, where = _boxes(start[:, large], size[:, large], self.shape)
            beam = beam[large][box]
            keep = self._touched(where, planes[:, rows], beam)
            found.append((where[keep].astype(np.int32), rows[beam[keep]]))
        cells, beams = zip(*found, strict=True)
        return np.concatenate(cells), np.concatenate(beams)

    def _touched(self, where, planes, beam) -> NDArray[np.bool_]:
        """(c,) whether no plane has a whole cell on its outer side."""
        index = np.stack(np.unravel_index(where, tuple(self.shape)))
        centre = self._lower[:, None] + (index + 0.5) * self.cell
        keep = np.ones(len(where), bool)
        for row in range(4):
            normal, offset = planes[row, :, :3], planes[row, :, 3]
            slack = np.abs(normal).sum(axis=1) * (self.cell * 0.500001)
            value = np.einsum("ic,ci->c", centre, normal[beam])
            keep &= value + (slack - offset)[beam] >= 0
        return keep


def _cell_size(corners: Float64, reach: Float64, extent: Float64) -> float:
    """Edge of the cells: near the triangles' own size, larger where lists would grow too long."""
    size = corners.max(axis=1) - corners.min(axis=1)
    wanted = float(np.median(size.max(axis=1))) if len(corners) else 1.0
    cell = max(wanted, float(extent.max()) / 128, (float(extent.prod()) / _MOST_CELLS) ** (1 / 3))
    cell = min(cell, float(extent.max()) / 24)
    # sixteen columns are enough where few beams are to be told apart
    while _entries_of(corners, reach, cell, extent).sum() > MOST_ENTRIES and cell < extent.max():
        cell *= 1.15
    return cell


def _entries_of(corners: Float64, reach: Float64, cell: float, extent: Float64) -> Float64:
    """(m,) estimate of how many cells each beam touches."""
    size = np.sort(corners.max(axis=1) - corners.min(axis=1), axis=1)
    length = np.minimum(reach, float(extent.max()) * 0.7)
    return (length / cell + 1) * (size[:, 1] / cell + 1.5) * (size[:, 2] / cell + 1.5)


def _parts(estimate: NDArray, entries: int) -> list[slice]:
    """Slices of some ``entries`` each."""
    part = (np.cumsum(estimate) / entries).astype(np.int64)
    edges = [0, *(np.flatnonzero(np.diff(part)) + 1), len(estimate)]
    return [slice(a, b) for a, b in pairwise(edges) if b > a]


def _ranges(start, count) -> NDArray[np.int64]:
    """All integers start, start + 1, ... (count of them), one range after the other."""
    total = int(count.sum())
    skipped = np.cumsum(count) - count
    return np.arange(total) + np.repeat(np.asarray(start, np.int64) - skipped, count)


def _boxes(start, size, shape) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """Box and flat cell index of all cells of boxes of cells; start, size (3, b)."""
    rows = size[0] * size[1]
    box = np.repeat(np.arange(start.shape[1]), rows)
    x, y = np.divmod(_ranges(np.zeros(len(rows), np.int64), rows), np.maximum(size[1], 1)[box])
    first = (start[0] * shape[1] + start[1]) * shape[2] + start[2]
    run = size[2][box]
    return np.repeat(box, run), _ranges(first[box] + (x * shape[1] + y) * shape[2], run)


def _slopes(across: Float64, spread: Float64, least: Float64, most: Float64, sign: Float64):
    """Least and greatest ratio of a component to the main one, for all directions of each cone."""
    ends = (across - spread, across + spread)
    slopes = [sign * end / along for end in ends for along in (least, most)]
    return np.minimum.reduce(slopes), np.maximum.reduce(slopes)


def _by_cell(cell, beam, cells: int):
    """Compressed rows: where each cell's list starts (cells + 1,), and the lists, without repeats."""
    from scipy.sparse import coo_array

    most = int(beam.max()) + 1 if len(beam) else 1
    table = coo_array((np.ones(len(cell), np.int8), (cell, beam)), shape=(cells, most)).tocsr()
    return table.indptr.astype(np.int32), table.indices.astype(np.int32)
