"""Rung ``weld``: join the two sides of seams that all but coincide."""

from __future__ import annotations

import numpy as np

from ..seams import SEAM_TOLERANCE, cluster_points, edges_closed_by_welding
from .draft import Draft


def weld(draft: Draft) -> Draft | None:
    """Move the ends of seam edges (SSS103, same tolerance) onto each other; faces that vanish go."""
    topology, tolerance = draft.topology, SEAM_TOLERANCE * draft.diagonal
    seams = edges_closed_by_welding(topology, tolerance)
    if len(seams) == 0:
        return None
    ends = np.unique(topology.edges[seams])
    joined = np.arange(len(topology.points))
    joined[ends] = ends[cluster_points(topology.points[ends], tolerance)]
    faces = joined[topology.faces]
    a, b, c = faces.T
    keep = (a != b) & (b != c) & (c != a)
    moved = int((joined != np.arange(len(joined))).sum())
    return draft.with_faces(faces, f"{moved} points joined along {len(seams)} seam edges", keep)
