"""sss-check --fix: what is written where, what never is."""

import json

import numpy as np
import pytest

from cli.sss_check import main
from sss_tools import shapes
from sss_tools.errors import InputError
from sss_tools.loading import load_mesh
from sss_tools.mesh import Body, Mesh
from sss_tools.repair.output import is_ours, plan_outputs, write_result
from sss_tools.writing import write_mesh

pytest.importorskip("igl")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def bowl() -> Mesh:
    return shapes.punctured(shapes.icosphere(1.0, 2), [[0, 0, 1]], 0.4)


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def run_json(capsys, *arguments):
    status = main([*arguments, "--jobs", "1", "--format", "json"])
    return status, json.loads(capsys.readouterr().out)["meshes"]


def test_a_result_is_written_checked_and_reported_and_the_input_not_touched(folder, capsys):
    write_mesh(shapes.inverted(shapes.box()), "box.ply")
    before = (folder / "box.ply").read_bytes()
    status, (mesh,) = run_json(capsys, "box.ply", "--fix")
    assert status == 0
    repair = mesh["repair"]
    assert repair["status"] == "fixed"
    assert repair["output"] == "box.fixed.ply"
    assert repair["before"]["findings"] == {"SSS204": 1}
    assert repair["after"]["findings"] == {}
    assert set(repair) == {"status", "reason", "output", "rungs", "before", "after", "lost"}
    assert {rung["status"] for rung in repair["rungs"]} <= {"applied", "skipped", "undone"}
    assert load_mesh(folder / "box.fixed.ply").volume == pytest.approx(1)
    assert (folder / "box.ply").read_bytes() == before


def test_safe_fixes_leave_a_hole_and_its_status(folder, capsys):
    write_mesh(bowl(), "bowl.ply")
    status, (mesh,) = run_json(capsys, "bowl.ply", "--fix")
    assert (status, mesh["repair"]["status"], files(folder)) == (1, "unchanged", ["bowl.ply"])


def test_unsafe_fixes_close_it_and_a_second_run_changes_nothing(folder, capsys):
    write_mesh(bowl(), "bowl.ply")
    assert run_json(capsys, "bowl.ply", "--unsafe-fixes")[0] == 0
    written = (folder / "bowl.fixed.ply").read_bytes()
    status, (mesh,) = run_json(capsys, "bowl.fixed.ply", "--unsafe-fixes")
    assert (status, mesh["repair"]["status"]) == (0, "unchanged")
    # ours, so it may be replaced; the same input makes the same bytes
    assert run_json(capsys, "bowl.ply", "--unsafe-fixes")[0] == 0
    assert (folder / "bowl.fixed.ply").read_bytes() == written
    assert files(folder) == ["bowl.fixed.ply", "bowl.ply"]


def test_the_record_of_a_result_keeps_how_it_came_to_be(folder, capsys):
    write_mesh(shapes.inverted(shapes.box()), "box.ply")

    def recorded():
        return [rung["name"] for rung in json.loads((folder / "box.fixed.ply.sss.json").read_text())["repairs"]]

    run_json(capsys, "box.ply", "--fix", "--record")
    assert recorded() == ["orientation"]
    # checked again, and fixed again: it is the same geometry
    run_json(capsys, "box.fixed.ply", "--record")
    assert recorded() == ["orientation"]
    run_json(capsys, "box.fixed.ply", "--unsafe-fixes", "--record")
    assert recorded() == ["orientation"]
    # another mesh of that name has another past
    write_mesh(shapes.box(2.0), "box.fixed.ply")
    run_json(capsys, "box.fixed.ply", "--record")
    assert recorded() == []


def test_clean_and_refused_meshes_write_nothing(folder, capsys):
    write_mesh(shapes.box(), "clean.ply")
    write_mesh(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "sheet.ply")
    status, (clean, sheet) = run_json(capsys, ".", "--unsafe-fixes")
    assert (clean["repair"]["status"], sheet["repair"]["status"]) == ("unchanged", "refused")
    assert status == 1  # the sheet keeps its finding
    assert any(rule["code"] == "SSS102" and rule["outcome"] == "fail" for rule in sheet["rules"])
    assert files(folder) == ["clean.ply", "sheet.ply"]


def test_a_file_of_somebody_else_is_never_replaced(folder, capsys):
    write_mesh(shapes.inverted(shapes.box()), "box.ply")
    (folder / "box.fixed.ply").write_bytes(b"my own work")
    assert main(["box.ply", "--fix", "--jobs", "1"]) == 1
    assert "was not written by sss-check" in capsys.readouterr().err
    assert (folder / "box.fixed.ply").read_bytes() == b"my own work"


def test_a_result_that_was_edited_since_is_somebody_elses(folder):
    box = shapes.box()
    path, _ = write_result(box, box, str(folder / "box.fixed"))
    assert is_ours(path)
    path.write_bytes(path.read_bytes()[:-1] + b"\x07")
    assert not is_ours(path)
    with pytest.raises(InputError, match="not written by"):
        write_result(box, box, str(folder / "box.fixed"))


def test_diff_writes_nothing_and_exits_1_if_a_fix_would_change_something(folder, capsys):
    write_mesh(shapes.inverted(shapes.box()), "box.ply")
    write_mesh(shapes.box(), "clean.ply")
    status, (mesh, clean) = run_json(capsys, "box.ply", "clean.ply", "--diff")
    assert (status, mesh["repair"]["status"], clean["repair"]["status"]) == (1, "fixed", "unchanged")
    assert mesh["repair"]["output"] is None
    assert main(["clean.ply", "--diff", "--jobs", "1"]) == 0
    assert files(folder) == ["box.ply", "clean.ply"]


def test_fix_out_mirrors_the_folders(folder, capsys):
    (folder / "in" / "deep").mkdir(parents=True)
    write_mesh(shapes.inverted(shapes.box()), "in/deep/box.ply")
    assert run_json(capsys, "in", "--fix", "--fix-out", "out")[0] == 0
    assert files(folder) == ["in/deep/box.ply", "out/deep/box.fixed.ply"]


def test_results_that_would_collide_keep_their_extension():
    assert plan_outputs(["a/x.stl", "a/X.ply", "a/y.stl"], ["a"]) == {
        "a/x.stl": "a/x.stl.fixed",
        "a/X.ply": "a/X.ply.fixed",
        "a/y.stl": "a/y.fixed",
    }


def test_results_that_nothing_tells_apart_are_refused():
    with pytest.raises(InputError, match="same file"):
        plan_outputs(["a/x.stl", "b/x.stl"], ["a/x.stl", "b/x.stl"], "out")


def test_fix_out_without_a_fix_is_a_mistake(folder, capsys):
    write_mesh(shapes.box(), "box.ply")
    assert main(["box.ply", "--fix-out", "out"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_folder_that_cannot_be_written_to_is_a_warning(folder, capsys):
    write_mesh(shapes.inverted(shapes.box()), "box.ply")
    (folder / "out").write_text("a file where a folder should be")
    assert main(["box.ply", "--fix", "--fix-out", "out", "--jobs", "1"]) == 1
    assert "cannot be written" in capsys.readouterr().err


def test_obj_with_materials_stays_obj(folder, capsys):
    box = shapes.box()
    lines = ["mtllib paint.mtl", *(f"v {x} {y} {z}" for x, y, z in box.vertices)]
    lines += [f"vt {x + 0.5} {y + 0.5}" for x, y, _ in box.vertices]
    lines += ["usemtl red", *(f"f {a}/{a} {c}/{c} {b}/{b}" for a, b, c in box.faces + 1)]
    (folder / "box.obj").write_text("\n".join(lines))
    (folder / "paint.mtl").write_text("newmtl red\nKd 1 0 0\n")
    status, (mesh,) = run_json(capsys, "box.obj", "--fix", "--fix-out", "out")
    assert (status, mesh["repair"]["output"]) == (0, "out/box.fixed.obj")
    text = (folder / "out" / "box.fixed.obj").read_text()
    assert "mtllib ../paint.mtl" in text and "usemtl red" in text
    assert is_ours(folder / "out" / "box.fixed.obj")
    assert "uv" in load_mesh(folder / "out" / "box.fixed.obj").vertex_attributes


def test_glb_with_materials_stays_glb(folder):
    trimesh = pytest.importorskip("trimesh")
    box = shapes.inverted(shapes.box())
    visual = trimesh.visual.TextureVisuals(
        uv=box.vertices[:, :2] + 0.5, material=trimesh.visual.material.PBRMaterial(name="jade")
    )
    trimesh.Scene([trimesh.Trimesh(box.vertices, box.faces, visual=visual, process=False)]).export("box.glb")
    source = load_mesh(folder / "box.glb")
    assert [body.material for body in source.bodies] == ["jade"]
    path, lost = write_result(Mesh(source.vertices, source.faces[:, ::-1], source.bodies), source, "box.fixed")
    assert (path.suffix, lost, is_ours(path)) == (".glb", [], True)
    back = load_mesh(path)
    assert back.volume == pytest.approx(1)
    assert [body.material for body in back.bodies] == ["jade"]


def test_materials_that_ply_loses_are_listed(folder):
    box = shapes.box()
    source = Mesh(box.vertices, box.faces, (Body("a", 0, 6, "wax"), Body("b", 6, 6, "jade")), path=folder / "box.3mf")
    path, lost = write_result(source, source, str(folder / "box.fixed"))
    assert path.suffix == ".ply"
    assert lost == ["material jade", "material wax", "the names of 2 bodies"]
    assert np.array_equal(load_mesh(path).faces, box.faces)
