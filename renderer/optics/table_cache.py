"""Numbers that take long to compute, kept on disk between runs."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sss_tools.cache import cache_folder, store


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
    file = io.BytesIO()
    np.save(file, computed, allow_pickle=False)
    store(path, file.getvalue())
    return computed


def _read(path: Path, shape: tuple[int, ...]) -> NDArray[np.float32] | None:
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    sound = isinstance(array, np.ndarray) and array.shape == shape and array.dtype == np.float32
    return array if sound and np.isfinite(array).all() else None
