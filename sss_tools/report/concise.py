"""The report for a terminal or an editor: one line a finding."""

from __future__ import annotations

from collections.abc import Sequence

from ..validation.outcome import MeshReport, Outcome


def render(reports: Sequence[MeshReport]) -> str:
    """``path:code severity message`` for each finding; a file that was not checked has a line that says so."""
    # a name may contain line breaks; a line must not
    return "".join(" ".join(line.splitlines()) + "\n" for report in reports for line in lines(report))


def lines(report: MeshReport) -> list[str]:
    """The lines of one mesh."""
    found = [_repair(report)] if report.repair is not None else []
    found += [f"{report.path}:{rule.code} {rule.severity} {rule.message}" for rule in report.findings]
    if not report.findings and report.error is not None:
        return [f"{report.path}:not-run {report.error.removeprefix(f'{report.path}: ')}"]
    return found + [
        f"{report.path}:{rule.code} {Outcome.NOT_RUN} {rule.reason}" for rule in report.rules if rule.raised
    ]


def _repair(report: MeshReport) -> str:
    """What became of the mesh, on one line."""
    repair = report.repair or {}
    detail = repair["output"] or repair["reason"]
    return f"{report.path}:repair {repair['status']}" + (f" {detail}" if detail else "")
