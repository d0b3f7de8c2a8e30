"""Pieces of surface that join smoothly enough to have one outside: patches, and how to orient them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .topology import Topology, connected_components


def patch_of_face(topology: Topology, left_out: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
    """(m,) the patch of each face: faces joined over edges with exactly two faces; -1 for faces not live.

    left_out  faces that belong to no patch and join none
    Patches end at boundary and non-manifold edges. All of a patch lies on one side of everything it does not
    pass through: without the faces that meet others, on one side of everything.
    """
    cut = ~topology.live
    if left_out is not None:
        cut[left_out] = True
    if not cut[topology.live].any() and len(topology.nonmanifold_edges) == 0:
        return topology.component_of_face
    left, right = (side // 3 for side in topology.side_pairs)
    joined = ~(cut[left] | cut[right])
    patch = connected_components(len(topology.faces), left[joined], right[joined])
    patch[cut] = -1
    # the others keep consecutive numbers
    patch[~cut] = np.unique(patch[~cut], return_inverse=True)[1]
    return patch


def orient_consistently(topology: Topology) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Faces turned so that neighbours agree, changing as little area as possible in each patch.

    Returns the faces (m, 3) over points and which of them were turned (m,). A patch that cannot be oriented
    (a Moebius strip) stays as it is.
    """
    turned = np.zeros(len(topology.faces), bool)
    if len(topology.misoriented_edges) == 0:
        return topology.faces, turned
    left, right = topology.side_pairs
    forward = topology.side_direction.ravel()
    agrees = forward[left] != forward[right]
    left, right = left // 3, right // 3
    count = len(topology.faces)
    # two copies of each face, as it is and turned: agreeing neighbours join like copies, others unlike ones
    mate = np.where(agrees, right, right + count)
    other = np.where(agrees, right + count, right)
    label = connected_components(2 * count, np.concatenate([left, left + count]), np.concatenate([mate, other]))
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
