import json

import jsonschema
import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.report import concise, full, github, json_report, sarif, statistics_table
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.run import check_file, check_mesh, report_not_checked
from sss_tools.validation.settings import Settings


def obj(required, **extra):
    return {"type": "object", "required": list(required), "properties": {**required, **extra}}


NUMBER, TEXT, COUNT, FLAG = (
    {"type": "number"},
    {"type": "string"},
    {"type": "integer", "minimum": 0},
    {"type": "boolean"},
)
NULL = {"type": "null"}
POINT = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
BOX = {"type": "array", "items": POINT, "minItems": 2, "maxItems": 2}
INDICES = {"type": "array", "items": COUNT}
PAIRS = {"type": "array", "items": {**INDICES, "minItems": 2, "maxItems": 2}}


def maybe(schema):
    return {"anyOf": [schema, NULL]}


CLOSEDNESS = obj(
    {
        "state": {"enum": ["closed", "holes", "open"]},
        **dict.fromkeys(("watertight", "manifold", "oriented", "internal_geometry"), FLAG),
        "self_intersecting": maybe(FLAG),
        "boundary_loops": COUNT,
        "holes": {
            "type": "array",
            "items": obj({"edges": COUNT, "perimeter": NUMBER, "area": NUMBER, "diameter": NUMBER, "centroid": POINT}),
        },
        "hole_area_fraction": NUMBER,
        "hole_handling": {"enum": ["strict", "cap", "terminate", "surface"]},
    }
)
RULE = obj(
    {
        "code": {"type": "string", "pattern": "^SSS[1-7]0[1-9]$"},
        "name": TEXT,
        "severity": {"enum": ["error", "warning", "info"]},
        "outcome": {"enum": ["pass", "fail", "waived", "not-run"]},
        "reason": maybe(TEXT),
        "count": COUNT,
        "message": TEXT,
        "faces": INDICES,
        "edges": PAIRS,
        "vertices": INDICES,
        "face_pairs": PAIRS,
        "truncated": FLAG,
        "centroid": maybe(POINT),
        "bbox": maybe(BOX),
        "fix": {"enum": ["safe", "unsafe", "none"]},
    }
)
MESH = obj(
    {
        "path": TEXT,
        "status": {"enum": ["ok", "unreadable"]},
        "error": maybe(TEXT),
        "vertices": maybe(COUNT),
        "faces": maybe(COUNT),
        "bbox": maybe(BOX),
        "area": maybe(NUMBER),
        "volume": maybe(NUMBER),
        "closedness": maybe(CLOSEDNESS),
        "components": {
            "type": "array",
            "items": obj(
                {
                    "faces": COUNT,
                    "role": {"enum": ["solid", "cavity", "internal", "sheet"]},
                    "closed": FLAG,
                    "volume": maybe(NUMBER),
                }
            ),
        },
        "rules": {"type": "array", "items": RULE},
        "seconds": NUMBER,
    }
)
RUN = obj(
    {
        "schema": {"const": "sss-check/1"},
        "version": TEXT,
        "seconds": NUMBER,
        "meshes": {"type": "array", "items": MESH},
    }
)


def broken_box():
    box = shapes.box()
    vertices = box.vertices.copy()
    vertices[0] = np.nan
    return Mesh(vertices, box.faces)


def many_reports(tmp_path):
    (tmp_path / "cut.ply").write_text("ply\n")
    return [
        check_mesh(shapes.box(), path="box.ply"),
        check_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3), path="hole.ply"),
        check_mesh(shapes.joined(shapes.hollow_ball(), shapes.hollow_ball()), path="twice.ply"),
        check_mesh(broken_box(), path="nan.ply"),
        check_mesh(Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), path="empty.ply"),
        check_file(tmp_path / "cut.ply"),
        report_not_checked("crash.ply", "the check was ended by SIGSEGV (signal 11)", Settings()),
    ]


def strict_parse(text):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


def test_json_has_the_promised_shape_for_every_kind_of_mesh(tmp_path):
    data = strict_parse(json_report.render(many_reports(tmp_path), "1.2.3", 4.5))
    jsonschema.validate(data, RUN)
    assert (data["version"], data["seconds"], len(data["meshes"])) == ("1.2.3", 4.5, 7)
    assert all(len(mesh["rules"]) == 23 for mesh in data["meshes"])
    assert "repair" not in data["meshes"][0]
    # nothing of the program's own gets out
    assert set(data["meshes"][0]["rules"][0]) == set(RULE["required"])
    assert set(data["meshes"][0]) == {*MESH["required"], "warnings", "hash", "object", "cached"}


def test_the_schema_of_this_test_can_fail(tmp_path):
    data = strict_parse(json_report.render(many_reports(tmp_path)[:1], "1", 1))
    data["meshes"][0]["rules"][0]["outcome"] = "ok"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, RUN)


def test_json_of_a_hollow_ball_is_a_solid_and_a_cavity():
    mesh = json_report.mesh_object(check_mesh(shapes.hollow_ball()))
    assert [part["role"] for part in mesh["components"]] == ["solid", "cavity"]
    assert (mesh["closedness"]["state"], mesh["closedness"]["hole_handling"]) == ("closed", "strict")
    assert mesh["closedness"]["self_intersecting"] is False


def test_concise_has_one_line_a_finding(tmp_path):
    lines = concise.render(many_reports(tmp_path)).splitlines()
    assert not any(line.startswith("box.ply") for line in lines)
    (hole,) = (line for line in lines if line.startswith("hole.ply"))
    assert hole.startswith("hole.ply:SSS101 error 1 hole, ")
    assert "crash.ply:not-run not checked: the check was ended by SIGSEGV (signal 11)" in lines


def test_full_says_where_why_and_what_helps():
    text = full.render([check_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3), path="a.ply")])
    for part in ("a.ply: ", "error   SSS101 open-boundary: 1 hole", "where: (", "why:   A path", "fix:   "):
        assert part in text
    assert "not run (no scene): SSS304 SSS503" in text
    assert "passed" not in text


def test_full_never_calls_a_check_that_did_not_run_passed():
    report = report_not_checked("crash.ply", "the check took longer than 3 s", Settings())
    text = full.render([report], verbose=True)
    assert "crash.ply: not checked" in text and "passed: nothing" in text
    assert "not run (the check took longer than 3 s): all" in text


def test_statistics_count_meshes_and_findings():
    inverted = check_mesh(shapes.inverted(shapes.box()))
    both = check_mesh(
        shapes.joined(shapes.inverted(shapes.box()), shapes.moved(shapes.inverted(shapes.box()), [3, 0, 0]))
    )
    assert "       2        3  SSS204 inverted-shell" in statistics_table.render([inverted, both])
    data = strict_parse(json_report.render([inverted, both], "1", 1, statistics=True))
    assert data["statistics"] == [{"code": "SSS204", "name": "inverted-shell", "meshes": 2, "count": 3}]
    assert len(data["meshes"]) == 2


def test_json_of_no_mesh_is_json():
    assert strict_parse(json_report.render([], "1", 0))["meshes"] == []


def waived(report, reason="by design"):
    for rule in report.findings:
        rule.outcome, rule.reason = Outcome.WAIVED, reason
    return report


def test_what_is_waived_shows_in_every_format_and_counts_nowhere():
    report = waived(check_mesh(shapes.inverted(shapes.box()), path="a.ply"))
    assert report.exit_status == 0 and report.findings == []
    text = full.render([report])
    assert "no findings, 1 waived" in text
    assert "waived  SSS204 inverted-shell: 1 solid" in text and "waived: by design" in text
    assert concise.render([report]).startswith("a.ply:SSS204 waived 1 solid")
    assert "(waived: by design)" in concise.render([report])
    (rule,) = (rule for rule in json_report.mesh_object(report)["rules"] if rule["outcome"] == "waived")
    assert (rule["code"], rule["reason"], rule["count"]) == ("SSS204", "by design", 1)
    assert github.render([report]).startswith("::notice file=a.ply,title=SSS204 inverted-shell (waived)::1 solid")
    (result,) = json.loads(sarif.render([report], "1"))["runs"][0]["results"]
    assert result["suppressions"] == [{"kind": "external", "status": "accepted", "justification": "by design"}]
    assert "SSS204" not in statistics_table.render([report])


def test_the_object_of_a_scene_is_named_in_every_format():
    report = check_mesh(shapes.inverted(shapes.box()), path="a.ply")
    report.object = "lamp"
    assert full.render([report]).startswith("a.ply (lamp): ")
    assert concise.render([report]).startswith("a.ply:lamp:SSS204 error ")
    assert "::object lamp: 1 solid" in github.render([report])
    (result,) = json.loads(sarif.render([report], "1"))["runs"][0]["results"]
    assert result["locations"][0]["logicalLocations"] == [{"name": "lamp", "kind": "object"}]


def test_github_has_a_command_a_finding_that_the_runner_can_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = github.render(many_reports(tmp_path)).splitlines()
    assert not any("file=box.ply" in line for line in lines)
    (hole,) = (line for line in lines if "file=hole.ply" in line)
    assert hole.startswith("::error file=hole.ply,title=SSS101 open-boundary::1 hole, ")
    # a percent sign begins an escape
    assert "%25 of the diagonal" in hole
    (crash,) = (line for line in lines if "crash.ply" in line)
    assert crash.startswith("::warning file=crash.ply,title=not checked::")
    assert any(line.startswith("::error file=cut.ply,title=SSS702 unreadable::") for line in lines)


def test_github_escapes_what_would_end_a_property():
    report = check_mesh(shapes.inverted(shapes.box()), path="a,b:c\n%.ply")
    (line,) = github.render([report]).splitlines()
    assert line.startswith("::error file=a%2Cb%3Ac%0A%25.ply,title=SSS204 inverted-shell::")
