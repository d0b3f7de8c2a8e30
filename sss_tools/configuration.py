"""Configuration of sss-check: ``sss.toml``, or ``[tool.sss-check]`` in ``pyproject.toml``.

For each mesh the nearest file counts: in its folder, else in the folders above it; where there is none, the one
nearest to the working directory. Files are not merged, and in one folder ``sss.toml`` comes first. A
``pyproject.toml`` without the table is passed over. Paths and patterns in a file are relative to its folder.

    select = ["SSS1", "SSS204"]             # codes, beginnings of codes, or names
    ignore = ["SSS402"]
    severity = { SSS202 = "error" }
    per-path-ignores = { "scans/*" = ["SSS101"] }
    unit = "mm"
    material = "marble"                     # a preset, or a file
    jobs = 4
    timeout = 60.0                          # seconds a mesh
    max-memory = "2G"                       # bytes a mesh, with K, M or G
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from .errors import InputError
from .keys import Key, Kind, Place, one_of, read_keys, to_number, to_text
from .medium import UNITS
from .toml_file import read_toml
from .validation.outcome import Severity
from .validation.rule import all_rules

TABLE = "sss-check"


@dataclass(frozen=True)
class Configuration:
    """What a configuration file says; None or empty where it says nothing.

    source            the file
    per_path_ignores  pattern -> codes
    max_memory        bytes
    """

    source: Path | None = None
    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    severity: Mapping[str, Severity] = field(default_factory=dict)
    per_path_ignores: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unit: str | None = None
    material: str | None = None
    jobs: int | None = None
    timeout: float | None = None
    max_memory: int | None = None

    def ignored_for(self, mesh: str | Path) -> tuple[str, ...]:
        """The codes that ``per_path_ignores`` leaves out for a mesh.

        A pattern matches the mesh's path relative to the file's folder, any folder above the mesh in it, or
        its name alone; ``*`` matches slashes, too.
        """
        if self.source is None:
            return ()
        full, folder = Path(mesh).absolute(), self.source.absolute().parent
        try:
            inner = full.relative_to(folder)
        except ValueError:
            inner = full
        names = [inner.as_posix(), full.name, *(parent.as_posix() for parent in inner.parents)]
        return tuple(
            code
            for pattern, codes in self.per_path_ignores.items()
            if any(fnmatchcase(name, pattern.rstrip("/")) for name in names)
            for code in codes
        )


class Configurations:
    """The configuration files of one run, each read once."""

    def __init__(self) -> None:
        self._nearest: dict[Path, Configuration | None] = {}

    def of(self, mesh: str | Path) -> Configuration:
        """The configuration that counts for a mesh; an empty one where there is no file.

        Raises InputError for a file that cannot be used: unknown keys (naming the nearest valid one), values
        of another kind, codes that no rule has.
        """
        return self._above(Path(mesh).absolute().parent) or self._above(Path.cwd()) or Configuration()

    def _above(self, folder: Path) -> Configuration | None:
        for step in (folder, *folder.parents):
            if step not in self._nearest:
                self._nearest[step] = _of_folder(step)
            if (found := self._nearest[step]) is not None:
                return found
        return None


def _of_folder(folder: Path) -> Configuration | None:
    for name in ("sss.toml", "pyproject.toml"):
        path = folder / name
        table = _table(path) if path.is_file() else None
        if table is not None:
            return read_configuration(table, path)
    return None


def _table(path: Path) -> Any:
    """What a file says about this tool; None where a pyproject.toml has nothing to say."""
    try:
        data = read_toml(path)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "check its permissions") from None
    if path.name == "sss.toml":
        return data
    tools = data.get("tool")
    return tools.get(TABLE) if isinstance(tools, dict) else None


def read_configuration(table: Any, path: Path) -> Configuration:
    """The configuration in a table of the file ``path``. Raises InputError for what cannot be used."""
    place = Place(path, f"[tool.{TABLE}]" if path.name == "pyproject.toml" else "the configuration")
    values = read_keys(table, _KEYS, place)
    material = values["material"]
    # a file is named relative to the configuration; the name of a preset is no path
    if material is not None and (path.parent / material).is_file():
        material = str(path.parent / material)
    return Configuration(
        source=path,
        select=values["select"],
        ignore=values["ignore"],
        severity=values["severity"],
        per_path_ignores=values["per-path-ignores"],
        unit=values["unit"],
        material=material,
        jobs=values["jobs"],
        timeout=values["timeout"],
        max_memory=values["max-memory"],
    )


def codes_of(text: str) -> tuple[str, ...]:
    """Codes, beginnings of codes and names, from a comma-separated list. Raises ValueError for what no rule has."""
    return tuple(_beginning_of(part.strip()) for part in text.split(",") if part.strip())


def _beginning_of(text: str) -> str:
    if any(rule.code.startswith(text.upper()) for rule in all_rules()):
        return text.upper()
    return code_of(text)


def code_of(text: str) -> str:
    """The code of the rule with this code or name. Raises ValueError where there is none."""
    for rule in all_rules():
        if text.upper() == rule.code or text.lower() == rule.name:
            return rule.code
    raise ValueError(text)


def size_of(text: str) -> int:
    """Bytes from ``500M``, ``2G``, ``1.5GiB`` (of 1024). Raises ValueError for what is no size."""
    parts = re.fullmatch(r"([\d.]+)\s*([KMG]?)(?:i?B)?", text.strip(), re.IGNORECASE)
    if parts is None:
        raise ValueError(text)
    size = int(float(parts[1]) * 1024 ** " KMG".index(parts[2].upper() or " "))
    if size < 1:
        raise ValueError(text)
    return size


def _to_codes(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise TypeError
    return tuple(code for entry in value for code in codes_of(to_text(entry)))


def _to_severities(value: Any) -> dict[str, Severity]:
    if not isinstance(value, dict):
        raise TypeError
    return {code_of(name): Severity(to_text(level).lower()) for name, level in value.items()}


def _to_ignores(value: Any) -> dict[str, tuple[str, ...]]:
    if not isinstance(value, dict):
        raise TypeError
    return {pattern: _to_codes(codes) for pattern, codes in value.items()}


def _to_size(value: Any) -> int:
    return size_of(to_text(value))


def _to_count(value: Any) -> int:
    if type(value) is not int:
        raise TypeError
    return value


_CODES = Kind('a list of codes, beginnings of codes or names, for example ["SSS1", "SSS204"]', _to_codes)
_KEYS = {
    "select": Key(_CODES, ()),
    "ignore": Key(_CODES, ()),
    "severity": Key(Kind('a table of code = "error", "warning" or "info"', _to_severities), {}),
    "per-path-ignores": Key(Kind('a table of "pattern" = [codes]', _to_ignores), {}),
    "unit": Key(one_of(UNITS), None),
    "material": Key(Kind("the name of a preset or of a file", to_text), None),
    "jobs": Key(Kind("a whole number from 1", _to_count, lambda count: count >= 1), None),
    "timeout": Key(Kind("seconds above 0", to_number, lambda seconds: seconds > 0), None),
    "max-memory": Key(Kind('bytes as text, for example "500M" or "2G"', _to_size), None),
}
