import pytest

from sss_tools import shapes
from sss_tools.record import record_path
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.run import check_file
from sss_tools.validation.settings import Settings
from sss_tools.writing import write_mesh


@pytest.fixture
def inverted(tmp_path):
    path = tmp_path / "box.ply"
    write_mesh(shapes.inverted(shapes.box()), path)
    return path


def test_a_waived_finding_keeps_what_was_found(inverted):
    report = check_file(inverted, Settings(waive={"SSS204": "by design"}))
    (rule,) = report.waived
    assert (rule.outcome, rule.reason, rule.count, len(rule.faces)) == (Outcome.WAIVED, "by design", 1, 12)
    assert report.findings == [] and report.exit_status == 0


def test_what_makes_a_file_unusable_cannot_be_waived(tmp_path):
    path = tmp_path / "empty.obj"
    path.write_text("v 0 0 0\n")
    report = check_file(path, Settings(waive={"SSS701": "whatever", "SSS702": "whatever"}))
    assert report.exit_status == 2 and not report.waived


def test_a_record_that_is_none_is_a_warning_of_the_report_alone(inverted):
    record_path(inverted).write_text("{")
    report = check_file(inverted)
    assert [rule.code for rule in report.findings] == ["SSS204"]
    assert len(report.warnings) == 1 and "it is ignored" in report.warnings[0]


def test_a_record_of_other_geometry_is_a_warning_even_without_waivers(inverted):
    check_file(inverted, Settings(record=True))
    assert check_file(inverted).warnings == []
    write_mesh(shapes.inverted(shapes.box(2.0)), inverted)
    assert "belongs to other geometry" in check_file(inverted).warnings[0]
    assert check_file(inverted, Settings(record=True)).warnings == []


def test_a_new_reason_replaces_the_old_one(inverted):
    for reason in ("first", "second"):
        check_file(inverted, Settings(record=True, waive={"SSS204": reason}))
    (rule,) = check_file(inverted).waived
    assert rule.reason == "second"


def test_an_isolated_check_applies_no_waiver_of_a_record_says_so_and_keeps_it(inverted):
    check_file(inverted, Settings(record=True, waive={"SSS204": "planted"}))
    assert check_file(inverted).findings == []
    report = check_file(inverted, Settings(isolated=True, record=True))
    assert [rule.code for rule in report.findings] == ["SSS204"]
    assert any("SSS204 are not applied" in warning for warning in report.warnings)
    assert check_file(inverted).findings == []
