"""What a glTF file (its JSON) promises: buffers, arrays, nodes, held against what is there.

Everything here raises ValueError, KeyError or TypeError, with the rest of a sentence about the file where it has one.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from typing import Any

from . import unfolding

_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_VALUES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_HEADER = 20
"""Bytes of a glb file before its JSON, whose length they end with."""


def without_images(suffix: str, data: bytes) -> bytes:
    """The same file without images: a check needs none, and whoever decodes them may meet anything."""
    tree = read_tree(suffix, data)
    if not tree.pop("images", None):
        return data
    text = json.dumps(tree).encode()
    if suffix == ".gltf":
        return text
    text += b" " * (-len(text) % 4)
    rest = data[_HEADER + _json_length(data) :]
    return data[:8] + struct.pack("<II", _HEADER + len(text) + len(rest), len(text)) + data[16:_HEADER] + text + rest


def read_tree(suffix: str, data: bytes) -> dict[str, Any]:
    """The JSON of a gltf or glb file."""
    text = data if suffix == ".gltf" else data[_HEADER : _HEADER + _json_length(data)]
    tree = json.loads(text)
    if not isinstance(tree, dict):
        raise ValueError("its JSON is no object")
    return tree


def _json_length(data: bytes) -> int:
    return struct.unpack("<I", data[12:16])[0] if len(data) >= _HEADER else 0


def check(suffix: str, data: bytes, size_of: Callable[[str], int]) -> None:
    """Refuse arrays and scenes that unfold to far more than the file and its buffers hold.

    size_of  bytes of a file beside this one, by name
    """
    tree = read_tree(suffix, data)
    names = {buffer["uri"] for buffer in tree.get("buffers", []) if "uri" in buffer}
    size = len(data) + sum(size_of(name) for name in names if "base64," not in name)
    # views and arrays are copied out of the buffers one by one; primitives share arrays, not what becomes of them
    unfolding.check_geometry(sum(_count(view["byteLength"]) for view in tree.get("bufferViews", [])), size)
    arrays = [_array_bytes(accessor) for accessor in tree.get("accessors", [])]
    unfolding.check_geometry(sum(arrays), size)
    used = 0
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            places = [*primitive["attributes"].values(), *([primitive["indices"]] if "indices" in primitive else [])]
            used += sum(arrays[place] for place in places if 0 <= place < len(arrays))
    unfolding.check_geometry(used, size)
    _check_nodes(tree)


def _array_bytes(accessor: dict[str, Any]) -> int:
    return _count(accessor["count"]) * _BYTES[accessor["componentType"]] * _VALUES[accessor["type"]]


def _count(value: Any) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"it counts {str(value)[:40]} of something")
    return value


def _check_nodes(tree: dict[str, Any]) -> None:
    """Nodes are trees, says the format; readers that meet another graph lose parts of it, or never end."""
    nodes = tree.get("nodes", [])
    parents: dict[int, int] = {}
    for number, node in enumerate(nodes):
        for child in node.get("children", []):
            if parents.setdefault(child, number) != number:
                raise ValueError(f"its node {child} is a child of two others")
    roots = [number for number in range(len(nodes)) if number not in parents]
    reached = unfolding.check_tree(roots, lambda number: nodes[number].get("children", []), lambda number: 1)
    if reached < len(nodes):
        raise ValueError("a node of its scene contains itself")
