"""How often each rule found something in a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ..validation.outcome import MeshReport


def render(reports: Sequence[MeshReport]) -> str:
    """One line a rule that found anything: meshes, count, code, name; most meshes first."""
    meshes: Counter[tuple[str, str]] = Counter()
    counts: Counter[tuple[str, str]] = Counter()
    for report in reports:
        for rule in report.findings:
            meshes[rule.code, rule.name] += 1
            counts[rule.code, rule.name] += rule.count
    lines = [f"{'meshes':>8} {'count':>8}  rule"]
    for key in sorted(meshes, key=lambda key: (-meshes[key], key)):
        lines.append(f"{meshes[key]:>8} {counts[key]:>8}  {key[0]} {key[1]}")
    return "\n".join(lines) + "\n"
