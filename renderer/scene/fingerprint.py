"""The hash of a scene: the same for the same picture's worth of input, wherever its files lie."""

from __future__ import annotations

import dataclasses
from hashlib import blake2b
from typing import Any

import numpy as np

from sss_tools.mesh import Mesh

from .description import Scene

_NOT_IN_THE_PICTURE = {"hash", "path", "mesh_path", "source", "closedness", "name", "unit"}
"""Where things came from, what was found out about them, and what they are called. Presets are already
converted, so the unit no longer matters either."""


def scene_hash(scene: Scene) -> str:
    """Hexadecimal BLAKE2b digest of everything the picture depends on but seed and passes.

    Takes the values as parsed, the geometry in scene coordinates and the environment's pixels, not bytes of
    files: moving, renaming or reformatting a file keeps it, moving a vertex changes it.
    """
    digest = blake2b(digest_size=16)
    _feed(digest, scene)
    return digest.hexdigest()


def with_hash(scene: Scene) -> Scene:
    """The scene with its hash filled in, to call again after a change."""
    return dataclasses.replace(scene, hash=scene_hash(scene))


def _feed(digest: Any, value: Any) -> None:
    # every value says its type and extent first, so that no two descriptions run together to the same bytes
    if isinstance(value, Mesh):
        _feed(digest, (value.vertices, value.faces))
    elif dataclasses.is_dataclass(value):
        digest.update(f"{type(value).__name__}{{".encode())
        for field in dataclasses.fields(value):
            if field.name not in _NOT_IN_THE_PICTURE:
                digest.update(f"{field.name}:".encode())
                _feed(digest, getattr(value, field.name))
        digest.update(b"}")
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, tuple):
        digest.update(f"({len(value)}".encode())
        for entry in value:
            _feed(digest, entry)
    elif isinstance(value, float):
        digest.update(f"{float(value).hex()};".encode())
    elif value is None or isinstance(value, str | int):
        digest.update(f"{value!r};".encode())
    else:
        raise TypeError(f"a scene holds no {type(value).__name__}")
