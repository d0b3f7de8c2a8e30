import os
import subprocess
import sys
import time
from multiprocessing.context import SpawnProcess
from pathlib import Path

import pytest

from sss_tools import shapes
from sss_tools.batch import Task, check_files, check_tasks, find_meshes
from sss_tools.errors import InputError
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.settings import Settings
from sss_tools.worker import Worker
from sss_tools.writing import write_mesh

SABOTAGE = """
import os, signal, time
from sss_tools.validation.run import check_file

time.sleep(float(os.environ.get("SABOTAGE_START", 0)))

def check(path, settings):
    name = os.path.basename(path)
    if "kill" in name:
        os.kill(os.getpid(), signal.SIGKILL)
    if "segfault" in name:
        signal.signal(signal.SIGSEGV, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGSEGV)
    if "hang" in name:
        with open(path + ".pid", "w") as file:
            file.write(str(os.getpid()))
        time.sleep(600)
    if "exit" in name:
        os._exit(7)
    if "raise" in name:
        raise KeyError("deep inside")
    if "memory" in name:
        raise MemoryError
    if "greedy" in name:
        import numpy
        numpy.ones(2**27)
    if "noise" in name:
        print("noise on stdout", flush=True)
        os.write(1, b"native noise")
    return check_file(path, settings)
"""


@pytest.fixture
def sabotage(tmp_path, monkeypatch):
    """A check that fails as told by the name of the mesh; workers find it on the path, as they would any module."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "sabotaged_check.py").write_text(SABOTAGE)
    monkeypatch.syspath_prepend(tmp_path / "lib")
    import sabotaged_check

    yield sabotaged_check.check
    sys.modules.pop("sabotaged_check")


def boxes(folder, *names):
    paths = [str(folder / f"{name}.ply") for name in names]
    for path in paths:
        write_mesh(shapes.box(), path)
    return paths


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_worker_that_dies_makes_its_mesh_not_run_and_the_others_are_reported(tmp_path, sabotage, jobs):
    paths = boxes(tmp_path, "a", "kill", "b", "segfault", "exit", "c")
    reports = check_files(paths, Settings(), jobs=jobs, check=sabotage)
    assert [report.path for report in reports] == paths
    for report in (reports[0], reports[2], reports[5]):
        assert report.status == "ok" and report.error is None
    for report, reason in ((reports[1], "SIGKILL"), (reports[3], "SIGSEGV"), (reports[4], "status 7")):
        assert {rule.outcome for rule in report.rules} == {Outcome.NOT_RUN}
        assert reason in report.error and reason in report.rules[0].reason
        assert report.exit_status == 0


def test_a_check_that_hangs_is_stopped_and_the_next_mesh_is_checked(tmp_path, sabotage):
    start = time.monotonic()
    hung, sound = check_files(boxes(tmp_path, "hang", "b"), Settings(), jobs=1, timeout=8, check=sabotage)
    assert "took longer than 8 s" in hung.error and hung.exit_status == 0
    assert sound.status == "ok" and sound.rules[0].outcome == Outcome.PASS
    assert time.monotonic() - start < 60


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_worker_does_not_outlive_the_command_that_is_killed(tmp_path, sabotage):
    (path,) = boxes(tmp_path, "hang")
    code = (
        "import sys; from sabotaged_check import check; from sss_tools.batch import check_files;"
        "from sss_tools.validation.settings import Settings; check_files([sys.argv[1]], Settings(), check=check)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(entry or "." for entry in sys.path)}
    command = subprocess.Popen([sys.executable, "-c", code, path], env=environment)
    note = Path(path + ".pid")
    assert eventually(lambda: note.exists() and note.read_text())
    worker = int(note.read_text())
    assert is_running(worker)
    command.kill()
    command.wait()
    assert eventually(lambda: not is_running(worker))


def eventually(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.05)
    return holds


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # an orphan that nobody has asked about is dead, too
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rsplit(")", 1)[1].split()[0] == "Z")


def test_an_error_of_the_check_itself_is_status_two_and_running_out_of_memory_is_not(tmp_path, sabotage):
    faulty, large = check_files(boxes(tmp_path, "raise", "memory"), Settings(), jobs=1, check=sabotage)
    assert "KeyError" in faulty.error and faulty.exit_status == 2
    assert "out of memory" in large.error and large.exit_status == 0


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not keep limits of data")
def test_a_mesh_that_takes_more_memory_than_allowed_is_not_run_and_the_next_is_checked(tmp_path, sabotage):
    greedy, sound = boxes(tmp_path, "greedy", "b")
    # the array takes 1 GiB
    (allowed,) = check_files([greedy], Settings(), check=sabotage)
    assert allowed.status == "ok"
    refused, checked = check_files([greedy, sound], Settings(), jobs=1, check=sabotage, max_memory=2**30)
    assert "out of memory: it needs more than 1 GiB" in refused.error and refused.exit_status == 0
    assert {rule.outcome for rule in refused.rules} == {Outcome.NOT_RUN}
    assert checked.status == "ok"


def test_the_time_a_worker_takes_to_start_is_not_the_meshs(tmp_path, sabotage, monkeypatch):
    monkeypatch.setenv("SABOTAGE_START", "7")
    (report,) = check_files(boxes(tmp_path, "a"), Settings(), timeout=6, check=sabotage)
    assert report.status == "ok"


def test_a_worker_that_cannot_be_started_says_why_and_can_be_stopped(monkeypatch):
    def no_process(self):
        raise OSError("no more processes")

    monkeypatch.setattr(SpawnProcess, "start", no_process)
    worker = Worker()
    with pytest.raises(OSError, match="no more processes"):
        worker.give(Task("ball.ply", Settings()))
    worker.stop()


def test_the_reports_of_many_meshes_wait_on_disk(tmp_path):
    reports = check_tasks([Task(path, Settings()) for path in boxes(tmp_path, "a", "b")])
    assert not isinstance(reports, list)
    assert [Path(report.path).name for report in reports] == ["a.ply", "b.ply"]
    # each access reads it anew
    assert reports[0] is not reports[0] and reports[0] == reports[0]


def test_nothing_a_worker_prints_reaches_stdout(tmp_path, sabotage, capfd):
    (report,) = check_files(boxes(tmp_path, "noise"), Settings(), check=sabotage)
    assert report.status == "ok"
    assert capfd.readouterr().out == ""


def test_reports_come_in_as_they_are_done(tmp_path):
    paths, seen = boxes(tmp_path, "a", "b", "c"), []
    check_files(paths, Settings(), jobs=2, done=lambda report: seen.append(report.path))
    assert sorted(seen) == paths


def test_settings_reach_the_workers(tmp_path):
    (report,) = check_files(boxes(tmp_path, "a"), Settings(select=("SSS2",)))
    assert {r.code for r in report.rules if r.outcome == Outcome.PASS} == {
        *("SSS201", "SSS202", "SSS203", "SSS204", "SSS602", "SSS701", "SSS702")
    }


def test_no_meshes_are_no_reports():
    assert check_files([], Settings()) == []


def test_folders_are_searched_recursively_for_meshes_alone(tmp_path):
    (tmp_path / "sub" / "deep").mkdir(parents=True)
    for name in ("b.PLY", "a.obj", "notes.txt", "scene.toml", "sub/c.stl", "sub/deep/d.glb", "a.obj.sss.json"):
        (tmp_path / name).write_text("")
    found = [os.path.relpath(path, tmp_path) for path in find_meshes([str(tmp_path)])]
    assert found == ["a.obj", "b.PLY", "sub/c.stl", "sub/deep/d.glb"]


def test_files_are_taken_as_they_are_and_each_once(tmp_path):
    (tmp_path / "a.obj").write_text("")
    paths = ["missing.ply", str(tmp_path / "a.obj"), "notes.txt", "missing.ply"]
    assert find_meshes([*paths, str(tmp_path)]) == ["missing.ply", str(tmp_path / "a.obj"), "notes.txt"]


def test_a_list_of_paths_may_name_folders_and_have_empty_lines(tmp_path):
    (tmp_path / "a.obj").write_text("")
    assert find_meshes(["-"], ["x.ply\n", "\n", f"{tmp_path}\n"]) == ["x.ply", str(tmp_path / "a.obj")]


def test_a_folder_without_meshes_is_an_error(tmp_path):
    with pytest.raises(InputError, match="no mesh in this folder"):
        find_meshes([str(tmp_path)])
