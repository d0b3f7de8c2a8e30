"""Damaged files, a few hundred of them; benchmarks/fuzz.py runs as many as one likes."""

import sys
from collections import Counter
from pathlib import Path

import pytest

from sss_tools.loading import SUFFIXES
from sss_tools.validation.outcome import Outcome, RuleReport, Severity
from sss_tools.validation.run import check_file, report_not_checked
from sss_tools.validation.settings import Settings

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
COUNT = 330
SEED = 20261122


@pytest.fixture
def fuzz(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import fuzz

    yield fuzz
    for name in ("fuzz", "fuzz_inputs", "fuzz_scenes", "hostile", "hostile_inputs", "hostile_scenes"):
        sys.modules.pop(name, None)


def test_no_damaged_file_makes_the_check_crash_hang_raise_or_print(fuzz, tmp_path, capfd):
    results = fuzz.check_inputs(tmp_path, SEED, range(COUNT), jobs=2)
    faults = [(path.name, report.error) for _, path, report in results if fuzz.outcome(report) in fuzz.FAULTS]
    assert faults == []
    assert capfd.readouterr() == ("", "")
    # damage that nothing survives, or that nothing is hurt by, would test nothing
    outcomes = Counter(fuzz.outcome(report) for _, _, report in results)
    assert outcomes["usable"] > COUNT / 10 and outcomes["refused"] > COUNT / 4


def test_every_format_is_there_and_valid_before_it_is_damaged(fuzz, tmp_path):
    from fuzz_inputs import valid_files

    assert {suffix for suffix, _ in valid_files().values()} == set(SUFFIXES)
    for kind, (suffix, data) in valid_files().items():
        path = tmp_path / f"{kind}{suffix}"
        path.write_bytes(data)
        report = check_file(path)
        # hollow balls, and a cube of quads
        expected = [] if kind == "obj-polygons" else ["SSS305"]
        assert report.status == "ok" and [finding.code for finding in report.findings] == expected, kind


def test_an_input_is_the_same_whenever_it_is_made(fuzz):
    from fuzz_inputs import damaged

    assert [damaged(1, number) for number in range(40)] == [damaged(1, number) for number in range(40)]
    assert damaged(1, 3) != damaged(2, 3)


def test_the_outcome_of_an_input_can_be_a_fault(fuzz):
    def ended(reason, raised=False):
        return fuzz.outcome(report_not_checked("a.ply", reason, Settings(), raised))

    assert ended("the check was ended by SIGSEGV (signal 11)") == "crash"
    assert ended("the check took longer than 20 s") == "hang"
    assert ended("the check failed (KeyError: 1)", raised=True) == "raised"
    assert ended("out of memory: it needs more than 2 GiB") == "out of memory"
    report = report_not_checked("a.ply", "x", Settings())
    report.rules = [RuleReport("SSS101", "open-boundary", Severity.ERROR, Outcome.NOT_RUN, raised=True)]
    assert fuzz.outcome(report) == "raised"


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_no_damaged_scene_sky_or_part_makes_the_renderer_crash_hang_or_raise(fuzz, capfd):
    import fuzz_scenes

    found, memory = fuzz_scenes.outcomes(SEED, range(210))
    assert [entry for entry in enumerate(found) if entry[1][1] in fuzz.FAULTS] == []
    assert capfd.readouterr() == ("", "")
    outcomes = Counter(outcome for _, outcome in found)
    assert outcomes["usable"] > 10 and outcomes["refused"] > 50 and memory < fuzz_scenes.MEMORY
    assert {kind for kind, _ in found} == set(fuzz_scenes.valid())
