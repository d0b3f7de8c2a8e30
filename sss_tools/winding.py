"""How often a surface winds round a point: 1 inside a solid, 0 outside, between the two near a hole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .rays import RAY_OFFSET, RayCaster, UnitFrame

PAIRS_AT_ONCE = 1 << 15
"""Point-face pairs in one block: the dozen float64 temporaries of a block stay in the second-level cache."""

CHORDS = 512
"""Chords cast each way in search of deep points."""


def winding_numbers(points, vertices, faces) -> NDArray[np.float64]:
    """Generalised winding number of each point: the solid angles of all faces over 4 pi, summed.

        tan(Omega / 2) = det(a, b, c) / (|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)

    points    (p, 3) float64
    vertices  (n, 3) float64
    faces     (m, 3) indices, counter-clockwise seen from outside
    Returns (p,) float64, positive inside what is oriented outwards. A point on the surface gets the mean of
    its two sides or either of them. Costs p times m: meant for tens of points on large meshes.

    Van Oosterom & Strackee 1983, IEEE Trans. Biomed. Eng. 30:125, eq. 8; the sum over a mesh with holes:
    Jacobson, Kavan & Sorkine-Hornung 2013, ACM Trans. Graph. 32(4):33, eq. 5.
    """
    points = np.asarray(points, np.float64).reshape(-1, 3)
    total = np.zeros(len(points))
    if len(points) == 0 or len(faces) == 0:
        return total
    # about the middle, so that differences lose nothing to an offset of the file
    middle = vertices[faces[0, 0]]
    columns = np.ascontiguousarray((vertices - middle).T)
    px, py, pz = ((points - middle).T)[:, :, None]
    block = max(1, PAIRS_AT_ONCE // len(points))
    for start in range(0, len(faces), block):
        ia, ib, ic = faces[start : start + block].T
        ax, ay, az = columns[0, ia] - px, columns[1, ia] - py, columns[2, ia] - pz
        bx, by, bz = columns[0, ib] - px, columns[1, ib] - py, columns[2, ib] - pz
        cx, cy, cz = columns[0, ic] - px, columns[1, ic] - py, columns[2, ic] - pz
        a = np.sqrt(ax * ax + ay * ay + az * az)
        b = np.sqrt(bx * bx + by * by + bz * bz)
        c = np.sqrt(cx * cx + cy * cy + cz * cz)
        determinant = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        denominator = (
            a * b * c
            + (ax * bx + ay * by + az * bz) * c
            + (bx * cx + by * cy + bz * cz) * a
            + (cx * ax + cy * ay + cz * az) * b
        )
        total += np.arctan2(determinant, denominator).sum(axis=1)
    # each arctangent is half a solid angle
    return total / (2 * np.pi)


def spread_by_area(areas: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """At most ``count`` different faces, spread evenly over the area in file order; the same ones every time."""
    cumulative = np.cumsum(areas)
    if len(areas) <= count or cumulative[-1] <= 0:
        return np.arange(min(len(areas), count))
    marks = (np.arange(count) + 0.5) / count * cumulative[-1]
    return np.unique(np.searchsorted(cumulative, marks))


def deepest_points(vertices, faces, count: int = 12) -> NDArray[np.float64]:
    """Points far from the surface: the middles of chords cast from the faces, on either side.

    vertices  (n, 3) float64, finite
    faces     (m, 3) indices, consistently oriented
    Returns (k, 3) float64, at most ``count`` from behind the faces and as many from in front of them, those
    with the most room first. A chord runs along a face's normal and must end on the same side of the surface
    as it began, so a sheet that nothing faces has no points at all.
    """
    used = vertices[np.unique(faces)]
    frame = UnitFrame.around(used.min(axis=0), used.max(axis=0))
    inside = frame.points_in(vertices)
    corners = inside[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    # a face without area has no normal to cast along
    faces, corners, normals, lengths = (x[lengths > 0] for x in (faces, corners, normals, lengths))
    if len(faces) == 0:
        return np.empty((0, 3))
    normals /= lengths[:, None]
    chosen = spread_by_area(lengths, CHORDS)
    surface = np.concatenate([corners[chosen].reshape(-1, 3), corners[chosen].mean(axis=1)])
    caster = RayCaster(inside, faces)

    found = []
    for side in (-1.0, 1.0):
        direction = side * normals[chosen]
        # centroids of large triangles are float32-rounded up to an ulp off their plane: start well clear
        origin = corners[chosen].mean(axis=1) + 4 * RAY_OFFSET * direction
        distance, hit = caster.closest(
            np.ascontiguousarray(origin.T, np.float32), np.ascontiguousarray(direction.T, np.float32)
        )
        ends = (hit >= 0) & (side * np.einsum("ij,ij->i", direction, normals[hit]) < 0)
        middles = origin[ends] + direction[ends] * distance[ends, None] / 2
        found.append(middles[np.argsort(-_room(middles, surface), kind="stable")[:count]])
    return frame.points_out(np.concatenate(found))


def _room(points: NDArray, surface: NDArray) -> NDArray[np.float64]:
    """(p,) squared distance from each of (p, 3) points to the nearest of (s, 3) surface samples."""
    nearest = np.full(len(points), np.inf)
    for start in range(0, len(points), 64):
        difference = points[start : start + 64, None] - surface[None]
        nearest[start : start + 64] = np.einsum("psi,psi->ps", difference, difference).min(axis=1)
    return nearest
