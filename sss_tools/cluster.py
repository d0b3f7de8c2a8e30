"""The same checks on the workers of a Dask cluster.

Every Dask worker keeps a process of its own for the meshes it is given (``worker``): time and memory limits hold
there as they do here, and a mesh that crashes a native library costs the cluster nothing. Meshes travel by
path: the workers must see the same files under the same names.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import threading
from collections.abc import Generator, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import InputError
from .scheduler import connected, is_gone
from .validation.outcome import MeshReport
from .worker import Check, Task, Worker

if TYPE_CHECKING:
    from distributed import Client

AHEAD = 4
"""Meshes handed out for each thread of the cluster: enough that none waits, few enough to keep nothing piled up."""

_local = threading.local()


def results_of_cluster(
    tasks: Sequence[Task], address: str, check: Check | None = None
) -> Generator[tuple[int, MeshReport], None, None]:
    """The reports and the number of their task, as they come in from the cluster at ``address``.

    A Dask worker that dies has its meshes checked by another; one that does so again and again makes its mesh
    ``not-run``. Raises InputError where distributed is not installed, no scheduler answers, or it is lost.
    """
    with connected(address) as client:
        from distributed import as_completed

        folder = str(Path.cwd())
        numbers = {}

        def submit(entry: tuple[int, Task]):
            future = client.submit(_check_on_worker, entry[1], check, folder, pure=False)
            numbers[future.key] = entry[0]
            return future

        waiting = enumerate(tasks)
        ahead = AHEAD * max(sum(client.nthreads().values()), 1)
        completed = as_completed([submit(entry) for entry in islice(waiting, ahead)], loop=client.loop)
        while not completed.is_empty():
            with _or_lost(client, address):
                future = next(completed)
                number = numbers.pop(future.key)
                report = _report(future, tasks[number])
            yield number, report
            with _or_lost(client, address):
                for entry in islice(waiting, 1):
                    completed.add(submit(entry))


@contextlib.contextmanager
def _or_lost(client: Client, address: str) -> Iterator[None]:
    """Turn what a lost scheduler makes the client raise into one line."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit, MemoryError):
        raise
    except BaseException as error:  # asyncio's cancellation is no Exception
        if not is_gone(error, client):
            raise
        raise InputError(
            f"--scheduler {address}", "the scheduler is gone", "start it again; what was checked is in the cache"
        ) from None


def _report(future, task: Task) -> MeshReport:
    """What came of a task."""
    if future.cancelled():
        raise ConnectionError("the scheduler no longer knows of it")
    error = future.exception()
    if error is None:
        return future.result()
    from .validation.run import report_not_checked

    # KilledWorker, an environment without this package: the mesh was not looked at
    reason = f"the cluster could not check it ({type(error).__name__}: {error})"
    return report_not_checked(task.path, reason, task.settings)


def _check_on_worker(task: Task, check: Check | None, folder: str) -> MeshReport:
    """What a thread of a Dask worker does."""
    arguments = (check, folder)
    if getattr(_local, "arguments", None) != arguments:
        if hasattr(_local, "worker"):
            _local.worker.stop()
        _local.worker, _local.arguments = Worker(*arguments), arguments
    with _children_allowed():
        return _local.worker.run(task)


@contextlib.contextmanager
def _children_allowed() -> Iterator[None]:
    """Let a daemon process start another.

    Dask's workers are daemons, and multiprocessing forbids those to have children, lest they outlive them.
    Ours end by themselves with the process that started them.
    """
    configuration = getattr(multiprocessing.current_process(), "_config", {})
    daemon = configuration.pop("daemon", None)
    try:
        yield
    finally:
        if daemon is not None:
            configuration["daemon"] = daemon
