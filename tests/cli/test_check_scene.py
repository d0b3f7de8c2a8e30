import json
import math
from pathlib import Path

import numpy as np
import pytest

from cli.check_scene import SceneMeshes
from cli.sss_check import main
from sss_tools import shapes
from sss_tools.record import geometry_hash
from sss_tools.surroundings import Placed, Surroundings
from sss_tools.writing import write_mesh

SCENE = """
[scene]
unit = "cm"
[camera]
position = [0, 0, 10]
target = [0, 0, 0]
fov = 90
resolution = [200, 100]
[[light]]
type = "environment"
radiance = 1.0
[[object]]
name = "small"
mesh = "box.ply"
material = "wax"
[[object]]
name = "large"
mesh = "box.ply"
material = "wax"
transform = { scale = 4.0, translate = [5, 0, 0] }
[[object]]
name = "floor"
mesh = "floor.ply"
material = "stone"
transform = { scale = [1, -1, 1] }
[material.wax]
type = "translucent"
sigma_a = 0.5
sigma_s = 2.0
[material.stone]
type = "diffuse"
reflectance = 0.5
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SSS_TOOLS_CACHE", str(tmp_path / "cache"))
    write_mesh(shapes.inverted(shapes.box()), "box.ply")
    write_mesh(shapes.punctured(shapes.box(), [[0, 0, 1]], 0.9), "floor.ply")
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def run_json(capsys, *arguments):
    status = main([*arguments, "--format", "json"])
    captured = capsys.readouterr()
    return status, json.loads(captured.out)["meshes"], captured.err


def outcomes(mesh):
    return {rule["code"]: (rule["outcome"], rule["reason"]) for rule in mesh["rules"]}


def test_coefficients_are_per_mesh_unit_and_only_unscaled_meshes_have_a_named_one(scene):
    small, large, floor = SceneMeshes("scene.toml").all()
    np.testing.assert_allclose(small.medium.sigma_s, 2.0)
    # one unit of the large box's file is four of the scene: four times as much happens on it
    np.testing.assert_allclose(large.medium.sigma_s, 8.0)
    assert (small.unit, large.unit, small.material) == ("cm", None, "wax")
    assert floor.medium is None and not floor.surroundings.placed.translucent


def test_neighbours_are_in_the_frame_of_the_mesh(scene):
    small, large, floor = SceneMeshes("scene.toml").all()
    (of_small, _), problems = small.surroundings.neighbours()
    assert problems == [] and (of_small.name, of_small.translucent) == ("large", True)
    np.testing.assert_allclose(of_small.mesh.bounds, [[3, -2, -2], [7, 2, 2]])
    (of_large, mirrored), _ = large.surroundings.neighbours()
    # the small box, seen from a frame of which one unit is four of the scene's
    np.testing.assert_allclose(of_large.mesh.bounds, [[-1.375, -0.125, -0.125], [-1.125, 0.125, 0.125]])
    assert (mirrored.name, mirrored.translucent) == ("floor", False)
    # mirrored, yet its outside is still outside
    box = Placed("box", Path("solid.ply"), np.diag([1.0, -1.0, 1.0, 1.0]), True)
    write_mesh(shapes.box(), "solid.ply")
    ((turned,), _) = Surroundings(small.surroundings.placed, (box,), small.surroundings.view).neighbours()
    assert math.isclose(turned.mesh.volume, 1.0)
    assert len(floor.surroundings.neighbours()[0]) == 2


def test_the_pixel_footprint_is_taken_where_the_mesh_is_nearest(scene):
    small, large, _ = SceneMeshes("scene.toml").all()
    box = shapes.box()
    # the front of the small box is 9.5 away; 100 rows share 2 tan 45 degrees of it
    assert math.isclose(small.surroundings.pixel_footprint(box), 9.5 * 2 / 100)
    assert math.isclose(large.surroundings.pixel_footprint(box), 8 * 2 / 100 / 4)
    behind = (scene / "scene.toml").read_text().replace("target = [0, 0, 0]", "target = [0, 0, 20]")
    (scene / "scene.toml").write_text(behind)
    assert SceneMeshes("scene.toml").all()[0].surroundings.pixel_footprint(box) is None


def test_a_scene_checks_all_its_objects(scene, capsys):
    status, meshes, err = run_json(capsys, "scene.toml")
    assert [(mesh["path"], mesh["object"]) for mesh in meshes] == [
        *(("box.ply", "small"), ("box.ply", "large"), ("floor.ply", "floor")),
    ]
    assert (status, err) == (1, "")
    assert meshes[0]["hash"] == geometry_hash(shapes.inverted(shapes.box()))
    assert all(outcomes(mesh)["SSS204"][0] == "fail" for mesh in meshes[:2])


def test_rules_about_the_inside_do_not_run_on_what_is_opaque_there(scene, capsys):
    _, (_, _, floor), _ = run_json(capsys, "scene.toml")
    assert outcomes(floor)["SSS101"] == ("not-run", "opaque in this scene: no light enters it")
    assert outcomes(floor)["SSS602"] == ("pass", None)
    assert floor["closedness"]["state"] in ("holes", "open")
    # by itself it is not
    _, (floor,), _ = run_json(capsys, "floor.ply")
    assert "fail" in (outcomes(floor)["SSS101"][0], outcomes(floor)["SSS102"][0])


def test_meshes_have_the_place_that_a_scene_gives_them(scene, capsys):
    status, meshes, err = run_json(capsys, "./box.ply", "--scene", "scene.toml")
    assert [(mesh["path"], mesh["object"]) for mesh in meshes] == [("./box.ply", "small"), ("./box.ply", "large")]
    assert (status, err) == (1, "")


def test_a_mesh_that_the_scene_does_not_show_is_checked_by_itself_and_that_is_said(scene, capsys):
    write_mesh(shapes.box(), "stray.ply")
    status, (mesh,), err = run_json(capsys, "stray.ply", "--scene", "scene.toml")
    assert (status, mesh["object"], outcomes(mesh)["SSS304"][1]) == (0, None, "no scene")
    assert err.count("\n") == 1 and "stray.ply: is not in scene.toml" in err


def test_a_corrupt_mesh_of_a_scene_is_its_own_finding_and_a_warning_of_its_neighbours(scene, capsys):
    (scene / "floor.ply").write_text("ply\n")
    status, meshes, err = run_json(capsys, "scene.toml")
    assert status == 2 and outcomes(meshes[2])["SSS702"][0] == "fail"
    assert outcomes(meshes[0])["SSS204"][0] == "fail"
    assert err.count("its neighbour floor is left out") == 2 and "Traceback" not in err


def test_a_moved_neighbour_is_another_check(scene, capsys):
    run_json(capsys, "scene.toml")
    (scene / "scene.toml").write_text(SCENE.replace("[5, 0, 0]", "[6, 0, 0]"))
    _, meshes, _ = run_json(capsys, "scene.toml")
    assert [mesh["cached"] for mesh in meshes] == [False, False, False]
    _, meshes, _ = run_json(capsys, "scene.toml")
    assert [mesh["cached"] for mesh in meshes] == [True, True, True]


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["scene.toml", "--material", "marble"], "--material: is for meshes without a scene"),
        (["box.ply", "--scene", "scene.toml", "--unit", "mm"], "--unit: is for meshes without a scene"),
        (["box.ply", "--scene", "missing.toml"], "missing.toml: there is no such scene file"),
        (["bad.toml"], 'unknown key "objekt"'),
        (["scene.toml", "-o", "floor.ply"], "is one of the meshes"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_status_two(scene, capsys, arguments, problem):
    (scene / "bad.toml").write_text(SCENE.replace("[[object]]", "[[objekt]]"))
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert problem in captured.err and captured.err.count("\n") == 1 and captured.out == ""
