"""Where a file is, as the services that read reports want it said."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote


def path_from_here(path: str) -> str:
    """With forward slashes; relative to the working directory where the file is below it, else absolute."""
    full, here = Path(path).absolute(), Path.cwd()
    return full.relative_to(here).as_posix() if _below(full, here) else full.as_posix()


def uri(path: str) -> str:
    """The same as a URI reference: relative below the working directory, else ``file://``."""
    full, here = Path(path).absolute(), Path.cwd()
    if _below(full, here):
        return quote(full.relative_to(here).as_posix(), errors="surrogateescape")
    return full.as_uri()


def _below(full: Path, here: Path) -> bool:
    return full.is_relative_to(here) and ".." not in full.relative_to(here).parts
