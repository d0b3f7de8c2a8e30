"""Fewer triangles, quickly: for turning large meshes in windows and pages, never for stills."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .exhibit import Surface


def simplified(surface: Surface, count: int) -> Surface:
    """The surface with about ``count`` faces: points are moved together on a grid, faces that vanish are dropped.

    Rossignac & Borrel 1993, Multi-resolution 3D approximations for rendering complex scenes. Colours, origins and
    what shines are those of the faces that are left.
    """
    if len(surface.faces) <= count or len(surface.faces) == 0:
        return surface
    lower, upper = surface.points.min(axis=0), surface.points.max(axis=0)
    # a surface of n faces has about n / 2 points, and meets some 3 k^2 of the cells of a grid of k^3
    cells = max(8.0, (count / 6) ** 0.5)
    for _ in range(6):
        coarse = _on_grid(surface, lower, max(float((upper - lower).max()), 1e-12) / cells)
        if 0.6 * count < len(coarse.faces) <= 1.1 * count or cells < 8:
            break
        cells *= (count / max(len(coarse.faces), 1)) ** 0.5
    return coarse


def _on_grid(surface: Surface, lower, side: float) -> Surface:
    cell = np.floor((surface.points - lower) / side).astype(np.int64)
    width = cell.max(axis=0) + 1
    key = (cell[:, 0] * width[1] + cell[:, 1]) * width[2] + cell[:, 2]
    _, number = np.unique(key, return_inverse=True)
    number = number.reshape(-1)
    members = np.bincount(number)
    points = np.stack([np.bincount(number, column) / members for column in surface.points.T.astype(float)], axis=1)
    faces = number[surface.faces]
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    kept = np.flatnonzero(kept)
    # of faces that have become the same one is enough
    _, first = np.unique(np.sort(faces[kept], axis=1), axis=0, return_index=True)
    kept = kept[np.sort(first)]
    return replace(surface.part(kept), points=points.astype(np.float32), faces=faces[kept])
