"""Gaps in the surface: SSS101 open-boundary, SSS102 open-sheet, SSS103 unwelded-seam."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..enclosure import ENCLOSES
from ..seams import SEAM_TOLERANCE, edges_closed_by_welding
from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural


def find_holes(subject: Subject) -> Finding | None:
    """Boundary loops of components that enclose volume, but for those that are only seams."""
    topology, closedness = subject.topology, subject.assessment.closedness
    seams = seam_edges(subject)
    rims = [
        (loop, hole)
        for loop, hole in zip(_hole_loops(subject), closedness.holes, strict=True)
        if not np.isin(loop, seams).all()
    ]
    if not rims:
        return None
    edges = np.concatenate([loop for loop, _ in rims])
    widest = max(hole.diameter for _, hole in rims)
    share = sum(hole.area for _, hole in rims) / subject.mesh.area
    return Finding(
        count=len(rims),
        message=f"{plural(len(rims), 'hole')}, the widest {widest:.3g} units across "
        f"({widest / subject.mesh.diagonal:.2%} of the diagonal), {share:.2%} of the area in all",
        edges=subject.edge_vertices(edges),
        faces=faces_at(topology.face_edges, edges),
    )


def find_sheets(subject: Subject) -> Finding | None:
    """Components that enclose nothing."""
    assessment = subject.assessment
    sheets = [number for number, part in enumerate(assessment.components) if part.role == "sheet"]
    if not sheets:
        return None
    faces = assessment.faces_of(sheets)
    total = len(assessment.components)
    return Finding(
        count=len(sheets),
        message=f"{len(sheets)} of {plural(total, 'component')} "
        f"{'encloses' if len(sheets) == 1 else 'enclose'} nothing (winding number below {ENCLOSES:g} everywhere; "
        f"{plural(len(faces), 'face')})",
        faces=faces,
    )


def find_seams(subject: Subject) -> Finding | None:
    """Boundary edges that all but coincide."""
    edges = seam_edges(subject)
    if len(edges) == 0:
        return None
    tolerance = SEAM_TOLERANCE * subject.mesh.diagonal
    return Finding(
        count=len(edges),
        message=f"{plural(len(edges), 'boundary edge')} within {tolerance:.3g} units "
        f"({SEAM_TOLERANCE:g} of the diagonal) of another",
        edges=subject.edge_vertices(edges),
        faces=faces_at(subject.topology.face_edges, edges),
    )


def seam_edges(subject: Subject) -> NDArray[np.int64]:
    """The topology's edges that a tolerant weld would close."""
    return edges_closed_by_welding(subject.topology, SEAM_TOLERANCE * subject.mesh.diagonal)


def faces_at(face_edges: NDArray[np.int64], edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces with a side on any of ``edges``, in file order."""
    return np.flatnonzero(np.isin(face_edges, edges).any(axis=1))


def _hole_loops(subject: Subject) -> list[NDArray[np.int64]]:
    """The boundary loops behind the holes of the verdict, in its order."""
    is_hole = subject.assessment.loop_is_hole
    return [loop for loop, hole in zip(subject.topology.boundary_loops, is_hole, strict=True) if hole]


OPEN_BOUNDARY = Rule(
    code="SSS101",
    name="open-boundary",
    severity=Severity.ERROR,
    finds="a hole: a boundary loop of a surface that otherwise encloses a volume",
    why="A path inside the solid leaves through the gap without meeting the boundary: no Fresnel event, no exit, "
    "energy missing from the image, and a dark halo where walls are near.",
    fix="close the hole; capping it invents surface, so look at the result",
    fix_safety=FixSafety.UNSAFE,
    check=find_holes,
)

OPEN_SHEET = Rule(
    code="SSS102",
    name="open-sheet",
    severity=Severity.ERROR,
    finds="a component that encloses nothing",
    why="A sheet has no inside for light to scatter in: it can only be shaded as an opaque surface.",
    fix="model the sheet as a solid with a wall thickness, or give it an opaque material",
    fix_safety=FixSafety.NONE,
    check=find_sheets,
)

UNWELDED_SEAM = Rule(
    code="SSS103",
    name="unwelded-seam",
    severity=Severity.ERROR,
    finds="boundary edges that coincide in space with others; welding closes them",
    why="The crack is too thin to see, yet every path that hits it leaks: bright or dark lines along the seam.",
    fix="weld the vertices along the seam",
    fix_safety=FixSafety.SAFE,
    check=find_seams,
)
