"""The report for notebooks: one table of HTML."""

from __future__ import annotations

from html import escape

from ..validation.outcome import MeshReport, Outcome, RuleReport


def render(report: MeshReport) -> str:
    """The verdict, each finding with why it matters, and what did not run."""
    facts = [f"{report.faces:,} faces"] if report.faces is not None else []
    if report.closedness is not None:
        facts += [f"closedness: {report.closedness['state']}", f"hole handling: {report.closedness['hole_handling']}"]
    if report.error is not None:
        facts.append(report.error)
    rows = "".join(map(_row, report.shown)) or "<tr><td>nothing found</td></tr>"
    missing = "".join(
        f"<p><small>not run ({escape(reason)}): {' '.join(rule.code for rule in rules)}</small></p>"
        for reason, rules in report.not_run.items()
    )
    return f"<p><b>{escape(report.path)}</b> {escape('; '.join(facts))}</p><table>{rows}</table>{missing}"


def _row(rule: RuleReport) -> str:
    level = f"waived: {rule.reason}" if rule.outcome == Outcome.WAIVED else str(rule.severity)
    cells = (f"{rule.code} {rule.name}", level, rule.message, rule.why)
    return "<tr>" + "".join(f'<td style="text-align: left">{escape(cell)}</td>' for cell in cells) + "</tr>"
