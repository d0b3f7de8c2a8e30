import dataclasses
import json

import numpy as np
import pytest

from sss_tools import findings_cache, shapes
from sss_tools.cache import FOLDER_VARIABLE
from sss_tools.medium import Medium
from sss_tools.record import geometry_hash
from sss_tools.validation import run
from sss_tools.validation.outcome import Outcome, Severity
from sss_tools.validation.rule import Context
from sss_tools.validation.run import check_file
from sss_tools.validation.settings import Settings
from sss_tools.writing import write_mesh

CACHED = Settings(cache=True)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "cache"))
    write_mesh(shapes.inverted(shapes.box()), tmp_path / "box.ply")
    return tmp_path


@pytest.fixture
def checks(monkeypatch):
    """The paths that were really checked."""
    seen = []
    original = run.check_mesh

    def counted(mesh, context, settings, path):
        seen.append(str(path))
        return original(mesh, context, settings, path)

    monkeypatch.setattr(run, "check_mesh", counted)
    return seen


def entries(folder):
    return [path for path in (folder / "cache").rglob("*") if path.is_file()]


def test_the_second_report_is_the_first(folder, checks):
    first, second = (check_file(folder / "box.ply", CACHED) for _ in range(2))
    assert len(checks) == 1 and second.cached
    first.seconds, second.seconds, second.cached = 0.0, 0.0, False
    assert json.dumps(dataclasses.asdict(second)) == json.dumps(dataclasses.asdict(first))
    # not only strings that compare equal
    assert all(type(rule.outcome) is Outcome and type(rule.severity) is Severity for rule in second.rules)


def test_the_same_geometry_under_another_name_is_known(folder, checks):
    check_file(folder / "box.ply", CACHED)
    box = shapes.inverted(shapes.box())
    rows = ["OFF", "8 12 0", *("{!r} {!r} {!r}".format(*corner) for corner in box.vertices.tolist())]
    rows += ["3 {} {} {}".format(*face) for face in box.faces]
    (folder / "copy.off").write_text("\n".join(rows) + "\n")
    report = check_file(folder / "copy.off", CACHED)
    assert report.cached and report.path == str(folder / "copy.off")


def test_changed_geometry_under_the_same_name_is_checked(folder, checks):
    check_file(folder / "box.ply", CACHED)
    write_mesh(shapes.box(), folder / "box.ply")
    assert check_file(folder / "box.ply", CACHED).findings == []
    assert len(checks) == 2


@pytest.mark.parametrize(
    "other",
    [
        Settings(cache=True, select=("SSS1",)),
        Settings(cache=True, ignore=("SSS204",)),
        Settings(cache=True, severities={"SSS204": Severity.INFO}),
        Settings(cache=True, material="marble"),
        Settings(cache=True, material="marble", unit="cm"),
        Settings(cache=True, unit="cm"),
        Settings(cache=True, material="mine", medium=Medium.from_coefficients(0.1, 2.0)),
    ],
)
def test_another_configuration_is_another_entry(folder, checks, other):
    check_file(folder / "box.ply", CACHED)
    report = check_file(folder / "box.ply", other)
    assert not report.cached and len(checks) == 2
    assert check_file(folder / "box.ply", other).cached


def test_waivers_apply_to_what_is_known_and_are_not_kept_with_it(folder):
    check_file(folder / "box.ply", CACHED)
    waived = check_file(folder / "box.ply", Settings(cache=True, waive={"SSS204": "by design"}))
    assert waived.cached and [rule.code for rule in waived.waived] == ["SSS204"]
    assert check_file(folder / "box.ply", CACHED).exit_status == 1


def test_other_code_does_not_trust_what_this_one_found(folder, checks, monkeypatch):
    check_file(folder / "box.ply", CACHED)
    monkeypatch.setattr(findings_cache, "_version", lambda: "other")
    assert not check_file(folder / "box.ply", CACHED).cached


@pytest.mark.parametrize("place", ["start", "middle", "end", "all", "length"])
def test_a_corrupt_entry_is_ignored_and_replaced(folder, checks, place):
    check_file(folder / "box.ply", CACHED)
    (entry,) = entries(folder)
    data = bytearray(entry.read_bytes())
    where = {"start": 0, "middle": len(data) // 2, "end": -1}
    if place in where:
        data[where[place]] ^= 1
    entry.write_bytes({"all": b"", "length": data[:-1]}.get(place, data))
    assert not check_file(folder / "box.ply", CACHED).cached
    assert check_file(folder / "box.ply", CACHED).cached


def test_what_may_be_otherwise_next_time_is_not_kept(folder, monkeypatch):
    def raising(report):
        report.rules[3].raised = True

    def lacking(report):
        report.rules[3].outcome, report.rules[3].reason = Outcome.NOT_RUN, "needs the package igl: install it"

    def warned(report):
        report.warnings.append("closedness could not be found out")

    original = run.check_mesh
    for spoil in (raising, lacking, warned):

        def spoilt(mesh, context, settings, path, spoil=spoil):
            report = original(mesh, context, settings, path)
            spoil(report)
            return report

        monkeypatch.setattr(run, "check_mesh", spoilt)
        check_file(folder / "box.ply", CACHED)
        assert entries(folder) == []


def test_the_reason_of_a_missing_package_is_the_one_the_rules_give():
    rule = dataclasses.replace(run.all_rules()[0], check=lambda subject: __import__("no_such_package"))
    result = run._run(rule, run.Subject(shapes.box()), Settings(), None)
    assert result.reason.startswith(findings_cache.MISSING_PACKAGE)


def test_nothing_is_kept_unless_asked_for(folder):
    check_file(folder / "box.ply")
    assert entries(folder) == []


def test_the_cache_keeps_within_its_limit(folder, monkeypatch):
    check_file(folder / "box.ply", CACHED)
    (entry,) = entries(folder)
    monkeypatch.setattr(findings_cache, "LIMIT", 0)
    findings_cache._prune_once.cache_clear()
    check_file(folder / "box.ply", Settings(cache=True, unit="m"))
    assert not entry.exists()


def test_all_that_is_known_besides_the_mesh_is_part_of_the_key():
    box, settings = shapes.box(), Settings()
    digest = geometry_hash(box)
    contexts = [
        Context(),
        Context(unit="mm"),
        Context(Medium.from_coefficients(0.1, 2.0)),
        Context(Medium.from_coefficients(0.1, np.nextafter(2.0, 3))),
    ]
    keys = {findings_cache.key_of(box, digest, context, settings) for context in contexts}
    assert len(keys) == len(contexts)
    with pytest.raises(TypeError):
        findings_cache.key_of(box, digest, object(), settings)
