"""Does a mesh file hold what it promises?

Every check takes the file's bytes and raises ValueError, with what was expected and what was found, where the
file ends too early or names what it does not have. PLY files are missing here: ``ply`` reads and checks them.
"""

from __future__ import annotations

import json
import re
import struct
from itertools import islice


def check(suffix: str, data: bytes) -> tuple[bytes, int | None]:
    """The file's bytes, text with plain line ends and indices, and how many triangles they hold.

    None where the format does not tell the number without reading everything. A reader that finds another
    number has skipped something it did not understand.
    """
    match suffix:
        case ".stl":
            return _check_stl(data)
        case ".obj":
            return _check_obj(data)
        case ".off":
            return _check_off(data)
        case ".glb":
            _check_glb(data)
        case ".gltf":
            # readers may look for another file when this one does not parse
            json.loads(data)
    return data, None


def _plain_line_ends(data: bytes) -> bytes:
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _check_stl(data: bytes) -> tuple[bytes, int]:
    """Binary: 84 bytes, and 50 for each face of the header. ASCII: every facet whole, endsolid at the end."""
    faces = struct.unpack("<I", data[80:84])[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + 50 * faces:
        return data, faces
    if not (data.lstrip()[:5].lower() == b"solid" and b"\0" not in data):
        if len(data) < 84:
            raise ValueError(f"truncated: a binary STL has a header of 84 bytes, the file has {len(data)}")
        raise ValueError(
            f"truncated or corrupt: its header promises {faces} faces in {84 + 50 * faces} bytes, "
            f"the file has {len(data)}"
        )
    data = _plain_line_ends(data)
    begun = len(re.findall(rb"^\s*facet\b", data, re.MULTILINE | re.IGNORECASE))
    ended = len(re.findall(rb"^\s*endfacet\b", data, re.MULTILINE | re.IGNORECASE))
    if not re.search(rb"endsolid[^\n]*\s*\Z", data, re.IGNORECASE):
        raise ValueError(f"truncated: no endsolid after its {begun} facets")
    vertices = len(re.findall(rb"^\s*vertex(?:[ \t]+[-+.\w]+){3}[ \t]*$", data, re.MULTILINE | re.IGNORECASE))
    if not begun == ended or vertices != 3 * begun:
        raise ValueError(f"corrupt: {begun} facets begin, {ended} end, with {vertices} vertices between them")
    return data, begun


def _check_off(data: bytes) -> tuple[bytes, int]:
    """As many vertices and faces as the first line of numbers says, every face with all its corners."""
    data = _plain_line_ends(data)
    text = re.sub(rb"#[^\n]*", b"", data)
    start = re.match(rb"\s*(?:ST)?C?N?OFF\b", text)
    if start is None:
        raise ValueError("it does not begin with OFF")
    lines = [line.split() for line in text[start.end() :].split(b"\n") if line.strip()]
    counts = lines[0][:2] if lines else []
    if len(counts) < 2 or not all(word.isdigit() for word in counts):
        raise ValueError("the line after OFF does not count its vertices and faces")
    vertices, faces = map(int, counts)
    found_vertices = sum(len(line) >= 3 for line in islice(lines, 1, 1 + vertices))
    face_lines = islice(lines, 1 + vertices, 1 + vertices + faces)
    corners = [int(line[0]) for line in face_lines if line[0].isdigit() and len(line) > int(line[0])]
    found_faces = len(corners)
    if (found_vertices, found_faces) != (vertices, faces):
        raise ValueError(
            f"truncated or corrupt: its header promises {vertices} vertices and {faces} faces, "
            f"{found_vertices} and {found_faces} are there"
        )
    return data, sum(max(count - 2, 0) for count in corners)


def _check_glb(data: bytes) -> None:
    """As many bytes as the header says."""
    if data[:4] != b"glTF" or len(data) < 12:
        raise ValueError("it does not begin with the glTF header of 12 bytes")
    length = struct.unpack("<I", data[8:12])[0]
    if len(data) < length:
        raise ValueError(f"truncated: its header promises {length} bytes, the file has {len(data)}")


def _check_obj(data: bytes) -> tuple[bytes, int]:
    """Vertices of three numbers, faces of three corners, indices from one. The format has no totals.

    Relative indices (-1 is the latest vertex so far) become absolute: a reader that looks at them after all
    vertices are known takes them for the last of the file.
    """
    data = _plain_line_ends(data).replace(b"\\\n", b" ")
    lines = data.split(b"\n")
    seen = {b"v": 0, b"vt": 0, b"vn": 0}
    triangles, foreign = 0, False
    for row, line in enumerate(lines):
        words = line.partition(b"#")[0].split()
        key = words[0] if words else b""
        if key in seen:
            seen[key] += 1
        elif key and key != b"f":
            foreign = True
        if key in (b"v", b"f") and len(words) < 4:
            raise ValueError(f"truncated or corrupt: '{_shown(line)}' has not three {_PARTS[key]}")
        triangles += len(words) - 3 if key == b"f" else 0
        if key == b"f" and (b" -" in line or b"/-" in line or b" 0" in line):
            corners = [_absolute_corner(corner, tuple(seen.values()), line) for corner in words[1:]]
            lines[row] = b"f " + b" ".join(corners)
    if foreign and seen[b"v"] == 0:
        raise ValueError("it has no vertex ('v x y z')")
    return b"\n".join(lines), triangles


_PARTS = {b"v": "coordinates", b"f": "corners"}


def _absolute_corner(corner: bytes, seen: tuple[int, ...], line: bytes) -> bytes:
    """A corner ``v/vt/vn`` with -k replaced by what is k before the next."""
    parts = corner.split(b"/")
    for place, (part, count) in enumerate(zip(parts, seen, strict=False)):
        index = int(part) if part else 1
        if index < 0:
            index += count + 1
            parts[place] = b"%d" % index
        if index < 1:
            raise ValueError(f"corrupt: '{_shown(line)}' names '{part.decode()}', which is before the first")
    return b"/".join(parts)


def _shown(line: bytes) -> str:
    return line.decode("latin-1").strip()[:60]
