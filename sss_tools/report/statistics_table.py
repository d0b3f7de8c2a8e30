"""How often each rule found something in a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from ..validation.outcome import MeshReport


def rows(reports: Sequence[MeshReport]) -> list[dict[str, Any]]:
    """``{"code", "name", "meshes", "count"}`` for each rule that found anything, most meshes first.

    What is waived does not count.
    """
    meshes: Counter[tuple[str, str]] = Counter()
    counts: Counter[tuple[str, str]] = Counter()
    for report in reports:
        for rule in report.findings:
            meshes[rule.code, rule.name] += 1
            counts[rule.code, rule.name] += rule.count
    ordered = sorted(meshes, key=lambda key: (-meshes[key], key))
    return [
        {"code": code, "name": name, "meshes": meshes[code, name], "count": counts[code, name]}
        for code, name in ordered
    ]


def render(reports: Sequence[MeshReport]) -> str:
    """One line for each of ``rows``."""
    lines = [f"{'meshes':>8} {'count':>8}  rule"]
    lines += [f"{row['meshes']:>8} {row['count']:>8}  {row['code']} {row['name']}" for row in rows(reports)]
    return "\n".join(lines) + "\n"
