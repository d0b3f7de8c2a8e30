"""An export on disk: the document, and a folder of files beside it. Nothing that is not ours is replaced."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from hashlib import blake2b
from pathlib import Path

from sss_tools.errors import InputError
from sss_tools.files import write_atomically

from .mitsuba import Export

MARKER = "sss-render export"
"""Stands in the document's first comment, before a hash of all that follows it: a document that was edited since is
not ours any more."""
_HEAD = re.compile(rf"<\?xml [^>]*\?>\n<!-- {MARKER} (\w+) -->\n".encode())
_FILE = re.compile(rb"<!-- file (\w+) (\S+) -->\n")


def folder_name(path: Path) -> str:
    """Name of the folder for the files beside the document ``path``."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", path.stem).strip("-") + "_files"


def check_target(path: Path) -> None:
    """Raise InputError where no document may or can be written to ``path``."""
    if path.suffix.lower() != ".xml":
        raise InputError(path, "is no name for a scene of Mitsuba", "end it in .xml")
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(path, "cannot be written: no such folder, or a folder itself", "name a file in a folder")
    if path.exists() and _recorded(path) is None:
        raise InputError(
            path,
            "exists and was not written by sss-render, or was edited since",
            "move it away, or choose another name",
        )


def write(export: Export, path: Path) -> None:
    """Write the files beside ``path``, then the document, each whole or not at all.

    The document lists its files with their hashes. What is there already is replaced only if it is the same, or if
    the document that is there is ours and lists it as it is. Raises InputError otherwise, before anything is
    written, and where writing fails.
    """
    check_target(path)
    known = (_recorded(path) if path.exists() else None) or {}
    for name, data in export.files.items():
        target = path.parent / name
        if target.exists() and _digest(_content(target)) not in (_digest(data), known.get(name)):
            raise InputError(
                target, "exists and was not written by sss-render, or was edited since", "move it away, or choose "
                "another name for the document"
            )  # fmt: skip
    try:
        for name, data in export.files.items():
            target = path.parent / name
            target.parent.mkdir(exist_ok=True)
            write_atomically(target, data)
        write_atomically(path, _document(export))
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror})", "choose another place") from None


def _document(export: Export) -> bytes:
    files = "".join(f"<!-- file {_digest(data)} {name} -->\n" for name, data in export.files.items())
    body = (files + ET.tostring(export.document, encoding="unicode") + "\n").encode()
    return f'<?xml version="1.0" encoding="utf-8"?>\n<!-- {MARKER} {_digest(body)} -->\n'.encode() + body


def _recorded(path: Path) -> dict[str, str] | None:
    """The hashes of the files that our document ``path`` lists, by name; None where it is not ours as it is."""
    data = _content(path)
    head = _HEAD.match(data)
    if head is None or head[1].decode() != _digest(data[head.end() :]):
        return None
    return {name.decode(): digest.decode() for digest, name in _FILE.findall(data)}


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "move it away") from None


def _digest(data: bytes) -> str:
    return blake2b(data, digest_size=16).hexdigest()
