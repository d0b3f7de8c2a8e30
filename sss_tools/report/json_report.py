"""The report for programs: schema sss-check/1."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from ..validation.outcome import MeshReport, RuleReport
from . import statistics_table

SCHEMA = "sss-check/1"


def chunks(reports: Sequence[MeshReport], version: str, seconds: float, statistics: bool = False) -> Iterator[str]:
    """One JSON object for the run, in pieces, one mesh at a time; ``seconds`` is its wall time."""
    head = {"schema": SCHEMA, "version": version, "seconds": round(seconds, 3)}
    if statistics:
        head["statistics"] = statistics_table.rows(reports)
    yield _dump(head).removesuffix("\n}") + ',\n "meshes": ['
    separator = "\n"
    for report in reports:
        yield separator + textwrap.indent(_dump(mesh_object(report)), "  ")
        separator = ",\n"
    yield "\n ]\n}\n"


def render(reports: Sequence[MeshReport], version: str, seconds: float, statistics: bool = False) -> str:
    """The whole object."""
    return "".join(chunks(reports, version, seconds, statistics))


def mesh_object(report: MeshReport) -> dict[str, Any]:
    """One entry of ``meshes``."""
    data = asdict(report)
    data["rules"] = [rule_object(rule) for rule in report.rules]
    if report.repair is None:
        del data["repair"]  # there only when asked for
    # wall time comes last, as a reader expects it
    data["seconds"] = round(data.pop("seconds"), 3)
    return data


def line(report: MeshReport) -> str:
    """``mesh_object`` as one line, with the end of the line."""
    return json.dumps(mesh_object(report), allow_nan=False) + "\n"


def rule_object(rule: RuleReport) -> dict[str, Any]:
    """One entry of ``rules``; what only the program itself needs is left out."""
    data = asdict(rule)
    del data["why"], data["raised"]
    return data


def _dump(data: dict[str, Any]) -> str:
    return json.dumps(data, indent=1, allow_nan=False)
