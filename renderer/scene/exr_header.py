"""What an OpenEXR file promises, before a library makes room for it.

"OpenEXR File Layout", openexr.com: a magic number, a version, then for each part attributes (name, type, size, value),
the last followed by a zero byte; parts of multi-part files are ended by one more.
"""

from __future__ import annotations

import struct

_MAGIC = b"\x76\x2f\x31\x01"
_MULTI_PART, _DEEP = 0x1000, 0x800
_BYTES = {0: 4, 1: 2, 2: 4}
"""Of a value: unsigned integer, half, float."""
_LONGEST_NAME = 256


def unfolded_bytes(data: bytes) -> int:
    """Bytes of all pixels of all parts. Raises ValueError, or struct.error, for a header that makes no sense."""
    if data[:4] != _MAGIC:
        raise ValueError("it does not begin as OpenEXR does")
    version = struct.unpack_from("<I", data, 4)[0]
    if version & _DEEP:
        raise ValueError("it holds several values a pixel (deep data)")
    position, total = 8, 0
    while True:
        attributes, position = _attributes(data, position)
        if not attributes and total:
            return total
        left, bottom, right, top = struct.unpack("<4i", attributes.get("dataWindow", b""))
        if right < left or top < bottom:
            raise ValueError("its data window is empty")
        total += (right - left + 1) * (top - bottom + 1) * _bytes_a_pixel(attributes.get("channels", b""))
        if not version & _MULTI_PART:
            return total


def _attributes(data: bytes, position: int) -> tuple[dict[str, bytes], int]:
    """The attributes of a part that begin at ``position``, and where they end."""
    found: dict[str, bytes] = {}
    while data[position : position + 1] != b"\0":
        name, position = _name(data, position)
        _, position = _name(data, position)
        (size,) = struct.unpack_from("<i", data, position)
        position += 4
        if not 0 <= size <= len(data) - position:
            raise ValueError(f"its attribute {name[:40]!r} has {size} bytes")
        found[name] = data[position : position + size]
        position += size
    return found, position + 1


def _name(data: bytes, position: int) -> tuple[str, int]:
    """The text that starts at ``position``, and where the next thing starts."""
    end = data.find(b"\0", position, position + _LONGEST_NAME)
    if end < 0:
        raise ValueError("its header ends within a name")
    return data[position:end].decode("latin-1"), end + 1


def _bytes_a_pixel(channels: bytes) -> int:
    """Of a list of channels: name, kind of value, 4 bytes that do not matter here, and the sampling in x and y."""
    position, total = 0, 0
    while channels[position : position + 1] != b"\0":
        _, position = _name(channels, position)
        (kind,) = struct.unpack_from("<i", channels, position)
        total += _BYTES.get(kind, 4)
        position += 16
    return total
