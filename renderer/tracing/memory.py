"""Memory that stays with the process, so that temporaries of the tracer cost no page faults."""

from __future__ import annotations

import ctypes
import sys

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
_KEEP = 1 << 28


def keep_freed_memory() -> None:
    """Tell glibc to keep up to 256 MB that are freed instead of giving them back page by page.

    By default arrays above 128 kB are mapped afresh each time, and clearing their pages makes threads wait for
    each other. Does nothing where there is no glibc.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return
    mallopt(_M_MMAP_THRESHOLD, _KEEP)
    mallopt(_M_TRIM_THRESHOLD, _KEEP)
