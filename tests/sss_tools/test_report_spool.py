import tracemalloc

import pytest

from sss_tools.report import json_report
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


def test_reports_may_come_in_while_others_are_read():
    spool = ReportSpool(3)
    spool.put(0, MeshReport("0.ply", warnings=["w" * 1000]))
    spool.put(1, MeshReport("1.ply"))
    assert spool[0].path == "0.ply"
    spool.put(2, MeshReport("2.ply"))
    assert [report.path for report in spool] == ["0.ply", "1.ply", "2.ply"]


def test_a_report_that_was_not_put_is_not_made_up():
    with pytest.raises(IndexError):
        _ = ReportSpool(1)[0]


def test_a_report_on_many_meshes_is_never_in_memory_as_a_whole():
    count, size = 200, 100_000
    spool = ReportSpool(count)
    tracemalloc.start()
    try:
        for number in range(count):
            spool.put(number, MeshReport(f"{number}.ply", warnings=["w" * size]))
        written = sum(len(chunk) for chunk in json_report.chunks(spool, "1", 1.0))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # one report is copied a few times on its way into text; all of them would be 20 MB
    assert written > count * size and peak < 20 * size
