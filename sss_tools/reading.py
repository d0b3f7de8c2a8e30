"""Reading a file of a stranger: a regular file, all of it, and the same from the first byte to the last."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from .errors import InputError


def read_file(path: str | Path, most: int | None = None) -> bytes:
    """The bytes of a file. Links are followed; what they lead to is not created, changed or waited for.

    most  bytes it may have

    Raises OSError as ``open`` does; InputError for what is no regular file (a pipe would be waited for, a device
    never ends), for more bytes than ``most``, and for a file that somebody else changes meanwhile.
    """
    with opened(path, most) as file:
        return file.read()


_TICK = 0.02
"""Seconds; file systems stamp changes with a clock that ticks every 1 to 10 ms."""


@contextmanager
def opened(path: str | Path, most: int | None = None) -> Iterator[BinaryIO]:
    """The same file to read in pieces. Raises as ``read_file`` does; of a change, at the end."""
    path = Path(path)
    # a pipe without a writer would hold a plain open up for ever
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        before = os.fstat(file.fileno())
        if not stat.S_ISREG(before.st_mode):
            raise InputError(path, f"is {_kind(before.st_mode)}, not a regular file", "give a file")
        if most is not None and before.st_size > most:
            problem = f"has {before.st_size} bytes, more than the {most} that such a file may have"
            raise InputError(path, problem, "check where it comes from")
        if abs(time.time() - before.st_ctime) < _TICK:
            # a second change within a tick would not show
            time.sleep(_TICK)
        yield file
        after = os.fstat(file.fileno())
    if (before.st_ctime_ns, before.st_size) != (after.st_ctime_ns, after.st_size):
        raise InputError(path, "changed while it was read", "try again when nobody writes to it")


def _kind(mode: int) -> str:
    for is_kind, name in ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket")):
        if is_kind(mode):
            return name
    return "a device"
