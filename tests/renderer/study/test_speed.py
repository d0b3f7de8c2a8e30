"""Which runs a chart of speed is made of, how they are taken up again, and what is said of them."""

import json
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest

from renderer.study import measured_runs, speed, speed_page
from renderer.study.measured_runs import Lab, PeerFailed, Task
from sss_tools.errors import InputError

ABOUT = {"processor": "of a test", "cores": "2", "threads": "2", "system": "none", "numpy": "2"}
EFFORT = speed.Effort(60.0, 2, (0.0, 1.0))
PASS_SECONDS = {"path": 0.1, "reference": 0.1, "plumb": 0.02, "scalar": 0.01, "diffuse": 0.01, "auto": 0.1,
                "mitsuba": 0.05}  # fmt: skip
BIAS = {"plumb": 0.1, "scalar": 0.3, "diffuse": 0.5}


class FakeLab(Lab):
    """Runs take no time and say that they took a second and some time a pass; noise falls as it should."""

    made = 0

    def _picture(self, task: Task) -> None:
        mix = np.random.default_rng(zlib.crc32(f"{task.name} {task.seed}".encode()))
        image = 1 + BIAS.get(task.method, 0.0) + mix.normal(size=(12, 10, 3)) / np.sqrt(task.passes)
        np.savez(self.picture_path(task), image=image.astype(np.float32), where=np.ones((12, 10), bool))

    def _ours(self, task: Task) -> dict:
        self.made += 1
        self._picture(task)
        render = PASS_SECONDS[task.method] * task.passes
        return {"seconds": 1.0 + render, "setup": 1.0, "build": 0.5, "render": render, "cpu": render,
                "stderr": 1 / task.passes**0.5, "shaders": "path", "command": "sss-render x"}  # fmt: skip

    def _mitsuba(self, task: Task) -> dict:
        return self._ours(task)


@pytest.fixture
def source(tmp_path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text("# a scene")
    return path


@pytest.fixture
def lab(tmp_path):
    """A function that opens the laboratory, each time anew."""

    def opened(about=ABOUT, kind=FakeLab) -> Lab:
        lab = kind(tmp_path / "out", ["false"], ["false"])
        lab.open(about)
        return lab

    return opened


def measure(lab, source, **options):
    return speed.measure(lab, "scene", str(source), EFFORT, options.get("peer", True))


def test_every_method_has_a_sweep_and_every_point_its_turns(lab, source):
    measured = measure(lab(), source)
    for method in speed.METHODS:
        points = measured.of(method)
        assert len(points) >= speed.LEAST_POINTS
        assert all(len(point.runs) == EFFORT.turns for point in points)
        seeds = [run.task.seed for point in points for run in point.runs]
        assert set(seeds) == {1, 2} and not set(seeds) & set(speed.REFERENCE_SEEDS)
    assert [run.task.seed for run in measured.reference] == list(speed.REFERENCE_SEEDS)


def test_a_scene_takes_about_the_time_that_it_was_given(lab, source):
    """Its least number of points may take longer: here one start of a second for each of some forty runs."""
    lab = lab()
    measure(lab, source)
    spent = sum(run.seconds for run in lab.runs.values())
    assert 0.6 * EFFORT.seconds < spent < 1.3 * EFFORT.seconds


def test_an_interrupted_session_is_taken_up_where_it_was(lab, source):
    whole = lab()
    expected = measure(whole, source)
    log = whole.folder / measured_runs.LOG
    lines = log.read_text().splitlines()
    log.write_text("\n".join([*lines[:10], lines[10][:50]]))
    again = lab()
    assert len(again.runs) == 10
    measured = measure(again, source)
    assert again.made == len(lines) - 10
    assert [point.errors for point in measured.points] == [point.errors for point in expected.points]
    third = lab()
    assert measure(third, source).points == measured.points and third.made == 0


def test_runs_of_a_scene_that_has_changed_are_made_again(lab, source):
    measure(lab(), source)
    source.write_text("# another scene")
    again = lab()
    measure(again, source)
    assert again.made == len(again.runs)


def test_runs_of_another_version_are_not_mixed_in(lab):
    lab()
    with pytest.raises(InputError, match=r"another machine or version \(numpy 2, now 3\)"):
        lab({**ABOUT, "numpy": "3"})


def test_bias_is_found_where_it_is_and_the_front_holds_no_beaten_point(lab, source):
    measured = measure(lab(), source)
    for method, bias in BIAS.items():
        found = measured.of(method)[-1].bias
        assert abs(found.size - bias) < 4 * found.stderr / (2 * bias) + 0.01
    path = measured.of("path")[-1].bias
    assert abs(path.squared) < 4 * path.stderr
    front = measured.pareto()
    times = [point.seconds()[0] for point in front]
    errors = [point.error()[0] for point in front]
    assert times == sorted(times) and errors == sorted(errors, reverse=True)
    for point in measured.points:
        assert point in front or any(
            other.seconds()[0] <= point.seconds()[0] and other.error()[0] <= point.error()[0] for other in front
        )


def test_a_peer_that_fails_is_left_out_and_said_so(lab, source):
    class Failing(FakeLab):
        def _mitsuba(self, task):
            raise PeerFailed("no LLVM")

    measured = measure(lab(kind=Failing), source)
    assert measured.of("mitsuba") == [] and "no LLVM" in measured.without_peer
    assert "no LLVM" in speed_page.page([measured], ABOUT, quick=True)


def test_the_page_names_the_machine_every_setting_and_who_is_first(lab, source):
    measured = measure(lab(), source)
    text = speed_page.page([measured], ABOUT, quick=False)
    assert "of a test, 2 cores" in text and "67.5" in text and "scene.png" in text
    for point in measured.points:
        assert f"| {point.setting} |" in text
    # half the time a pass of ours, and the same noise
    assert "**Mitsuba 3**" in text


def test_rows_hold_every_run_and_its_command(lab, source):
    lab = lab()
    measured = measure(lab, source)
    rows = list(speed.rows(measured))
    assert len(rows) == len(lab.runs) and all(row["command"] for row in rows)
    assert all(set(row) <= set(speed.COLUMNS) for row in rows)


def test_scenes_of_one_name_are_told_apart():
    assert list(speed.names([Path("a/x.toml"), Path("b/x.toml"), Path("y.ply")])) == ["x", "x-2", "y"]


def test_what_sss_render_refuses_is_said_in_its_words(tmp_path, source, monkeypatch):
    lab = Lab(tmp_path / "out", ["false"], ["false"])
    lab.open(ABOUT)

    def refuse(command, **_):
        return subprocess.CompletedProcess(command, 2, "", "sss-render: error: scene.toml: it is dark; light it\n")

    monkeypatch.setattr(measured_runs.subprocess, "run", refuse)
    with pytest.raises(InputError, match="it is dark"):
        lab.run(Task("scene", str(source), "path", 1, 0, 1))
    assert json.loads((tmp_path / "out" / measured_runs.ABOUT).read_text()) == ABOUT
