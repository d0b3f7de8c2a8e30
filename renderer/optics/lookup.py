"""Tables over (radius, cosine), read by bilinear interpolation in float32.

Radii are in transport mean free paths and geometrically spaced, so that the logarithm is the index.
Radii outside the table are moved to its ends. Below, that makes bodies thinner than a quarter of a transport mean
free path too bright (their scattered light falls in proportion to the radius); above, it leaves the terminator as
soft as at 256 paths, under half a degree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

RADII: NDArray[np.float64] = np.geomspace(0.25, 256.0, 48)
"""(48,) radii of the table rows, transport mean free paths."""
COSINES: NDArray[np.float64] = np.linspace(-1.0, 1.0, 201)
"""(201,) cosines of the table columns."""

_ROWS, _COLUMNS = len(RADII), len(COSINES)
_ROWS_PER_OCTAVE = float((_ROWS - 1) / np.log2(RADII[-1] / RADII[0]))
_FIRST_OCTAVE = float(np.log2(RADII[0]))
# the last cell includes its far edge; one ulp below, so that its index stays in range
_LAST_ROW = float(np.nextafter(np.float32(_ROWS - 1), np.float32(0)))
_LAST_COLUMN = float(np.nextafter(np.float32(_COLUMNS - 1), np.float32(0)))


@dataclass(frozen=True)
class Rows:
    """Where radii fall between rows: ``index`` (n,) intp of the lower one and ``share`` (n,) of the upper one."""

    index: NDArray[np.intp]
    share: Float32


@dataclass(frozen=True)
class Columns:
    """Where cosines fall between columns, as ``Rows``."""

    index: NDArray[np.intp]
    share: Float32


@dataclass(frozen=True)
class Places:
    """Where pairs of both fall in a table.

    corner         (n,) intp the node of the lower row and the lower column, counted along the rows
    row, column    (n,) shares of the upper row and of the upper column
    """

    corner: NDArray[np.intp]
    row: Float32
    column: Float32


def places(rows: Rows, columns: Columns) -> Places:
    """The pairs of n rows with n columns."""
    corner = rows.index * _COLUMNS
    corner += columns.index
    return Places(corner, rows.share, columns.share)


def octaves(radius: Float32) -> Float32:
    """(n,) log2 of positive radii; 0 and infinity stay harmless."""
    return np.log2(np.clip(radius, np.float32(1e-30), np.float32(1e30)))


def rows_at(log2_radius: Float32) -> Rows:
    """Rows for the logarithms of n radii in transport mean free paths, moved into the table's range."""
    place = log2_radius * np.float32(_ROWS_PER_OCTAVE)
    place -= _FIRST_OCTAVE * _ROWS_PER_OCTAVE
    np.clip(place, 0.0, _LAST_ROW, out=place)
    index = place.astype(np.intp)
    place -= index.astype(np.float32)
    return Rows(index, place)


def columns_at(cosine: Float32) -> Columns:
    """Columns for n cosines in [-1, 1]."""
    place = cosine * ((_COLUMNS - 1) / 2)
    place += (_COLUMNS - 1) / 2
    np.clip(place, 0.0, _LAST_COLUMN, out=place)
    index = place.astype(np.intp)
    place -= index.astype(np.float32)
    return Columns(index, place)


def interpolate(table: Float32, at: Places) -> Float32:
    """(n,) values of a (48, 201) float32 table between its nodes."""
    flat = table.reshape(-1)
    lower = _between(flat, at.corner, at.column)
    # the row above begins a row of nodes on
    upper = _between(flat[_COLUMNS:], at.corner, at.column)
    upper -= lower
    upper *= at.row
    lower += upper
    return lower


def interpolate_rows(values: Float32, rows: Rows) -> Float32:
    """(n,) values of a (48,) float32 column between its nodes."""
    return _between(values, rows.index, rows.share)


def _between(flat: Float32, index: NDArray[np.intp], share: Float32) -> Float32:
    # indices are in range by construction; "clip" spares numpy a buffered copy
    left = flat.take(index, mode="clip")
    right = flat[1:].take(index, mode="clip")
    right -= left
    right *= share
    left += right
    return left
