"""Numbers that take long to compute, kept on disk between runs.

The cache is a convenience: whatever goes wrong with it, the numbers are computed. ``SSS_TOOLS_CACHE`` names
another folder than the user's cache folder.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FOLDER_VARIABLE = "SSS_TOOLS_CACHE"


def cache_folder() -> Path:
    """The folder for cached tables; it need not exist."""
    override = os.environ.get(FOLDER_VARIABLE)
    if override:
        return Path(override)
    import platformdirs

    return Path(platformdirs.user_cache_dir("sss-tools", appauthor=False))


def cached(name: str, key: str, shape: tuple[int, ...], compute: Callable[[], NDArray]) -> NDArray[np.float32]:
    """The array ``compute()`` returns, as float32: from disk if it is there, else computed and put there.

    name   first part of the file's name
    key    everything the numbers depend on, the version of the formula included
    shape  what a sound file must hold; files that are cut short, of another shape or not finite are replaced
    """
    digest = hashlib.blake2b(key.encode(), digest_size=16).hexdigest()
    path = cache_folder() / f"{name}-{digest}.npy"
    stored = _read(path, shape)
    if stored is not None:
        return stored
    computed = np.ascontiguousarray(compute(), np.float32)
    _write(path, computed)
    return computed


def _read(path: Path, shape: tuple[int, ...]) -> NDArray[np.float32] | None:
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    sound = isinstance(array, np.ndarray) and array.shape == shape and array.dtype == np.float32
    return array if sound and np.isfinite(array).all() else None


def _write(path: Path, array: NDArray[np.float32]) -> None:
    """Write beside and rename, so that readers see a whole file or none."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".part")
    except OSError:
        return
    try:
        with os.fdopen(handle, "wb") as file:
            np.save(file, array, allow_pickle=False)
        Path(temporary).replace(path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
