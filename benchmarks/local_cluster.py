"""A Dask scheduler and workers as processes on this machine, begun as people begin them: to measure, and to kill."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE = 120.0
"""Seconds to wait for processes to come up on a busy machine."""
ADVISED = {
    "DASK_DISTRIBUTED__ADMIN__LOW_LEVEL_LOG_LENGTH": "50",
    "DASK_DISTRIBUTED__ADMIN__LOG_LENGTH": "100",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__LOG_LENGTH": "600",
    "DASK_DISTRIBUTED__DIAGNOSTICS__COMPUTATIONS__MAX_HISTORY": "10",
    "DASK_DISTRIBUTED__SCHEDULER__EVENTS_CLEANUP_DELAY": "1 minute",
    "DASK_DISTRIBUTED__SCHEDULER__PRELOAD": "sss_tools.long_lived_scheduler",
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
}
"""Dask's settings as docs/scaling.md advises them. With its own, a scheduler keeps the last 1000 messages to each
worker, among them every scene of less than a megabyte, and sampling what workers do takes them time."""


class LocalCluster:
    """Ends with the block.

    folder     for the scheduler's file and what the processes write
    scheduler  its process
    workers    theirs, of one thread each and without a nanny, so that one that is killed is gone

    ``environment`` is added to that of all processes.
    """

    def __init__(self, folder: Path, workers: int = 0, port: int = 0, environment: Mapping[str, str] | None = None):
        self.folder, self.workers, self._environment = folder, [], environment or {}
        self._file = folder / "scheduler.json"
        self._file.unlink(missing_ok=True)
        self.scheduler = self._start("scheduler", "--port", str(port))
        self.address = self._wait_for_address()
        for _ in range(workers):
            self.add_worker()

    def add_worker(self) -> subprocess.Popen:
        """Start another worker."""
        options = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder))
        self.workers.append(self._start("worker", self.address, *options))
        return self.workers[-1]

    def wait_for_workers(self, count: int) -> None:
        """Until so many have told the scheduler."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=PATIENCE)

    def end(self) -> None:
        """End all processes."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def __enter__(self) -> LocalCluster:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _start(self, kind: str, *options: str) -> subprocess.Popen:
        more = ("--scheduler-file", str(self._file)) if kind == "scheduler" else ()
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", **self._environment}
        with Path(self.folder, f"{kind}.log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "dask", kind, *options, *more, "--no-dashboard", "--host", "127.0.0.1"],
                stdout=log, stderr=log, env=environment, cwd=self.folder,
            )  # fmt: skip

    def _wait_for_address(self) -> str:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline and self.scheduler.poll() is None:
            if self._file.exists() and (text := self._file.read_text()):
                return json.loads(text)["address"]
            time.sleep(0.02)
        self.end()
        raise TimeoutError(f"no scheduler came up: {Path(self.folder, 'scheduler.log').read_text()}")
