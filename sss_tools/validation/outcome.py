"""What a check reports, as plain data without numpy: light to import, to send between processes, to print."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class Severity(StrEnum):
    """How bad a finding is; an error decides the exit status."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


class FixSafety(StrEnum):
    """What a fix promises: safe keeps the shape, unsafe may invent or remove surface."""

    SAFE = "safe"
    UNSAFE = "unsafe"
    NONE = "none"


class Outcome(StrEnum):
    """How a rule ended on a mesh."""

    PASS = "pass"
    FAIL = "fail"
    WAIVED = "waived"
    NOT_RUN = "not-run"


RULES_VERSION = "2"
"""Changes when a verdict may change; a record of another version is not trusted."""

UNUSABLE = ("SSS602", "SSS701", "SSS702")
"""Codes that say a file cannot be used at all: exit status 2."""


@dataclass
class RuleReport:
    """How one rule ended on one mesh; the fields of the JSON object, and ``why`` and ``raised`` besides.

    reason    why it did not run, or was waived: then what was found is here all the same
    count     of what the rule's name names; 0 where it found nothing
    faces, edges, vertices, face_pairs   indices in file order, at most ``run.LISTED`` of each
    truncated whether more were found than are listed
    raised    the rule itself failed
    """

    code: str
    name: str
    severity: Severity
    outcome: Outcome
    reason: str | None = None
    count: int = 0
    message: str = ""
    faces: list[int] = field(default_factory=list)
    edges: list[list[int]] = field(default_factory=list)
    vertices: list[int] = field(default_factory=list)
    face_pairs: list[list[int]] = field(default_factory=list)
    truncated: bool = False
    centroid: list[float] | None = None
    bbox: list[list[float]] | None = None
    fix: FixSafety = FixSafety.NONE
    why: str = ""
    raised: bool = False


@dataclass
class MeshReport:
    """Everything found out about one file.

    status      "ok", or "unreadable" where no mesh came out of the file
    error       one line saying why the file cannot be used, or None
    hash        ``record.geometry_hash`` of what the file holds; None where that is not known
    object      the name of the scene's object that was looked at, where the mesh was checked as part of a scene
    closedness, components  as in CONTRACTS section 1; None and [] where they could not be found out
    repair      what became of it, as in CONTRACTS section 1; None where nobody asked. All the rest is then about
                the result, where one was written
    warnings    what went wrong beside the check (an unwritable record), one line each
    cached      the findings were known from an earlier check of the same geometry
    seconds     wall time
    """

    path: str
    status: str = "ok"
    error: str | None = None
    hash: str | None = None
    object: str | None = None
    vertices: int | None = None
    faces: int | None = None
    bbox: list[list[float]] | None = None
    area: float | None = None
    volume: float | None = None
    closedness: dict[str, Any] | None = None
    components: list[dict[str, Any]] = field(default_factory=list)
    rules: list[RuleReport] = field(default_factory=list)
    repair: dict[str, Any] | None = None
    warnings: list[str] = field(default_factory=list)
    cached: bool = False
    seconds: float = 0.0

    @property
    def findings(self) -> list[RuleReport]:
        """The rules that found something, in the order of their codes."""
        return [rule for rule in self.rules if rule.outcome == Outcome.FAIL]

    @property
    def waived(self) -> list[RuleReport]:
        """The rules that found something which the user accepts."""
        return [rule for rule in self.rules if rule.outcome == Outcome.WAIVED]

    @property
    def shown(self) -> list[RuleReport]:
        """Findings and waived ones, in the order of their codes."""
        return [rule for rule in self.rules if rule.outcome in (Outcome.FAIL, Outcome.WAIVED)]

    @property
    def not_run(self) -> dict[str, list[RuleReport]]:
        """The rules that did not run, by reason."""
        gathered: dict[str, list[RuleReport]] = {}
        for rule in self.rules:
            if rule.outcome == Outcome.NOT_RUN:
                gathered.setdefault(rule.reason or "no reason given", []).append(rule)
        return gathered

    def _repr_html_(self) -> str:
        """How notebooks show it."""
        from ..report.html_table import render

        return render(self)

    @property
    def exit_status(self) -> int:
        """0, 1 for a finding at error level, 2 for a file that cannot be used or a rule that raised."""
        if any(rule.raised for rule in self.rules) or any(f.code in UNUSABLE for f in self.findings):
            return 2
        return int(any(finding.severity == Severity.ERROR for finding in self.findings))
