"""PLY files, read whole or not at all.

The format (Turk, "The PLY Polygon File Format", 1994) says how many rows follow, so a cut file can be told
from a whole one. General readers miss that: they return the part that is there, or nothing, without a word;
and they stumble over binary files that mix triangles with quads, which is what Blender writes.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8",
    "uint64": "u8",
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


@dataclass
class _Property:
    """A column: scalars of ``kind``, or lists of them where ``length_kind`` is given."""

    name: str
    kind: str
    length_kind: str | None = None


@dataclass
class _Element:
    """A table of the file."""

    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


@dataclass
class _Lists:
    """A column of lists: ``lengths`` (rows,) and all ``items`` one after the other."""

    lengths: NDArray[np.int64]
    items: NDArray


_Columns = dict[str, NDArray | _Lists]


def read_ply(data: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64], dict[str, NDArray]]:
    """The vertices (n, 3), the triangles (m, 3) and the vertex attributes of a PLY file.

    Polygons become fans in file order; triangle strips are unrolled. Attributes are "normal" (n, 3), "uv"
    (n, 2) and "color" (n, 4) uint8, where the vertices have them; texture coordinates of faces are not read.
    Raises ValueError where the file is no PLY file or holds less than its header promises.
    """
    elements, byte_order, start = _parse_header(data)
    cells: _Bytes | _Words = _Bytes(data, start, byte_order) if byte_order else _Words(data[start:])
    tables: dict[str, _Columns] = {}
    position = cells.start
    for element in elements:
        tables[element.name], position = _read_element(cells, element, position)
    columns = tables.get("vertex", {})
    missing = [axis for axis in "xyz" if not isinstance(columns.get(axis), np.ndarray)]
    if columns and missing:
        raise ValueError(f"its vertices have no {', '.join(missing)}")
    vertices = _stack(columns, tuple("xyz")) if columns else np.zeros((0, 3))
    return vertices, _triangles(tables), _vertex_attributes(columns)


def _parse_header(data: bytes) -> tuple[list[_Element], str, int]:
    """The elements, the byte order ("" for ascii) and where the body starts."""
    end = re.search(rb"(?<=[\r\n])end_header[ \t]*(\r\n|\n|\r|\Z)", data)
    lines = [line.split() for line in data[: end.start()].decode("latin-1").splitlines()] if end else []
    if end is None or not lines or lines[0] != ["ply"]:
        raise ValueError("it has no header from 'ply' to 'end_header'")
    byte_order = None
    elements: list[_Element] = []
    for words in lines[1:]:
        try:
            match words:
                case ["format", name, *_]:
                    byte_order = _FORMATS[name]
                case ["element", name, count] if count.isdigit():
                    elements.append(_Element(name, int(count)))
                case ["property", "list", length_kind, kind, name]:
                    elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[length_kind]))
                case ["property", kind, name]:
                    elements[-1].properties.append(_Property(name, _TYPES[kind]))
                case [] | ["comment" | "obj_info", *_]:
                    pass
                case _:
                    raise ValueError
        except (KeyError, IndexError, ValueError):
            raise ValueError(f"its header has the odd line {' '.join(words)[:60]!r}") from None
    if byte_order is None:
        raise ValueError("its header names no format")
    return elements, byte_order, end.end()


class _Bytes:
    """The body of a binary file: positions count bytes."""

    def __init__(self, data: bytes, start: int, byte_order: str):
        self.data, self.start, self.size, self.order = data, start, len(data), byte_order
        self.array = np.frombuffer(data, np.uint8)

    def width(self, kind: str) -> int:
        """How many positions a value takes."""
        return int(kind[1:])

    def length_at(self, position: int, kind: str) -> int:
        """The length of the list that starts here; -1 behind the end."""
        raw = self.data[position : position + self.width(kind)]
        return int(np.frombuffer(raw, self.order + kind)[0]) if len(raw) == self.width(kind) else -1

    def gather(self, positions: NDArray[np.int64], kind: str) -> NDArray:
        """The values that start at ``positions``."""
        raw = self.array[positions[:, None] + np.arange(self.width(kind))]
        return raw.view(self.order + kind).ravel()


class _Words:
    """The body of an ASCII file: positions count numbers."""

    def __init__(self, text: bytes):
        with warnings.catch_warnings():
            # older versions of numpy stop at what is no number, and only warn
            warnings.simplefilter("error", DeprecationWarning)
            try:
                self.values = np.fromstring(text, dtype=np.float64, sep=" ") if text.strip() else np.zeros(0)
            except (DeprecationWarning, ValueError):
                raise ValueError("its body holds something that is no number") from None
        self.start, self.size = 0, len(self.values)

    def width(self, kind: str) -> int:
        """How many positions a value takes."""
        return 1

    def length_at(self, position: int, kind: str) -> int:
        """The length of the list that starts here; -1 behind the end."""
        return int(self.values[position]) if position < self.size else -1

    def gather(self, positions: NDArray[np.int64], kind: str) -> NDArray:
        """The values that start at ``positions``."""
        values = self.values[positions]
        return values if kind[0] == "f" else values.astype(np.int64)


def _read_element(cells: _Bytes | _Words, element: _Element, position: int) -> tuple[_Columns, int]:
    """The columns of an element whose first row starts at ``position``, and where the next element starts."""
    rows = _row_starts(cells, element, position)
    cursor = rows[:-1].copy()
    columns: _Columns = {}
    for column in element.properties:
        width = cells.width(column.kind)
        if column.length_kind is None:
            columns[column.name] = cells.gather(cursor, column.kind)
            cursor += width
            continue
        lengths = cells.gather(cursor, column.length_kind).astype(np.int64)
        cursor += cells.width(column.length_kind)
        within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        items = cells.gather(np.repeat(cursor, lengths) + width * within, column.kind)
        columns[column.name] = _Lists(lengths, items)
        cursor += width * lengths
    return columns, int(rows[-1])


def _row_starts(cells: _Bytes | _Words, element: _Element, position: int) -> NDArray[np.int64]:
    """(count + 1,) where each row starts, and where the last one ends."""
    if not element.count:
        return np.array([position])
    if not element.properties:
        raise ValueError(f"its header promises {element.count} of '{element.name}', which have no properties")
    first_end = _row_end(cells, element, position)
    width = first_end - position
    if width > 0 and position + width * element.count <= cells.size:
        rows = position + width * np.arange(element.count + 1)
        if _lists_are_equally_long(cells, element, rows[:-1]):
            return rows
    if all(column.length_kind is None for column in element.properties):
        raise _truncated(element, (cells.size - position) // width)
    # lists of different lengths: only the row before tells where the next one starts
    starts = [position]
    for row in range(element.count):
        starts.append(_row_end(cells, element, starts[-1]))
        if not 0 <= starts[-1] <= cells.size:
            raise _truncated(element, row)
    return np.array(starts)


def _row_end(cells: _Bytes | _Words, element: _Element, position: int) -> int:
    """Where the row ends that starts at ``position``; -1 if the file ends within a length."""
    for column in element.properties:
        items = 1
        if column.length_kind is not None:
            items = cells.length_at(position, column.length_kind)
            if items < 0:
                return -1
            position += cells.width(column.length_kind)
        position += items * cells.width(column.kind)
    return position


def _lists_are_equally_long(cells: _Bytes | _Words, element: _Element, rows: NDArray[np.int64]) -> bool:
    """Whether all rows have lists of the lengths of the first; then they are equally long themselves."""
    cursor = rows.copy()
    for column in element.properties:
        items = 1
        if column.length_kind is not None:
            lengths = cells.gather(cursor, column.length_kind)
            items = int(lengths[0])
            if (lengths != items).any():
                return False
            cursor += cells.width(column.length_kind)
        cursor += items * cells.width(column.kind)
    return True


def _truncated(element: _Element, found: int) -> ValueError:
    """What to raise for an element of which only ``found`` rows are there."""
    promised = f"its header promises {element.count} of '{element.name}'"
    return ValueError(f"truncated: {promised}, {found} are there")


def _triangles(tables: dict[str, _Columns]) -> NDArray[np.int64]:
    """(m, 3) the file's polygons as fans, then its strips unrolled."""
    names = ("vertex_indices", "vertex_index")
    faces = [np.zeros((0, 3), np.int64)]
    for table, unroll in (("face", fans), ("tristrips", _strips)):
        for name in names:
            lists = tables.get(table, {}).get(name)
            if isinstance(lists, _Lists):
                faces.append(unroll(lists.lengths, lists.items.astype(np.int64)))
    return np.concatenate(faces)


def fans(lengths: NDArray[np.int64], items: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) triangles of polygons, each a fan about its first corner, in the polygons' order.

    lengths  (p,) corners of each polygon; fewer than three give no triangle
    items    (sum of lengths,) the corners, polygon after polygon
    """
    count = np.maximum(lengths - 2, 0)
    first = np.repeat(np.cumsum(lengths) - lengths, count)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.stack([items[first], items[first + step + 1], items[first + step + 2]], axis=1)


def _strips(lengths: NDArray[np.int64], items: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) triangles of strips; -1 ends a strip, and every second triangle of one runs backwards."""
    items = np.insert(items, np.cumsum(lengths), -1)
    index = np.arange(len(items))
    since_break = index - np.maximum.accumulate(np.where(items == -1, index, -1)) - 1
    corner = index[:-2][(items[:-2] >= 0) & (items[1:-1] >= 0) & (items[2:] >= 0)]
    odd = since_break[corner] % 2
    return np.stack([items[corner + odd], items[corner + 1 - odd], items[corner + 2]], axis=1)


def _vertex_attributes(columns: _Columns) -> dict[str, NDArray]:
    """What the vertices carry besides their position."""
    attributes: dict[str, NDArray] = {}
    if all(name in columns for name in ("nx", "ny", "nz")):
        attributes["normal"] = _stack(columns, ("nx", "ny", "nz"))
    for u, v in _UV_NAMES:
        if u in columns and v in columns:
            attributes["uv"] = _stack(columns, (u, v))
            break
    if all(name in columns for name in ("red", "green", "blue")):
        names = ("red", "green", "blue", *(["alpha"] if "alpha" in columns else []))
        color = _stack(columns, names)
        if np.asarray(columns["red"]).dtype.kind == "f":
            color = 255 * np.nan_to_num(color).clip(0, 1)
        opaque = np.full((len(color), 4), 255, np.uint8)
        opaque[:, : color.shape[1]] = np.rint(color)
        attributes["color"] = opaque
    return attributes


def _stack(columns: _Columns, names: tuple[str, ...]) -> NDArray[np.float64]:
    """(n, len(names)) the named scalar columns side by side."""
    return np.stack([np.asarray(columns[name], np.float64) for name in names], axis=1)
