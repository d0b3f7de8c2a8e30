"""The examples do what their first lines say; their pictures are judged by eye."""

import shutil
import sys
from pathlib import Path

import pytest

from renderer.scene.admission import admit
from renderer.scene.scene_file import load_scene
from renderer.shaders.selection import select
from sss_tools.closedness import assess

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture
def example(monkeypatch):
    """Import an example as ``python examples/NAME.py`` would."""
    import importlib

    monkeypatch.syspath_prepend(str(EXAMPLES))
    before = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - before:
        if Path(getattr(sys.modules[name], "__file__", None) or "").parent == EXAMPLES:
            del sys.modules[name]


@pytest.mark.parametrize(
    ("name", "state", "internal", "holes"),
    [
        ("elephant", "closed", False, 0),
        ("elephant_with_holes", "holes", False, 3),
        ("elephant_with_shell", "closed", True, 0),
        ("sheet", "open", False, 1),
        ("ground", "closed", False, 0),
    ],
)
def test_the_meshes_are_what_they_are_called(example, name, state, internal, holes):
    closedness = assess(example("make_meshes").MESHES[name]()).closedness
    assert (closedness.state, closedness.internal_geometry, closedness.boundary_loops) == (state, internal, holes)


def test_three_distances_are_three_shaders(example, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "examples").mkdir()
    scene_file = shutil.copy(EXAMPLES / "three_distances.toml", tmp_path / "examples")
    example("make_meshes").make(tmp_path / "out", ["elephant", "ground"])
    scene, _ = admit(load_scene(scene_file))
    assert [plan.shader for plan in select(scene, 0.05)] == ["path", "plumb", "scalar", "opaque"]


@pytest.mark.parametrize("trouble", [OSError("no network"), ValueError("another hash")], ids=["offline", "hash"])
def test_the_bunny_that_cannot_be_had_is_one_line_and_status_two(example, monkeypatch, tmp_path, capsys, trouble):
    pooch = pytest.importorskip("pooch")

    def retrieve(*_, **__):
        raise trouble

    monkeypatch.setattr(pooch, "retrieve", retrieve)
    monkeypatch.setattr(sys, "argv", ["bunny.py", str(tmp_path)])
    assert example("bunny").main() == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("bunny.py: error: https://") and captured.err.count("\n") == 1
    assert captured.out == ""


def test_the_bunny_in_the_shared_folder_is_the_one_that_is_downloaded(example, shared):
    import hashlib

    file = (shared / "meshes" / "bunny_stanford.obj").read_bytes()
    assert hashlib.sha256(file).hexdigest() == example("bunny").SHA256
