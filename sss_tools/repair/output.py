"""Where a repaired mesh goes, in which format, and when an older file may be replaced."""

from __future__ import annotations

import hashlib
import json
import os
import struct
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import write_atomically
from ..mesh import Mesh
from ..writing import ply_bytes
from .textured import glb_bytes, obj_bytes

MARKER = "sss-check fix"
"""Stands in a comment of what we wrote, before a hash of all that follows it: a file that was edited since is not
ours any more."""


def plan_outputs(meshes: Iterable[str], given: Iterable[str], folder: str | None = None) -> dict[str, str]:
    """Where the result of each of ``meshes`` goes, without the extension: ``STEM.fixed``.

    given   the PATHs the meshes were found by; below ``folder`` the way from there is mirrored
    folder  where results go; None for beside each mesh
    Two with the same place keep their extensions (``x.stl.fixed``). Raises InputError where even that does not
    tell them apart.
    """
    roots = [Path(path) for path in given if path != "-" and Path(path).is_dir()]
    places: dict[str, Path] = {}
    for mesh in meshes:
        path = Path(mesh)
        if folder is None:
            places[mesh] = path.parent
            continue
        root = next((root for root in roots if path.is_relative_to(root)), path.parent)
        places[mesh] = Path(folder) / path.parent.relative_to(root)
    names: dict[tuple[str, str], list[str]] = defaultdict(list)
    for mesh, place in places.items():
        # file systems that ignore case must not make two results one
        names[os.path.realpath(place), Path(mesh).stem.lower()].append(mesh)
    outputs: dict[str, str] = {}
    for group in names.values():
        for mesh in group:
            stem = Path(mesh).name if len(group) > 1 else Path(mesh).stem
            outputs[mesh] = str(places[mesh] / f"{stem}.fixed")
        if len({outputs[mesh].lower() for mesh in group}) < len(group):
            raise InputError(
                ", ".join(group), "their results would be written to the same file", "repair them one at a time"
            )
    return outputs


def write_result(mesh: Mesh, source: Mesh, place: str) -> tuple[Path, list[str]]:
    """Write the repaired ``mesh`` of ``source`` to ``place`` plus an extension; its path, and what that lost.

    PLY, or the source's format where that keeps materials that PLY would lose. An older file is replaced,
    atomically, only if we wrote it and nobody changed it. Raises InputError where it may not or cannot be written.
    """
    suffix, data, lost = encoded(mesh, source, place)
    path = Path(place + suffix)
    if path.is_symlink() or (path.exists() and not is_ours(path)):
        raise InputError(path, "exists and was not written by sss-check", "move it away, or use --fix-out")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    except OSError as error:
        raise InputError(
            path, f"cannot be written ({error.strerror})", "use --fix-out with a folder you may write to"
        ) from None
    return path, lost


def encoded(mesh: Mesh, source: Mesh, place: str) -> tuple[str, bytes, list[str]]:
    """The suffix, the bytes and what is lost with them."""
    materials = sorted({body.material for body in source.bodies if body.material})
    suffix = source.path.suffix.lower() if source.path is not None else ".ply"
    if materials and suffix == ".obj":
        return suffix, _marked_text(obj_bytes(mesh, source, Path(place).parent), b"# "), []
    if materials and suffix == ".glb" and _same_in_single_precision(mesh):
        return suffix, glb_bytes(mesh, source, lambda binary: {MARKER: _hash(binary)}), []
    lost = [f"material {name}" for name in materials]
    if len(mesh.bodies) > 1:
        lost.append(f"the names of {len(mesh.bodies)} bodies")
    # the marker follows the format line, which must come second
    data = ply_bytes(mesh)
    head, _, tail = data.partition(b"binary_little_endian 1.0\n")
    return ".ply", head + b"binary_little_endian 1.0\n" + _marked_text(tail, b"comment "), lost


def is_ours(path: Path) -> bool:
    """Whether a file was written by ``write_result`` and not changed since."""
    try:
        data = path.read_bytes()
    except OSError:
        return False
    if data[:4] == b"glTF":
        return _is_our_glb(data)
    before, found, after = data.partition(f" {MARKER} ".encode())
    if not found or len(before) > 100:
        return False
    recorded, _, rest = after.partition(b"\n")
    return recorded.decode(errors="replace") == _hash(rest)


def _is_our_glb(data: bytes) -> bool:
    try:
        length = struct.unpack("<I", data[12:16])[0]
        extras = json.loads(data[20 : 20 + length])["asset"].get("extras", {})
    except (struct.error, ValueError, KeyError, AttributeError):
        return False
    return isinstance(extras, Mapping) and extras.get(MARKER) == _hash(data[28 + length :])


def _marked_text(rest: bytes, comment: bytes) -> bytes:
    return comment.rstrip() + f" {MARKER} {_hash(rest)}\n".encode() + rest


def _hash(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=16).hexdigest()


def _same_in_single_precision(mesh: Mesh) -> bool:
    """Whether single precision, which is all glTF has, leaves the surface as sound as it is."""
    from .draft import Draft
    from .judge import Examined

    rounded = Mesh(mesh.vertices.astype(np.float32).astype(float), mesh.faces)
    before, after = (Examined(Draft.of(each)).condition.faults() for each in (mesh, rounded))
    return all(count <= before.get(name, 0) for name, count in after.items())
