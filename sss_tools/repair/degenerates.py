"""Rung ``degenerates``: faces without area go, and no edge opens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .draft import Draft

FLAT = 1e-9
"""Least height of a face as a share of the diagonal: the tolerance of SSS401."""

ROUNDS = 6
AT_ONCE = 300


def remove_degenerates(draft: Draft) -> Draft | None:
    """Drop faces with a repeated corner, collapse edges without length, flip the long side of what is left flat.

    A face with a repeated corner bounds nothing: it takes no part in edges. An edge is collapsed only where that
    keeps the surface what it is (link condition: its ends have no common neighbours but the tips of its two
    faces); a long side is flipped only where the new edge is not there yet. What allows neither stays.
    """
    live = draft.topology.live
    dropped = int((~live).sum())
    tolerance = FLAT * draft.diagonal
    faces, birth = draft.topology.faces[live], draft.birth[live]
    points = draft.mesh.vertices
    collapsed = flipped = 0
    for _ in range(ROUNDS):
        flat = _flat_faces(points, faces, tolerance)
        if len(flat) == 0:
            break
        faces, birth, c, f = _one_round(points, faces, birth, flat[:AT_ONCE], tolerance)
        collapsed, flipped = collapsed + c, flipped + f
        if c + f == 0:
            break
    if dropped + collapsed + flipped == 0:
        return None
    note = f"{dropped} faces dropped, {collapsed} edges collapsed, {flipped} flipped"
    return Draft(draft.source, points, faces, birth, note)


def _flat_faces(points, faces, tolerance) -> NDArray[np.int64]:
    corners = points[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.flatnonzero(doubled <= tolerance * longest)


def _one_round(points, faces, birth, flat, tolerance):
    """One collapse or flip for each of the flat faces whose surroundings no other one has touched yet."""
    faces = faces.copy()
    gone = np.zeros(len(faces), bool)
    touched = np.zeros(len(points), bool)
    collapsed = flipped = 0
    for face in flat:
        if gone[face] or touched[faces[face]].any():
            continue
        corner = faces[face]
        lengths = np.linalg.norm(points[corner] - points[np.roll(corner, -1)], axis=1)
        short, long = int(np.argmin(lengths)), int(np.argmax(lengths))
        a, b = corner[short], corner[(short + 1) % 3]
        if lengths[short] <= tolerance:
            around_a, around_b = _faces_at(faces, gone, a), _faces_at(faces, gone, b)
            shared = np.intersect1d(around_a, around_b)
            common = np.setdiff1d(np.intersect1d(faces[around_a], faces[around_b]), [a, b])
            ring = np.union1d(faces[around_a], faces[around_b])
            if len(shared) != 2 or len(common) != 2 or touched[ring].any():
                continue
            gone[shared] = True
            faces[around_b] = np.where(faces[around_b] == b, a, faces[around_b])
            touched[ring] = True
            collapsed += 1
            continue
        a, b, tip = corner[long], corner[(long + 1) % 3], corner[(long + 2) % 3]
        shared = np.intersect1d(_faces_at(faces, gone, a), _faces_at(faces, gone, b))
        if len(shared) != 2:
            continue
        other = shared[shared != face][0]
        far = np.setdiff1d(faces[other], [a, b])
        if len(far) != 1 or touched[faces[other]].any() or _is_edge(faces, gone, tip, far[0]):
            continue
        if not _runs(faces[other], b, a):
            continue  # the neighbours disagree on outside: not before they are turned
        pair = np.array([[a, far[0], tip], [far[0], b, tip]])
        # fewer flat faces than before, or the next round would flip it back
        if len(_flat_faces(points, pair, tolerance)) >= len(_flat_faces(points, faces[shared], tolerance)):
            continue
        faces[face], faces[other] = pair
        birth = birth.copy()
        birth[face] = birth[other]  # the flat face has no attributes to interpolate
        touched[pair] = True
        flipped += 1
    return faces[~gone], birth[~gone], collapsed, flipped


def _faces_at(faces, gone, point) -> NDArray[np.int64]:
    return np.flatnonzero((faces == point).any(axis=1) & ~gone)


def _is_edge(faces, gone, a, b) -> bool:
    return len(np.intersect1d(_faces_at(faces, gone, a), _faces_at(faces, gone, b))) > 0


def _runs(face, a, b) -> bool:
    """Whether the face runs from a to b."""
    return any(face[k] == a and face[(k + 1) % 3] == b for k in range(3))
