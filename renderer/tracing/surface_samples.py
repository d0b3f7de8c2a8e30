"""Points strewn over triangles so densely that none of the surface is far from one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

COVERING = 1 / np.sqrt(3)
"""A triangle's points lie within this many longest edges of one of its corners: by Jung's theorem it lies in a disc
of that radius, and discs of the radius of the smallest enclosing disc about the corners cover it."""
_LATTICE, _THIN = 4, 64


def cover(points, faces, spacing: float, lower, upper) -> Float32:
    """(k, 3) samples: each point of the surface in the box lies within ``COVERING * spacing`` of one.

    points   (n, 3) vertices
    faces    (m, 3) indices
    spacing  longest edge of the pieces whose corners are the samples
    lower    (3,) corner of the box; pieces that do not touch it may be left out
    upper    (3,) opposite corner

    Faces with edges of up to four spacings are cut by a lattice of barycentric coordinates into similar pieces, larger
    ones bisected at their longest edge first, all at a time; needles get samples along their longest edge alone. So a
    floor of two triangles costs no more than what the box sees of it.
    """
    triangles = np.asarray(points, np.float32)[faces]
    samples, first = [], True
    while len(triangles):
        near = ((triangles.max(axis=1) >= lower) & (triangles.min(axis=1) <= upper)).all(axis=1)
        triangles = triangles[near]
        if first:
            samples.append(np.asarray(points, np.float32)[np.unique(np.asarray(faces)[near])])
        sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        parts = np.maximum(np.ceil(sides.max(axis=1, initial=0) / spacing), 1)
        twice_area = np.linalg.norm(np.cross(*(triangles[:, 1:] - triangles[:, :1]).transpose(1, 0, 2)), axis=1)
        # points are at most a quarter spacing from their foot on the longest side, the foot half a spacing from a
        # sample there: together sqrt(5)/4 = .56 spacings, less than COVERING
        thin = (parts > 1) & (parts <= _THIN) & (twice_area <= sides.max(axis=1, initial=0) * spacing / 4)
        samples.append(_along_longest(triangles[thin], sides[thin], parts[thin]))
        parts[thin] = 0
        large = parts > _LATTICE
        for count in range(1, _LATTICE + 1):
            lattice = _barycentric_lattice(count, with_corners=not first)
            fine = triangles[parts == count]
            # (j, 3) times (3 corners of all triangles), one product for each coordinate
            if len(lattice) and len(fine):
                samples.append(np.matmul(lattice, fine).reshape(-1, 3))
        triangles, first = _bisected(triangles[large], sides[large]), False
    return np.concatenate(samples) if samples else np.zeros((0, 3), np.float32)


def _barycentric_lattice(count: int, with_corners: bool) -> Float32:
    """(j, 3) weights of the corners at the lattice points that cut each side into ``count`` parts."""
    weights = [(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]
    kept = [weight for weight in weights if with_corners or max(weight) < count]
    return np.array(kept, np.float32).reshape(-1, 3) / np.float32(count)


def _along_longest(triangles: Float32, sides: Float32, parts: NDArray) -> Float32:
    """(j, 3) points that cut the longest side of each triangle into ``parts`` (m,), ends included."""
    row, longest = np.arange(len(triangles)), sides.argmax(axis=1) if len(sides) else np.zeros(0, int)
    start, end = triangles[row, longest], triangles[row, (longest + 1) % 3]
    count = parts.astype(int) + 1
    of = np.repeat(row, count)
    step = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    share = (step / parts[of]).astype(np.float32)[:, None]
    return start[of] * (1 - share) + end[of] * share


def _bisected(triangles: Float32, sides: Float32) -> Float32:
    """(2m, 3, 3) halves of triangles cut at the middle of the longest side; side k joins corner k and k + 1."""
    row, longest = np.arange(len(triangles)), sides.argmax(axis=1) if len(sides) else np.zeros(0, int)
    a, b, c = (triangles[row, (longest + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
