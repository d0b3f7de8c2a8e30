"""The report for people: each finding with its place, what it does to the light, and what helps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..errors import printable
from ..validation.outcome import FixSafety, MeshReport, Outcome, RuleReport, Severity

_STATES = {
    "closed": "closed",
    "holes": "encloses a volume, but has holes",
    "open": "open: encloses nothing, so no light can scatter in it",
}
_HANDLINGS = {
    "strict": "strict: nothing to make up for",
    "cap": "cap: light is kept in at the holes",
    "terminate": "terminate: paths that get lost end there",
    "surface": "surface: shaded as an opaque surface",
}
_FIXES = {
    FixSafety.SAFE: "a safe fix keeps the shape",
    FixSafety.UNSAFE: "a fix may change the shape",
    FixSafety.NONE: "no automatic fix",
}
_SHOWN = 6


def chunks(reports: Sequence[MeshReport], verbose: bool = False) -> Iterator[str]:
    """All meshes one after the other; ``verbose`` lists the rules that passed, too."""
    for number, report in enumerate(reports):
        yield "\n" * (number > 0) + section(report, verbose)


def render(reports: Sequence[MeshReport], verbose: bool = False) -> str:
    """The whole report."""
    return "".join(chunks(reports, verbose))


def section(report: MeshReport, verbose: bool = False) -> str:
    """One mesh."""
    name = report.path if report.object is None else f"{report.path} ({report.object})"
    lines = [f"{name}: {_headline(report)}"]
    if report.repair is not None:
        lines += _repair(report.repair)
    if report.closedness is not None:
        lines += _verdict(report)
    elif report.error is not None:
        lines.append(f"  {report.error.removeprefix(f'{report.path}: ')}")
    for rule in report.findings:
        lines += _finding(rule)
    for rule in report.waived:
        lines += _waived(rule)
    lines += _not_run(report)
    if verbose:
        passed = [f"{rule.code} {rule.name}" for rule in report.rules if rule.outcome == Outcome.PASS]
        lines.append(f"  passed: {', '.join(passed) or 'nothing'}")
        lines.append(f"  {report.seconds:.2f} s")
    # names come from strangers, and a line must stay one
    return "\n".join(map(printable, lines)) + "\n"


def _headline(report: MeshReport) -> str:
    if report.status != "ok" and not report.findings:
        return "not checked"
    if report.status != "ok":
        return "unreadable"
    counts = [(sum(rule.severity == severity for rule in report.findings), severity) for severity in Severity]
    tally = ", ".join(f"{count} {severity}{'s' * (count > 1)}" for count, severity in counts if count)
    if report.waived:
        tally = f"{tally or 'no findings'}, {len(report.waived)} waived"
    return f"{report.vertices} vertices, {report.faces} faces: {tally or 'no findings'}"


def _verdict(report: MeshReport) -> list[str]:
    closedness = report.closedness or {}
    roles = [part["role"] for part in report.components]
    parts = ", ".join(
        f"{roles.count(role)} {role}" for role in ("solid", "cavity", "internal", "sheet") if role in roles
    )
    return [
        f"  {_STATES[closedness['state']]} (components: {parts or 'none'})",
        f"  hole handling {_HANDLINGS[closedness['hole_handling']]}",
    ]


def _repair(repair: dict[str, Any]) -> list[str]:
    """What was done, what that changed, and what it cost."""
    lines = [f"  repair {repair['status']}" + (f": {repair['reason']}" if repair["reason"] else "")]
    for rung in repair["rungs"]:
        if rung["status"] != "skipped" or rung["reason"] != "nothing to do":
            lines.append(f"          {rung['name']} {rung['status']}: {rung['reason']}")
    before, after = repair["before"], repair["after"]
    if after:
        for name in ("faces", "area", "volume"):
            old, new = (_amount(values.get(name)) for values in (before, after))
            lines.append(f"          {name}: {old} -> {new}")
        lines.append(
            f"          greatest distance from the old visible surface: {after['distance']:.2%} of the diagonal"
        )
        lines.append(f"          lost: {'; '.join(repair['lost']) or 'nothing'}")
    if repair["output"]:
        lines.append(f"          written to {repair['output']}; what follows is about that file")
    return lines


def _amount(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.6g}"


def _finding(rule: RuleReport) -> list[str]:
    lines = [f"  {rule.severity:<7} {rule.code} {rule.name}: {rule.message}"]
    where = _where(rule)
    if where:
        lines.append(f"          where: {where}")
    lines.append(f"          why:   {rule.why}")
    lines.append(f"          fix:   {_FIXES[rule.fix]} (sss-check --explain {rule.code})")
    return lines


def _waived(rule: RuleReport) -> list[str]:
    lines = [f"  {Outcome.WAIVED:<7} {rule.code} {rule.name}: {rule.message}"]
    where = _where(rule)
    if where:
        lines.append(f"          where: {where}")
    return [*lines, f"          waived: {rule.reason}"]


def _where(rule: RuleReport) -> str:
    parts = []
    if rule.bbox is not None:
        parts.append(f"({_point(rule.bbox[0])}) to ({_point(rule.bbox[1])})")
    if rule.vertices:
        parts.append(_some("vertices", map(str, rule.vertices), len(rule.vertices)))
    elif rule.edges:
        parts.append(_some("edges", (f"{a}-{b}" for a, b in rule.edges), len(rule.edges)))
    elif rule.faces:
        parts.append(_some("faces", map(str, rule.faces), len(rule.faces)))
    return "; ".join(parts)


def _point(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _some(noun: str, items: Iterable[str], count: int) -> str:
    shown = " ".join(item for item, _ in zip(items, range(_SHOWN), strict=False))
    return f"{noun} {shown}{' ...' if count > _SHOWN else ''}"


def _not_run(report: MeshReport) -> list[str]:
    """The rules that did not run, gathered by reason."""
    return [
        f"  not run ({reason}): {'all' if len(rules) == len(report.rules) else ' '.join(rule.code for rule in rules)}"
        for reason, rules in report.not_run.items()
    ]
