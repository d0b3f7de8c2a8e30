"""Many meshes, each checked in a worker process, so that a crash or a hang takes down that mesh alone.

A worker serves one mesh after the other: starting one costs a second of imports, checking a mesh often less.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from .errors import InputError
from .validation.outcome import MeshReport
from .validation.settings import Settings

TIMEOUT = 300.0
"""Seconds one mesh may take unless the user says otherwise."""

Check = Callable[[str, Settings], MeshReport]


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
) -> list[MeshReport]:
    """Check mesh files, ``jobs`` at a time (as many as there are processors by default), in the order given.

    timeout  seconds for one mesh, after which its worker is stopped
    check    what a worker does with a path, ``validation.run.check_file`` by default; must be importable
    done     called with each report as it comes in
    A worker that dies or takes too long makes its mesh ``not-run``; the others go on.
    """
    jobs = min(jobs or os.cpu_count() or 1, len(paths))
    reports: dict[int, MeshReport] = {}
    waiting = deque(enumerate(paths))
    workers = [_Worker(settings, check) for _ in range(jobs)]
    try:
        for worker in workers:
            worker.give(*waiting.popleft(), timeout)
        while busy := [worker for worker in workers if worker.task is not None]:
            for worker, report in _next_results(busy, settings):
                assert worker.task is not None
                reports[worker.task.number] = report
                worker.task = None
                done(report)
                if waiting:
                    worker.give(*waiting.popleft(), timeout)
    finally:
        for worker in workers:
            worker.stop()
    return [reports[number] for number in range(len(paths))]


@dataclass
class _Task:
    number: int
    path: str
    started: float
    deadline: float


class _Worker:
    """A process and the pipe to it; started when there is something to do, again after its death."""

    def __init__(self, settings: Settings, check: Check | None):
        self._arguments = (settings, check)
        self.task: _Task | None = None
        self.process: SpawnProcess | None = None
        self.pipe: Connection | None = None

    def give(self, number: int, path: str, timeout: float) -> None:
        """Send the next mesh."""
        # a fresh interpreter: forking a process with threads or open libraries is what crashes are made of
        context = multiprocessing.get_context("spawn")
        now = time.monotonic()
        self.task = _Task(number, path, now, now + timeout)
        if self.process is None or not self.process.is_alive():
            self.stop()
            self.pipe, far_end = context.Pipe()
            self.process = context.Process(target=_serve, args=(far_end, *self._arguments), daemon=True)
            self.process.start()
            # the worker's end must be open in the worker alone, or its death would not show
            far_end.close()
        assert self.pipe is not None
        # it may have died since: the pipe says so when it is read
        with contextlib.suppress(OSError):
            self.pipe.send(path)

    def receive(self) -> MeshReport | str:
        """The report, or how the worker died."""
        assert self.process is not None and self.pipe is not None
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self.process.join(timeout=5)
            code = self.process.exitcode
            self.stop()
        if code is not None and code < 0:
            return f"the check was ended by {_signal_name(-code)}"
        return f"the check ended with status {code}"

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        if self.pipe is not None:
            self.pipe.close()
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process.close()
        self.process = self.pipe = None


def _next_results(busy: list[_Worker], settings: Settings) -> Iterator[tuple[_Worker, MeshReport]]:
    """Wait until something happens; the workers that are through with their mesh, and the reports on it."""
    tasks = {worker: worker.task for worker in busy if worker.task is not None}
    remaining = max(min(task.deadline for task in tasks.values()) - time.monotonic(), 0)
    ready = set(wait([worker.pipe for worker in busy if worker.pipe is not None], remaining))
    for worker, task in tasks.items():
        if worker.pipe in ready:
            answer = worker.receive()
        elif time.monotonic() >= task.deadline:
            worker.stop()
            answer = f"the check took longer than {task.deadline - task.started:g} s"
        else:
            continue
        if isinstance(answer, str):
            from .validation.run import report_not_checked

            answer = report_not_checked(task.path, answer, settings)
            answer.seconds = time.monotonic() - task.started
        yield worker, answer


def _signal_name(number: int) -> str:
    try:
        return f"{signal.Signals(number).name} (signal {number})"
    except ValueError:
        return f"signal {number}"


def _serve(pipe: Any, settings: Settings, check: Check | None) -> None:
    """The worker: check what comes down the pipe until it closes."""
    # Ctrl-C goes to the whole group; the command decides, not its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # whatever a native library prints must not end up in the report
    os.dup2(2, 1)
    from .validation.run import check_file, report_not_checked

    while True:
        try:
            path = pipe.recv()
        except EOFError:
            return
        try:
            report = (check or check_file)(path, settings)
        except MemoryError:
            report = report_not_checked(path, "out of memory", settings)
        except Exception as error:  # the last line of defence: one line in the report, not a traceback
            reason = f"the check failed ({type(error).__name__}: {error})"
            report = report_not_checked(path, reason, settings, raised=True)
        try:
            pipe.send(report)
        except OSError:
            return  # the command is gone, and nobody waits for the report
