"""OBJ and GLB with the materials of the file the mesh came from."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..loading import load_checked
from ..mesh import Mesh
from ..reading import read_file

_IMAGES = ("PNG", "JPEG", "WEBP")
_TEXTURES = ("baseColorTexture", "metallicRoughnessTexture", "normalTexture", "occlusionTexture", "emissiveTexture")
_MOST_PIXELS = 2**26


def obj_bytes(mesh: Mesh, source: Mesh, folder: Path) -> bytes:
    """An OBJ file for ``folder`` that uses the source's material libraries where they lie."""
    assert source.path is not None
    lines = []
    for line in source.path.read_text(errors="replace").splitlines():
        words = line.split(maxsplit=1)
        if len(words) == 2 and words[0] == "mtllib":
            library = os.path.relpath(source.path.parent / words[1].strip(), folder).replace(os.sep, "/")
            lines.append(f"mtllib {library}")
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    uv, normal = mesh.vertex_attributes.get("uv"), mesh.vertex_attributes.get("normal")
    if uv is not None:
        lines += [f"vt {u!r} {v!r}" for u, v in uv.tolist()]
    if normal is not None:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in normal.tolist()]
    corner = {
        (False, False): "{0}",
        (True, False): "{0}/{0}",
        (False, True): "{0}//{0}",
        (True, True): "{0}/{0}/{0}",
    }[uv is not None, normal is not None]
    for body in mesh.bodies:
        lines.append(f"o {body.name}")
        if body.material:
            lines.append(f"usemtl {body.material}")
        faces = mesh.faces[body.first_face : body.first_face + body.face_count] + 1
        lines += ["f " + " ".join(corner.format(index) for index in face) for face in faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def glb_bytes(mesh: Mesh, source: Mesh, mark: Callable[[bytes], dict[str, Any]]) -> bytes:
    """A binary glTF file with the source's materials and textures.

    mark  given the binary chunk, what goes into ``asset.extras``
    """
    import trimesh

    assert source.path is not None
    materials: dict[str, Any] = {}
    for geometry in load_checked(source.path, read_file(source.path))[0].geometry.values():
        material = getattr(getattr(geometry, "visual", None), "material", None)
        if getattr(material, "name", None):
            _drop_odd_images(material)
            materials[str(getattr(material, "name", ""))] = material
    scene = trimesh.Scene()
    for number, body in enumerate(mesh.bodies):
        faces = mesh.faces[body.first_face : body.first_face + body.face_count]
        used, compact = np.unique(faces, return_inverse=True)
        part: Any = trimesh.Trimesh(mesh.vertices[used], compact.reshape(-1, 3), process=False)
        uv = mesh.vertex_attributes.get("uv")
        if body.material in materials:
            part.visual = trimesh.visual.TextureVisuals(
                uv=None if uv is None else uv[used], material=materials[body.material]
            )
        elif "color" in mesh.vertex_attributes:
            part.visual.vertex_colors = mesh.vertex_attributes["color"][used]
        if "normal" in mesh.vertex_attributes:
            part.vertex_normals = mesh.vertex_attributes["normal"][used]
        scene.add_geometry(part, geom_name=f"{body.name}_{number}", node_name=f"{body.name}_{number}")
    return _with_extras(scene.export(file_type="glb"), mark)


def _drop_odd_images(material: Any) -> None:
    """Keep the images that glTF allows. Others may be of kinds that are decoded by other programs, or far too large;
    until now only their headers were looked at."""
    for name in _TEXTURES:
        image = getattr(material, name, None)
        if image is not None and (image.format not in _IMAGES or image.width * image.height > _MOST_PIXELS):
            setattr(material, name, None)


def _with_extras(data: bytes, mark: Callable[[bytes], dict[str, Any]]) -> bytes:
    """A binary glTF file with ``asset.extras`` set."""
    length = struct.unpack("<I", data[12:16])[0]
    binary = data[20 + length :]
    header = json.loads(data[20 : 20 + length])
    header["asset"]["extras"] = mark(binary[8:])
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(binary), len(text), 0x4E4F534A) + text + binary
