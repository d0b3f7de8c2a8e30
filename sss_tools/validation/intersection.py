"""Surfaces that pass through each other: SSS302 self-intersection, SSS304 overlapping-solids, SSS503 near-contact."""

from __future__ import annotations

import numpy as np

from ..contact import common_faces, lies_within, near_faces
from ..rays import RAY_OFFSET
from .outcome import FixSafety, Severity
from .rule import Finding, Neighbour, NotRun, Rule, Subject, plural

RESOLVED = 2 * float(RAY_OFFSET)
"""Least gap that rays tell from none, over the longest side of the scene: a ray starts one offset off its face, and
may end as far off the next."""


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


def find_overlaps(subject: Subject) -> Finding | None:
    """Neighbours in the scene that the mesh interpenetrates or touches."""
    neighbours = _neighbours(subject)
    _refuse_what_bounds_nothing(subject)
    faces, names = [], []
    for neighbour in neighbours:
        if not _within(subject, neighbour, 0.0):
            continue
        common = common_faces(subject.mesh, neighbour.mesh)
        if len(common) == 0 and lies_within(subject.mesh, neighbour.mesh):
            common = np.arange(len(subject.mesh.faces))
        if len(common) or lies_within(neighbour.mesh, subject.mesh):
            faces.append(common)
            names.append(neighbour.name)
    if not names:
        return None
    return Finding(
        count=len(names),
        message=f"overlaps or touches {', '.join(names)} (exact, no tolerance)",
        faces=np.unique(np.concatenate(faces)),
    )


def find_near_contacts(subject: Subject) -> Finding | None:
    """Neighbours in the scene across a gap that rays do not resolve."""
    neighbours = _neighbours(subject)
    extent = subject.context.extent or _extent(subject, neighbours)
    least = RESOLVED * extent
    faces, found = [], []
    for neighbour in neighbours:
        if not _within(subject, neighbour, least):
            continue
        near, gap = near_faces(subject.mesh, neighbour.mesh, least)
        # what touches is SSS304's
        if len(near) and gap > 0:
            faces.append(near)
            found.append(f"{gap:.3g} to {neighbour.name}")
    if not found:
        return None
    unit = subject.context.unit or "units"
    return Finding(
        count=len(found),
        message=f"gaps of {', '.join(found)}, where rays need {least:.3g} {unit} "
        f"({RESOLVED:g} of the scene's longest side)",
        faces=np.unique(np.concatenate(faces)),
    )


def _neighbours(subject: Subject) -> tuple[Neighbour, ...]:
    if subject.context.neighbours is None:
        raise NotRun("no scene")
    return tuple(
        neighbour for neighbour in subject.context.neighbours if neighbour.translucent and len(neighbour.mesh.faces)
    )


def _refuse_what_bounds_nothing(subject: Subject) -> None:
    if subject.assessment.closedness.state == "open":
        raise NotRun("the mesh encloses no volume")


def _within(subject: Subject, neighbour: Neighbour, distance: float) -> bool:
    """Whether the boxes of the two come within ``distance`` of each other along every axis."""
    (lower, upper), (low, high) = subject.mesh.bounds, neighbour.mesh.bounds
    return bool(((lower - distance <= high) & (low - distance <= upper)).all())


def _extent(subject: Subject, neighbours: tuple[Neighbour, ...]) -> float:
    bounds = np.array([subject.mesh.bounds, *(neighbour.mesh.bounds for neighbour in neighbours)])
    return float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max())


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
    fix_safety=FixSafety.NONE,
    check=find_overlaps,
)

NEAR_CONTACT = Rule(
    code="SSS503",
    name="near-contact",
    severity=Severity.WARNING,
    finds="gaps between translucent objects below the least distance rays can resolve",
    why="A ray that leaves one object starts inside the next and never meets its boundary.",
    fix="widen the gap, or let the objects overlap on purpose",
    fix_safety=FixSafety.NONE,
    check=find_near_contacts,
)
