"""Many meshes: which there are, and how they are handed out, here or on a cluster."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from multiprocessing.connection import wait
from pathlib import Path

from .errors import InputError
from .report_spool import ReportSpool
from .validation.outcome import MeshReport
from .validation.settings import Settings
from .worker import TIMEOUT, Check, Task, Worker

__all__ = ["TIMEOUT", "Check", "Task", "check_files", "check_tasks", "find_meshes"]


def find_meshes(paths: Iterable[str], listed: Iterable[str] = ()) -> list[str]:
    """The mesh files that ``paths`` mean, each once: files as they are, folders searched recursively.

    ``-`` stands for ``listed``, a list of paths, one a line. In folders files of other kinds are skipped; a
    file named by itself is taken whatever its kind. Raises InputError for a folder that cannot be searched or
    holds no mesh.
    """
    found: list[str] = []
    for path in paths:
        if path == "-":
            found += find_meshes(line for line in (entry.strip() for entry in listed) if line and line != "-")
        elif Path(path).is_dir():
            found += _meshes_below(path)
        else:
            found.append(path)
    return list(dict.fromkeys(found))


def _meshes_below(folder: str) -> list[str]:
    from .loading import SUFFIXES

    def refuse(error: OSError) -> None:
        raise InputError(error.filename, f"cannot be searched ({error.strerror})", "check its permissions")

    found = []
    for root, folders, names in os.walk(folder, onerror=refuse):
        folders.sort()
        found += [str(Path(root, name)) for name in sorted(names) if Path(name).suffix.lower() in SUFFIXES]
    if not found:
        kinds = ", ".join(suffix[1:] for suffix in SUFFIXES)
        raise InputError(folder, "no mesh in this folder", f"name a folder with files of {kinds}")
    return found


def check_files(
    paths: Sequence[str],
    settings: Settings,
    jobs: int | None = None,
    timeout: float = TIMEOUT,
    check: Check | None = None,
    done: Callable[[MeshReport], None] = lambda report: None,
    max_memory: int | None = None,
) -> list[MeshReport]:
    """``check_tasks`` for meshes that are all checked alike, with the reports as a list."""
    return list(check_tasks([Task(path, settings, timeout, max_memory) for path in paths], jobs, check, done))


def check_tasks(
    tasks: Sequence[Task],
    jobs: int | None = None,
    check: Check | None = None,
    done: Callable[[MeshReport], None] = lambda report: None,
    scheduler: str | None = None,
) -> Sequence[MeshReport]:
    """Check mesh files, ``jobs`` at a time (as many as there are processors by default); reports in their order.

    check      what a worker does with a path, ``validation.run.check_file`` by default; must be importable
    done       called with each report as it comes in
    scheduler  address of a Dask scheduler whose workers do the work instead of processes here
    A worker that dies, takes too long or too much memory makes its mesh ``not-run``; the others go on. Reports
    wait on disk, so that this process stays small however many there are.
    Raises InputError for a scheduler that cannot be used.
    """
    if scheduler is not None:
        from .cluster import results_of_cluster

        results = results_of_cluster(tasks, scheduler, check)
    else:
        results = _results_of_processes(tasks, min(jobs or os.cpu_count() or 1, len(tasks)), check)
    reports = ReportSpool(len(tasks))
    # closed at once, whatever happens: that is what stops the workers
    with closing(results):
        for number, report in results:
            reports.put(number, report)
            done(report)
    return reports


def _results_of_processes(
    tasks: Sequence[Task], jobs: int, check: Check | None
) -> Generator[tuple[int, MeshReport], None, None]:
    """The reports and the number of their task, as they come in."""
    waiting = enumerate(tasks)
    workers = [Worker(check) for _ in range(jobs)]
    numbers: dict[Worker, int] = {}

    def give(worker: Worker) -> None:
        if (entry := next(waiting, None)) is not None:
            numbers[worker], task = entry
            worker.give(task)

    try:
        for worker in workers:
            give(worker)
        while numbers:
            for worker in _through(list(numbers)):
                assert worker.report is not None
                yield numbers.pop(worker), worker.report
                give(worker)
    finally:
        for worker in workers:
            worker.stop()


def _through(busy: list[Worker]) -> list[Worker]:
    """Wait until something happens; the workers that are through with their mesh."""
    remaining = max(min(worker.deadline for worker in busy) - time.monotonic(), 0)
    ready = set(wait([worker.pipe for worker in busy if worker.pipe is not None], remaining))
    for worker in busy:
        worker.look(worker.pipe in ready)
    return [worker for worker in busy if worker.report is not None]
