"""Rung ``duplicates``: one face where several lie over the same three points, or none where they cancel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh
from .draft import Draft


def remove_duplicates(draft: Draft) -> Draft | None:
    """Keep of coincident faces (SSS303) what they amount to.

    More copies face one way than the other: one of those stays. As many either way: they cancel where the
    surface around them is closed without them (an inner wall written twice), and one stays where it is not. A
    sheet written twice that touches nothing else stays as it is: it is all there is.
    """
    topology = draft.topology
    live = np.flatnonzero(topology.live)
    triple = np.sort(topology.faces[live], axis=1)
    _, group, sizes = np.unique(triple, axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    if (sizes == 1).all():
        return None
    forward = _is_even(topology.faces[live])
    net = np.bincount(group, np.where(forward, 1, -1), len(sizes)).astype(np.int64)
    first = np.full((2, len(sizes)), -1)
    # in reverse, so that the earliest face of each group and direction is what is left
    first[forward.astype(int)[::-1], group[::-1]] = live[::-1]

    keep = np.ones(len(topology.faces), bool)
    several = sizes > 1
    keep[live[several[group]]] = False
    uneven = np.flatnonzero(several & (net != 0))
    keep[first[(net[uneven] > 0).astype(int), uneven]] = True
    cancelled = _settle_cancelling_pairs(topology, live, group, several & (net == 0), first, keep)
    if keep.all():
        return None
    dropped = int((~keep).sum())
    note = f"{dropped} faces removed" + (f", {cancelled} of them inner walls that cancel" if cancelled else "")
    return draft.with_faces(topology.faces, note, keep)


def _settle_cancelling_pairs(topology, live, group, even, first, keep) -> int:
    """Decide for each patch of pairs that cancel; marks in ``keep`` what stays, returns how many faces cancel."""
    pairs = np.flatnonzero(even)
    if len(pairs) == 0:
        return 0
    from ..patches import patch_of_face

    # each pair as one face; those that share an edge are settled alike
    single = Mesh(topology.points, topology.faces[first[0, pairs]])
    # points that coincide with nothing keep their numbers
    patch = patch_of_face(single.topology)
    sides = topology.face_edges[first[0, pairs]]
    # what is left round each edge when all pairs are gone
    others = np.bincount(topology.face_edges[topology.live & keep].ravel(), minlength=len(topology.edges))
    cancelled = 0
    for number in range(patch.max() + 1):
        chosen = patch == number
        around = others[sides[chosen].ravel()]
        closed_without, open_without = int((around >= 2).sum()), int((around == 1).sum())
        if closed_without == open_without == 0:
            keep[live[np.isin(group, pairs[chosen])]] = True
        elif closed_without >= open_without:
            cancelled += int(np.isin(group, pairs[chosen]).sum())
        else:
            keep[first[0, pairs[chosen]]] = True  # which way it faces is for the next rung to say
    return cancelled


def _is_even(faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether the corners are an even permutation of their sorted order."""
    turned = np.take_along_axis(faces, (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    return turned[:, 1] < turned[:, 2]
