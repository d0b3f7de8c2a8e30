"""Files that save work between runs.

A cache is a convenience: whatever goes wrong with it, the work is done again. ``SSS_TOOLS_CACHE`` names another
folder than the user's cache folder.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from .files import write_atomically

FOLDER_VARIABLE = "SSS_TOOLS_CACHE"


def cache_folder() -> Path:
    """The folder for cached files; it need not exist."""
    override = os.environ.get(FOLDER_VARIABLE)
    if override:
        return Path(override)
    import platformdirs

    return Path(platformdirs.user_cache_dir("sss-tools", appauthor=False))


def store(path: Path, data: bytes) -> None:
    """Write a file of the cache, so that readers see all of it or none; where that is not possible, do nothing."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)


def prune(folder: Path, limit: int) -> None:
    """Delete the files in ``folder`` that were used longest ago, until what is left has at most ``limit`` bytes.

    Reading a file does not count as using it; ``os.utime`` does.
    """
    files = []
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            with contextlib.suppress(OSError):  # another process may prune, too
                state = entry.stat(follow_symlinks=False)
                files.append((state.st_mtime, state.st_size, entry.path))
    excess = sum(size for _, size, _ in files) - limit
    for _, size, path in sorted(files):
        if excess <= 0:
            return
        with contextlib.suppress(OSError):
            Path(path).unlink()
            excess -= size
