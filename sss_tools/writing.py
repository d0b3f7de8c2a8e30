"""Meshes to files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .errors import InputError
from .files import write_atomically
from .mesh import Mesh

_ATTRIBUTES = {
    "normal": (("nx", "ny", "nz"), "<f4", "float"),
    "uv": (("s", "t"), "<f4", "float"),
    "color": (("red", "green", "blue", "alpha"), "u1", "uchar"),
}


def write_mesh(mesh: Mesh, path: str | Path) -> None:
    """Write a binary PLY file with the vertex attributes "normal", "uv" and "color".

    Positions are single precision where that loses nothing, double otherwise: reading gives the same vertices.
    The file appears whole or not at all, and replaces an older one only when it is complete.
    Raises InputError where it cannot be written or ``path`` does not end in .ply.
    """
    path = Path(path)
    if path.suffix.lower() != ".ply":
        raise InputError(path, "meshes are written as PLY only", "end the name in .ply")
    data = ply_bytes(mesh)
    try:
        write_atomically(path, data)
    except OSError as error:
        raise InputError(
            path, f"cannot be written ({error.strerror})", "choose a folder that exists and can be written to"
        ) from None


def ply_bytes(mesh: Mesh) -> bytes:
    """The mesh as a binary PLY file."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = np.array_equal(mesh.vertices.astype(np.float32), mesh.vertices, equal_nan=True)
    kind, name = ("<f4", "float") if single else ("<f8", "double")
    columns = [(axis, kind, name, mesh.vertices[:, k]) for k, axis in enumerate("xyz")]
    for attribute, (fields, kind, name) in _ATTRIBUTES.items():
        if attribute in mesh.vertex_attributes:
            values = mesh.vertex_attributes[attribute]
            columns += [(field, kind, name, values[:, k]) for k, field in enumerate(fields[: values.shape[1]])]
    vertices = np.empty(len(mesh.vertices), [(field, kind) for field, kind, _, _ in columns])
    for field, _, _, values in columns:
        vertices[field] = values
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property {name} {field}" for field, _, name, _ in columns),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()
