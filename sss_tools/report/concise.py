"""The report for a terminal or an editor: one line a finding."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ..errors import printable
from ..validation.outcome import MeshReport, Outcome, RuleReport


def chunks(reports: Sequence[MeshReport]) -> Iterator[str]:
    """``path:code severity message`` for each finding; a file that was not checked has a line that says so."""
    # a name may contain line breaks; a line must not
    for report in reports:
        yield from (printable(" ".join(line.splitlines())) + "\n" for line in lines(report))


def render(reports: Sequence[MeshReport]) -> str:
    """The whole report."""
    return "".join(chunks(reports))


def lines(report: MeshReport) -> list[str]:
    """The lines of one mesh."""
    place = report.path if report.object is None else f"{report.path}:{report.object}"
    found = [_repair(place, report.repair)] if report.repair is not None else []
    found += [_finding(place, rule) for rule in report.shown]
    if not report.shown and report.error is not None:
        return [f"{place}:not-run {report.error.removeprefix(f'{report.path}: ')}"]
    return found + [f"{place}:{rule.code} {Outcome.NOT_RUN} {rule.reason}" for rule in report.rules if rule.raised]


def _finding(place: str, rule: RuleReport) -> str:
    if rule.outcome == Outcome.WAIVED:
        return f"{place}:{rule.code} {Outcome.WAIVED} {rule.message} (waived: {rule.reason})"
    return f"{place}:{rule.code} {rule.severity} {rule.message}"


def _repair(place: str, repair: dict[str, Any]) -> str:
    """What became of the mesh, on one line."""
    detail = repair["output"] or repair["reason"]
    return f"{place}:repair {repair['status']}" + (f" {detail}" if detail else "")
