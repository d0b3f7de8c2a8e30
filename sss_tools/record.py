"""The sidecar MESH.sss.json: what a check found, tied to the geometry it looked at."""

from __future__ import annotations

import errno
import hashlib
import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .closedness import Closedness
from .errors import InputError
from .files import write_atomically
from .medium import Medium
from .mesh import Mesh
from .reading import read_file
from .validation.outcome import RULES_VERSION, MeshReport

SCHEMA = "sss-record/1"
MOST_BYTES = 64 * 2**20
"""A record with the most that all rules list has some 2 MB."""

OTHER_GEOMETRY = "belongs to other geometry: the mesh has changed since"


class RecordWarning(UserWarning):
    """A record that is there but cannot be trusted."""


@dataclass(frozen=True)
class Record:
    """A record that belongs to its mesh.

    closedness  the verdict
    material    the name of what the mesh was judged against, if anything
    components  as in the report of a check
    findings    rule objects as in the report of a check, waived ones included
    waivers     code -> the reason the user gave for accepting what the rule finds in this geometry
    repairs     what was done to the mesh to make it what it is: the rungs applied, first to last
    """

    hash: str
    closedness: Closedness
    material: str | None
    components: list[dict[str, Any]]
    findings: list[dict[str, Any]]
    waivers: dict[str, str]
    repairs: list[dict[str, Any]]


def geometry_hash(mesh: Mesh) -> str:
    """BLAKE2b (256 bits, hexadecimal) of the decoded vertices and faces, in the order of the file.

    Two files with the same geometry have the same hash, whatever their format, attributes and names; -0.0
    and 0.0 differ.
    """
    digest = hashlib.blake2b(digest_size=32)
    digest.update(b"sss-geometry/1")
    digest.update(np.array([len(mesh.vertices), len(mesh.faces)], "<u8").tobytes())
    digest.update(np.ascontiguousarray(mesh.vertices, "<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, "<i8").tobytes())
    return f"blake2b:{digest.hexdigest()}"


def record_path(mesh_path: str | Path) -> Path:
    """Where the record of a mesh file is: ``bunny.ply`` has ``bunny.ply.sss.json`` beside it."""
    mesh_path = Path(mesh_path)
    return mesh_path.with_name(mesh_path.name + ".sss.json")


def write_record(
    mesh_path: str | Path,
    mesh: Mesh,
    report: MeshReport,
    material: str | None = None,
    medium: Medium | None = None,
    unit: str | None = None,
    waivers: Mapping[str, str] | None = None,
    repairs: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """Write what ``report`` says about ``mesh`` beside it. Raises OSError where that is not possible, and where a link
    has the record's name: who made it chose what would be overwritten.

    material, medium, unit  what it was judged against: its name, its coefficients per mesh unit, what that unit is
    waivers                 code -> reason
    repairs                 what was done to the mesh to make it what it is
    """
    from .report.json_report import rule_object

    record = {
        "schema": SCHEMA,
        "hash": report.hash or geometry_hash(mesh),
        "rules": RULES_VERSION,
        "material": material,
        "medium": None if medium is None else _medium_object(medium),
        "unit": unit,
        "closedness": report.closedness,
        "components": report.components,
        "findings": [rule_object(finding) for finding in report.shown],
        "waivers": [{"code": code, "reason": reason} for code, reason in sorted((waivers or {}).items())],
        "repairs": [dict(repair) for repair in repairs],
    }
    path = record_path(mesh_path)
    if path.is_symlink():
        raise OSError(errno.ELOOP, "a link has its name")
    write_atomically(path, (json.dumps(record, indent=1) + "\n").encode())
    return path


def _medium_object(medium: Medium) -> dict[str, Any]:
    return {
        "sigma_a": medium.sigma_a.tolist(),
        "sigma_s": medium.sigma_s.tolist(),
        "g": medium.g,
        "ior": medium.ior,
    }


def read_record(mesh_path: str | Path, mesh: Mesh) -> Record | None:
    """The record of a mesh file, or None where there is none that can be trusted.

    A record of other geometry, of other rules, or that is no record at all is ignored with a RecordWarning.
    """
    path = record_path(mesh_path)
    try:
        data = _parse(path)
        if data is None:
            return None
        if data.get("hash") != geometry_hash(mesh):
            raise ValueError(OTHER_GEOMETRY)
        if data.get("rules") != RULES_VERSION:
            raise ValueError("was made by other rules")
    except ValueError as error:
        _ignore(path, str(error))
        return None
    try:
        return Record(
            hash=data["hash"],
            closedness=Closedness.from_json(data["closedness"]),
            material=_material(data),
            components=_objects(data, "components", "faces", "role"),
            findings=_objects(data, "findings", "code", "outcome"),
            waivers=_waivers(data),
            repairs=_objects(data, "repairs", "name", "status"),
        )
    except (KeyError, TypeError, ValueError) as error:
        _ignore(path, f"is incomplete ({type(error).__name__}: {error})")
        return None


def read_repairs(mesh_path: str | Path, digest: str) -> list[dict[str, Any]]:
    """What was done to make geometry with this hash what it is, as its record says; [] where none can be trusted."""
    try:
        data = _parse(record_path(mesh_path))
        return [] if data is None or data.get("hash") != digest else _objects(data, "repairs", "name", "status")
    except (KeyError, TypeError, ValueError):
        return []


def read_waivers(mesh_path: str | Path, digest: str) -> tuple[dict[str, str], list[str]]:
    """What the user accepts in geometry with this hash, code -> reason; and the codes waived in other geometry.

    A waiver is bound to the geometry alone: rules that have become stricter do not undo it. Raises ValueError,
    with the rest of a sentence about the record, for one that cannot be read.
    """
    data = _parse(record_path(mesh_path))
    if data is None:
        return {}, []
    try:
        waivers = _waivers(data)
    except (KeyError, TypeError) as error:
        raise ValueError(f"is incomplete ({type(error).__name__}: {error})") from None
    if data.get("hash") != digest:
        if not waivers:
            raise ValueError(OTHER_GEOMETRY)
        return {}, sorted(waivers)
    return waivers, []


def _parse(path: Path) -> dict[str, Any] | None:
    """What a record says; None where there is none. Raises ValueError for what is no record."""
    try:
        data = json.loads(read_file(path, MOST_BYTES))
    except FileNotFoundError:
        return None
    except InputError as error:
        raise ValueError(f"cannot be read: it {error.problem}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"cannot be read ({error})") from None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise ValueError(f"is not of schema {SCHEMA}")
    return data


def _objects(data: dict[str, Any], key: str, *needed: str) -> list[dict[str, Any]]:
    """The list of objects under ``key``, each with the keys ``needed``. Raises KeyError or TypeError for another."""
    objects = data[key]
    if not isinstance(objects, list) or not all(isinstance(entry, dict) for entry in objects):
        raise TypeError(f'"{key}" is no list of objects')
    for entry in objects:
        for name in needed:
            entry[name]
    return objects


def _material(data: dict[str, Any]) -> str | None:
    if not isinstance(data["material"], str | None):
        raise TypeError('"material" is no name')
    return data["material"]


def _waivers(data: dict[str, Any]) -> dict[str, str]:
    return {str(waiver["code"]): str(waiver["reason"]) for waiver in _objects(data, "waivers", "code", "reason")}


def _ignore(path: Path, problem: str) -> None:
    warnings.warn(f"{path}: the record {problem}; it is ignored", RecordWarning, stacklevel=3)
