"""Rung ``orientation``: neighbours agree, solids face outwards, cavities into their void."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..closedness import Assessment, assess
from ..mesh import Mesh
from ..patches import orient_consistently, patch_of_face
from ..topology import Topology
from .draft import Draft

PATCHES = 2000
"""Patches balanced against each other at most; beyond that non-manifold edges keep what the file says."""


def orient(draft: Draft) -> Draft | None:
    """Turn faces (SSS203, SSS204). The generalised winding number decides which side of a shell is out."""
    topology = draft.topology
    faces, _ = orient_consistently(topology)
    faces = _balanced(topology, faces)
    turned = (faces != topology.faces).any()
    mesh = Mesh(topology.points, faces) if turned else draft.mesh
    inverted = _inverted_components(assess(mesh) if turned else draft.assessment)
    if len(inverted):
        turn = np.isin(mesh.topology.component_of_face, inverted)
        faces = np.where(turn[:, None], faces[:, ::-1], faces)
    changed = (faces != topology.faces).any(axis=1)
    if not changed.any():
        return None
    what = f"{int(changed.sum())} faces turned"
    return draft.with_faces(faces, what + (f", {len(inverted)} shells inside out" if len(inverted) else ""))


def _inverted_components(assessment: Assessment) -> NDArray[np.int64]:
    """Solids inside out, and what lies inside them: a void in such a solid is as inverted as the solid itself."""
    sign = assessment.sign
    roles = np.array([part.role for part in assessment.components])
    # how the surroundings wind round a component follows from its sign and role
    around = np.where(roles == "cavity", -sign, np.where(roles == "internal", sign, 0))
    return np.flatnonzero(assessment.inverted | (around < 0))


def _balanced(topology: Topology, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces with whole patches turned so that non-manifold edges are run through as often either way.

    Greedy: patches are turned while that lessens the imbalance; least area first, so that walls give way to hulls.
    """
    if len(topology.nonmanifold_edges) == 0:
        return faces
    patch = patch_of_face(topology)
    count = int(patch.max()) + 1
    if count < 2 or count > PATCHES:
        return faces
    direction = np.where(faces < np.roll(faces, -1, axis=1), 1, -1)
    edges = _edges_of(topology, faces)
    shared = (edges >= 0) & np.isin(edges, topology.nonmanifold_edges)
    row = np.searchsorted(topology.nonmanifold_edges, edges[shared])
    column = np.broadcast_to(patch[:, None], edges.shape)[shared]
    runs = np.zeros((len(topology.nonmanifold_edges), count), np.int64)
    np.add.at(runs, (row, column), direction[shared])
    area = np.bincount(patch[patch >= 0], Mesh(topology.points, faces).face_areas[patch >= 0], count)
    sign, balance = np.ones(count, np.int64), runs.sum(axis=1)
    improved = True
    while improved and np.abs(balance).sum():
        improved = False
        for number in np.argsort(area, kind="stable"):
            other = balance - 2 * sign[number] * runs[:, number]
            if np.abs(other).sum() < np.abs(balance).sum():
                balance, improved = other, True
                sign[number] *= -1
    turn = (patch >= 0) & (sign[patch] < 0)
    return np.where(turn[:, None], faces[:, ::-1], faces)


def _edges_of(topology: Topology, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) the edge of each side of faces that may be turned."""
    turned = (faces != topology.faces).any(axis=1)
    # reversed corners (c, b, a): their sides are those of (a, b, c) in the order 1, 0, 2
    return np.where(turned[:, None], topology.face_edges[:, [1, 0, 2]], topology.face_edges)
