"""Elements of no use: SSS401 degenerate-face, SSS402 needle-face, SSS403 unreferenced-vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural

FLAT = 1e-9
"""Least height of a face, as a share of the diagonal; below it the area is zero at this scale."""

NEEDLE = 1000.0
"""Longest side over least height from which single precision gets the normal wrong by a thousandth and more."""


def find_degenerate_faces(subject: Subject) -> Finding | None:
    """Faces with a repeated corner or next to no height."""
    faces = np.flatnonzero(_is_degenerate(subject))
    if len(faces) == 0:
        return None
    repeated = int((~subject.topology.live[faces]).sum())
    return Finding(
        count=len(faces),
        message=f"{plural(len(faces), 'face')} without area ({repeated} with a repeated corner, "
        f"{len(faces) - repeated} lower than {FLAT * subject.mesh.diagonal:.3g} units, {FLAT:g} of the diagonal)",
        faces=faces,
    )


def find_needles(subject: Subject) -> Finding | None:
    """Faces a thousand times as long as high."""
    longest, height = _measures(subject)
    faces = np.flatnonzero(~_is_degenerate(subject) & (longest > NEEDLE * height))
    if len(faces) == 0:
        return None
    worst = float((longest[faces] / height[faces]).max())
    return Finding(
        count=len(faces),
        message=f"{plural(len(faces), 'face')} more than {NEEDLE:g} times as long as high (up to {worst:.2g})",
        faces=faces,
    )


def find_unreferenced_vertices(subject: Subject) -> Finding | None:
    """Vertices that no face names."""
    used = np.zeros(len(subject.mesh.vertices), bool)
    used[subject.mesh.faces.ravel()] = True
    vertices = np.flatnonzero(~used)
    if len(vertices) == 0:
        return None
    return Finding(
        count=len(vertices),
        message=f"{plural(len(vertices), 'vertex', 'vertices')} that no face uses",
        vertices=vertices,
    )


def _measures(subject: Subject) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Longest side and least height of each face, (m,) each, mesh units."""
    longest = subject.mesh.longest_sides
    height = np.divide(2 * subject.mesh.face_areas, longest, out=np.zeros_like(longest), where=longest > 0)
    return longest, height


def _is_degenerate(subject: Subject) -> NDArray[np.bool_]:
    """(m,) whether each face has no area at this scale."""
    _, height = _measures(subject)
    return ~subject.topology.live | (height <= FLAT * subject.mesh.diagonal)


DEGENERATE_FACE = Rule(
    code="SSS401",
    name="degenerate-face",
    severity=Severity.WARNING,
    finds="zero area at this scale",
    why="It has no normal: a ray that does hit it is reflected and refracted at random, or becomes NaN.",
    fix="remove it",
    fix_safety=FixSafety.SAFE,
    check=find_degenerate_faces,
)

NEEDLE_FACE = Rule(
    code="SSS402",
    name="needle-face",
    severity=Severity.INFO,
    finds="aspect ratio that ruins normals or intersection",
    why="Rounding tilts its normal, so highlights sparkle on it, and rays slip through along its long sides.",
    fix="remesh, or flip the edge to a better neighbour",
    fix_safety=FixSafety.NONE,
    check=find_needles,
)

UNREFERENCED_VERTEX = Rule(
    code="SSS403",
    name="unreferenced-vertex",
    severity=Severity.INFO,
    finds="vertices no face uses",
    why="Nothing happens to the light; but tools that frame or scale by all vertices get the size wrong.",
    fix="remove them; a copy that is written because of something else is without them",
    fix_safety=FixSafety.NONE,
    check=find_unreferenced_vertices,
)
