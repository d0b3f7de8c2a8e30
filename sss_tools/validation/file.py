"""Files that hold no mesh: SSS701 empty, SSS702 unreadable."""

from __future__ import annotations

from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject


def find_emptiness(subject: Subject) -> Finding | None:
    """A mesh without faces."""
    if len(subject.mesh.faces):
        return None
    return Finding(count=1, message=f"no faces ({len(subject.mesh.vertices)} vertices)")


def find_unreadable(subject: Subject) -> None:
    """Nothing: whoever has a mesh in hand could read it. A file that cannot be read fails this in ``run``."""


EMPTY = Rule(
    code="SSS701",
    name="empty",
    severity=Severity.ERROR,
    finds="no faces",
    why="There is nothing for light to meet.",
    fix="export the surface, not its points or curves alone",
    fix_safety=FixSafety.NONE,
    check=find_emptiness,
    on_file=True,
)

UNREADABLE = Rule(
    code="SSS702",
    name="unreadable",
    severity=Severity.ERROR,
    finds="a file that is corrupt, truncated or of no known kind",
    why="Half a file is half a surface: what was cut off would be rendered as a hole.",
    fix="write the file again from its source",
    fix_safety=FixSafety.NONE,
    check=find_unreadable,
    on_file=True,
)
