"""The report for programs: schema sss-check/1."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ..validation.outcome import MeshReport, RuleReport

SCHEMA = "sss-check/1"


def render(reports: Sequence[MeshReport], version: str, seconds: float) -> str:
    """One JSON object for the run; ``seconds`` is its wall time."""
    data = {
        "schema": SCHEMA,
        "version": version,
        "seconds": round(seconds, 3),
        "meshes": [mesh_object(report) for report in reports],
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def mesh_object(report: MeshReport) -> dict[str, Any]:
    """One entry of ``meshes``."""
    data = asdict(report)
    data["rules"] = [rule_object(rule) for rule in report.rules]
    if report.repair is None:
        del data["repair"]  # there only when asked for
    # wall time comes last, as a reader expects it
    data["seconds"] = round(data.pop("seconds"), 3)
    return data


def rule_object(rule: RuleReport) -> dict[str, Any]:
    """One entry of ``rules``; what only the program itself needs is left out."""
    data = asdict(rule)
    del data["why"], data["raised"]
    return data
