"""What a check found, kept between runs by everything it depends on: geometry, rules, configuration, surroundings.

The file is still read and decoded, so that a changed mesh is never taken for the old one, and the same geometry
in another file is recognised.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import zlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .cache import cache_folder, prune, store
from .mesh import Mesh
from .record import geometry_hash
from .validation.outcome import RULES_VERSION, FixSafety, MeshReport, Outcome, RuleReport, Severity
from .validation.rule import Context
from .validation.settings import Settings

LIMIT = 256 * 2**20
"""Bytes of findings to keep; some 5 kB a mesh, so tens of thousands of meshes."""

_MAGIC = b"sss-findings/1\n"
_DIGEST = 16

MISSING_PACKAGE = "needs the package"
"""Begins the reason of a rule that did not run for want of a package: it may be there next time."""


def key_of(mesh: Mesh, digest: str, context: Context, settings: Settings) -> str:
    """What the findings on a mesh with this geometry hash are kept under."""
    parts = hashlib.blake2b(digest_size=20)
    bodies = [(body.first_face, body.face_count) for body in mesh.bodies]
    asked = (settings.select, settings.ignore, {code: str(level) for code, level in settings.severities.items()})
    for part in (_version(), digest, bodies, asked, context):
        _feed(parts, part)
    return parts.hexdigest()


def recall(key: str) -> MeshReport | None:
    """The report kept under ``key``; None where there is none that is whole. Its path is empty."""
    path = _path(key)
    try:
        data = path.read_bytes()
        body = data[len(_MAGIC) + _DIGEST :]
        if data[: len(data) - len(body)] != _MAGIC + _checksum(body):
            return None
        report = _report(json.loads(zlib.decompress(body)))
        os.utime(path)
        return report
    except (OSError, ValueError, TypeError, KeyError, zlib.error):
        return None


def keep(key: str, report: MeshReport) -> None:
    """Keep a report, unless it tells of something that may be otherwise next time."""
    if report.error is not None or report.warnings:
        return
    if any(rule.raised or (rule.reason or "").startswith(MISSING_PACKAGE) for rule in report.rules):
        return
    body = zlib.compress(json.dumps(dataclasses.asdict(report) | {"path": ""}).encode(), 1)
    store(_path(key), _MAGIC + _checksum(body) + body)
    _prune_once()


def _folder() -> Path:
    return cache_folder() / "findings"


def _path(key: str) -> Path:
    return _folder() / key


@lru_cache
def _prune_once() -> None:
    """Once a process: looking at every file each time would cost more than it saves."""
    prune(_folder(), LIMIT)


def _checksum(body: bytes) -> bytes:
    return hashlib.blake2b(body, digest_size=_DIGEST).digest()


def _report(data: dict[str, Any]) -> MeshReport:
    rules = [
        RuleReport(
            **{
                **rule,
                "severity": Severity(rule["severity"]),
                "outcome": Outcome(rule["outcome"]),
                "fix": FixSafety(rule["fix"]),
            }
        )
        for rule in data.pop("rules")
    ]
    return MeshReport(**data, rules=rules)


@lru_cache
def _version() -> str:
    """Of the rules and of all code below them: a verdict of yesterday's program is not today's."""
    digest = hashlib.blake2b(RULES_VERSION.encode(), digest_size=20)
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Add a value of plain data, arrays, meshes and dataclasses; two that differ feed different bytes.

    Raises TypeError for anything else, lest two things that differ be taken for one.
    """
    if isinstance(value, Mesh):
        value = geometry_hash(value)
    if value is None or isinstance(value, bool | int | float | str):
        text = repr(value)
        digest.update(f"{type(value).__name__}:{len(text)}:{text}".encode(errors="surrogateescape"))
    elif isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        _feed(digest, f"{array.dtype.str}{np.shape(value)}")
        digest.update(array.tobytes())
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        _feed(digest, {field.name: getattr(value, field.name) for field in dataclasses.fields(value)})
    elif isinstance(value, Mapping):
        _feed(digest, sorted(value))
        _feed(digest, [value[name] for name in sorted(value)])
    elif isinstance(value, list | tuple):
        digest.update(f"list:{len(value)}:".encode())
        for entry in value:
            _feed(digest, entry)
    else:
        raise TypeError(f"a {type(value).__name__} cannot be part of a key")
