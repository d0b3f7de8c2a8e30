import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from cli.sss_check import main
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

GLB_CUT = b"glTF\x02\x00\x00\x00\xff\xff\x00\x00JSON"

BAD_FILES = {
    "missing.ply": None,
    "empty.ply": b"",
    "empty.obj": b"",
    "empty.stl": b"",
    "corrupt.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n\x00\x01",
    "corrupt.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "corrupt.stl": b"\x00" * 80 + b"\xff\xff\x00\x00" + b"\x01" * 60,
    "corrupt.glb": GLB_CUT,
    "text.stl": b"this is no mesh",
    "unknown.xyz": b"0 0 0",
    "nan.obj": b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "points.obj": b"v 0 0 0\nv 1 0 0\n",
}


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """No test sees what another, or the user, has checked before."""
    monkeypatch.setenv("SSS_TOOLS_CACHE", str(tmp_path_factory.mktemp("cache")))


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def listing():
    return sorted(path.name for path in Path().iterdir())


def python(code, *arguments):
    """Run code in a fresh interpreter that finds what this one finds."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)}
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False, env=environment
    )


def write(name, mesh):
    write_mesh(mesh, name)
    return name


def run_json(capsys, *arguments):
    status = main([*arguments, "--format", "json"])
    return status, json.loads(capsys.readouterr().out)


def test_a_sound_mesh_is_status_zero(in_folder, capsys):
    assert main([write("box.ply", shapes.box())]) == 0
    captured = capsys.readouterr()
    assert "8 vertices, 12 faces: no findings" in captured.out and captured.err == ""
    assert listing() == ["box.ply"]


def test_a_finding_at_error_level_is_status_one_and_exit_zero_masks_it(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    assert main([path]) == 1
    assert main([path, "--exit-zero"]) == 0
    assert main([path, "--severity", "SSS204=warning"]) == 0
    assert main([path, "--ignore", "SSS204"]) == 0
    assert main([path, "--select", "sss1,SSS204"]) == 1


def test_information_alone_is_status_zero(in_folder, capsys):
    assert main([write("hollow.ply", shapes.hollow_ball()), "--format", "concise"]) == 0
    assert "hollow.ply:SSS305 info 1 void" in capsys.readouterr().out


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_one_line_and_status_two(in_folder, capfd, name):
    if BAD_FILES[name] is not None:
        (in_folder / name).write_bytes(BAD_FILES[name])
    assert main([name, "--exit-zero"]) == 2
    captured = capfd.readouterr()
    assert captured.err.startswith(f"sss-check: error: {name}: ")
    assert captured.err.count("\n") == 1 and "; " in captured.err
    assert "Traceback" not in captured.out
    if BAD_FILES[name] is not None:
        assert (in_folder / name).read_bytes() == BAD_FILES[name]


def test_a_bad_file_beats_findings_and_the_others_are_still_reported(in_folder, capsys):
    inverted = write("inverted.ply", shapes.inverted(shapes.box()))
    status, data = run_json(capsys, "missing.ply", inverted, write("box.ply", shapes.box()))
    assert status == 2
    assert [mesh["status"] for mesh in data["meshes"]] == ["unreadable", "ok", "ok"]
    failed = [[rule["code"] for rule in mesh["rules"] if rule["outcome"] == "fail"] for mesh in data["meshes"]]
    assert failed == [["SSS702"], ["SSS204"], []]


def test_nan_vertices_are_named_by_their_rule(in_folder, capsys):
    vertices = shapes.box().vertices.copy()
    vertices[2, 0] = np.nan
    status, data = run_json(capsys, write("nan.ply", Mesh(vertices, shapes.box().faces)))
    (rule,) = (rule for rule in data["meshes"][0]["rules"] if rule["outcome"] == "fail")
    assert (status, rule["code"], rule["vertices"]) == (2, "SSS602", [2])


def test_a_folder_is_searched_and_a_list_is_read_from_stdin(in_folder, capsys, monkeypatch):
    import io

    (in_folder / "sub").mkdir()
    write("sub/a.ply", shapes.box())
    write("b.ply", shapes.box())
    status, data = run_json(capsys, ".")
    assert (status, [mesh["path"] for mesh in data["meshes"]]) == (0, ["b.ply", "sub/a.ply"])
    monkeypatch.setattr(sys, "stdin", io.StringIO("b.ply\nsub\n"))
    _, data = run_json(capsys, "-")
    assert [mesh["path"] for mesh in data["meshes"]] == ["b.ply", "sub/a.ply"]


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["box.ply", "--format", "xml"],
        ["box.ply", "--unit", "furlong"],
        ["box.ply", "--material", "unobtainium"],
        ["box.ply", "--select", "SSS9"],
        ["box.ply", "--ignore", "x"],
        ["box.ply", "--severity", "SSS101"],
        ["box.ply", "--severity", "SSS101=fatal"],
        ["box.ply", "--severity", "SSS999=error"],
        ["box.ply", "--jobs", "0"],
        ["box.ply", "--jobs", "many"],
        ["box.ply", "--timeout", "-1"],
        ["box.ply", "--timeout", "nan"],
        ["box.ply", "--waive", "SSS204"],
        ["box.ply", "--reason", "none"],
        ["box.ply", "--waive", "SSS204", "--reason", " "],
        ["box.ply", "--waive", "SSS2", "--reason", "a prefix is no rule"],
        ["box.ply", "--waive", "SSS702", "--reason", "whatever"],
        ["box.ply", "--max-memory", "much"],
        ["box.ply", "--max-memory", "0G"],
        ["box.ply", "--material", "missing.toml"],
        ["box.ply", "--fix", "--unsafe-fixes"],
        ["box.ply", "-q", "-v"],
        ["--explain", "SSS999"],
        ["scene.toml"],
        ["box.ply", "--scene", "missing.toml"],
        ["box.ply", "-o", "no/such/folder/report.json"],
        ["box.ply", "-o", "box.ply"],
        ["box.ply", "-o", "./../" + "."],
    ],
    ids=" ".join,
)
def test_a_bad_option_is_one_line_and_status_two(in_folder, capsys, arguments):
    write("box.ply", shapes.box())
    before = (in_folder / "box.ply").read_bytes()
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("sss-check: error: ") and captured.err.count("\n") == 1
    assert captured.out == ""
    assert (in_folder / "box.ply").read_bytes() == before and listing() == ["box.ply"]


def test_the_report_goes_to_the_file_named(in_folder, capsys):
    path = write("box.ply", shapes.box())
    (in_folder / "report.json").write_text("an older report")
    assert main([path, "--format", "json", "-o", "report.json"]) == 0
    assert capsys.readouterr().out == ""
    assert json.loads((in_folder / "report.json").read_text())["schema"] == "sss-check/1"


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_an_unwritable_report_is_one_line_and_status_two(in_folder, capsys):
    path = write("box.ply", shapes.box())
    (in_folder / "locked").mkdir(mode=0o500)
    assert main([path, "-o", "locked/report.json"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_the_report_goes_to_stdout_by_that_name_too(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    for name in ("-", "/dev/stdout"):
        assert main([path, "--format", "concise", "-o", name]) == 1
        assert "SSS204" in capsys.readouterr().out
    assert listing() == ["box.ply"]


def test_an_empty_list_of_meshes_is_one_line_and_status_two(in_folder, capsys, monkeypatch):
    import io

    monkeypatch.setattr(sys, "stdin", io.StringIO("\n"))
    assert main(["-"]) == 2
    assert "names no mesh" in capsys.readouterr().err


def test_a_name_with_a_line_break_is_reported_on_one_line(in_folder, capsys):
    write("two\nlines.ply", shapes.inverted(shapes.box()))
    assert main(["two\nlines.ply", "--format", "concise"]) == 1
    assert capsys.readouterr().out.count("\n") == 1


def test_a_record_is_written_on_request_alone(in_folder, capsys):
    path = write("box.ply", shapes.box())
    assert main([path, "--no-record"]) == 0
    assert listing() == ["box.ply"]
    assert main([path, "--record", "--material", "marble"]) == 0
    record = json.loads((in_folder / "box.ply.sss.json").read_text())
    assert (record["schema"], record["material"]) == ("sss-record/1", "marble")


def test_a_material_and_a_unit_decide_on_scale(in_folder, capsys):
    path = write("box.ply", shapes.box(0.5))
    for unit, thin, mismatch in (("mm", "fail", "fail"), ("cm", "pass", "pass")):
        _, data = run_json(capsys, path, "--material", "skin1", "--unit", unit)
        outcomes = {rule["code"]: rule["outcome"] for rule in data["meshes"][0]["rules"]}
        # light of the channel that gets least far goes 0.67 mm
        assert (outcomes["SSS501"], outcomes["SSS502"]) == (thin, mismatch)


def test_explain_tells_all_about_a_rule(capsys):
    assert main(["--explain", "sss101"]) == 0
    text = capsys.readouterr().out
    for part in ("SSS101 open-boundary (error)", "Finds: ", "Why:   ", "Fix:   ", "unsafe"):
        assert part in text
    assert main(["--explain", "open-boundary"]) == 0


def test_statistics_follow_the_report(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    main([path, "--format", "concise", "--statistics"])
    assert "       1        1  SSS204 inverted-shell" in capsys.readouterr().out


def test_the_command_is_quick_to_help_and_imports_nothing_heavy():
    code = (
        "import sys; from cli.sss_check import main; status = main(['--help']);"
        "heavy = {'numpy', 'scipy', 'trimesh', 'rich', 'pymeshlab', 'pyvista', 'embreex'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else status)"
    )
    start = time.monotonic()
    done = python(code)
    assert done.returncode == 0, done.stderr
    # a loose bound against a busy machine; what makes it quick is what is not imported
    assert time.monotonic() - start < 2


def test_checking_imports_neither_pymeshlab_nor_pyvista(in_folder):
    path = write("box.ply", shapes.hollow_ball())
    code = (
        "import sys; from sss_tools.validation.run import check_file; check_file(sys.argv[1]);"
        "sys.exit(str({'pymeshlab', 'pyvista', 'vtk', 'igl'} & set(sys.modules) or ''))"
    )
    done = python(code, path)
    assert done.stderr.strip() == "", done.stderr


def test_the_bunny_has_five_holes(shared, capsys):
    for name in ("bunny_stanford.obj", "bunny_bun_zipper_with_holes.ply"):
        status, data = run_json(capsys, str(shared / "meshes" / name))
        (mesh,) = data["meshes"]
        counts = {rule["code"]: rule["count"] for rule in mesh["rules"] if rule["severity"] == "error"}
        assert (status, counts["SSS101"], mesh["closedness"]["hole_handling"]) == (1, 5, "cap")


def test_spot_has_no_hole_although_its_texture_has_seams(shared, capsys):
    status, data = run_json(capsys, str(shared / "meshes" / "spot.obj"))
    assert status == 0 and data["meshes"][0]["vertices"] > 2930
    assert data["meshes"][0]["closedness"]["hole_handling"] == "strict"


def test_corrupt_real_files_are_refused(shared, capsys):
    import csv

    folder = shared / "meshes"
    with (folder / "MANIFEST.csv").open() as file:
        names = [row["file"] for row in csv.DictReader(file) if row["class"] == "corrupt"]
    status, data = run_json(capsys, *(str(folder / name) for name in names))
    assert status == 2 and len(names) > 10
    for mesh in data["meshes"]:
        codes = {rule["code"] for rule in mesh["rules"] if rule["outcome"] == "fail"}
        assert codes & {"SSS602", "SSS701", "SSS702"}, mesh["path"]


def test_sarif_and_github_reports_are_written(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    assert main([path, "--format", "sarif"]) == 1
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert [result["ruleId"] for result in run["results"]] == ["SSS204"]
    assert main([path, "--format", "github", "--statistics"]) == 1
    text = capsys.readouterr().out
    assert text.startswith("::error file=box.ply,title=SSS204 inverted-shell::") and "       1        1" in text


def test_lines_of_json_come_as_meshes_are_checked(in_folder, capsys):
    write("a.ply", shapes.box())
    write("b.ply", shapes.inverted(shapes.box()))
    (in_folder / "c.ply").write_text("ply")
    assert main([".", "--format", "jsonl", "-o", "lines.jsonl", "--jobs", "1"]) == 2
    assert capsys.readouterr().out == ""
    assert main([".", "--format", "json", "-o", "whole.json"]) == 2
    lines = {one["path"]: one for one in map(json.loads, (in_folder / "lines.jsonl").read_text().splitlines())}
    whole = {one["path"]: one for one in json.loads((in_folder / "whole.json").read_text())["meshes"]}
    assert lines.keys() == whole.keys()
    for path, one in lines.items():
        assert one["rules"] == whole[path]["rules"] and one["closedness"] == whole[path]["closedness"]


def test_lines_have_no_place_for_statistics_and_no_room_on_a_full_disk(in_folder, capsys):
    write("a.ply", shapes.box())
    assert main(["a.ply", "--format", "jsonl", "--statistics"]) == 2
    assert "--statistics" in capsys.readouterr().err
    if Path("/dev/full").exists():
        assert main(["a.ply", "--format", "jsonl", "-o", "/dev/full"]) == 2
        said = capsys.readouterr().err
        assert said.startswith("sss-check: error: /dev/full: cannot be written") and said.count("\n") == 1


def test_a_run_that_is_killed_leaves_whole_lines_and_the_next_one_goes_on(in_folder, capsys):
    for number in range(12):
        write(f"{number}.ply", shapes.icosphere(1.0 + number, 2))
    running = subprocess.Popen(
        [sys.executable, "-m", "cli.sss_check", ".", "--format", "jsonl", "-o", "lines.jsonl", "-q", "--jobs", "1"],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    lines = in_folder / "lines.jsonl"
    while not lines.exists() or lines.read_bytes().count(b"\n") < 3:
        assert running.poll() is None
        time.sleep(0.005)
    running.kill()
    running.wait()
    done = [json.loads(line)["path"] for line in lines.read_text().splitlines(keepends=True) if line.endswith("\n")]
    assert main([".", "--format", "jsonl", "-o", "lines.jsonl", "-q"]) == 0
    again = {one["path"]: one["cached"] for one in map(json.loads, lines.read_text().splitlines())}
    assert len(again) == 12 and all(again[path] for path in done)


def test_statistics_are_part_of_a_report_for_programs(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    _, data = run_json(capsys, path, "--statistics")
    assert [row["code"] for row in data["statistics"]] == ["SSS204"]
    main([path, "--statistics", "--format", "sarif"])
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert [row["code"] for row in run["properties"]["statistics"]] == ["SSS204"]


def test_a_configuration_file_counts_and_the_command_line_wins(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    (in_folder / "sss.toml").write_text('ignore = ["SSS204"]\nmaterial = "marble"\nunit = "cm"\n')
    assert main([path]) == 0
    assert main([path, "--isolated"]) == 1
    assert main([path, "--ignore", "SSS101"]) == 1
    (in_folder / "sss.toml").write_text('severity = { SSS204 = "info", SSS101 = "info" }\njobs = 1\n')
    assert main([path]) == 0
    assert main([path, "--severity", "SSS204=error"]) == 1
    (in_folder / "sss.toml").write_text('per-path-ignores = { "*.ply" = ["SSS2"] }\n')
    assert main([path, "--ignore", "SSS101"]) == 0
    (in_folder / "sss.toml").write_text('select = ["SSS1"]\n')
    assert main([path]) == 0
    assert main([path, "--select", "SSS2"]) == 1


def test_each_mesh_has_the_configuration_nearest_to_it(in_folder, capsys):
    for name in ("a", "b"):
        (in_folder / name).mkdir()
        write(f"{name}/box.ply", shapes.inverted(shapes.box()))
    (in_folder / "b" / "pyproject.toml").write_text('[tool.sss-check]\nseverity = { SSS204 = "info" }\n')
    _, data = run_json(capsys, ".")
    severities = [rule["severity"] for mesh in data["meshes"] for rule in mesh["rules"] if rule["code"] == "SSS204"]
    assert severities == ["error", "info"]


@pytest.mark.parametrize(
    "text",
    ["selct = []", 'unit = "furlong"', 'material = "marbel"', "jobs = 0", "= 1", 'material = "missing.toml"'],
)
def test_a_bad_configuration_is_one_line_and_status_two(in_folder, capsys, text):
    write("box.ply", shapes.box())
    (in_folder / "sss.toml").write_text(text)
    assert main(["box.ply"]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("sss-check: error: ") and captured.err.count("\n") == 1
    assert "sss.toml" in captured.err and captured.out == ""


def test_a_scheduler_that_is_not_there_is_one_line_and_status_two(in_folder, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("sss_tools.scheduler.CONNECT", 0.5)
    assert main([write("box.ply", shapes.box()), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("sss-check: error: --scheduler tcp://127.0.0.1:9: ")
    assert captured.err.count("\n") == 1


def test_without_distributed_the_scheduler_option_says_what_to_install(in_folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main([write("box.ply", shapes.box()), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    captured = capsys.readouterr()
    assert "pip install 'sss-tools[cluster]'" in captured.err and captured.err.count("\n") == 1


def test_a_finding_is_waived_with_a_reason_and_stays_so_in_the_record(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    assert main([path, "--waive", "inverted-shell", "--reason", "by design"]) == 0
    assert main([path]) == 1, "without a record it holds for one run"
    assert listing() == ["box.ply"]
    assert main([path, "--waive", "SSS204", "--reason", "by design", "--record"]) == 0
    capsys.readouterr()
    status, data = run_json(capsys, path)
    (rule,) = (rule for rule in data["meshes"][0]["rules"] if rule["code"] == "SSS204")
    assert (status, rule["outcome"], rule["reason"]) == (0, "waived", "by design")
    record = json.loads((in_folder / "box.ply.sss.json").read_text())
    assert record["waivers"] == [{"code": "SSS204", "reason": "by design"}]
    # writing the record again keeps them
    assert main([path, "--record"]) == 0
    assert json.loads((in_folder / "box.ply.sss.json").read_text())["waivers"] == record["waivers"]


def test_a_waiver_is_never_applied_to_other_geometry(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    main([path, "--waive", "SSS204", "--reason", "by design", "--record"])
    write("box.ply", shapes.inverted(shapes.box(2.0)))
    capsys.readouterr()
    assert main([path]) == 1
    assert "waivers of SSS204 belong to other geometry and are not applied" in capsys.readouterr().err
    assert main([path, "--record"]) == 1
    assert "are dropped" in capsys.readouterr().err
    assert main([path]) == 1
    assert capsys.readouterr().err == ""


def test_waiving_what_was_not_found_is_a_warning_and_not_recorded(in_folder, capsys):
    path = write("box.ply", shapes.box())
    assert main([path, "--waive", "SSS204", "--reason", "by design", "--record"]) == 0
    assert "nothing to waive: SSS204" in capsys.readouterr().err
    assert json.loads((in_folder / "box.ply.sss.json").read_text())["waivers"] == []


def test_what_was_checked_before_is_not_checked_again(in_folder, capsys):
    path = write("box.ply", shapes.inverted(shapes.box()))
    first, second, third = (run_json(capsys, path, *options)[1]["meshes"][0] for options in ((), (), ("--no-cache",)))
    assert [mesh["cached"] for mesh in (first, second, third)] == [False, True, False]
    varying = {"seconds", "cached"}
    for other in (second, third):
        assert {key: other[key] for key in other.keys() - varying} == {
            key: first[key] for key in first.keys() - varying
        }
