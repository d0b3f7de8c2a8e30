"""Damaged mesh files: small valid ones of every format, and what may happen to their bytes.

Input ``number`` of a seed is the same wherever it is made, so that a run can be resumed and a failure repeated.
"""

from __future__ import annotations

import base64
import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from sss_tools import shapes
from sss_tools.mesh import Mesh

_WORDS = (b"nan", b"inf", b"-1", b"0", b"1e999", b"-0.0", b"2147483648", b"4294967295", b"99999999999999999999", b"x")
_INTEGERS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)


@lru_cache
def valid_files() -> dict[str, tuple[str, bytes]]:
    """A small valid file of every kind: name of the kind -> suffix, bytes."""
    import trimesh

    mesh = shapes.hollow_ball(subdivisions=1)
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    scene = trimesh.Scene({"left": body, "right": body.copy().apply_translation([3, 0, 0])})
    exported = {
        kind: (suffix, _bytes(body.export(file_type=file_type)))
        for kind, suffix, file_type in (
            ("stl", ".stl", "stl"),
            ("stl-ascii", ".stl", "stl_ascii"),
            ("ply", ".ply", "ply"),
            ("off", ".off", "off"),
            ("obj", ".obj", "obj"),
            ("glb", ".glb", "glb"),
            ("dae", ".dae", "dae"),
        )
    }
    return {
        **exported,
        "ply-ascii": (".ply", _ascii_ply(mesh)),
        "obj-polygons": (".obj", _polygon_obj()),
        "gltf": (".gltf", _embedded_gltf(mesh)),
        "3mf": (".3mf", _bytes(scene.export(file_type="3mf"))),
    }


def damaged(seed: int, number: int) -> tuple[str, str, bytes]:
    """Kind, suffix and bytes of an input."""
    chance = random.Random(f"{seed}:{number}")
    kinds = sorted(valid_files())
    kind = kinds[number % len(kinds)]
    suffix, data = valid_files()[kind]
    other = chance.choice([content for name, (end, content) in valid_files().items() if end == suffix])
    inner = chance.random() < 0.5
    if inner and suffix == ".3mf":
        return kind, suffix, damaged_zip(data, chance)
    if inner and suffix == ".glb":
        return kind, suffix, _damaged_glb(data, chance)
    return kind, suffix, damaged_in_places(data, other, chance)


def damaged_in_places(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """The bytes damaged once to eight times; pieces of ``other`` may come in."""
    for _ in range(chance.choice((1, 1, 1, 2, 3, 8))):
        data = chance.choice(_DAMAGES)(data, other, chance)
    return data


# ---- what may happen to bytes ----


def _flip(data: bytes, other: bytes, chance: random.Random) -> bytes:
    place = chance.randrange(max(len(data), 1))
    return data[:place] + bytes([data[place] ^ 1 << chance.randrange(8)]) + data[place + 1 :] if data else data


def _cut(data: bytes, other: bytes, chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data) + 1)]


def _drop(data: bytes, other: bytes, chance: random.Random) -> bytes:
    start, length = _range(data, chance)
    return data[:start] + data[start + length :]


def _repeat(data: bytes, other: bytes, chance: random.Random) -> bytes:
    start, length = _range(data, chance)
    return data[: start + length] + data[start:]


def _noise(data: bytes, other: bytes, chance: random.Random) -> bytes:
    start, length = _range(data, chance)
    return data[:start] + chance.randbytes(length) + data[start + length * chance.randrange(2) :]


def _splice(data: bytes, other: bytes, chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data) + 1)] + other[chance.randrange(len(other) + 1) :]


def _word(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """Another number, or none, where a number is written in digits."""
    numbers = list(re.finditer(rb"-?\d[\d.eE+-]*", data))
    if not numbers:
        return _integer(data, other, chance)
    found = chance.choice(numbers)
    return data[: found.start()] + chance.choice(_WORDS) + data[found.end() :]


def _integer(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """A number at the edge of its range, in 1, 2 or 4 bytes."""
    place, width = chance.randrange(len(data) + 1), chance.choice((1, 2, 4))
    value = struct.pack("<I", chance.choice(_INTEGERS))[:width]
    return data[:place] + value + data[place + width :]


def _float(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """A number that is none, or far too large, or denormal."""
    place = chance.randrange(len(data) + 1)
    value = struct.pack("<f", chance.choice((float("nan"), float("inf"), 3.4e38, -3.4e38, 1e-45)))
    return data[:place] + value + data[place + 4 :]


_DAMAGES: tuple[Callable[[bytes, bytes, random.Random], bytes], ...] = (
    *(_flip, _cut, _drop, _repeat, _noise, _splice, _word, _word, _integer, _float),
)


def _range(data: bytes, chance: random.Random) -> tuple[int, int]:
    return chance.randrange(len(data) + 1), chance.choice((1, 2, 4, 12, 50, 200))


def damaged_zip(data: bytes, chance: random.Random) -> bytes:
    """One member damaged, the archive sound: damage from outside stops at its checksums."""
    source, target = zipfile.ZipFile(io.BytesIO(data)), io.BytesIO()
    victim = chance.choice(source.namelist())
    with zipfile.ZipFile(target, "w") as archive:
        for name in source.namelist():
            content = source.read(name)
            archive.writestr(name, damaged_in_places(content, content, chance) if name == victim else content)
    return target.getvalue()


def _damaged_glb(data: bytes, chance: random.Random) -> bytes:
    """The description damaged, the lengths sound."""
    length = struct.unpack("<I", data[12:16])[0]
    text = damaged_in_places(data[20 : 20 + length], data[20 : 20 + length], chance)
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    total = 20 + len(text) + len(rest)
    return data[:8] + struct.pack("<II", total, len(text)) + data[16:20] + text + rest


# ---- valid files that no exporter at hand writes ----


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def _ascii_ply(mesh: Mesh) -> bytes:
    rows = ["ply", "format ascii 1.0", f"element vertex {len(mesh.vertices)}"]
    rows += [f"property float {axis}" for axis in "xyz"]
    rows += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    rows += [" ".join(map(str, corner)) for corner in mesh.vertices.tolist()]
    rows += ["3 " + " ".join(map(str, face)) for face in mesh.faces.tolist()]
    return ("\n".join(rows) + "\n").encode()


def _polygon_obj() -> bytes:
    """A cube of quads with texture coordinates, groups, relative indices and a continued line."""
    corners = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ["f 1/1 2/2 4/3 3/4", "f 5/1 7/2 8/3 6/4", "f 1/1 5/2 6/3 2/4", "f -6/1 -5/2 -1/3 -2/4"]
    faces += ["f 1/1 3/2 7/3 \\\n 5/4", "f 2/1 6/2 8/3 4/4"]
    return "\n".join(["# cube", "g cube", *corners, "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", *faces, ""]).encode()


def _embedded_gltf(mesh: Mesh) -> bytes:
    points, corners = mesh.vertices.astype("<f4"), mesh.faces.astype("<u4")
    data = points.tobytes() + corners.tobytes()
    bounds = {"min": np.min(points, axis=0).tolist(), "max": np.max(points, axis=0).tolist()}
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
        {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
    ]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3", **bounds},
        {"bufferView": 1, "componentType": 5125, "count": corners.size, "type": "SCALAR"},
    ]
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [
                {
                    "byteLength": len(data),
                    "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
                }
            ],
        }
    ).encode()
