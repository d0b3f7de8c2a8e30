"""How much memory there is, and how much of it may be used."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

_CONTAINER = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def machine_memory() -> int | None:
    """Bytes of memory of this machine, or of the container this runs in; None where the system does not tell."""
    sizes = []
    with contextlib.suppress(AttributeError, ValueError, OSError):
        sizes.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    for name in _CONTAINER:
        with contextlib.suppress(OSError, ValueError):  # "max": no limit
            sizes.append(int(Path(name).read_text()))
    return min(sizes, default=None)


def share_of_memory(share: float) -> int | None:
    """So much of ``machine_memory``."""
    memory = machine_memory()
    return None if memory is None else int(share * memory)


def peak_memory() -> int | None:
    """Greatest resident memory of this program so far, bytes; None where the system does not tell.

    On Linux VmHWM of proc(5): the kernel's other count (getrusage) begins with what the process that started this
    program held.
    """
    with contextlib.suppress(OSError):
        lines = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


@contextlib.contextmanager
def limited_memory(limit: int | None) -> Iterator[None]:
    """Allocations beyond ``limit`` bytes of data fail as long as this lasts, where the platform can do that.

    They raise MemoryError. None: no limit.
    """
    if limit is None or sys.platform == "win32":
        yield
        return
    import resource

    # RLIMIT_DATA counts what a process may write to (Linux 4.7 and later); the address space, with its mapped
    # libraries and reserved stacks, is several times that
    kind = resource.RLIMIT_DATA
    soft, hard = resource.getrlimit(kind)
    try:
        resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
        yield
    finally:
        resource.setrlimit(kind, (soft, hard))


def shown_size(count: int) -> str:
    """``2 GiB``, ``500 MiB``."""
    return f"{count / 2**30:.3g} GiB" if count >= 2**30 else f"{count / 2**20:.3g} MiB"
