import dataclasses

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.record import record_path
from sss_tools.validation import rule as rule_module
from sss_tools.validation import run as run_module
from sss_tools.validation.outcome import Outcome, Severity
from sss_tools.validation.rule import NotRun, all_rules
from sss_tools.validation.run import check_file, check_mesh
from sss_tools.validation.settings import Settings
from sss_tools.writing import write_mesh


def outcomes(report):
    return {rule.code: rule.outcome for rule in report.rules}


def with_check(monkeypatch, code, check):
    """The rules, with another check for one of them."""
    rules = tuple(dataclasses.replace(r, check=check) if r.code == code else r for r in all_rules())
    monkeypatch.setattr(run_module, "all_rules", lambda: rules)


@pytest.mark.parametrize("fault", [ValueError("odd"), IndexError("5"), ZeroDivisionError(), np.linalg.LinAlgError()])
def test_a_rule_that_raises_is_named_and_the_others_still_run(monkeypatch, fault):
    def broken(subject):
        raise fault

    with_check(monkeypatch, "SSS203", broken)
    report = check_mesh(shapes.inverted(shapes.box()))
    (result,) = (rule for rule in report.rules if rule.code == "SSS203")
    assert result.outcome == Outcome.NOT_RUN and result.raised
    assert type(fault).__name__ in result.reason
    assert outcomes(report)["SSS204"] == Outcome.FAIL
    assert report.exit_status == 2


def test_a_missing_package_is_not_run_and_no_status(monkeypatch):
    def needs_more(subject):
        import a_package_nobody_has  # noqa: F401

    with_check(monkeypatch, "SSS203", needs_more)
    report = check_mesh(shapes.box())
    (result,) = (rule for rule in report.rules if rule.code == "SSS203")
    assert "needs the package a_package_nobody_has" in result.reason
    assert (result.outcome, report.exit_status) == (Outcome.NOT_RUN, 0)


def test_not_run_is_never_pass(monkeypatch):
    def declines(subject):
        raise NotRun("no such thing")

    with_check(monkeypatch, "SSS101", declines)
    assert outcomes(check_mesh(shapes.box()))["SSS101"] == Outcome.NOT_RUN


def test_every_rule_ends_somehow_for_every_mesh():
    codes = [rule.code for rule in all_rules()]
    for mesh in (shapes.box(), Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))):
        assert [rule.code for rule in check_mesh(mesh).rules] == codes


def test_what_is_not_selected_is_not_run():
    report = check_mesh(shapes.inverted(shapes.box()), settings=Settings(select=("SSS1",)))
    assert outcomes(report)["SSS101"] == Outcome.PASS
    assert outcomes(report)["SSS204"] == Outcome.NOT_RUN
    assert report.exit_status == 0


@pytest.mark.parametrize(
    ("select", "ignore", "wanted"),
    [
        ((), (), True),
        (("SSS1",), (), True),
        (("SSS2",), (), False),
        ((), ("SSS1",), False),
        ((), ("SSS2",), True),
        (("SSS101",), ("SSS1",), True),
        (("SSS1",), ("SSS101",), False),
        (("SSS1",), ("SSS1",), False),
    ],
)
def test_the_more_specific_choice_wins(select, ignore, wanted):
    assert Settings(select=select, ignore=ignore).wants("SSS101") == wanted


def test_an_unusable_file_stays_unusable_whatever_is_selected(tmp_path):
    report = check_file(tmp_path / "none.ply", Settings(select=("SSS1",), ignore=("SSS7",)))
    assert (report.status, report.exit_status) == ("unreadable", 2)
    assert [rule.code for rule in report.findings] == ["SSS702"]
    assert "no such file" in report.error


def test_a_severity_the_user_gives_replaces_the_rules_own():
    settings = Settings(severities={"SSS204": Severity.INFO})
    report = check_mesh(shapes.inverted(shapes.box()), settings=settings)
    assert [(rule.code, rule.severity) for rule in report.findings] == [("SSS204", Severity.INFO)]
    assert report.exit_status == 0


def test_a_report_describes_its_mesh():
    report = check_mesh(shapes.box(2.0))
    assert (report.vertices, report.faces, report.status, report.error) == (8, 12, "ok", None)
    assert report.area == pytest.approx(24) and report.volume == pytest.approx(8)
    assert np.ptp(np.array(report.bbox), axis=0).tolist() == [2, 2, 2]
    assert report.closedness["state"] == "closed"
    assert [(part["role"], part["closed"]) for part in report.components] == [("solid", True)]
    assert report.components[0]["volume"] == pytest.approx(8)


def test_an_open_mesh_has_no_volume():
    report = check_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3))
    assert report.volume is None and report.components[0]["volume"] is None


def test_a_record_is_written_only_when_asked_for(tmp_path):
    path = tmp_path / "box.ply"
    write_mesh(shapes.box(), path)
    check_file(path)
    assert not record_path(path).exists()
    check_file(path, Settings(record=True))
    assert record_path(path).exists()


def test_an_unwritable_record_is_a_warning(tmp_path, monkeypatch):
    path = tmp_path / "box.ply"
    write_mesh(shapes.box(), path)

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(run_module, "write_record", refuse)
    report = check_file(path, Settings(record=True))
    assert report.exit_status == 0 and "Permission denied" in report.warnings[0]


def test_a_loader_without_its_package_is_not_run(tmp_path, monkeypatch):
    def refuse(path):
        from sss_tools.errors import InputError

        raise InputError(path, "unreadable", "write it again") from ModuleNotFoundError(name="collada")

    monkeypatch.setattr(run_module, "load_mesh", refuse)
    report = check_file("duck.dae")
    assert set(outcomes(report).values()) == {Outcome.NOT_RUN}
    assert "needs the package collada" in report.error and report.exit_status == 0


def test_two_rules_of_one_code_are_refused(monkeypatch):
    from sss_tools.validation import boundary, orientation

    monkeypatch.setattr(orientation, "COPY", dataclasses.replace(boundary.OPEN_SHEET), raising=False)
    rule_module.all_rules.cache_clear()
    try:
        with pytest.raises(ValueError, match="SSS102"):
            all_rules()
    finally:
        monkeypatch.undo()
        rule_module.all_rules.cache_clear()


@pytest.mark.parametrize("scale", [1e-320, 1e-200, 1e-30, 1e30, 3e38])
def test_no_scale_makes_a_rule_raise_or_warn(scale):
    ball = shapes.icosphere(1.0, 1)
    report = check_mesh(Mesh(ball.vertices * scale, ball.faces))
    assert not any(rule.raised for rule in report.rules)
