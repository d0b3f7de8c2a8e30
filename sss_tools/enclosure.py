"""Does a surface that is not closed, or is but has no volume to speak of, enclose anything?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .winding import deepest_points, spread_by_area, winding_numbers

ENCLOSES = 0.75
"""Least winding number, somewhere inside, of a surface with holes that still encloses a volume."""

DEPTH = 0.01
"""How far off its face a place is that is asked, over the diagonal: noise and the tips of creases reach less far."""

PLACES = 1024
"""Faces asked, spread over the area, on either side of each."""

SHARE = 0.02
"""Share of the faces that must have such a place on the same side: a few may lie where sheets touch by chance.
Of bodies that have one behind 3.5 % of their area, fewer than one in a hundred is missed."""


def enclosed_side(points, faces) -> int:
    """Which side of a surface encloses a volume: 1 behind its faces, -1 in front of them, 0 neither.

    points  (k, 3) float64, finite where faces use them
    faces   (m, 3) indices, consistently oriented, not all without area

    Something is enclosed where the winding number reaches ``ENCLOSES`` in size. Where the surface has most room
    comes first: that settles nearly all solids with holes, thin ones, too. A panelled body or a bowl reaches it only
    nearer to its walls, as the winding number grows towards the surface: so the rest is decided just off the faces.
    """
    used, compact = np.unique(faces, return_inverse=True)
    points, faces = points[used], compact.reshape(-1, 3)
    winding = winding_numbers(deepest_points(points, faces), points, faces)
    least = 1.0
    if not (np.abs(winding) >= ENCLOSES).any():
        # a row for each side
        behind, before = _winding_off_the_faces(points, faces)
        winding, least = np.concatenate([behind[behind > 0], before[before < 0]]), max(1.0, SHARE * len(behind))
    positive, negative = np.count_nonzero(winding >= ENCLOSES), np.count_nonzero(winding <= -ENCLOSES)
    if max(positive, negative) < least:
        return 0
    return 1 if positive >= negative else -1


def _winding_off_the_faces(points, faces) -> NDArray[np.float64]:
    """(2, p) winding numbers ``DEPTH`` behind and in front of the middles of faces, to some 0.003.

    Barill et al. 2018, ACM Trans. Graph. 37(4):43: what is far is summed as one; it costs m log m.
    """
    from igl import fast_winding_number

    lower, upper = points.min(axis=0), points.max(axis=0)
    # about the middle and of size 1, so that nothing depends on frame and unit
    corners = np.ascontiguousarray((points - (lower + upper) / 2) / np.linalg.norm(upper - lower))
    a, b, c = (corners[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    chosen = spread_by_area(lengths, PLACES)
    chosen = chosen[lengths[chosen] > 0]
    step = DEPTH * normals[chosen] / lengths[chosen, None]
    middles = (a[chosen] + b[chosen] + c[chosen]) / 3
    places = np.concatenate([middles - step, middles + step])
    if len(places) == 0:
        return np.zeros((2, 0))
    return fast_winding_number(corners, np.ascontiguousarray(faces), places).reshape(2, -1)
