"""The files beside a mesh file that it names: its folder, and nothing else in the world."""

from __future__ import annotations

import os
import re
from pathlib import Path

from trimesh.resolvers import Resolver

from .reading import read_file

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")


class FilesBeside(Resolver):
    """What trimesh asks for the files that a mesh file names.

    kinds  suffixes of names that are given out, in lower case; None: all
    """

    def __init__(self, path: Path, kinds: tuple[str, ...] | None = None):
        self.file_name = path.name
        self._folder, self._kinds = path.parent.resolve(), kinds
        self._read: dict[Path, bytes] = {}

    def get(self, key: str) -> bytes:
        """The bytes of a file.

        Raises ValueError for a name that is an address or leads, also by links, out of the folder, FileNotFoundError
        for one that is not there or of no kind that is given out, InputError for what is no regular file.
        """
        path = self._path(key)
        if path not in self._read:
            self._read[path] = read_file(path)
        return self._read[path]

    def size(self, key: str) -> int:
        """Bytes of the file. Raises as ``get`` does."""
        return self._path(key).stat().st_size

    def _path(self, name: str) -> Path:
        name = name.strip()
        if _SCHEME.match(name):
            raise ValueError(f"it names '{name[:100]}', and nothing is fetched")
        outside = False
        # names written on other machines: what comes after the last separator may lie here
        for candidate in (name, name.lstrip("/"), re.split(r"[/\\]", name)[-1]):
            path = Path(os.path.realpath(self._folder / candidate))
            if not path.is_relative_to(self._folder):
                outside = True
            elif path.exists() and path != self._folder:
                if self._kinds is not None and path.suffix.lower() not in self._kinds:
                    break
                return path
        if outside:
            raise ValueError("it names a file outside its folder")
        raise FileNotFoundError(name[:100])

    def write(self, name: str, data: object) -> None:
        """Nothing is written."""
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> FilesBeside:
        """Files in folders of the folder are named by their whole name."""
        raise FileNotFoundError(namespace)

    def keys(self) -> list[str]:
        """No lists: a reader is to ask for what the file names."""
        return []
