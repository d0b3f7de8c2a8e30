"""What travels between here and a cluster."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from ..output.film import Film
from ..render import Settings
from ..scene.description import Camera, Scene
from ..shaders.selection import Measured
from ..tracing.tally import Tally


@dataclass(frozen=True)
class Parcel:
    """What a worker builds its renderer from; arguments as of ``Renderer``."""

    scene: Scene
    settings: Settings
    passes: int | None
    measured: Mapping[str, Measured] | None


@dataclass(frozen=True)
class Task:
    """Passes to render.

    passes  their numbers, ascending
    chosen  pixels that take part, (h, w) bool as packed bits; None: all
    camera  another one than the scene's
    whole   send back one film of all passes, instead of the samples of each
    """

    passes: tuple[int, ...]
    chosen: NDArray[np.uint8] | None = None
    camera: Camera | None = None
    whole: bool = False


@dataclass(frozen=True)
class Pass:
    """Samples of one pass. ``radiance`` (n, 3) float32 of the pixels that take part; ``hit`` and ``biased`` are those
    of ``Film.add_pass``, (h, w) as packed bits."""

    index: int
    radiance: NDArray[np.float32]
    hit: NDArray[np.uint8]
    biased: NDArray[np.uint8]


@dataclass(frozen=True)
class Result:
    """What came of a task.

    passes   samples, one entry a pass; empty where the whole film was asked for
    film     that film, else None
    tally    what happened on the way
    seconds  the worker took, without building the scene
    hash     of the scene as the worker plans to render it, see ``render.planned_hash``
    machine  what last bits depend on, see ``worker.machine``
    """

    passes: tuple[Pass, ...]
    film: Film | None
    tally: Tally
    seconds: float
    hash: str
    machine: str

    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = [array for one in self.passes for array in (one.radiance, one.hit, one.biased)]
        if self.film is not None:
            arrays += list(self.film.arrays().values())
        return sum(array.nbytes for array in arrays)


def digest(parcel: bytes) -> str:
    """Hexadecimal, of a pickled parcel."""
    return blake2b(parcel, digest_size=16).hexdigest()


def unpacked(bits: NDArray[np.uint8], resolution: tuple[int, int]) -> NDArray[np.bool_]:
    """(h, w) bool of packed bits; ``resolution`` is (width, height)."""
    width, height = resolution
    return np.unpackbits(bits, count=width * height).reshape(height, width).astype(bool)
