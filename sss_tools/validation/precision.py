"""Numbers that do not hold up: SSS601 float32-resolution, SSS602 non-finite."""

from __future__ import annotations

import numpy as np

from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural

SPACINGS = 4
"""Shortest edge, in steps of single precision at its place: rounding moves each end by up to half a step, so
shorter edges turn by up to a quarter of a radian and more, or vanish."""


def find_unresolved_vertices(subject: Subject) -> Finding | None:
    """Vertices joined by edges that single precision cannot resolve here, but could at the origin."""
    topology = subject.topology
    start, end = (np.ascontiguousarray(points) for points in topology.edges.T)
    places = topology.points.T
    square = np.zeros(len(start))
    for place in places:
        difference = place.take(end) - place.take(start)
        square += difference * difference
    length = np.sqrt(square)
    spacings = (_spacing(_largest(np.abs(p))) for p in (places, places - subject.mesh.bounds.mean(axis=0)[:, None]))
    here, centred = (np.maximum(spacing.take(start), spacing.take(end)) for spacing in spacings)
    edges = np.flatnonzero((length < SPACINGS * here) & (length >= SPACINGS * centred))
    if len(edges) == 0:
        return None
    vertices = np.unique(subject.edge_vertices(edges))
    return Finding(
        count=len(vertices),
        message=f"{plural(len(vertices), 'vertex', 'vertices')} on edges shorter than {SPACINGS} steps of single "
        f"precision, which are {here[edges].max():.3g} units at this offset from the origin",
        vertices=vertices,
        edges=subject.edge_vertices(edges),
    )


def _largest(coordinates):
    """(n,) largest of each point's three coordinates (3, n)."""
    return np.maximum(np.maximum(coordinates[0], coordinates[1]), coordinates[2])


def _spacing(magnitude):
    """Distance from a number of this size to the next one in single precision."""
    with np.errstate(over="ignore"):
        return np.spacing(magnitude.astype(np.float32)).astype(np.float64)


def find_non_finite(subject: Subject) -> Finding | None:
    """Vertices with a NaN or infinite coordinate, or one beyond the range of single precision."""
    with np.errstate(over="ignore"):
        finite = np.isfinite(subject.mesh.vertices.astype(np.float32))
    bad = np.flatnonzero(~finite.all(axis=1))
    if len(bad) == 0:
        return None
    faces = np.flatnonzero(np.isin(subject.mesh.faces, bad).any(axis=1))
    return Finding(
        count=len(bad),
        message=f"{plural(len(bad), 'vertex', 'vertices')} with NaN or infinite coordinates "
        "(single precision ends at 3.4e38)",
        vertices=bad,
        faces=faces,
    )


FLOAT32_RESOLUTION = Rule(
    code="SSS601",
    name="float32-resolution",
    severity=Severity.WARNING,
    finds="vertices that single precision cannot separate at this offset",
    why="Ray casters work in single precision: far from the origin the surface turns into steps, facets shade "
    "wrongly and rays miss. A file that was written in single precision out there has lost the shape already.",
    fix="move the object to the origin before it is written",
    fix_safety=FixSafety.NONE,
    check=find_unresolved_vertices,
)

NON_FINITE = Rule(
    code="SSS602",
    name="non-finite",
    severity=Severity.ERROR,
    finds="NaN or infinite coordinates",
    why="There is no place to put the surface; one such vertex turns distances, boxes and whole images into NaN.",
    fix="write the file again from its source",
    fix_safety=FixSafety.NONE,
    check=find_non_finite,
    on_file=True,
)
