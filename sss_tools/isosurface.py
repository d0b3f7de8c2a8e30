"""Solids given by a function that is negative inside, as triangle meshes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

Points = NDArray[np.float64]
Field = Callable[[Points, Points, Points], Points]
"""Values at coordinates x, y, z that broadcast together: negative inside, zero on the surface."""


def mesh_isosurface(field: Field, lower, upper, cell: float, rounds: int = 3) -> Mesh:
    """The surface where ``field`` is zero: closed and oriented outwards, with vertices on the surface.

    lower, upper  (3,) corners of a box that holds the solid with a cell to spare
    cell          edge of the grid's cells; features should be some three cells thick
    rounds        how often vertices are drawn to the middle of their neighbours and back onto the surface

    Surface nets (Gibson, "Constrained Elastic Surface Nets", MICCAI 1998): a vertex in every cell that the
    surface cuts, and two triangles across every grid edge that it cuts. Where sheets come closer than two
    cells the mesh may touch itself; a thicker feature or a smaller cell avoids it.
    """
    lower = np.asarray(lower, float)
    values = _without_checkered_faces(_grid_values(field, lower, np.asarray(upper, float), cell))
    corners, vertex_of_cell = _cell_vertices(values)
    quads = _quads(values < 0, vertex_of_cell)
    points = lower + cell * corners
    for _ in range(rounds):
        points = _onto_surface(field, _drawn_together(points, quads), cell)
    points = _onto_surface(field, points, cell)
    return Mesh(points, _split_along_shorter_diagonal(points, quads))


def _grid_values(field: Field, lower: Points, upper: Points, cell: float) -> Points:
    """The field on the grid; far from the surface the value of a coarser grid, which has the right sign."""
    coarse = 4
    blocks = np.ceil((upper - lower) / (coarse * cell)).astype(int)
    centre = [lower[k] + coarse * cell * (np.arange(blocks[k]) + 0.5) for k in range(3)]
    near = field(centre[0][:, None, None], centre[1][None, :, None], centre[2][None, None, :])
    values = near.repeat(coarse, 0).repeat(coarse, 1).repeat(coarse, 2)
    # twice the way to a block's corner: the field need not be an exact distance
    band = np.argwhere(np.abs(values) < np.sqrt(3) * coarse * cell)
    values[tuple(band.T)] = field(*(lower + cell * band).T)
    return values


def _without_checkered_faces(values: Points) -> Points:
    """The values with the sign changed where a cell's face has its diagonals on different sides.

    At a saddle that lies flat in the grid the surface leaves such a face by all four edges, and four triangles
    would meet in one edge. The face's value closest to zero changes sides; the vertices find back later.
    """
    for _ in range(10):
        changed = False
        for axis in range(3):
            u, v = (k for k in range(3) if k != axis)
            corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
            around = np.stack([_shifted(_shifted(values, u, du), v, dv) for du, dv in corners], axis=-1)
            inside = around < 0
            checkered = (inside[..., 0] == inside[..., 2]) & (inside[..., 1] == inside[..., 3])
            checkered &= inside[..., 0] != inside[..., 1]
            for place in np.argwhere(checkered):
                nearest = np.argmin(np.abs(around[tuple(place)]))
                place[u] += corners[nearest][0]
                place[v] += corners[nearest][1]
                values[tuple(place)] *= -1
                changed = True
        if not changed:
            break
    return values


def _cell_vertices(values: Points) -> tuple[Points, NDArray[np.int64]]:
    """Grid coordinates (n, 3) of the cells' vertices, and each cell's vertex or -1.

    A vertex is the mean of the points where the surface cuts the cell's edges.
    """
    inside = values < 0
    shape = np.array(values.shape) - 1
    total = np.zeros((*shape, 3))
    cuts = np.zeros(shape, np.int64)
    for axis in range(3):
        low, high = _shifted(values, axis, 0), _shifted(values, axis, 1)
        crossed = _shifted(inside, axis, 0) != _shifted(inside, axis, 1)
        place = np.argwhere(crossed)
        at = low[crossed] / (low[crossed] - high[crossed])
        # the edge bounds four cells, which lie at and before it along the two other axes
        for offset in np.ndindex(2, 2):
            cell = place.copy()
            cell[:, [k for k in range(3) if k != axis]] -= offset
            within = ((cell >= 0) & (cell < shape)).all(axis=1)
            point = place[within].astype(float)
            point[:, axis] += at[within]
            index = tuple(cell[within].T)
            total[index] += point  # a cell occurs once at most for each axis and offset
            cuts[index] += 1
    vertex_of_cell = np.full(shape, -1, np.int64)
    vertex_of_cell[cuts > 0] = np.arange(np.count_nonzero(cuts))
    return total[cuts > 0] / cuts[cuts > 0][:, None], vertex_of_cell


def _shifted(array: NDArray, axis: int, by: int) -> NDArray:
    """The ends of all grid edges along ``axis``: the first for by = 0, the second for by = 1."""
    return np.delete(array, -1 if by == 0 else 0, axis)


def _quads(inside: NDArray[np.bool_], vertex_of_cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """(q, 4) a quadrilateral across every grid edge the surface cuts, counter-clockwise seen from outside."""
    found = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        leaving = _shifted(inside, axis, 0)
        place = np.argwhere(leaving != _shifted(inside, axis, 1))
        outward = leaving[tuple(place.T)]  # the solid ends along +axis
        corner = []
        for back_u, back_v in ((1, 1), (0, 1), (0, 0), (1, 0)):
            cell = place.copy()
            cell[:, u] -= back_u
            cell[:, v] -= back_v
            corner.append(vertex_of_cell[tuple(cell.T)])
        quads = np.stack(corner, axis=1)
        quads[~outward] = quads[~outward][:, ::-1]
        found.append(quads)
    return np.concatenate(found)


def _drawn_together(points: Points, quads: NDArray[np.int64]) -> Points:
    """Every vertex halfway to the mean of its neighbours, which evens out the triangles."""
    start, end = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    count = np.bincount(start, minlength=len(points))
    mean = np.stack([np.bincount(start, points[end, k], len(points)) for k in range(3)], axis=1)
    return (points + mean / count[:, None]) / 2


def _onto_surface(field: Field, points: Points, cell: float) -> Points:
    """A Newton step down the field, no longer than half a cell."""
    value = field(*points.T)
    step = 0.01 * cell
    gradient = np.stack([field(*(points + step * axis).T) - value for axis in np.eye(3)], axis=1) / step
    slope = np.maximum((gradient**2).sum(axis=1), 1e-6)
    move = -(value / slope)[:, None] * gradient
    length = np.linalg.norm(move, axis=1, keepdims=True)
    return points + move * np.minimum(1, 0.5 * cell / np.maximum(length, 1e-12))


def _split_along_shorter_diagonal(points: Points, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """(2 q, 3) two triangles a quadrilateral."""
    a, b, c, d = quads.T
    along_ac = np.linalg.norm(points[a] - points[c], axis=1) <= np.linalg.norm(points[b] - points[d], axis=1)
    first = np.where(along_ac[:, None], np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    second = np.where(along_ac[:, None], np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    return np.stack([first, second], axis=1).reshape(-1, 3)
