"""Memory that stays with the process, so that temporaries of the tracer cost no page faults."""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache
from typing import Any

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8  # malloc.h
_KEEP = 1 << 28
_PR_SET_THP_DISABLE = 41  # linux/prctl.h


def keep_freed_memory() -> None:
    """Tell glibc to keep up to 256 MB that are freed instead of giving them back page by page.

    By default arrays above 128 kB are mapped afresh each time, and clearing their pages makes threads wait for
    each other. Threads share as many arenas as there are cores, and one: each keeps at its end what its largest arrays
    took, which is never given back, and by default there are up to eight a core, so that memory grows as threads come
    and go. Does nothing where there is no glibc.
    """
    mallopt = _of_glibc("mallopt")
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, (os.cpu_count() or 1) + 1)
        mallopt(_M_MMAP_THRESHOLD, _KEEP)
        mallopt(_M_TRIM_THRESHOLD, _KEEP)


def give_back_memory() -> None:
    """Give what is free back to the system: for processes that go on to something else. Where scenes come and go, what
    is kept of each lies in other pieces."""
    trim = _of_glibc("malloc_trim")
    if trim is not None:
        trim(0)


def keep_pages_small() -> None:
    """Tell Linux to give this process, and those that it starts, no huge pages: for those in which scenes come and go.

    NumPy asks for huge pages where its arrays of 4 MB and more lie, and what it asked for stays with the place: once
    such an array is freed, every small piece that comes to lie there takes 2 MB, and the kernel fills up what was given
    back between such pieces. So more and more of what was ever in use stays resident. Renders take as long without.
    """
    prctl = _of_glibc("prctl")
    if prctl is not None:
        prctl(_PR_SET_THP_DISABLE, 1, 0, 0, 0)


@cache  # each look makes a class, which waits for the garbage collector
def _of_glibc(name: str) -> Any:
    """A function of the C library; None where there is none of that name."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        return getattr(ctypes.CDLL(None), name)
    except (OSError, AttributeError):
        return None
