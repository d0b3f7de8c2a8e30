"""On a real cluster: a scheduler and workers as processes of their own, some of them killed."""

import json
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")

from benchmarks.local_cluster import LocalCluster
from cli.sss_render import main
from renderer.cluster import worker
from renderer.cluster.renderer import ClusterRenderer
from renderer.cluster.task import Parcel, Task
from renderer.render import Renderer, Settings
from sss_tools import shapes
from sss_tools.scheduler import connected
from sss_tools.writing import write_mesh

from .scenes import WHITE_SKY, camera, placed, scene, translucent

ROOT = Path(__file__).parents[2]
SCENE = """
[camera]
position = [0, 0.5, 6]
target = [0, 0, 0]
fov = 25
resolution = [64, 56]
[[light]]
type = "environment"
radiance = 0.7
[[object]]
mesh = "ball.ply"
material = "wax"
[material.wax]
type = "translucent"
albedo = [0.95, 0.9, 0.8]
sigma_t = 6.0
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with LocalCluster(tmp_path_factory.mktemp("cluster"), 2) as running:
        yield running


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mesh(shapes.icosphere(1.0, 2), "ball.ply")
    Path("scene.toml").write_text(SCENE)
    return tmp_path


def render(out, *options, status=0):
    """The arrays of a picture in which nothing is allowed to depend on who rendered it."""
    assert main(["scene.toml", "-o", out, "-q", *map(str, options)]) == status
    with np.load(out) as file:
        return {name: file[name] for name in file.files if name != "seconds"}


def assert_same_bits(one, other):
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def started(out, address, *options):
    """The command in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "cli.sss_render", "scene.toml", "-o", out, "-q", "--scheduler", address,
         "--shader", "path", *map(str, options)],
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def wait_for(path, process):
    deadline = time.monotonic() + 300
    while not Path(path).exists():
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()
        time.sleep(0.01)


@pytest.mark.parametrize(
    "options", [("--shader", "path"), ("--shader", "plumb"), ("--shader", "path", "--adaptive")], ids=" ".join
)
def test_a_picture_has_the_same_bits_from_threads_and_from_a_cluster(workplace, cluster, options):
    options = (*options, "--passes", 13)
    one, two = (render(f"{n}.npz", "--threads", n, *options) for n in (1, 2))
    many = render("many.npz", "--scheduler", cluster.address, *options)
    assert_same_bits(one, two)
    assert_same_bits(one, many)


def test_a_target_error_ends_at_the_same_pass_and_the_report_tells_of_the_cluster(workplace, cluster):
    options = ("--shader", "path", "--target-error", 0.2)
    here = render("here.npz", *options)
    there = render("there.npz", "--scheduler", cluster.address, "--report", "report.json", *options)
    assert_same_bits(here, there)
    told = json.loads(Path("report.json").read_text())
    assert told["cluster"]["workers"] == 2 and told["cluster"]["tasks"] > 0 and told["rays"] > 0
    render("more.npz", "--scheduler", cluster.address, "--report", "report.json", "--shader", "path", "--passes", 8)
    # three floats and two bits a pixel and pass
    assert json.loads(Path("report.json").read_text())["cluster"]["received"] == 64 * 56 * 8 * 12.25


def test_time_is_kept(workplace, cluster):
    begun = time.monotonic()
    picture = render("out.npz", "--scheduler", cluster.address, "--shader", "path", "--time", 1e-3)
    # counted from the start of this process: no time is left, and one pass is made
    assert picture["passes"] >= 1 and time.monotonic() - begun < 30


@pytest.mark.parametrize("shader", ["path", "scalar"])
def test_films_of_a_camera_path_are_those_rendered_here(cluster, shader):
    things = [placed(shapes.icosphere(1.0, 2), translucent(), name="ball")]
    views = [camera((4 * np.sin(a), 0, 4 * np.cos(a)), resolution=(20, 16)) for a in (0.0, 1.0, 2.0, 3.0, 4.0)]
    here = Renderer(scene(things, [WHITE_SKY], views[0]), Settings(shader=shader))
    with connected(cluster.address) as client:
        there = ClusterRenderer(client, scene(things, [WHITE_SKY], views[0]), Settings(shader=shader))
        for view, film in zip(views, there.films(views, 3), strict=True):
            here.look_from(view)
            here.run(range(3))
            np.testing.assert_array_equal(film.sum, here.film.sum)
            np.testing.assert_array_equal(film.hits, here.film.hits)


def _status():
    return Path("/proc/self/status").read_text()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux tells")
def test_workers_have_no_huge_pages_once_they_have_rendered(workplace, cluster):
    render("out.npz", "--passes", 8, "--shader", "path", "--scheduler", cluster.address)
    with connected(cluster.address) as client:
        states = [re.search(r"THP_enabled:\s*(\d)", status) for status in client.run(_status).values()]
    if None in states:
        pytest.skip("this system does not tell")
    assert any(state[1] == "0" for state in states)


def test_a_worker_keeps_two_scenes_and_the_buffers_of_the_last_alone(monkeypatch):
    monkeypatch.setattr(worker, "_built", OrderedDict())
    things = [placed(shapes.icosphere(1.0, 2), translucent(), name="ball")]
    scenes = [scene(things, [WHITE_SKY], camera((0, 0, far), resolution=(8, 8))) for far in (4.0, 5.0, 6.0)]
    parcels = [pickle.dumps(Parcel(one, Settings(shader="path"), 2, None)) for one in scenes]
    first = worker.render(parcels[0], Task((0, 1)))
    for parcel in parcels[1:]:
        worker.render(parcel, Task((0, 1)))
    assert [built._idle.qsize() for built in worker._built.values()] == [0, 1]
    again = worker.render(parcels[0], Task((0, 1)))
    assert len(worker._built) == 2 and again.hash == first.hash
    for one, other in zip(first.passes, again.passes, strict=True):
        np.testing.assert_array_equal(one.radiance, other.radiance)


def test_a_worker_that_is_killed_costs_no_pass(workplace, cluster):
    passes = 100
    running = started("out.npz", cluster.address, "--passes", passes, "--preview", "preview.npz")
    wait_for("preview.npz", running)
    victim = cluster.workers.pop()
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    assert running.poll() is None, "it was killed only after all was done"
    said = running.communicate(timeout=120)[1]
    assert (running.returncode, said) == (0, "")
    with np.load("out.npz") as file:
        killed = {name: file[name] for name in file.files if name != "seconds"}
    assert_same_bits(killed, render("whole.npz", "--shader", "path", "--passes", passes))


def test_a_scheduler_that_is_killed_is_one_line_and_the_render_goes_on_later(workplace):
    passes = 100
    with LocalCluster(workplace, 1) as mortal:
        running = started("out.png", mortal.address, "--passes", passes, "--preview", "preview.npz")
        wait_for("preview.npz", running)
        mortal.scheduler.kill()
        said = running.communicate(timeout=60)[1]
    assert running.returncode == 2 and said.count("\n") == 1
    assert said.startswith(f"sss-render: error: --scheduler {mortal.address}: the scheduler is gone; ")
    assert "--resume" in said
    kept = Path("out.png.unfinished.npz")
    with np.load(kept) as file:
        assert 0 < file["passes"] < passes
    assert Path("out.png").read_bytes().endswith(b"IEND\xaeB`\x82")
    # to the end, without a cluster; sums of the same passes in the same order
    assert main(["scene.toml", "-o", "out.npz", "-q", "--shader", "path", "--passes", str(passes)]) == 0
    kept.rename("resumed.npz.unfinished.npz")
    resumed = render("resumed.npz", "--shader", "path", "--passes", passes, "--resume")
    with np.load("out.npz") as file:
        np.testing.assert_array_equal(resumed["film_sum"], file["film_sum"])


def test_a_scheduler_that_is_not_there_is_one_line_and_status_two(workplace, capsys, monkeypatch):
    monkeypatch.setattr("sss_tools.scheduler.CONNECT", 0.5)
    for address in ("tcp://127.0.0.1:9", "no address", "tcp://here:1"):
        assert main(["scene.toml", "-o", "out.npz", "--scheduler", address]) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"sss-render: error: --scheduler {address}: ") and said.count("\n") == 1
    assert not Path("out.npz").exists()


def test_without_distributed_the_scheduler_option_says_what_to_install(workplace, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["scene.toml", "-o", "out.npz", "--scheduler", "tcp://127.0.0.1:9"]) == 2
    said = capsys.readouterr().err
    assert "pip install 'sss-tools[cluster]'" in said and said.count("\n") == 1


def test_threads_are_the_clusters_own(workplace, capsys):
    assert main(["scene.toml", "-o", "out.npz", "--scheduler", "tcp://127.0.0.1:9", "--threads", "2"]) == 2
    assert "--threads" in capsys.readouterr().err
