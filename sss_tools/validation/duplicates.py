"""Faces written more than once: SSS303 duplicate-face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology import Topology
from .outcome import FixSafety, Severity
from .rule import Finding, Rule, Subject, plural


def find_duplicates(subject: Subject) -> Finding | None:
    """Faces over the same three points as an earlier one, whichever way they face."""
    topology = subject.topology
    live = _candidates(topology)
    corners = np.sort(topology.faces[live], axis=1)
    order = np.lexsort(corners.T)  # stable: the first of equal faces is the earliest in the file
    same = np.zeros(len(live), bool)
    same[1:] = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    if not same.any():
        return None
    run_start = np.maximum.accumulate(np.where(same, 0, np.arange(len(live))))
    pairs = np.stack([live[order[run_start[same]]], live[order[same]]], axis=1)
    pairs = pairs[np.argsort(pairs[:, 1], kind="stable")]
    return Finding(
        count=len(pairs),
        message=f"{plural(len(pairs), 'face')} over the same three points as an earlier one (exact, no tolerance)",
        faces=np.unique(pairs),
        face_pairs=pairs,
    )


def _candidates(topology: Topology) -> NDArray[np.int64]:
    """Live faces with a side of more than two faces, or whose other face there has the same third point."""
    if len(topology.edges) == 0:
        return np.zeros(0, np.int64)
    left, right = topology.side_pairs
    points = topology.faces.ravel()
    same = points.take(left - left % 3 + (left + 2) % 3) == points.take(right - right % 3 + (right + 2) % 3)
    crowded = (topology.faces_per_edge > 2)[topology.face_edges].any(axis=1) & topology.live
    crowded[left[same] // 3] = crowded[right[same] // 3] = True
    return np.flatnonzero(crowded)


DUPLICATE_FACE = Rule(
    code="SSS303",
    name="duplicate-face",
    severity=Severity.ERROR,
    finds="coincident faces, whichever way they face",
    why="A ray meets two boundaries where there is one, and which comes first is chance: it counts itself twice "
    "inside, or not at all, in a noise that more samples do not remove.",
    fix="remove the copies",
    fix_safety=FixSafety.SAFE,
    check=find_duplicates,
)
