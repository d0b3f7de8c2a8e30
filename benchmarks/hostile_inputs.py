"""Meshes made to harm whoever reads them, one function each; ``hostile_scenes`` has scenes and parts of renders.

``attack`` registers what a function writes into a folder: it returns the file to read. ``reader`` says who reads it: a
mesh file by the check, a scene by the renderer, a part by merge. ``says`` is what the one line must contain; None where
the file is no lie, and must only be got through.
"""

from __future__ import annotations

import base64
import io
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from sss_tools import shapes
from sss_tools.writing import ply_bytes

Reader = Literal["mesh", "scene", "part"]
MIB = 2**20


@dataclass(frozen=True)
class Attack:
    """A hostile file. ``heavy``: too long for a test that runs with every change."""

    name: str
    reader: Reader
    says: str | None
    write: Callable[[Path], Path]
    heavy: bool = False


ATTACKS: list[Attack] = []


def attack(reader: Reader, says: str | None, heavy: bool = False) -> Callable:
    """Register a function that writes a hostile file; its docstring is the attack's name."""

    def register(write: Callable[[Path], Path]) -> Callable[[Path], Path]:
        assert write.__doc__
        ATTACKS.append(Attack(write.__doc__, reader, says, write, heavy))
        return write

    return register


def put(path: Path, data: bytes | str) -> Path:
    """Write a file."""
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def png(width: int, height: int, data: bytes = b"") -> bytes:
    """A PNG file of 8-bit RGB that holds ``data``."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


# ---- headers that promise what is not there ----


@attack("mesh", "promises 1000000000 of 'vertex'")
def _(folder: Path) -> Path:
    """PLY that promises 1e9 vertices"""
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\n"
    return put(folder / "a.ply", header + "property float x\nproperty float y\nproperty float z\nend_header\n0000")


@attack("mesh", "promises 3 of 'face'")
def _(folder: Path) -> Path:
    """PLY with a list of 2^31 corners"""
    header = "ply\nformat binary_little_endian 1.0\nelement face 3\nproperty list uint int vertex_indices\nend_header\n"
    return put(folder / "a.ply", header.encode() + struct.pack("<I", 2**31) + bytes(1000))


@attack("mesh", "promises 4000000000 faces")
def _(folder: Path) -> Path:
    """STL that promises 4e9 faces"""
    return put(folder / "a.stl", bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(50))


@attack("mesh", "promises 1000000000 vertices")
def _(folder: Path) -> Path:
    """OFF that promises 1e9 vertices"""
    return put(folder / "a.off", "OFF\n1000000000 1000000000 0\n0 0 0\n")


@attack("mesh", "index 999999999")
def _(folder: Path) -> Path:
    """OBJ whose face names vertex 1e9"""
    return put(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 1000000000\n")


@attack("mesh", "promises 4294967295 bytes")
def _(folder: Path) -> Path:
    """GLB that promises 4 GiB"""
    return put(folder / "a.glb", b"glTF" + struct.pack("<IIII", 2, 0xFFFFFFFF, 0xFFFFFFF0, 0x4E4F534A) + b"{}")


# ---- glTF ----


def gltf(folder: Path, uri: str | None = None, length: int | None = None, **changes: object) -> Path:
    """A tetrahedron with its buffer in the file, or at ``uri``."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
    corners = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], "<u4")
    data = points.tobytes() + corners.tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
        ],
        "buffers": [
            {
                "byteLength": length or len(data),
                "uri": uri or "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }
    return put(folder / "a.gltf", json.dumps({**tree, **changes}))


for _uri, _says in (
    ("http://127.0.0.1:9/a.bin", "nothing is fetched"),
    ("https://example.com/a.bin", "nothing is fetched"),
    ("file:///etc/passwd", "nothing is fetched"),
    ("../../../../../../../etc/passwd", "outside its folder"),
    ("/etc/passwd", "outside its folder"),
    ("data:text/plain,abc", "nothing is fetched"),
):
    ATTACKS.append(Attack(f"glTF buffer at {_uri}", "mesh", _says, lambda folder, uri=_uri: gltf(folder, uri)))


@attack("mesh", "outside its folder")
def _(folder: Path) -> Path:
    """glTF buffer behind a link that leaves the folder"""
    inner = folder / "inner"
    inner.mkdir()
    (inner / "a.bin").symlink_to("/etc/passwd")
    return gltf(inner, "a.bin")


@attack("mesh", "is a pipe")
def _(folder: Path) -> Path:
    """glTF buffer that is a pipe"""
    os.mkfifo(folder / "a.bin")
    return gltf(folder, "a.bin")


@attack("mesh", "unfold to")
def _(folder: Path) -> Path:
    """glTF array of 1e9 zeros without a buffer"""
    accessor = {"componentType": 5126, "count": 10**9, "type": "VEC3"}
    return gltf(folder, accessors=[accessor, {**accessor, "componentType": 5125, "type": "SCALAR"}])


@attack("mesh", "unfold to")
def _(folder: Path) -> Path:
    """glTF with 10 000 views of one buffer of 1 MiB in the file"""
    data = "data:;base64," + base64.b64encode(bytes(MIB)).decode()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": MIB}] * 10_000
    return gltf(folder, data, MIB, bufferViews=views)


@attack("mesh", "contains itself")
def _(folder: Path) -> Path:
    """glTF nodes in a circle beside the scene"""
    return gltf(folder, nodes=[{"mesh": 0}, {"children": [2]}, {"children": [1]}])


@attack("mesh", "is a child of two others")
def _(folder: Path) -> Path:
    """glTF nodes that double 40 times"""
    nodes = [{"children": [number + 1, number + 2]} for number in range(40)]
    return gltf(folder, nodes=[*nodes, {"mesh": 0}, {"mesh": 0}])


@attack("mesh", "contains itself")
def _(folder: Path) -> Path:
    """glTF scene whose root is its own grandchild"""
    return gltf(folder, nodes=[{"children": [1], "mesh": 0}, {"children": [0]}])


@attack("mesh", "levels of nodes")
def _(folder: Path) -> Path:
    """glTF with 100 000 nodes inside each other"""
    count = 100_000
    nodes = [{"children": [number + 1]} for number in range(count - 1)] + [{"mesh": 0}]
    return gltf(folder, nodes=nodes)


@attack("mesh", "unfold to")
def _(folder: Path) -> Path:
    """glTF that places 100 000 triangles 20 000 times"""
    accessor = {"bufferView": 0, "componentType": 5126, "count": 300_000, "type": "VEC3"}
    view = {"buffer": 0, "byteOffset": 0, "byteLength": 3_600_000}
    nodes = [{"children": list(range(1, 20_001))}, *({"mesh": 0} for _ in range(20_000))]
    put(folder / "a.bin", bytes(3_600_000))
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
    return gltf(folder, "a.bin", nodes=nodes, accessors=[accessor], bufferViews=[view], meshes=meshes)


@attack("mesh", "unreadable gltf")
def _(folder: Path) -> Path:
    """glTF of 1e6 opening brackets"""
    return put(folder / "a.gltf", '{"nodes":' + "[" * 1_000_000)


@attack("mesh", None)
def _(folder: Path) -> Path:
    """glTF with a PostScript texture and one of 1e10 pixels"""
    images = [{"uri": "a.eps"}, {"uri": "a.png"}]
    put(folder / "a.eps", "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n(w) (written) file\n")
    put(folder / "a.png", png(100_000, 100_000))
    textures = [{"source": 0}, {"source": 1}]
    materials = [{"name": "m", "pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in (0, 1)]
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": k}]} for k in (0, 1)]
    return gltf(folder, images=images, textures=textures, materials=materials, meshes=meshes)


# ---- archives and XML ----

_LAUGHS = "<!DOCTYPE x [" + '<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {after} "{f"&{before};" * 10}">' for before, after in zip("abcdefghi", "bcdefghij", strict=True)
)  # fmt: skip
_FOREIGN = '<!DOCTYPE x [<!ENTITY j SYSTEM "file:///etc/passwd">'
_3MF = '<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">{}</model>'
_TETRAHEDRON = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/>'
    '<vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>'
    '<triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/></triangles></mesh>'
)


def threemf(folder: Path, model: str | bytes, **others: bytes) -> Path:
    """A 3mf file with this model."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
        for name, data in others.items():
            archive.writestr(name, data)
    return put(folder / "a.3mf", target.getvalue())


def _objects(count: int, times: int, last: int = 0) -> str:
    """Objects of which each holds the one before ``times`` times; the first holds ``last``, or a mesh."""
    first = f'<components><component objectid="{last}"/></components>' if last else _TETRAHEDRON
    objects = [f'<object id="1">{first}</object>']
    for number in range(2, count + 1):
        components = f'<component objectid="{number - 1}"/>' * times
        objects.append(f'<object id="{number}"><components>{components}</components></object>')
    return f'<resources>{"".join(objects)}</resources><build><item objectid="{count}"/></build>'


@attack("mesh", "unfold to")
def _(folder: Path) -> Path:
    """3mf of 128 MiB of spaces, deflated"""
    return threemf(folder, _3MF.format(" " * 2**27))


@attack("mesh", "document type")
def _(folder: Path) -> Path:
    """3mf with entities of 1e9 laughs"""
    return threemf(folder, f"{_LAUGHS}]><x>&j;</x>")


@attack("mesh", "document type")
def _(folder: Path) -> Path:
    """3mf with an entity that is a file"""
    return threemf(folder, f"{_FOREIGN}]><x>&j;</x>")


@attack("mesh", "document type")
def _(folder: Path) -> Path:
    """3mf in UTF-16 with an entity that is a file"""
    return threemf(folder, f'<?xml version="1.0" encoding="UTF-16"?>{_FOREIGN}]><x>&j;</x>'.encode("utf-16"))


@attack("mesh", "unfolds to more than")
def _(folder: Path) -> Path:
    """3mf components that double 40 times"""
    return threemf(folder, _3MF.format(_objects(40, 2)))


@attack("mesh", "contains itself")
def _(folder: Path) -> Path:
    """3mf components in a circle"""
    return threemf(folder, _3MF.format(_objects(3, 1, last=3)))


@attack("mesh", "unfold to")
def _(folder: Path) -> Path:
    """3mf whose 20 000 components each name a file of 1 MiB"""
    path = 'p:path="/b.model" xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
    components = f'<component objectid="9" {path}/>' * 20_000
    model = f'<resources><object id="1"><components>{components}</components></object></resources><build/>'
    return threemf(folder, _3MF.format(model), **{"b.model": _3MF.format(" " * MIB).encode()})


_DAE = (
    '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><up_axis>Y_UP</up_ax'
    'is></asset><library_geometries><geometry id="g"><mesh><source id="s"><float_array id="f" count="12">0 0 0'
    ' 1 0 0 0 1 0 0 0 1</float_array><technique_common><accessor source="#f" count="4" stride="3"><param name='
    '"X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_comm'
    'on></source><vertices id="v"><input semantic="POSITION" source="#s"/></vertices><triangles count="4"><inp'
    'ut semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>'
    '</library_geometries><library_nodes>{}</library_nodes><library_visual_scenes><visual_scene id="w">{}</vis'
    'ual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>'
)


@attack("mesh", "document type")
def _(folder: Path) -> Path:
    """dae with entities of 1e9 laughs"""
    return put(folder / "a.dae", f"{_LAUGHS}]><x>&j;</x>")


@attack("mesh", "document type")
def _(folder: Path) -> Path:
    """dae with an entity that is a file"""
    return put(folder / "a.dae", f"{_FOREIGN}]><x>&j;</x>")


@attack("mesh", "unfolds to more than")
def _(folder: Path) -> Path:
    """dae nodes that double 40 times"""
    nodes = ['<node id="n1"><instance_geometry url="#g"/></node>']
    nodes += [f'<node id="n{k + 1}">{f"""<instance_node url="#n{k}"/>""" * 2}</node>' for k in range(1, 41)]
    return put(folder / "a.dae", _DAE.format("".join(nodes), '<node id="r"><instance_node url="#n41"/></node>'))


@attack("mesh", "contains itself")
def _(folder: Path) -> Path:
    """dae nodes in a circle"""
    nodes = '<node id="a"><instance_node url="#b"/></node><node id="b"><instance_node url="#a"/></node>'
    return put(folder / "a.dae", _DAE.format(nodes, '<node id="r"><instance_node url="#a"/></node>'))


@attack("mesh", "nested more than")
def _(folder: Path) -> Path:
    """dae of 100 000 elements inside each other"""
    return put(folder / "a.dae", "<node>" * 100_000 + "</node>" * 100_000)


@attack("mesh", "it is an archive")
def _(folder: Path) -> Path:
    """dae that is a zip archive of 128 MiB"""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.dae", "w") as file:
        for _ in range(8):
            file.write(bytes(16 * MIB))
    return put(folder / "a.dae", target.getvalue())


# ---- what is no file, names, libraries of materials ----


@attack("mesh", "is a device")
def _(folder: Path) -> Path:
    """mesh that is a link to a device without end"""
    (folder / "a.stl").symlink_to("/dev/zero")
    return folder / "a.stl"


@attack("mesh", "is a pipe")
def _(folder: Path) -> Path:
    """mesh that is a pipe nobody writes to"""
    os.mkfifo(folder / "a.ply")
    return folder / "a.ply"


@attack("mesh", "cannot be read")
def _(folder: Path) -> Path:
    """mesh that is a link to itself"""
    (folder / "a.ply").symlink_to("a.ply")
    return folder / "a.ply"


@attack("mesh", "\\x1b]0;x\\x07")
def _(folder: Path) -> Path:
    """name with line breaks and orders to the terminal"""
    return put(folder / "a\n::error::b\r\x1b]0;x\x07\u202e.ply", "x")


@attack("mesh", None)
def _(folder: Path) -> Path:
    """OBJ whose library of materials is a device, with a PostScript texture"""
    (folder / "a.mtl").symlink_to("/dev/zero")
    put(folder / "b.eps", "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n")
    put(folder / "b.mtl", "newmtl m\nmap_Kd b.eps\n")
    faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl m\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    return put(folder / "a.obj", f"mtllib a.mtl\nmtllib b.mtl\nmtllib ../../etc/passwd\n{faces}")


def _one_vertex(folder: Path, count: int) -> Path:
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n"
    header += "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    return put(folder / "a.ply", header.encode() + bytes(12 * count) + struct.pack("<Biii", 3, 0, 1, 2))


@attack("mesh", None)
def _(folder: Path) -> Path:
    """mesh of one vertex 1e5 times"""
    return _one_vertex(folder, 100_000)


@attack("mesh", None, heavy=True)
def _(folder: Path) -> Path:
    """mesh of one vertex 1e7 times"""
    return _one_vertex(folder, 10_000_000)


def _same_faces(folder: Path, count: int) -> Path:
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    header += f"property float z\nelement face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    return put(folder / "a.ply", header.encode() + points + struct.pack("<Biii", 3, 0, 1, 2) * count)


@attack("mesh", None)
def _(folder: Path) -> Path:
    """mesh of one face 2000 times"""
    return _same_faces(folder, 2_000)


@attack("mesh", None, heavy=True)
def _(folder: Path) -> Path:
    """mesh of one face 10 000 times"""
    return _same_faces(folder, 10_000)


# ---- records ----


@attack("mesh", None)
def _(folder: Path) -> Path:
    """record that is nested 1e6 deep"""
    put(folder / "a.ply.sss.json", "[" * 1_000_000)
    return put(folder / "a.ply", ply_bytes(shapes.icosphere(1.0, 1)))


@attack("mesh", None)
def _(folder: Path) -> Path:
    """record of 8 GiB"""
    with (folder / "a.ply.sss.json").open("wb") as file:
        file.truncate(8 * 2**30)
    return put(folder / "a.ply", ply_bytes(shapes.icosphere(1.0, 1)))


@attack("mesh", None)
def _(folder: Path) -> Path:
    """record that is a pipe"""
    os.mkfifo(folder / "a.ply.sss.json")
    return put(folder / "a.ply", ply_bytes(shapes.icosphere(1.0, 1)))
