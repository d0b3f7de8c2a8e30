"""Which side is out: SSS203 inconsistent-winding, SSS204 inverted-shell."""

from __future__ import annotations

import numpy as np

from .boundary import faces_at
from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural


def find_disagreeing_neighbours(subject: Subject) -> Finding | None:
    """Edges whose two faces run through them in the same direction."""
    edges = subject.topology.misoriented_edges
    if len(edges) == 0:
        return None
    return Finding(
        count=len(edges),
        message=f"{plural(len(edges), 'edge')} across which the faces disagree on outside (exact, no tolerance)",
        edges=subject.edge_vertices(edges),
        faces=faces_at(subject.topology.face_edges, edges),
    )


def find_inverted_shells(subject: Subject) -> Finding | None:
    """Solids whose normals point inwards; where neighbours disagree there is no telling, and SSS203 tells that."""
    topology, assessment = subject.topology, subject.assessment
    mixed = assessment.component_of_face[faces_at(topology.face_edges, topology.misoriented_edges)]
    inverted = np.setdiff1d(np.flatnonzero(assessment.inverted), mixed)
    if len(inverted) == 0:
        return None
    faces = assessment.faces_of(inverted)
    return Finding(
        count=len(inverted),
        message=f"{plural(len(inverted), 'solid')} with normals pointing inwards ({plural(len(faces), 'face')}; "
        "by the sign of the volume, no tolerance)",
        faces=faces,
    )


INCONSISTENT_WINDING = Rule(
    code="SSS203",
    name="inconsistent-winding",
    severity=Severity.ERROR,
    finds="neighbours that disagree on outside",
    why="The turned faces refract light the wrong way: entering paths are taken for leaving ones, and patches turn "
    "black or glow.",
    fix="turn the faces that disagree",
    fix_safety=FixSafety.SAFE,
    check=find_disagreeing_neighbours,
)

INVERTED_SHELL = Rule(
    code="SSS204",
    name="inverted-shell",
    severity=Severity.ERROR,
    finds="a solid whose normals point inwards",
    why="Inside and outside are exchanged: the medium fills the world and the object is a void in it.",
    fix="turn all faces of the shell",
    fix_safety=FixSafety.SAFE,
    check=find_inverted_shells,
)
