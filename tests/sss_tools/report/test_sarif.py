"""SARIF 2.1.0.

No package that the tests depend on ships the official schema. ``LOG`` below says by hand, after the specification
(OASIS, errata 01, sections 3.13 to 3.58), what the parts we write must be, and forbids all others. Where
SARIF_SCHEMA names a copy of the official schema file, the logs are held against that, too.
"""

import json
import os
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.report import sarif
from sss_tools.report.location import uri
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.rule import all_rules
from sss_tools.validation.run import check_file, check_mesh, report_not_checked
from sss_tools.validation.settings import Settings

TEXT = {"type": "string", "minLength": 1}
ANY = {"type": "object"}


def exactly(required, **optional):
    return {
        "type": "object",
        "required": list(required),
        "properties": {**required, **optional},
        "additionalProperties": False,
    }


def listed(items):
    return {"type": "array", "items": items}


LEVEL = {"enum": ["none", "note", "warning", "error"]}
MESSAGE = exactly({"text": TEXT}, markdown=TEXT)
URI = {"type": "string", "pattern": r"^(file:///)?[A-Za-z0-9\-._~%!$&'()*+,;=@/]+$"}
LOCATION = exactly(
    {"physicalLocation": exactly({"artifactLocation": exactly({"uri": URI})})},
    logicalLocations=listed(exactly({"name": TEXT, "kind": TEXT})),
)
RULE = exactly(
    {
        **dict.fromkeys(("id", "name"), TEXT),
        **dict.fromkeys(("shortDescription", "fullDescription", "help"), MESSAGE),
        "defaultConfiguration": exactly({"level": LEVEL}),
    },
    properties=ANY,
)
RESULT = exactly(
    {
        "ruleId": TEXT,
        "ruleIndex": {"type": "integer", "minimum": 0},
        "level": LEVEL,
        "message": MESSAGE,
        "locations": {**listed(LOCATION), "minItems": 1, "maxItems": 1},
        "properties": ANY,
    },
    partialFingerprints={"type": "object", "additionalProperties": TEXT},
    suppressions=listed(
        exactly(
            {"kind": {"enum": ["inSource", "external"]}},
            status={"enum": ["accepted", "underReview", "rejected"]},
            justification=TEXT,
        )
    ),
)
INVOCATION = exactly(
    {
        "executionSuccessful": {"type": "boolean"},
        "toolExecutionNotifications": listed(
            exactly({"level": LEVEL, "message": MESSAGE, "locations": listed(LOCATION)}, properties=ANY)
        ),
    }
)
RUN = exactly(
    {
        "tool": exactly({"driver": exactly({"name": TEXT, "version": TEXT, "rules": listed(RULE)})}),
        "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
        "results": listed(RESULT),
        "invocations": listed(INVOCATION),
    },
    properties=ANY,
)
LOG = exactly({"version": {"const": "2.1.0"}, "$schema": TEXT, "runs": {**listed(RUN), "minItems": 1}})


def many_reports(folder):
    (folder / "cut.ply").write_text("ply\n")
    nan = shapes.box().vertices.copy()
    nan[0] = np.nan
    accepted = check_mesh(shapes.inverted(shapes.box()), path="accepted.ply")
    accepted.findings[0].reason, accepted.findings[0].outcome = "by design", Outcome.WAIVED
    placed = check_mesh(shapes.inverted(shapes.box()), path="placed in a scene, 50 %.ply")
    placed.object, placed.hash = "lamp", "blake2b:00"
    return [
        check_mesh(shapes.box(), path="box.ply"),
        check_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3), path="hole.ply"),
        check_mesh(Mesh(nan, shapes.box().faces), path="nan.ply"),
        check_file(folder / "cut.ply"),
        report_not_checked("crash.ply", "the check was ended by SIGSEGV (signal 11)", Settings()),
        report_not_checked("raised.ply", "the check failed (KeyError: 'x')", Settings(), raised=True),
        accepted,
        placed,
    ]


@pytest.fixture
def reports(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return many_reports(tmp_path)


def test_a_log_is_what_the_specification_says(reports):
    for log in (sarif.render(reports, "1.2.3", statistics=True), sarif.render([], "1")):
        jsonschema.validate(json.loads(log), LOG)


def test_a_log_is_valid_by_the_official_schema_where_that_is_at_hand(reports):
    if not os.environ.get("SARIF_SCHEMA"):
        pytest.skip("SARIF_SCHEMA does not name a copy of the official schema")
    schema = json.loads(Path(os.environ["SARIF_SCHEMA"]).read_text())
    for log in (sarif.render(reports, "1.2.3", statistics=True), sarif.render([], "1")):
        jsonschema.validate(json.loads(log), schema)


def test_the_schema_of_this_test_can_fail(reports):
    log = json.loads(sarif.render(reports, "1"))
    log["runs"][0]["results"][0]["level"] = "info"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(log, LOG)


def test_results_name_their_rule_file_and_place(reports):
    (run,) = json.loads(sarif.render(reports, "1"))["runs"]
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == [rule.code for rule in all_rules()]
    assert all(rule.why in text["help"]["text"] for rule, text in zip(all_rules(), rules, strict=True))
    found = [(result["ruleId"], result["level"]) for result in run["results"]]
    assert found == [("SSS101", "error"), ("SSS602", "error"), ("SSS702", "error"), *[("SSS204", "error")] * 2]
    assert all(rules[result["ruleIndex"]]["id"] == result["ruleId"] for result in run["results"])
    hole = run["results"][0]
    assert hole["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "hole.ply"
    assert len(hole["properties"]["edges"]) > 3 and len(hole["properties"]["bbox"]) == 2
    assert run["results"][-1]["partialFingerprints"] == {"geometry/v1": "blake2b:00:SSS204"}


def test_what_did_not_run_is_told_and_is_no_result(reports):
    (run,) = json.loads(sarif.render(reports, "1"))["runs"]
    (invocation,) = run["invocations"]
    assert invocation["executionSuccessful"] is False
    notices = [
        (note["locations"][0]["physicalLocation"]["artifactLocation"]["uri"], note["level"], note["message"]["text"])
        for note in invocation["toolExecutionNotifications"]
    ]
    assert ("box.ply", "note", "not run: no scene") in notices
    assert any(uri == "crash.ply" and level == "warning" and "SIGSEGV" in text for uri, level, text in notices)
    assert any(uri == "raised.ply" and level == "error" and "KeyError" in text for uri, level, text in notices)
    sound = json.loads(sarif.render(reports[:2], "1"))["runs"][0]["invocations"][0]
    assert sound["executionSuccessful"] is True


def test_files_below_the_working_directory_are_relative_and_others_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert uri("sub/a b.ply") == uri(str(tmp_path / "sub" / "a b.ply")) == "sub/a%20b.ply"
    assert uri("a:b\udcff.ply") == "a%3Ab%FF.ply"
    assert uri("../x.ply").startswith("file:///")
