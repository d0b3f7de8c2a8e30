"""A Dask scheduler and workers as processes on this machine, begun as people begin them: to measure, and to kill."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE = 120.0
"""Seconds to wait for processes to come up on a busy machine."""


class LocalCluster:
    """Ends with the block.

    folder     for the scheduler's file and what the processes write
    scheduler  its process
    workers    theirs, of one thread each and without a nanny, so that one that is killed is gone
    """

    def __init__(self, folder: Path, workers: int = 0, port: int = 0):
        self.folder, self.workers = folder, []
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
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
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
