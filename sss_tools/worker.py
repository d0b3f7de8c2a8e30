"""A process that checks meshes, so that a crash, a hang or a lack of memory takes down one mesh alone.

It serves one mesh after the other: starting one costs a second of imports, checking a mesh often less.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from .memory import limited_memory, share_of_memory, shown_size
from .validation.outcome import MeshReport
from .validation.settings import Settings

TIMEOUT = 300.0
"""Seconds one mesh may take unless the user says otherwise."""

SHARE = 0.5
"""Of the memory of the machine that a mesh may take unless the user says otherwise."""

START = 120.0
"""Seconds a worker may take to start: seconds of imports, on a machine under load."""

Check = Callable[[str, Settings], MeshReport]


@dataclass(frozen=True)
class Task:
    """One mesh to check.

    timeout     seconds it may take, after which its worker is stopped
    max_memory  bytes of data its worker may hold while it does; None: half of what its machine or container has. Not
                kept on Windows
    """

    path: str
    settings: Settings
    timeout: float = TIMEOUT
    max_memory: int | None = None

    @property
    def memory(self) -> int | None:
        """``max_memory`` in numbers, on the machine that asks; None where that does not tell its memory."""
        return self.max_memory or share_of_memory(SHARE)


class Worker:
    """A process and the pipe to it; started when there is something to do, again after its death.

    pipe      to wait on; None where there is no process
    deadline  when the task in hand must be through, in seconds of ``time.monotonic``
    report    on the task last given, once it is through
    """

    def __init__(self, check: Check | None = None, folder: str | None = None):
        """``folder``: where paths are relative to; the folder of this process by default."""
        self._arguments = (check, folder)
        self._process: SpawnProcess | None = None
        self._task: Task | None = None
        self._started = 0.0
        self.pipe: Connection | None = None
        self.deadline = float("inf")
        self.report: MeshReport | None = None

    def give(self, task: Task) -> None:
        """Send the next mesh."""
        now = time.monotonic()
        self._task, self._started, self.report = task, now, None
        self.deadline = now + task.timeout
        if self._process is None or not self._process.is_alive():
            self._start()
            self.deadline = now + START
        assert self.pipe is not None
        # it may have died since: the pipe says so when it is read
        with contextlib.suppress(OSError):
            self.pipe.send(task)

    def look(self, ready: bool) -> None:
        """See how the task stands; ``ready``: the pipe has something to say."""
        assert self._task is not None
        if ready:
            answer = self._receive()
        elif time.monotonic() >= self.deadline:
            self.stop()
            answer = f"the check took longer than {self._task.timeout:g} s"
        else:
            return
        if answer is None:
            # the worker is up: the time for the mesh begins now
            self._started = time.monotonic()
            self.deadline = self._started + self._task.timeout
        elif isinstance(answer, str):
            from .validation.run import report_not_checked

            self.report = report_not_checked(self._task.path, answer, self._task.settings)
            self.report.seconds = time.monotonic() - self._started
        else:
            self.report = answer

    def run(self, task: Task) -> MeshReport:
        """Check one mesh and wait for the report."""
        self.give(task)
        while self.report is None:
            assert self.pipe is not None
            self.look(bool(wait([self.pipe], max(self.deadline - time.monotonic(), 0))))
        return self.report

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        if self.pipe is not None:
            self.pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process.close()
        self._process = self.pipe = None

    def _start(self) -> None:
        self.stop()
        # a fresh interpreter: forking a process with threads or open libraries is what crashes are made of
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        process = context.Process(target=_serve, args=(far_end, *self._arguments), daemon=True)
        process.start()
        self._process = process
        # the worker's end must be open in the worker alone, or its death would not show
        far_end.close()

    def _receive(self) -> MeshReport | str | None:
        """The report, how the worker died, or None for a worker that has come up."""
        assert self._process is not None and self.pipe is not None and self._task is not None
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self._process.join(timeout=5)
            code = self._process.exitcode
            self.stop()
        memory = self._task.memory
        limit = "" if memory is None else f" (its memory was limited to {shown_size(memory)})"
        if code is not None and code < 0:
            return f"the check was ended by {_signal_name(-code)}{limit}"
        return f"the check ended with status {code}{limit}"


def _signal_name(number: int) -> str:
    try:
        return f"{signal.Signals(number).name} (signal {number})"
    except ValueError:
        return f"signal {number}"


def _serve(pipe: Any, check: Check | None, folder: str | None) -> None:
    """The worker: check what comes down the pipe until it closes."""
    # Ctrl-C goes to the whole group; the command decides, not its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # whatever a native library prints must not end up in the report
    os.dup2(2, 1)
    threading.Thread(target=_die_with_the_parent, daemon=True).start()
    if folder is not None:
        os.chdir(folder)
    from .validation.run import check_file

    pipe.send(None)
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        report = _checked(task, check or check_file)
        try:
            pipe.send(report)
        except OSError:
            return  # the command is gone, and nobody waits for the report


def _die_with_the_parent() -> None:
    """A process that nobody waits for must not go on checking."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _checked(task: Task, check: Check) -> MeshReport:
    """The report on a task, whatever the check raises."""
    from .validation.run import report_not_checked

    try:
        with limited_memory(task.memory):
            return check(task.path, task.settings)
    except MemoryError:
        limit = "" if task.memory is None else f": it needs more than {shown_size(task.memory)}"
        return report_not_checked(task.path, f"out of memory{limit}", task.settings)
    except Exception as error:  # the last line of defence: one line in the report, not a traceback
        reason = f"the check failed ({type(error).__name__}: {error})"
        return report_not_checked(task.path, reason, task.settings, raised=True)
