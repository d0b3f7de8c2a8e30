"""The report for GitHub Actions: workflow commands that become annotations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..validation.outcome import MeshReport, Outcome, RuleReport, Severity
from .location import path_from_here

_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}


def chunks(reports: Sequence[MeshReport]) -> Iterator[str]:
    """``::error file=PATH,title=CODE name::message`` for each finding; waived ones are notices that say so.

    A file that was not checked and a rule that raised have a command of their own.
    """
    for report in reports:
        yield from (line + "\n" for line in _lines(report))


def render(reports: Sequence[MeshReport]) -> str:
    """All commands, one a line."""
    return "".join(chunks(reports))


def _lines(report: MeshReport) -> Iterator[str]:
    for rule in report.shown:
        yield _finding(report, rule)
    if not report.shown and report.error is not None:
        yield _command("error" if report.exit_status == 2 else "warning", report, "not checked", report.error)
        return
    for rule in report.rules:
        if rule.raised:
            yield _command("error", report, f"{rule.code} {rule.name} (not-run)", rule.reason or "")


def _finding(report: MeshReport, rule: RuleReport) -> str:
    title = f"{rule.code} {rule.name}"
    if rule.outcome == Outcome.WAIVED:
        return _command("notice", report, f"{title} (waived)", f"{rule.message}; waived: {rule.reason}")
    return _command(_COMMANDS[rule.severity], report, title, rule.message)


def _command(kind: str, report: MeshReport, title: str, message: str) -> str:
    place = "" if report.object is None else f"object {report.object}: "
    return f"::{kind} file={_property(path_from_here(report.path))},title={_property(title)}::{_data(place + message)}"


def _data(text: str) -> str:
    """As the runner's own toolkit escapes messages."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    """As the runner's own toolkit escapes the properties before them."""
    return _data(text).replace(":", "%3A").replace(",", "%2C")
