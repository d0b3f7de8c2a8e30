"""Surfaces that pass through each other: SSS302 self-intersection, SSS304 overlapping-solids, SSS503 near-contact."""

from __future__ import annotations

import numpy as np

from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural, without_scene


def find_self_intersections(subject: Subject) -> Finding | None:
    """Pairs of faces that meet elsewhere than in their common side or corner."""
    pairs = subject.assessment.self_intersections
    if len(pairs) == 0:
        return None
    faces = np.unique(pairs)
    return Finding(
        count=len(pairs),
        message=f"{plural(len(pairs), 'pair')} of faces pass through or touch each other, "
        f"{plural(len(faces), 'face')} in all (exact, no tolerance)",
        faces=faces,
        face_pairs=pairs,
    )


SELF_INTERSECTION = Rule(
    code="SSS302",
    name="self-intersection",
    severity=Severity.ERROR,
    finds="faces of one mesh that pass through each other",
    why="Where a surface folds through itself a path counts itself twice inside, and boundaries appear within the "
    "medium.",
    fix="unite the overlapping parts",
    fix_safety=FixSafety.UNSAFE,
    check=find_self_intersections,
)

OVERLAPPING_SOLIDS = Rule(
    code="SSS304",
    name="overlapping-solids",
    severity=Severity.ERROR,
    finds="two closed solids that interpenetrate or touch",
    why="Two media in one place have no right answer: what light does there depends on which object is listed first.",
    fix="move them apart, or cut one from the other",
    fix_safety=FixSafety.UNSAFE,
    check=without_scene,
)

NEAR_CONTACT = Rule(
    code="SSS503",
    name="near-contact",
    severity=Severity.WARNING,
    finds="gaps between translucent objects below the least distance rays can resolve",
    why="A ray that leaves one object starts inside the next and never meets its boundary.",
    fix="widen the gap, or let the objects overlap on purpose",
    fix_safety=FixSafety.NONE,
    check=without_scene,
)
