"""Objects that touch: made to overlap by a hair, so that rays meet their surfaces in an order.

Where two objects share a surface, or are no more than the ray offset apart, a ray that crosses one starts behind the
other, and the path takes itself for somewhere it is not: with boxes side by side one path in eight was lost. So where
an object touches one listed before it, it grows by ``GROWTH``; the first still owns what they share, as with any
overlap, and the two are in optical contact, with no film of air between.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET

from .normals import point_normals

Float64 = NDArray[np.float64]

CLOSE = 3 * float(RAY_OFFSET)
"""Surfaces no farther apart than this touch (unit-size frame): twice the offset, and what rounding may add."""
GROWTH = 2e-5
"""How far vertices move along their normal. At corners of a box that is 1.2e-5 across each side: several offsets more
than what was between, and still no more than a hundredth of a pixel."""


def grown_where_touching(points: Sequence[Float64], faces: Sequence[NDArray]) -> list[Float64]:
    """Vertices of each object, those near a surface of another moved outwards.

    points, faces  of each object, (n, 3) in the unit-size frame and (m, 3)

    Where vertices of both touch, the later object's move; where those of one do (a box upon a floor), that one's.
    """
    moves = [np.zeros(len(block), bool) for block in points]
    for later in range(len(points)):
        for first in range(later):
            if not _mark(moves[later], points[later], points[first], faces[first]):
                _mark(moves[first], points[first], points[later], faces[later])
    return [_grown(*each) if each[2].any() else each[0] for each in zip(points, faces, moves, strict=True)]


def _mark(moves: NDArray[np.bool_], points: Float64, other: Float64, faces: NDArray) -> bool:
    """Mark ``points`` within ``CLOSE`` of the other object's faces; whether there are any."""
    lower, upper = other.min(axis=0) - CLOSE, other.max(axis=0) + CLOSE
    near = np.flatnonzero(((points >= lower) & (points <= upper)).all(axis=1))
    if not len(near):
        return False
    import igl

    squared, *_ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points[near]), np.ascontiguousarray(other), np.ascontiguousarray(faces, np.int64)
    )
    touching = near[squared <= CLOSE**2]
    moves[touching] = True
    return len(touching) > 0


def _grown(points: Float64, faces: NDArray, moves: NDArray[np.bool_]) -> Float64:
    """Marked vertices, and those in the same places, moved along the mean normal of the faces around."""
    mesh = Mesh(points, faces)
    normals, place = point_normals(mesh), mesh.topology.point_of_vertex
    marked = np.zeros(len(normals), bool)
    marked[place[moves]] = True
    return points + GROWTH * (normals * marked[:, None])[place]
