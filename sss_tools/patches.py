"""Pieces of surface that join smoothly enough to have one outside: patches, and how to orient them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .topology import Topology


def patch_of_face(topology: Topology) -> NDArray[np.int64]:
    """(m,) the patch of each face: faces joined over edges with exactly two faces; -1 for faces not live.

    Patches end at boundary and non-manifold edges. All of a patch lies on one side of everything it does not
    pass through.
    """
    if len(topology.nonmanifold_edges) == 0:
        return topology.component_of_face
    left, right = (side // 3 for side in _neighbours(topology))
    patch = _components(len(topology.faces), left, right)
    patch[~topology.live] = -1
    # live faces keep consecutive numbers
    patch[topology.live] = np.unique(patch[topology.live], return_inverse=True)[1]
    return patch


def orient_consistently(topology: Topology) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Faces turned so that neighbours agree, changing as little area as possible in each patch.

    Returns the faces (m, 3) over points and which of them were turned (m,). A patch that cannot be oriented
    (a Moebius strip) stays as it is.
    """
    turned = np.zeros(len(topology.faces), bool)
    if len(topology.misoriented_edges) == 0:
        return topology.faces, turned
    left, right = _neighbours(topology)
    forward = topology.side_direction.ravel()
    agrees = forward[left] != forward[right]
    left, right = left // 3, right // 3
    count = len(topology.faces)
    # two copies of each face, as it is and turned: agreeing neighbours join like copies, others unlike ones
    mate = np.where(agrees, right, right + count)
    other = np.where(agrees, right + count, right)
    label = _components(2 * count, np.concatenate([left, left + count]), np.concatenate([mate, other]))
    kept, flipped = label[:count], label[count:]
    # one half of each patch's copies keeps the face with the lesser label; the area decides between halves
    corners = topology.points[topology.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # by area, and by number where areas tie at zero
    weight = np.bincount(kept, area, minlength=2 * count)
    turned = weight[kept] < weight[flipped]
    tie = (weight[kept] == weight[flipped]) & (kept != flipped)
    turned[tie] = kept[tie] > flipped[tie]
    turned &= topology.live
    faces = topology.faces.copy()
    faces[turned] = faces[turned][:, ::-1]
    return faces, turned


def _neighbours(topology: Topology) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The two sides (3 * face + corner) of every edge with exactly two faces."""
    edge_of_side = topology.face_edges.ravel()
    sides = np.flatnonzero(edge_of_side >= 0)
    sides = sides[topology.faces_per_edge[edge_of_side[sides]] == 2]
    sides = sides[np.argsort(edge_of_side[sides], kind="stable")]
    return sides[0::2], sides[1::2]


def _components(count: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """(count,) labels of the connected components of a graph with links a[i] - b[i]."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(a), bool), (a, b)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.int64)
