"""The report for code-scanning services: SARIF 2.1.0 (OASIS, with errata 01).

A mesh has no lines to point at. The location of a result is the file; where in the geometry the finding is
stands in its ``properties``, under the names of the JSON report.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from ..validation.outcome import MeshReport, Outcome, RuleReport, Severity
from ..validation.rule import Rule, all_rules
from . import statistics_table
from .json_report import rule_object
from .location import uri

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"

_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
_PLACE = ("count", "faces", "edges", "vertices", "face_pairs", "truncated", "centroid", "bbox", "fix")


def chunks(reports: Sequence[MeshReport], version: str, statistics: bool = False) -> Iterator[str]:
    """The log in pieces, one mesh at a time; ``reports`` is gone through twice, three times with ``statistics``.

    Findings are results; waived ones are results with a suppression. What did not run is a notification of the
    invocation, so that no reader takes the absence of a result for a pass.
    """
    index = {rule.code: number for number, rule in enumerate(all_rules())}
    driver = {"name": "sss-check", "version": version, "rules": [_rule(rule) for rule in all_rules()]}
    yield f'{{"version": "2.1.0", "$schema": {_json(SCHEMA)}, "runs": [{{"tool": {_json({"driver": driver})}'
    yield ', "columnKind": "unicodeCodePoints", "results": ['
    yield from _separated(_result(report, rule, index) for report in reports for rule in report.shown)
    yield '], "invocations": [{"executionSuccessful": '
    failed = any(rule.raised for report in reports for rule in report.rules)
    yield f'{_json(not failed)}, "toolExecutionNotifications": ['
    yield from _separated(notice for report in reports for notice in _notifications(report))
    yield "]}]"
    if statistics:
        yield f', "properties": {_json({"statistics": statistics_table.rows(reports)})}'
    yield "}]}\n"


def render(reports: Sequence[MeshReport], version: str, statistics: bool = False) -> str:
    """The whole log."""
    return "".join(chunks(reports, version, statistics))


def _rule(rule: Rule) -> dict[str, Any]:
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.finds},
        "fullDescription": {"text": rule.why},
        "help": {
            "text": f"{rule.why}\n\nFix: {rule.fix} (automatic fix: {rule.fix_safety})",
            "markdown": f"{rule.why}\n\n**Fix:** {rule.fix} (automatic fix: {rule.fix_safety})",
        },
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
        "properties": {"fix": rule.fix_safety},
    }


def _result(report: MeshReport, rule: RuleReport, index: dict[str, int]) -> dict[str, Any]:
    data = rule_object(rule)
    result = {
        "ruleId": rule.code,
        "ruleIndex": index[rule.code],
        "level": _LEVELS[rule.severity],
        "message": {"text": rule.message},
        "locations": [_location(report)],
        "properties": {key: data[key] for key in _PLACE},
    }
    if report.hash is not None:
        # the same fault of the same geometry is the same alert, wherever the file is moved to
        result["partialFingerprints"] = {"geometry/v1": f"{report.hash}:{rule.code}"}
    if rule.outcome == Outcome.WAIVED:
        result["suppressions"] = [{"kind": "external", "status": "accepted", "justification": rule.reason}]
    return result


def _location(report: MeshReport) -> dict[str, Any]:
    location: dict[str, Any] = {"physicalLocation": {"artifactLocation": {"uri": uri(report.path)}}}
    if report.object is not None:
        location["logicalLocations"] = [{"name": report.object, "kind": "object"}]
    return location


def _notifications(report: MeshReport) -> Iterator[dict[str, Any]]:
    """What went wrong with a file, and which rules did not run for which reason."""
    if report.error is not None:
        level = "error" if report.exit_status == 2 else "warning"
        yield {"level": level, "message": {"text": report.error}, "locations": [_location(report)]}
    for warning in report.warnings:
        yield {"level": "warning", "message": {"text": warning}, "locations": [_location(report)]}
    for reason, rules in report.not_run.items():
        yield {
            "level": "error" if any(rule.raised for rule in rules) else "note",
            "message": {"text": f"not run: {reason}"},
            "locations": [_location(report)],
            "properties": {"rules": [rule.code for rule in rules]},
        }


def _separated(items: Iterator[dict[str, Any]]) -> Iterator[str]:
    separator = "\n"
    for item in items:
        yield separator + _json(item)
        separator = ",\n"


def _json(data: Any) -> str:
    return json.dumps(data, allow_nan=False)
