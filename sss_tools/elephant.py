"""A small elephant: a thick body with thin ears, tusks and a tail, so that light shows what it does in both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .isosurface import mesh_isosurface
from .mesh import Mesh

Values = NDArray[np.float64]

_TOES = ((0.105, 0.2), (0.16, 0.208), (0.212, 0.183), (0.105, -0.243), (0.16, -0.233), (0.212, -0.257))
TURN_RAD = np.radians(38.0)
"""How far the elephant looks past a viewer on the z axis."""


def elephant(cell: float = 0.0135) -> Mesh:
    """A closed, outward oriented elephant about a unit high, standing on y = 0, looking between +z and +x.

    cell  edge of the sampling grid: 0.0135 gives some 55,000 faces, half of it four times as many
    """
    mesh = mesh_isosurface(_elephant, (-0.62, -0.05, -0.70), (0.62, 1.10, 1.02), cell)
    x, y, z = mesh.vertices.T
    cosine, sine = np.cos(TURN_RAD), np.sin(TURN_RAD)
    turned = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=1)
    return Mesh(turned, mesh.faces)


def _elephant(x: Values, y: Values, z: Values) -> Values:
    """Negative inside. The elephant looks along +z and is its own mirror image in x."""
    x = np.abs(x)
    parts = (
        (_ellipsoid(x, y, z, (0, 0.52, 0.10), (0.22, 0.24, 0.20)), 0.09),  # shoulders
        (_head(x, y, z), 0.09),
        (_tube(x, y, z, ((0.145, 0.42, 0.06), (0.15, 0.2, 0.09), (0.15, 0, 0.1)), (0.12, 0.1, 0.107)), 0.07),
        (_tube(x, y, z, ((0.145, 0.4, -0.32), (0.15, 0.2, -0.36), (0.15, 0, -0.34)), (0.14, 0.1, 0.11)), 0.07),
        (_tube(x, y, z, *_TAIL), 0.03),
        (_ear(x, y, z), 0.035),
        (_tube(x, y, z, *_TUSK), 0.015),
        *((_ellipsoid(x, y, z, (tx, 0.02, tz), (0.028, 0.042, 0.022)), 0.012) for tx, tz in _TOES),
    )
    solid = _ellipsoid(x, y, z, (0, 0.50, -0.14), (0.27, 0.265, 0.37))
    for part, blend in parts:
        solid = _smooth_union(solid, part, blend)
    return -_smooth_union(-solid, y, 0.02)  # flat soles


def _head(x: Values, y: Values, z: Values) -> Values:
    """Skull, brow, cheek, lip, trunk and eye."""
    head = _ellipsoid(x, y, z, (0, 0.80, 0.30), (0.185, 0.20, 0.19))
    head = _smooth_union(head, _ellipsoid(x, y, z, (0.075, 0.90, 0.33), (0.10, 0.10, 0.11)), 0.09)
    head = _smooth_union(head, _ellipsoid(x, y, z, (0.085, 0.68, 0.36), (0.10, 0.10, 0.11)), 0.09)
    head = _smooth_union(head, _ellipsoid(x, y, z, (0, 0.56, 0.40), (0.055, 0.05, 0.09)), 0.04)
    head = _smooth_union(head, _tube(x, y, z, *_TRUNK), 0.09)
    return _smooth_union(head, _ellipsoid(x, y, z, (0.158, 0.795, 0.425), (0.024, 0.026, 0.024)), 0.012)


def _ear(x: Values, y: Values, z: Values) -> Values:
    """A thin leaf of even thickness, hung from the side of the head, swung backwards and cupped."""
    along, up, across = x - 0.15, y - 0.78, z - 0.24
    swing = np.radians(28.0)
    along, across = np.cos(swing) * along - np.sin(swing) * across, np.sin(swing) * along + np.cos(swing) * across
    across = across - 0.55 * (along - 0.20) ** 2 + 0.35 * up**2 - 0.02
    along = along / (1 + 0.55 * np.tanh(2.2 * up))  # wide above, narrow below
    outline = _ellipsoid(along, up, 0.0 * up, (0.16, -0.045, 0), (0.215, 0.265, 1))
    return np.sqrt(np.maximum(outline, 0) ** 2 + across**2) - 0.021


def _ellipsoid(x, y, z, centre, radii) -> Values:
    """About the distance to an ellipsoid: exact to first order at its surface (Quilez, "Ellipsoid SDF")."""
    scaled = [(axis - c) / r for axis, c, r in zip((x, y, z), centre, radii, strict=True)]
    level = np.sqrt(sum(s**2 for s in scaled))
    slope = np.sqrt(sum((s / r) ** 2 for s, r in zip(scaled, radii, strict=True)))
    return level * (level - 1) / np.maximum(slope, 1e-9)


def _tube(x, y, z, path, radii) -> Values:
    """About the distance to a tube round a polyline whose radius changes evenly between its points."""
    path, nearest = np.asarray(path, float), np.array(np.inf)
    for start, end, r0, r1 in zip(path[:-1], path[1:], radii[:-1], radii[1:], strict=True):
        run = end - start
        u, v, w = x - start[0], y - start[1], z - start[2]
        along = np.clip((u * run[0] + v * run[1] + w * run[2]) / (run @ run), 0, 1)
        gap = np.sqrt((u - along * run[0]) ** 2 + (v - along * run[1]) ** 2 + (w - along * run[2]) ** 2)
        nearest = np.minimum(nearest, gap - (r0 + along * (r1 - r0)))
    return nearest


def _smooth_union(a: Values, b: Values, blend: float) -> Values:
    """The lesser of two distances, rounded where they differ by less than ``blend`` (Quilez, polynomial)."""
    overlap = np.maximum(blend - np.abs(a - b), 0)
    return np.minimum(a, b) - overlap**2 / (4 * blend)


def _bent(control, radii, pieces: int):
    """(pieces + 1, 3) points on the cubic Bezier curve of four control points, and as many even radii."""
    t = np.linspace(0, 1, pieces + 1)
    a, b, c, d = np.asarray(control, float)
    s = t[:, None]
    path = (1 - s) ** 3 * a + 3 * (1 - s) ** 2 * s * b + 3 * (1 - s) * s**2 * c + s**3 * d
    return path, np.interp(t, np.linspace(0, 1, len(radii)), radii)


_TRUNK = _bent(
    ((0, 0.70, 0.42), (0, 0.36, 0.62), (0, 0.34, 0.96), (0, 0.84, 0.86)), (0.128, 0.092, 0.068, 0.052, 0.05), 22
)
_TUSK = _bent(
    ((0.095, 0.66, 0.42), (0.15, 0.52, 0.56), (0.17, 0.52, 0.72), (0.13, 0.62, 0.80)), (0.036, 0.032, 0.015), 10
)
_TAIL = _bent(
    ((0, 0.60, -0.46), (0, 0.56, -0.60), (0, 0.36, -0.52), (0, 0.24, -0.62)), (0.034, 0.022, 0.018, 0.028, 0.018), 10
)
