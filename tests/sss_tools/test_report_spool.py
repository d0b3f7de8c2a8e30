import pytest

from sss_tools.report_spool import ReportSpool
from sss_tools.validation.outcome import MeshReport


def test_reports_come_back_in_order_whatever_the_order_they_came_in():
    spool = ReportSpool(3)
    for number in (2, 0, 1):
        spool.put(number, MeshReport(f"{number}.ply", warnings=["w" * number]))
    for _ in range(2):
        assert [report.path for report in spool] == ["0.ply", "1.ply", "2.ply"]
    assert spool[-1].warnings == ["ww"] and len(spool) == 3
    assert [report.path for report in spool[1:]] == ["1.ply", "2.ply"]


def test_a_report_that_was_not_put_is_not_made_up():
    with pytest.raises(IndexError):
        _ = ReportSpool(1)[0]
