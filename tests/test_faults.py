"""Faults injected for real, a few of each; benchmarks/faults.py injects as many as one likes, and prints a table."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from renderer import checkpoint, job
from renderer.checkpoint import checkpoint_path
from renderer.job import Budget, execute
from renderer.output import image
from sss_tools import reading
from sss_tools.errors import InputError
from sss_tools.reading import read_file
from tests.renderer.test_job import ready

ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(sys.platform != "linux", reason="forks, signals and mounts of Linux")
def test_no_fault_spoils_a_pixel_or_a_file_and_what_was_finished_is_kept():
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks/faults.py"), "--count", "3", "--refresh", "0.05", "--json",
         "--cluster-passes", "0"],
        capture_output=True,
        text=True,
        timeout=1800,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    results = {trials["fault"]: trials for trials in json.loads(done.stdout)}
    assert {name: trials["wrong"] for name, trials in results.items() if trials["wrong"]} == {}
    # while Python and libraries are being imported it is they who answer signals, with tracebacks of their own
    ours = {name: trials["broken"] for name, trials in results.items() if not name.endswith("while it starts")}
    assert {name: broken for name, broken in ours.items() if broken} == {}
    # an interrupt loses nothing that was finished, nor does a full disk
    for name in ("SIGINT", "SIGTERM", "full disk", "disk that becomes read-only"):
        assert max(results[name]["lost"]) == 0, name
    # those of a cluster are in tests/renderer/test_cluster.py
    assert results["kill -9"]["count"] == 3


def full(path, picture):
    raise InputError(path, f"cannot be written ({os.strerror(errno.ENOSPC)})", "choose another place")


def test_a_picture_that_cannot_be_written_is_kept_elsewhere_and_resumed(tmp_path, monkeypatch):
    out, elsewhere = tmp_path / "here" / "out.png", tmp_path / "elsewhere"
    out.parent.mkdir()
    elsewhere.mkdir()
    monkeypatch.setattr(checkpoint.tempfile, "tempdir", str(elsewhere))
    write = image.write
    monkeypatch.setattr(image, "write", lambda path, *rest: (full if path.parent == out.parent else write)(path, *rest))
    with pytest.raises(InputError) as raised:
        execute(ready(), out, Budget(0, 3))
    (rescued,) = elsewhere.rglob("*.npz")
    assert f"all passes are in {rescued}" in raised.value.line() and "--resume" in raised.value.remedy
    monkeypatch.setattr(image, "write", write)
    rescued.rename(checkpoint_path(out))
    renderer = ready()
    assert execute(renderer, out, Budget(0, 4), resume=True).film.passes == 4 and renderer.added == 1


def test_a_checkpoint_that_could_not_be_written_is_tried_again_with_one_warning(tmp_path, monkeypatch):
    for name in ("REFRESH_EVERY", "RETRY_EVERY"):
        monkeypatch.setattr(checkpoint, name, 0.0)
    monkeypatch.setattr(checkpoint, "REFRESH_SHARE", 1e9)
    out = tmp_path / "out.npz"
    write, tried = image.write, []

    def sometimes(path, picture):
        tried.append(path)
        (full if len(tried) < 3 else write)(path, picture)

    monkeypatch.setattr(image, "write", sometimes)
    kept = []
    with pytest.warns(UserWarning, match="tried again") as warned:
        execute(ready(), out, Budget(0, 4), progress=lambda *_: kept.append(checkpoint_path(out).exists()))
    assert len(warned) == 1 and kept == [False, False, True, True]


def test_a_budget_of_seconds_does_not_look_at_the_time_of_day(tmp_path, monkeypatch):
    day = iter(np.cumsum(np.tile([86400.0, -3e7], 100_000)))
    monkeypatch.setattr(job.time, "time", lambda: float(next(day)))
    film = execute(ready(), tmp_path / "out.png", Budget(0, None, seconds=1.0, started=job.time.monotonic())).film
    assert film.passes >= 1


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.ply"
    path.write_bytes(bytes(100))
    with pytest.raises(InputError, match="changed while it was read"), reading.opened(path) as file:
        file.read(50)
        path.write_bytes(bytes(100))
    # a change within the tick of the file system's clock before the reading shows all the same: the reader waits
    waited = []
    monkeypatch.setattr(reading.time, "sleep", waited.append)
    path.write_bytes(bytes(100))
    assert read_file(path) == bytes(100) and waited
