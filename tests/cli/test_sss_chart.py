"""sss-chart from end to end, in its smallest form, and what it refuses."""

import csv
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from cli.sss_chart import main
from cli.sss_render import main as render

NO_MATPLOTLIB = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "matplotlib":
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Absent())
from cli.sss_chart import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_a_chart_of_speed_is_drawn_and_taken_up_again_and_its_rows_can_be_rerun(workplace, capfd):
    command = ["speed", "scene.toml", "-o", "out", "--minutes", "0.01", "--turns", "1", "--no-peers"]
    assert main(command) == 0
    told = capfd.readouterr()
    assert told.err.count("remain\n") > 10 and "speed.md: 1 scene(s)" in told.out
    for name in ("scene.png", "scene.svg", "speed.csv", "speed.md"):
        assert (workplace / "out" / name).stat().st_size > 1000
    assert main(command) == 0
    assert capfd.readouterr().err == ""
    with (workplace / "out" / "speed.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["method"] for row in rows} == {"path", "plumb", "scalar", "diffuse", "auto", "reference"}
    row = next(row for row in rows if row["method"] == "diffuse")
    program, *arguments = shlex.split(row["command"])
    assert program == "sss-render" and render([*arguments, "-q"]) == 0
    kept = np.load(workplace / "out" / "pictures" / arguments[-1])["image"]
    assert (np.load(workplace / arguments[-1])["image"] == kept).all()


def refused(capfd, *arguments: str) -> str:
    assert main(list(arguments)) == 2
    captured = capfd.readouterr()
    assert captured.err.startswith("sss-chart") and captured.err.count("\n") == 1 and captured.out == ""
    return captured.err


def test_bad_input_is_one_line_that_names_it(workplace, capfd):
    assert "speed or stability" in refused(capfd)
    assert "-o: is missing" in refused(capfd, "speed", "scene.toml")
    assert "nowhere.toml" in refused(capfd, "speed", "nowhere.toml", "-o", "out")
    Path("broken.ply").write_bytes(b"ply\n")
    assert "broken.ply" in refused(capfd, "speed", "broken.ply", "-o", "out")
    assert "--study gravity: is no study; choose from wall" in refused(
        capfd, "stability", "--study", "gravity", "-o", "out"
    )
    assert "scene.toml" in refused(capfd, "speed", "scene.toml", "-o", "scene.toml", "--no-peers")
    assert "ball.ply" in refused(capfd, "stability", "-o", "ball.ply")
    assert "positive number" in refused(capfd, "speed", "scene.toml", "--minutes", "0", "-o", "out")
    assert not Path("out").exists()


def test_without_matplotlib_one_line_says_what_to_install(workplace, start):
    process = start(NO_MATPLOTLIB, "speed", "scene.toml", "-o", "out")
    _, error = process.communicate()
    assert process.returncode == 2
    assert error.splitlines() == [
        "sss-chart: error: charts: matplotlib is not installed; pip install 'sss-tools[charts]'"
    ]


def test_studies_are_listed(capfd):
    assert main(["stability", "--list"]) == 0
    listed = capfd.readouterr().out
    assert all(name in listed for name in ("wall:", "tessellation:", "light-distance:", "seeds:"))


@pytest.mark.slow
def test_a_study_is_drawn_with_its_scenes_beside_it(workplace, capfd, monkeypatch):
    from renderer.study import stability_bench

    monkeypatch.setattr(stability_bench, "QUICK", stability_bench.Effort(0.01, 7))
    monkeypatch.setattr(sys.modules["renderer.study.stability_report"], "QUICK", stability_bench.Effort(0.01, 7))
    assert main(["stability", "--study", "ior", "--quick", "-o", "out"]) == 0
    out = workplace / "out"
    for name in ("ior.png", "ior.svg", "stability.csv", "stability.md", "limits.md", "scenes/ior-1.toml"):
        assert (out / name).stat().st_size > 200
    assert "remain" in capfd.readouterr().err
