"""What sss-render refuses: one line on stderr, status 2, no traceback, and nothing written or overwritten."""

from pathlib import Path

import numpy as np
import pytest

from cli.sss_render import main
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

OLD = b"an older picture"
CORRUPT = {
    "empty.ply": b"",
    "empty.obj": b"",
    "empty.stl": b"",
    "empty.glb": b"",
    "corrupt.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n\x00\x01",
    "corrupt.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "corrupt.stl": b"\x00" * 80 + b"\xff\xff\x00\x00" + b"\x01" * 60,
    "corrupt.glb": b"glTF\x02\x00\x00\x00\xff\xff\x00\x00JSON",
    "nan.obj": b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "points.obj": b"v 0 0 0\nv 1 0 0\n",
    "one_point.obj": b"v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n",
    "unknown.xyz": b"0 0 0",
    "empty.toml": b"",
    "syntax.toml": b"[camera\n",
    "binary.toml": b"\xff\xfe\x00",
}


@pytest.fixture
def refused(workplace, capfd, monkeypatch):
    """A function that runs sss-render, sees that it refuses properly and renders nothing, and returns its line."""
    from renderer.render import Renderer

    def run_anyway(*_):
        raise AssertionError("rendered what should have been refused")

    monkeypatch.setattr(Renderer, "run", run_anyway)
    (workplace / "out.png").write_bytes(OLD)

    def run(*arguments: str) -> str:
        before = {path: path.read_bytes() for path in workplace.rglob("*") if path.is_file()}
        assert main(list(arguments)) == 2
        captured = capfd.readouterr()
        assert captured.err.startswith(("sss-render: error: ", "sss-render merge: error: "))
        assert captured.err.count("\n") == 1 and captured.err.endswith("\n")
        assert captured.out == ""
        assert {path: path.read_bytes() for path in workplace.rglob("*") if path.is_file()} == before
        return captured.err

    return run


def scene(old: str = "", new: str = "", more: str = "") -> str:
    """A changed copy of the scene: ``old``, which must be there, is replaced by ``new``, and ``more`` added."""
    text = Path("scene.toml").read_text()
    assert old in text
    Path("changed.toml").write_text(text.replace(old, new) + more)
    return "changed.toml"


def names_subject_and_remedy(line: str, subject: str) -> bool:
    return line.startswith(f"sss-render: error: {subject}: ") and "; " in line


@pytest.mark.parametrize("name", ["missing.ply", "missing.toml", "no/such/folder/mesh.stl", "."])
def test_a_missing_file(refused, name):
    assert names_subject_and_remedy(refused(name, "-o", "out.png"), name)


@pytest.mark.parametrize("name", CORRUPT)
def test_an_empty_or_corrupt_file(refused, workplace, name):
    (workplace / name).write_bytes(CORRUPT[name])
    assert names_subject_and_remedy(refused(name, "-o", "out.png"), name)


@pytest.mark.parametrize("name", [name for name in CORRUPT if not name.endswith(".toml") and name != "one_point.obj"])
def test_a_scene_with_an_empty_or_corrupt_mesh_names_the_mesh(refused, workplace, name):
    (workplace / name).write_bytes(CORRUPT[name])
    assert names_subject_and_remedy(refused(scene("ball.ply", name), "-o", "out.png"), name)


def test_nan_vertices_in_a_binary_file(refused):
    ball = shapes.icosphere(1.0, 2)
    vertices = ball.vertices.copy()
    vertices[7, 1] = np.nan
    write_mesh(Mesh(vertices, ball.faces), "nan.ply")
    for source in ("nan.ply", scene("ball.ply", "nan.ply")):
        assert "not finite" in refused(source, "-o", "out.png") or "NaN" in refused(source, "-o", "out.png")


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("sigma_t = 6.0", "sigma_t = 6.0\nroughnes = 0.1", '"roughness"'),
        ("fov = 26", "fovv = 26", '"fov"'),
        ('name = "ball"', 'nam = "ball"', '"name"'),
        ('type = "environment"', 'type = "enviroment"', '"environment"'),
        ("[camera]", "[kamera]\nx = 1\n[camera]", '"camera"'),
        ('material = "wax"', 'material = "wix"', '"wax"'),
    ],
    ids=["material", "camera", "object", "kind of light", "table", "material's name"],
)
def test_an_unknown_key_or_name_and_the_nearest_valid_one(refused, old, new, hint):
    line = refused(scene(old, new), "-o", "out.png")
    assert names_subject_and_remedy(line, "changed.toml") and hint in line


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("sigma_t = 6.0", "sigma_t = -6.0"),
        ("albedo = [0.9, 0.8, 0.7]\nsigma_t = 6.0", "sigma_a = [0.1, -0.1, 0.1]\nsigma_s = 1.0"),
        ("albedo = [0.9, 0.8, 0.7]", "albedo = [0.9, 0.8, 1.1]"),
        ("sigma_t = 6.0", "sigma_t = nan"),
        ("sigma_t = 6.0", "sigma_t = 6.0\nior = 0.5"),
        ("sigma_t = 6.0", "sigma_t = 6.0\ng = 1.0"),
        ("radiance = [0.5, 0.6, 0.7]", "radiance = -1.0"),
        ("fov = 26", "fov = 0"),
        ("resolution = [24, 20]", "resolution = [0, 20]"),
    ],
    ids=lambda text: text.splitlines()[-1],
)
def test_a_negative_coefficient_or_another_value_that_cannot_be(refused, old, new):
    assert names_subject_and_remedy(refused(scene(old, new), "-o", "out.png"), "changed.toml")


def test_a_camera_inside_an_object(refused):
    line = refused(scene("position = [0, 1, 6]", "position = [0, 0.1, 0.5]"), "-o", "out.png")
    assert names_subject_and_remedy(line, "changed.toml") and "inside the object 'ball'" in line


def test_a_camera_in_a_hollow_of_the_bounding_box_is_no_camera_inside(workplace):
    write_mesh(shapes.torus(1.0, 0.3), "ball.ply")
    changed = scene("position = [0, 1, 6]", "position = [0.1, 0.1, 0]")
    assert main([changed, "-o", "out.npz", "--passes", "1"]) == 0


def test_no_lights_and_no_objects(refused):
    text = Path("scene.toml").read_text()
    light = text[text.index("[[light]]") : text.index("[[object]]")]
    thing = text[text.index("[[object]]") : text.index("[material")]
    assert "there is no [[light]]" in refused(scene(light), "-o", "out.png")
    assert "there is no [[object]]" in refused(scene(thing), "-o", "out.png")


@pytest.mark.parametrize("source", ["scene.toml", "ball.ply"])
@pytest.mark.parametrize(
    "output",
    ["folder.png", "missing/out.png", "ball.ply/out.png", "out.jpg", "out", "x" * 300 + ".png"],
    ids=["a folder", "a missing parent", "below a file", "an unknown kind", "no kind", "too long a name"],
)
def test_an_unwritable_output_before_anything_is_rendered(refused, workplace, source, output):
    (workplace / "folder.png").mkdir()
    assert names_subject_and_remedy(refused(source, "-o", output), output)


@pytest.mark.parametrize("report", ["folder", "missing/report.json", "ball.ply/report.json"])
def test_an_unwritable_report_before_anything_is_rendered(refused, workplace, report):
    (workplace / "folder").mkdir()
    line = refused("scene.toml", "-o", "out.png", "--report", report)
    assert names_subject_and_remedy(line, report)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["scene.toml"],
        ["-o", "out.png"],
        ["scene.toml", "-o", "out.png", "--shader", "photon"],
        ["scene.toml", "-o", "out.png", "--quality", "1.5"],
        ["scene.toml", "-o", "out.png", "--passes", "0"],
        ["scene.toml", "-o", "out.png", "--passes", "2", "--time", "3"],
        ["scene.toml", "-o", "out.png", "--time", "0"],
        ["scene.toml", "-o", "out.png", "--time", "nan"],
        ["scene.toml", "-o", "out.png", "--target-error", "-1"],
        ["scene.toml", "-o", "out.png", "--seed", "-1"],
        ["scene.toml", "-o", "out.png", "--threads", "0"],
        ["scene.toml", "-o", "out.png", "--size", "20"],
        ["scene.toml", "-o", "out.png", "--size", "0x20"],
        ["scene.toml", "-o", "out.png", "--pass-range", "3:3"],
        ["scene.toml", "-o", "out.png", "--pass-range", "3"],
        ["scene.toml", "-o", "out.png", "--aov", "depht"],
        ["scene.toml", "-o", "out.png", "--material", "marble"],
        ["ball.ply", "-o", "out.png", "--material", "marbel"],
        ["scene.toml", "-o", "out.png", "--scheduler", "tcp://here:1"],
        ["scene.toml", "-o", "out.png", "--no-such-option"],
        ["merge", "-o", "out.png"],
        ["merge", "missing.npz", "-o", "out.png"],
        ["merge", "ball.ply", "-o", "out.png"],
        ["merge", "scene.toml"],
    ],
    ids=" ".join,
)
def test_a_bad_option(refused, capfd, arguments):
    # the verdict on the meshes comes before the arrays that depend on the scene
    if "--aov" in arguments:
        arguments = [*arguments, "--quiet"]
    refused(*arguments)
