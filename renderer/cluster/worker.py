"""What a worker does: build a scene once, render passes of it again and again."""

from __future__ import annotations

import copy
import pickle
import platform
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from ..output import passes as pass_numbers
from ..output.film import Film
from ..render import Renderer
from ..scene.description import Camera
from ..stages import Stages
from ..tracing.memory import give_back_memory, keep_pages_small
from ..tracing.tally import Tally
from .task import Parcel, Pass, Result, Task, digest, unpacked

KEPT_SCENES = 2
"""Built scenes that a worker process keeps."""


@dataclass(eq=False)
class _PassesApart(Film):
    """A film that keeps the samples of each pass instead of adding them up."""

    kept: list[Pass] = field(default_factory=list)

    def add_pass(self, index, radiance, hit, biased=None, chosen=None) -> None:
        """Keep pass number ``index``, as the samples of the pixels that take part."""
        self.ranges = pass_numbers.united(self.ranges, ((index, index + 1),))
        if biased is None:
            biased = np.zeros(hit.shape, bool)
        samples = radiance.reshape(-1, 3) if chosen is None else radiance[chosen]
        self.kept.append(Pass(index, samples.copy(), np.packbits(hit), np.packbits(biased)))


_built: OrderedDict[str, Renderer] = OrderedDict()
_building = threading.Lock()


def render(parcel: bytes, task: Task) -> Result:
    """Render a task: what a thread of a worker does."""
    built = _renderer(parcel)
    renderer = _own(built, task.camera)
    resolution = renderer.film.resolution
    if not task.whole:
        renderer.film = _PassesApart.blank(resolution)
    chosen = None if task.chosen is None else unpacked(task.chosen, resolution)
    start = time.perf_counter()
    renderer.run(task.passes, chosen=chosen)
    seconds = time.perf_counter() - start
    film = renderer.film
    apart = tuple(film.kept) if isinstance(film, _PassesApart) else ()
    return Result(apart, film if task.whole else None, renderer.tally, seconds, built.film.scene_hash, machine())


@cache
def machine() -> str:
    """What the last bits of a picture depend on, but for the scene: versions and the processor's abilities."""
    from importlib.metadata import PackageNotFoundError, version

    def of(package: str) -> str:
        try:
            return f"{package} {version(package)}"
        except PackageNotFoundError:  # run from a checkout
            return package

    from numpy._core._multiarray_umath import __cpu_features__ as features

    has = " ".join(name for name in ("AVX2", "AVX512F", "AVX512_SKX", "NEON", "SVE") if features.get(name))
    return ", ".join([*map(of, ("sss-tools", "numpy", "scipy", "embreex")), platform.machine(), has])


def _renderer(parcel: bytes) -> Renderer:
    """The renderer of this process for a parcel, built when it is first asked for."""
    key = digest(parcel)
    with _building:
        if key not in _built:
            if len(_built) == KEPT_SCENES:
                _built.popitem(last=False)
            for other in _built.values():
                other.forget_buffers()
            keep_pages_small()
            give_back_memory()
            sent: Parcel = pickle.loads(parcel)
            _built[key] = Renderer(sent.scene, sent.settings, sent.passes, measured=sent.measured)
        _built.move_to_end(key)
        return _built[key]


def _own(renderer: Renderer, camera: Camera | None = None) -> Renderer:
    """A renderer of the same built scene for one thread, with a film and counts of its own."""
    own = copy.copy(renderer)
    own.settings = replace(renderer.settings, threads=1)
    own.tally, own.stages, own.added = Tally(), Stages(), 0
    if camera is None:
        own.film = Film.blank(renderer.film.resolution, renderer.film.scene_hash, renderer.film.seed)
    else:
        own._frames = copy.copy(renderer._frames)  # frames know their camera
        own.look_from(camera)
    return own
