"""Places where the surface is no surface: SSS201 non-manifold-edge, SSS202 non-manifold-vertex."""

from __future__ import annotations

from .boundary import faces_at
from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural


def find_shared_edges(subject: Subject) -> Finding | None:
    """Edges with more than two faces."""
    topology = subject.topology
    edges = topology.nonmanifold_edges
    if len(edges) == 0:
        return None
    most = topology.faces_per_edge[edges].max()
    return Finding(
        count=len(edges),
        message=f"{plural(len(edges), 'edge')} with more than two faces (up to {most}; exact, no tolerance)",
        edges=subject.edge_vertices(edges),
        faces=faces_at(topology.face_edges, edges),
    )


def find_pinches(subject: Subject) -> Finding | None:
    """Points where several fans of faces meet."""
    points = subject.topology.pinched_points
    if len(points) == 0:
        return None
    return Finding(
        count=len(points),
        message=f"{plural(len(points), 'vertex', 'vertices')} where faces meet in a point alone (exact, no tolerance)",
        vertices=subject.vertex_of_point[points],
    )


NON_MANIFOLD_EDGE = Rule(
    code="SSS201",
    name="non-manifold-edge",
    severity=Severity.ERROR,
    finds="an edge with more than two faces",
    why="Which side is inside is undecided there: a path that crosses such a wall may count itself outside while "
    "still in the medium, and stops scattering.",
    fix="remove the inner faces, or split the edge so that each solid has its own",
    fix_safety=FixSafety.UNSAFE,
    check=find_shared_edges,
)

NON_MANIFOLD_VERTEX = Rule(
    code="SSS202",
    name="non-manifold-vertex",
    severity=Severity.WARNING,
    finds="faces that meet in a vertex alone",
    why="The light passes none the worse, but the point has no normal and no curvature: a bright or dark speck in "
    "the approximate shaders.",
    fix="give each fan of faces its own vertex, drawn a hair's breadth apart",
    fix_safety=FixSafety.UNSAFE,
    check=find_pinches,
)
