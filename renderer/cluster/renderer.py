"""A renderer whose threads are those of a cluster."""

from __future__ import annotations

import os
import pickle
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..output.film import Film
from ..render import Renderer, Settings
from ..scene.description import Camera, Scene
from ..shaders.selection import Measured
from ..stages import Stages
from .queue import ClusterLost, TaskQueue, Traffic, where
from .task import Parcel, Pass, Result, Task, digest, unpacked
from .worker import machine

if TYPE_CHECKING:
    from distributed import Client, Future

TASK_SAMPLES = 2**21
"""Camera samples of a task of several passes, at most: 26 MB of result."""
TASK_SECONDS = 8.0
"""Tasks grow until they take about as long: the last paths of each walk alone, which costs 0.3 s in a body of medium
density, as much as two thirds of a pass of 250 x 250 pixels."""
FIRST_SAMPLES = 2**18
LEAST_SHARE = 4
"""Towards the end tasks become smaller, for all to end together, but not by more than this."""


class ClusterRenderer(Renderer):
    """A ``Renderer`` whose passes are rendered by a cluster.

    client   of the cluster, see ``sss_tools.scheduler``
    traffic  what went back and forth

    Memory here does not grow with the cluster: results wait on their workers for their turn.
    """

    def __init__(
        self,
        client: Client,
        scene: Scene,
        settings: Settings,
        passes: int | None = None,
        stages: Stages | None = None,
        measured: Mapping[str, Measured] | None = None,
    ):
        # shaders are chosen by predicted seconds, too: workers must not count their own cores
        settings = replace(settings, threads=settings.threads or os.cpu_count() or 1)
        super().__init__(scene, settings, passes, stages, measured)
        self.traffic = Traffic()
        self._client = client
        # the verdicts on the meshes go along, what was computed from the meshes does not
        parcel = pickle.dumps(Parcel(_bare(self.scene), settings, passes, measured), pickle.HIGHEST_PROTOCOL)
        self.traffic.scene = len(parcel)
        self._parcel = _ship(client, parcel)
        self._hash, self._warned = self.film.scene_hash, False

    def run(
        self,
        passes: Iterable[int],
        done: Callable[[int], bool] | None = None,
        seconds_left: Callable[[], float] | None = None,
        chosen: NDArray[np.bool_] | None = None,
    ) -> bool:
        """As ``Renderer.run``. Raises ClusterLost where the cluster or its workers fail; the film then keeps all whole
        passes, and a later run goes on."""
        packed = None if chosen is None else np.packbits(chosen)
        pixels = self.film.hits.size if chosen is None else int(np.count_nonzero(chosen))
        pace = _Pace(pixels, seconds_left)
        waiting = _Waiting(passes)
        with self.stages.stage("render"), self._tasks() as tasks:
            while True:
                while tasks.wanted() and (numbers := waiting.take(pace.passes, 2 * tasks.threads)):
                    tasks.submit(Task(numbers, packed))
                if not tasks.open:
                    return True
                result = tasks.next(seconds_left if self.film.passes else None)
                if result is None:
                    return False
                pace.learn(len(result.passes), result.seconds)
                self._count(result)
                for one in result.passes:
                    self._take(one, chosen)
                    ends = done is not None and done(one.index)
                    if ends and (seconds_left is None or one is result.passes[-1]):
                        return False

    def films(self, cameras: Iterable[Camera], passes: int) -> Iterator[Film]:
        """Films of ``passes`` passes from each camera, in their order; each is a task. Shaders stay those chosen for
        the scene's own camera, as in ``look_from``. Raises ClusterLost."""
        waiting = iter(cameras)
        with self._tasks() as tasks:
            while True:
                while tasks.wanted() and (camera := next(waiting, None)) is not None:
                    tasks.submit(Task(tuple(range(passes)), camera=camera, whole=True))
                if not tasks.open:
                    return
                result = tasks.next()
                assert result is not None and result.film is not None
                self._count(result)
                yield result.film

    def _tasks(self) -> TaskQueue:
        return TaskQueue(self._client, self._parcel, self.traffic, self.film.passes > 0)

    def _count(self, result: Result) -> None:
        if result.hash != self._hash:
            raise ClusterLost(
                where(self._client), "a worker would render another picture", "install one version on all machines"
            )
        if result.machine != machine() and not self._warned:
            self._warned = True
            warnings.warn(
                f"{where(self._client)}: a worker has {result.machine}, and here are {machine()}: the picture may "
                "differ from others in its last bits",
                stacklevel=2,
            )
        self.traffic.tasks += 1
        self.traffic.received += result.nbytes()
        self.traffic.rendering += result.seconds
        self.tally.add(result.tally)

    def _take(self, one: Pass, chosen: NDArray[np.bool_] | None) -> None:
        """Add the samples of a pass to the film."""
        start = time.perf_counter()
        resolution = self.film.resolution
        radiance = one.radiance
        if chosen is None:
            radiance = radiance.reshape(self.film.sum.shape)
        else:
            radiance = np.zeros(self.film.sum.shape, np.float32)
            radiance[chosen] = one.radiance
        hit, biased = (unpacked(bits, resolution) for bits in (one.hit, one.biased))
        self.film.add_pass(one.index, radiance, hit, biased, chosen)
        self.added += 1
        self.tally.non_finite = self.film.non_finite
        self.traffic.adding += time.perf_counter() - start


class _Pace:
    """How many passes a task takes: few at first, more while tasks are short."""

    def __init__(self, pixels: int, seconds_left: Callable[[], float] | None):
        self._most = max(TASK_SAMPLES // max(pixels, 1), 1)
        self._seconds_left, self._each = seconds_left, 0.0
        self._passes = 1 if seconds_left else min(max(FIRST_SAMPLES // max(pixels, 1), 1), self._most)

    def learn(self, passes: int, seconds: float) -> None:
        """A task of so many passes took so long."""
        self._each = seconds / max(passes, 1)
        if passes == self._passes and 2 * seconds < TASK_SECONDS:
            self._passes = min(2 * passes, self._most)

    @property
    def passes(self) -> int:
        """Of the next task; towards the end of the time fewer."""
        if self._seconds_left is None or not self._each:
            return self._passes
        return max(min(self._passes, int(self._seconds_left() / 4 / self._each)), 1)


class _Waiting:
    """Numbers of passes to come."""

    def __init__(self, passes: Iterable[int]):
        self._rest = iter(passes)
        self._next: deque[int] = deque()

    def take(self, passes: int, shares: int) -> tuple[int, ...]:
        """The next ones, fewer where they would not do for ``shares`` such tasks; empty when none are left."""
        self._next.extend(islice(self._rest, max(passes * shares - len(self._next), 0)))
        count = min(max(-(-len(self._next) // shares), passes // LEAST_SHARE), passes, len(self._next))
        return tuple(self._next.popleft() for _ in range(count))


def _ship(client: Client, parcel: bytes) -> Future:
    """The parcel as data of the cluster: workers hand it on to each other, and the scheduler can give it anew."""
    import dask

    with dask.config.set({"distributed.admin.large-graph-warning-threshold": sys.maxsize}):
        return client.submit(bytes, parcel, key=f"sss-scene-{digest(parcel)}")


def _bare(scene: Scene) -> Scene:
    """The scene without what was computed from its meshes."""
    bare: dict[int, Any] = {}

    def of(mesh):
        return None if mesh is None else bare.setdefault(id(mesh), replace(mesh))

    things: Sequence = [replace(thing, mesh=of(thing.mesh), source=of(thing.source)) for thing in scene.objects]
    return replace(scene, objects=tuple(things))
