"""Tasks at a cluster: few enough in flight, results in order, failures in one line."""

from __future__ import annotations

import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from sss_tools.errors import InputError
from sss_tools.scheduler import is_gone

from .task import Result, Task
from .worker import render

if TYPE_CHECKING:
    from distributed import Client, Future

AHEAD = 3
"""Tasks handed out for each thread of the cluster: one under way, and enough that none waits for the slowest."""
HELD_BYTES = 2**28
"""Results that came in before their turn are held here up to so many bytes; beyond, they stay on their workers."""
NEWS_EVERY, LOOK_EVERY = 2.0, 0.5
"""Seconds between looks at how many workers there are, and at a result whose worker died with it."""


class ClusterLost(InputError):
    """The cluster can no longer be used. The film keeps the whole passes so far."""


@dataclass
class Traffic:
    """What the cluster was asked and gave.

    workers, threads  the most there were at a time
    tasks             results that came in
    received          bytes of their arrays
    scene             bytes of the parcel that each worker gets once
    rendering         seconds of the workers' threads, summed
    adding            seconds of adding samples to the film here
    """

    workers: int = 0
    threads: int = 0
    tasks: int = 0
    received: int = 0
    scene: int = 0
    rendering: float = 0.0
    adding: float = 0.0


class TaskQueue:
    """Tasks at the cluster, and their results in the order in which they were submitted.

    open     how many were submitted and not yet given out
    threads  of the cluster
    """

    def __init__(self, client: Client, parcel: Future, traffic: Traffic, resumable: bool):
        self._client, self._parcel, self._traffic = client, parcel, traffic
        self._resumable = resumable
        self._order: OrderedDict[Any, Future] = OrderedDict()
        self._ended: SimpleQueue[Future] = SimpleQueue()
        self._held: dict[Any, Result] = {}
        self._held_bytes = 0
        self._news_at = 0.0
        self.threads = 1
        self._alone = False

    def __enter__(self) -> TaskQueue:
        return self

    def __exit__(self, *_: object) -> None:
        # nobody waits for these any more
        for future in self._order.values():
            future.release()

    @property
    def open(self) -> int:
        """Tasks submitted and not yet given out."""
        return len(self._order)

    def wanted(self) -> bool:
        """Whether the cluster should get another task."""
        now = time.monotonic()
        if now >= self._news_at:
            self._news_at = now + NEWS_EVERY
            with self._or_lost():
                each = self._client.nthreads()
            self.threads = max(sum(each.values()), 1)
            self._traffic.threads = max(self._traffic.threads, sum(each.values()))
            self._traffic.workers = max(self._traffic.workers, len(each))
            if not each and not self._alone:
                self._alone = True
                warnings.warn(f"{where(self._client)}: it has no workers; waiting for some", stacklevel=2)
        return self.open < AHEAD * self.threads

    def submit(self, task: Task) -> None:
        """Hand out a task."""
        with self._or_lost():
            future = self._client.submit(render, self._parcel, task, pure=False)
        future.add_done_callback(self._ended.put)
        self._order[future.key] = future

    def next(self, seconds_left: Callable[[], float] | None = None) -> Result | None:
        """The result of the oldest open task, once it is there; None when no seconds are left."""
        first = next(iter(self._order.values()))
        while first.key not in self._held and not first.done():
            patience = LOOK_EVERY if seconds_left is None else min(max(seconds_left(), 0.0), LOOK_EVERY)
            try:
                self._hold(self._ended.get(timeout=patience))
            except Empty:
                if seconds_left is not None and seconds_left() <= 0:
                    return None
        del self._order[first.key]
        result = self._held.pop(first.key, None)
        if result is None:
            result = self._fetched(first)
        else:
            self._held_bytes -= result.nbytes()
        first.release()
        return result

    def _hold(self, future: Future) -> None:
        """Fetch a result before its turn, where there is room: its worker may die meanwhile."""
        if future.key in self._order and self._held_bytes < HELD_BYTES:
            result = self._held[future.key] = self._fetched(future)
            self._held_bytes += result.nbytes()

    def _fetched(self, future: Future) -> Result:
        with self._or_lost():
            return future.result()

    @contextmanager
    def _or_lost(self) -> Iterator[None]:
        """Turn whatever the cluster raises into ClusterLost."""
        try:
            yield
        except (KeyboardInterrupt, SystemExit, MemoryError):
            raise
        except BaseException as error:  # asyncio's cancellation is no Exception
            raise ClusterLost(where(self._client), *self._problem(error)) from None

    def _problem(self, error: BaseException) -> tuple[str, str]:
        """What is wrong, and what to do."""
        if is_gone(error, self._client):
            resumable = self._resumable or self._traffic.tasks > 0
            return "the scheduler is gone", f"start it again{', and use --resume' * resumable}"
        if type(error).__name__ == "KilledWorker":
            problem = "a task ended several workers, probably for want of memory"
            return problem, "give workers more of it, or fewer threads"
        problem = f"a worker failed ({type(error).__name__}: {error})"
        return problem, "install this version of sss-tools on all workers"


def where(client: Client) -> str:
    """How messages name the cluster."""
    address = client.scheduler.address if client.scheduler is not None else ""
    return f"--scheduler {address}".rstrip()
