"""On a real cluster: processes on this machine."""

import os
import signal
import sys
import threading
import time

import pytest

from benchmarks.local_cluster import LocalCluster
from sss_tools import shapes
from sss_tools.batch import Task, check_tasks
from sss_tools.errors import InputError
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.settings import Settings
from sss_tools.writing import write_mesh

distributed = pytest.importorskip("distributed")

SLOW = """
import os, signal, time
from sss_tools.validation.run import check_file

def check(path, settings):
    if "kill" in path:
        os.kill(os.getpid(), signal.SIGKILL)
    if "hang" in path:
        time.sleep(600)
    open(os.path.join(os.path.dirname(os.path.abspath(path)), "begun"), "a").close()
    time.sleep(0.3)
    return check_file(path, settings)
"""


@pytest.fixture
def slow_check(tmp_path, monkeypatch):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "slow_check.py").write_text(SLOW)
    monkeypatch.syspath_prepend(tmp_path / "lib")
    import slow_check

    yield slow_check.check
    sys.modules.pop("slow_check")


@pytest.fixture
def cluster(slow_check):
    """Two workers, as processes under a nanny: the kind people run."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as running:
        yield running


def tasks_for(folder, *names, timeout=60.0):
    for name in names:
        write_mesh(shapes.inverted(shapes.box()), folder / name)
    return [Task(name, Settings(), timeout) for name in names]


def test_a_worker_killed_in_the_middle_costs_no_report(tmp_path, monkeypatch, cluster, slow_check):
    monkeypatch.chdir(tmp_path)
    tasks = tasks_for(tmp_path, *(f"{number}.ply" for number in range(12)))
    with distributed.Client(cluster) as client:
        victims = list(client.run(os.getpid).values())
    killed = threading.Event()

    def kill_one():
        while not (tmp_path / "begun").exists():
            time.sleep(0.05)
        os.kill(victims[0], signal.SIGKILL)
        killed.set()

    thread = threading.Thread(target=kill_one, daemon=True)
    thread.start()
    seen = []

    def done(report):
        seen.append((report.path, killed.is_set()))

    reports = check_tasks(tasks, check=slow_check, scheduler=cluster.scheduler_address, done=done)
    thread.join(timeout=10)
    assert any(after for _, after in seen), "the worker was killed only after all was done"
    # relative paths mean what they mean here
    assert [report.path for report in reports] == [task.path for task in tasks]
    assert all(report.status == "ok" and report.exit_status == 1 for report in reports)


def test_a_scheduler_that_is_killed_is_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tasks = tasks_for(tmp_path, *(f"{number}.ply" for number in range(40)))
    with LocalCluster(tmp_path, 1) as mortal, pytest.raises(InputError, match="the scheduler is gone"):
        check_tasks(tasks, scheduler=mortal.address, done=lambda report: mortal.scheduler.kill())


def test_a_crash_and_a_hang_are_one_meshs_not_run_there_too(tmp_path, monkeypatch, cluster, slow_check):
    monkeypatch.chdir(tmp_path)
    tasks = tasks_for(tmp_path, "kill.ply", "a.ply", "hang.ply", "b.ply", timeout=5)
    crashed, first, hung, second = check_tasks(tasks, check=slow_check, scheduler=cluster.scheduler_address)
    assert first.status == second.status == "ok"
    assert "SIGKILL" in crashed.error and "took longer than 5 s" in hung.error
    assert {rule.outcome for rule in [*crashed.rules, *hung.rules]} == {Outcome.NOT_RUN}
