"""sss-inspect looks at meshes, scenes and records, and refuses the rest in one line."""

import json
import os
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cli import inspect_subject, sss_inspect
from cli.sss_check import main as check
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

NO_GL = ("libEGL.so.1", "libEGL.so", "libGL.so.1", "libGL.so", "libOSMesa.so", "libOSMesa.so.8", "libOSMesa.so.6",
         "libGLX.so.0", "libOpenGL.so.0")  # fmt: skip
SMALL_STILL = ("--screenshot", "a.png", "--size", "500x400")


@pytest.fixture
def by_rays(monkeypatch):
    """Stills without VTK: the preflight finds nothing."""
    from renderer.inspection import gl

    monkeypatch.setattr(gl, "preflight", lambda: gl.Drawable(None, gl.MISSING))


@pytest.fixture
def holes(workplace):
    write_mesh(shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1], [1, 0, 0]], 0.2), "holes.ply")
    return workplace


def one_line(captured) -> str:
    assert captured.out == "" and captured.err.count("\n") == 1
    assert captured.err.startswith("sss-inspect: error: ")
    return captured.err


def test_a_still_of_a_mesh_is_written_and_its_findings_counted(holes, by_rays, capsys):
    assert sss_inspect.main(["holes.ply", "--screenshot", "a.png", "--size", "600x450"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "a.png: 1 finding in 2 places\n"
    assert Image.open("a.png").size == (600, 450)
    # why VTK did not draw it, and what to install
    assert "libegl1" in captured.err and captured.err.count("\n") == 1


def test_the_command_survives_a_machine_without_gl(holes, start):
    folder = Path("no_gl")
    folder.mkdir()
    for name in NO_GL:
        (folder / name).write_text("no library")
    code = "import sys; from cli.sss_inspect import main; sys.exit(main(sys.argv[1:]))"
    before = os.environ.get("LD_LIBRARY_PATH")
    os.environ["LD_LIBRARY_PATH"] = str(folder.resolve())
    try:
        process = start(code, "holes.ply", *SMALL_STILL)
    finally:
        os.environ.pop("LD_LIBRARY_PATH")
        if before is not None:
            os.environ["LD_LIBRARY_PATH"] = before
    _, error = process.communicate()
    assert process.returncode == 0, error
    assert Image.open("a.png").size == (500, 400)


def test_a_rule_by_name_is_all_that_is_shown(holes, by_rays, capsys):
    assert sss_inspect.main(["holes.ply", "--rule", "inverted-shell", *SMALL_STILL]) == 0
    assert "0 findings in 0 places" in capsys.readouterr().out


@pytest.mark.parametrize("colour", ["thickness", "shader", "component"])
@pytest.mark.parametrize("subject", ["holes.ply", "scene.toml"])
def test_every_colouring_draws_meshes_and_scenes(holes, by_rays, subject, colour):
    arguments = [subject, "--color", colour, "--screenshot", "a.png", "--size", "600x450", "-q"]
    assert sss_inspect.main(arguments) == 0
    assert np.asarray(Image.open("a.png")).std() > 5


def test_a_scene_shows_its_camera(workplace, by_rays, capsys):
    assert sss_inspect.main(["scene.toml", "--screenshot", "a.png", "--html", "a.html", "--size", "600x450"]) == 0
    assert len(json.loads(data_of(Path("a.html")))["strokes"]) >= 2


def data_of(path: Path) -> str:
    return path.read_text().split('id="data">')[1].split("</script>")[0]


def test_a_record_shows_what_it_says_and_goes_on_the_page(holes, by_rays, capsys):
    check(["holes.ply", "--record", "-q"])
    capsys.readouterr()
    assert sss_inspect.main(["holes.ply.sss.json", "--html", "a.html"]) == 0
    assert capsys.readouterr().out == "a.html: 1 finding in 2 places\n"
    assert "blake2b:" in Path("a.html").read_text()


def test_a_record_that_lists_only_some_faces_says_so_and_who_shows_all(workplace, by_rays, capsys):
    write_mesh(shapes.inverted(shapes.icosphere(1.0, 3)), "inverted.ply")  # 1280 faces
    check(["inverted.ply", "--record", "-q"])
    capsys.readouterr()
    assert sss_inspect.main(["inverted.ply.sss.json", "--html", "a.html"]) == 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "only the first 1000" in error and "sss-inspect inverted.ply shows all" in error
    assert "only the first 1000" in Path("a.html").read_text()
    assert sss_inspect.main(["inverted.ply", "--html", "b.html"]) == 0
    assert "only the first" not in capsys.readouterr().err + Path("b.html").read_text()


@pytest.mark.parametrize("unit", [None, "cm"])
def test_the_live_picture_takes_a_material_from_a_file_and_in_its_own_unit(workplace, unit):
    Path("wax.toml").write_text("albedo = [0.9, 0.8, 0.7]\nsigma_t = 2.0\n")
    scene = inspect_subject.scene_of(Namespace(subject="ball.ply", material="wax.toml", unit=unit))
    (thing,) = scene.objects
    # per millimetre in the file
    assert thing.material.medium.sigma_t == pytest.approx([2.0 if unit is None else 20.0] * 3)


def test_the_shader_shown_is_that_of_the_material_named(holes, by_rays):
    """Two millimetres of ketchup are thinner, optically, than what a bare mesh is made of unless somebody says."""
    chosen = []
    for material in ([], ["--material", "ketchup"]):
        options = ["holes.ply", "--color", "shader", "--html", "a.html", "-q", *material]
        assert sss_inspect.main(options) == 0
        chosen.append(Path("a.html").read_text().split("shader: ")[1].split("</p>")[0])
    assert chosen[0] != chosen[1]


def test_a_record_of_another_mesh_is_refused(holes, capsys):
    check(["holes.ply", "--record", "-q"])
    write_mesh(shapes.icosphere(1.0, 2), "holes.ply")
    capsys.readouterr()
    assert sss_inspect.main(["holes.ply.sss.json", "--screenshot", "a.png"]) == 2
    error = capsys.readouterr().err
    assert "sss-inspect: error: holes.ply.sss.json: does not go with holes.ply" in error and "--record" in error
    assert not Path("a.png").exists()


def test_a_render_goes_on_the_page(holes, capsys):
    Image.new("RGB", (4, 4)).save("render.png")
    assert sss_inspect.main(["holes.ply", "--html", "a.html", "--picture", "render.png"]) == 0
    assert "data:image/png;base64," in Path("a.html").read_text()


def test_faces_with_finite_corners_are_drawn_where_others_are_not(workplace, by_rays, capsys):
    ball = shapes.icosphere(1.0, 2)
    vertices = ball.vertices.copy()
    vertices[3] = np.nan
    write_mesh(Mesh(vertices, ball.faces), "nan.ply")
    assert sss_inspect.main(["nan.ply", *SMALL_STILL, "-q"]) == 0


REFUSALS = {
    "no file": (["none.ply", "--screenshot", "a.png"], "none.ply"),
    "no mesh": (["text.txt", "--screenshot", "a.png"], "is no mesh, scene or record"),
    "a folder": ([".", "--screenshot", "a.png"], "is a folder"),
    "truncated": (["short.ply", "--screenshot", "a.png"], "short.ply"),
    "no faces": (["points.ply", "--screenshot", "a.png"], "has no faces"),
    "bad scene": (["bad.toml", "--screenshot", "a.png"], "bad.toml"),
    "no record": (["text.sss.json", "--screenshot", "a.png"], "text.sss.json"),
    "wrong suffix": (["ball.ply", "--screenshot", "a.jpg"], "a.png"),
    "no folder": (["ball.ply", "--screenshot", "x/a.png"], "there is no folder x"),
    "over itself": (["page.html", "--html", "page.html"], "is what is to be looked at"),
    "no such rule": (["ball.ply", "--rule", "SSS999", "--screenshot", "a.png"], "SSS999"),
    "no such material": (["ball.ply", "--material", "marbel", "--screenshot", "a.png"], "marble"),
    "material of a scene": (["scene.toml", "--material", "marble", "--screenshot", "a.png"], "set it in scene.toml"),
    "bad clip": (["ball.ply", "--clip", "w", "--screenshot", "a.png"], "--clip"),
    "empty clip": (["ball.ply", "--clip", "x:0.5:0.5", "--screenshot", "a.png"], "--clip"),
    "tiny": (["ball.ply", "--size", "5x5", "--screenshot", "a.png"], "--size"),
    "picture without page": (["ball.ply", "--picture", "p.png", "--screenshot", "a.png"], "--html"),
    "picture that is none": (["ball.ply", "--picture", "text.txt", "--html", "a.html"], "is no PNG"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_what_cannot_be_looked_at_is_refused_in_one_line(workplace, capsys, case):
    Path("text.txt").write_text("words")
    Path("text.sss.json").write_text("words")
    Path("page.html").write_text("words")
    Path("bad.toml").write_text("[camera\n")
    Path("short.ply").write_bytes(Path("ball.ply").read_bytes()[:-50])
    write_mesh(Mesh(np.eye(3), np.empty((0, 3), np.int64)), "points.ply")
    arguments, words = REFUSALS[case]
    assert sss_inspect.main(arguments) == 2
    assert words in one_line(capsys.readouterr())
    assert not Path("a.png").exists() and not Path("a.html").exists()


@pytest.mark.parametrize("more", [["--screenshot", "a.png"], ["--rule", "SSS101"], ["--clip", "x"]])
def test_live_goes_without_what_it_would_ignore(workplace, capsys, more):
    assert sss_inspect.main(["ball.ply", "--live", *more]) == 2
    assert f"goes without {more[0]}" in one_line(capsys.readouterr())
