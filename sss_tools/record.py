"""The sidecar MESH.sss.json: what a check found, tied to the geometry it looked at."""

from __future__ import annotations

import hashlib
import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .closedness import Closedness
from .files import write_atomically
from .mesh import Mesh
from .validation.outcome import RULES_VERSION, MeshReport

SCHEMA = "sss-record/1"


class RecordWarning(UserWarning):
    """A record that is there but cannot be trusted."""


@dataclass(frozen=True)
class Record:
    """A record that belongs to its mesh.

    closedness  the verdict
    material    the preset the mesh was judged against, if any
    findings    rule objects as in the report of a check
    components  as in the report of a check
    """

    hash: str
    closedness: Closedness
    material: str | None
    components: list[dict[str, Any]]
    findings: list[dict[str, Any]]


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


def write_record(mesh_path: str | Path, mesh: Mesh, report: MeshReport, material: str | None = None) -> Path:
    """Write what ``report`` says about ``mesh`` beside it. Raises OSError where that is not possible."""
    from .report.json_report import rule_object

    record = {
        "schema": SCHEMA,
        "hash": geometry_hash(mesh),
        "rules": RULES_VERSION,
        "material": material,
        "closedness": report.closedness,
        "components": report.components,
        "findings": [rule_object(finding) for finding in report.findings],
        "waivers": [],
        "repairs": [],
    }
    path = record_path(mesh_path)
    write_atomically(path, (json.dumps(record, indent=1) + "\n").encode())
    return path


def read_record(mesh_path: str | Path, mesh: Mesh) -> Record | None:
    """The record of a mesh file, or None where there is none that can be trusted.

    A record of other geometry, of other rules, or that is no record at all is ignored with a RecordWarning.
    """
    path = record_path(mesh_path)
    try:
        data = json.loads(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _ignore(path, f"cannot be read ({error})")
        return None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        _ignore(path, f"is not of schema {SCHEMA}")
        return None
    if data.get("hash") != geometry_hash(mesh):
        _ignore(path, "belongs to other geometry: the mesh has changed since")
        return None
    if data.get("rules") != RULES_VERSION:
        _ignore(path, "was made by other rules")
        return None
    try:
        return Record(
            hash=data["hash"],
            closedness=Closedness.from_json(data["closedness"]),
            material=data["material"],
            components=list(data["components"]),
            findings=list(data["findings"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        _ignore(path, f"is incomplete ({type(error).__name__}: {error})")
        return None


def _ignore(path: Path, problem: str) -> None:
    warnings.warn(f"{path}: the record {problem}; it is ignored", RecordWarning, stacklevel=3)
