"""Writing a file whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path


def write_atomically(path: str | Path, data: bytes | Iterable[bytes]) -> None:
    """Write ``data``, whole or in pieces, beside ``path`` and move it there: nobody ever reads half a file.

    A link is followed. What is no regular file (a terminal, a pipe) and what lies below /dev (/dev/stdout may
    lead to a file that others hold open) is written to directly.
    Raises OSError where that is not possible; an existing file is then unchanged.
    """
    pieces = (data,) if isinstance(data, bytes) else data
    if Path(path).is_absolute() and Path(path).parts[1:2] == ("dev",):
        with Path(path).open("ab") as file:
            file.writelines(pieces)
        return
    path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file():
        with path.open("wb") as file:
            file.writelines(pieces)
        return
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.writelines(pieces)
        # mkstemp makes files private; give this one the rights a plain open would have given it
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask()
        Path(temporary).chmod(mode)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _umask() -> int:
    """The process's file mode mask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
