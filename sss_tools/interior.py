"""Surface that lies inside a solid: faces with matter on both sides, by the generalised winding number."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .winding import spread_by_area, winding_numbers

SOLID = 0.5
"""From this winding number on (in size), a point counts as inside a solid."""

SAMPLES = 3
"""Faces asked in each patch; most of them decide."""

CUT_FACES, CUT_PAIRS = 200, 6_000_000
"""Of the faces that meet others the largest are asked: so many in any case, more while they cost fewer point-face
pairs than this. Which of two equally large ones comes last is chance: hence all of them in small meshes."""

_PLACES = np.array([[1, 1, 1], [18, 1, 1], [1, 18, 1], [1, 1, 18], [5, 5, 1], [1, 5, 5], [5, 1, 5]], float)
_PLACES /= _PLACES.sum(axis=1, keepdims=True)
"""Where a face that meets others is asked, barycentric: in the middle, near the corners, near the sides."""

PAIRS = 30_000_000
"""Point-face pairs spent on one mesh: some two seconds."""


@dataclass(frozen=True)
class Shell:
    """A component that encloses volume, consistently oriented.

    faces  (m, 3) over points
    lower, upper  (3,) its bounding box
    """

    faces: NDArray[np.int64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]


@dataclass(frozen=True)
class Interior:
    """What was found inside solids.

    patches  face indices of each patch that lies inside
    faces    further single faces that lie inside in part: they meet the surface they pass through
    skipped  how many patches the budget did not reach
    """

    patches: tuple[NDArray[np.int64], ...] = ()
    faces: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    skipped: int = 0

    def __bool__(self) -> bool:
        """Whether anything lies inside."""
        return bool(self.patches) or len(self.faces) > 0


def winding_in_shells(samples, points, shells: list[Shell]) -> NDArray[np.float64]:
    """Winding number of ``samples`` (s, 3) in all ``shells`` together.

    A closed shell does not wind round what lies outside its box, and one with small holes hardly does.
    """
    total = np.zeros(len(samples))
    for shell in shells:
        near = np.flatnonzero(((samples >= shell.lower) & (samples <= shell.upper)).all(axis=1))
        total[near] += winding_numbers(samples[near], points, shell.faces)
    return total


def find_interior(points, faces, patch_of_face, shells: list[Shell], component_of_face, cut) -> Interior:
    """The patches, and single faces outside all patches, that have solid on both sides.

    points             (k, 3) float64
    faces              (m, 3) over points, consistently oriented in each patch
    patch_of_face      (m,), -1 for faces that take no part and for ``cut``
    shells             what encloses volume
    component_of_face  (m,), -1 for faces that take no part
    cut                (c,) faces that meet others: they may be inside in part

    A patch meets nothing, so any of its faces speaks for all; a few are asked, largest patches first, lest one
    that touches something decides. A cut face is asked in several places and named where one is inside.
    The wall of a cavity has the void on one side and is not inside.
    """
    if not shells:
        return Interior()
    corners = points[faces]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(vectors, axis=1) / 2
    budget = _Budget(shells)
    whole, skipped = _patches_inside(points, faces, patch_of_face, shells, component_of_face, vectors, areas, budget)

    cut = np.asarray(cut, np.int64)
    cut = cut[(areas[cut] > 0) & (component_of_face[cut] >= 0)]
    cut = cut[np.argsort(-areas[cut], kind="stable")]
    places = np.einsum("pk,fki->fpi", _PLACES, corners[cut])
    most = max(CUT_FACES, CUT_PAIRS // (2 * len(_PLACES) * sum(len(shell.faces) for shell in shells)))
    reached = budget.spend(places[:most, 0], 2 * len(_PLACES))
    cut, places = cut[:reached], places[:reached]
    asked = np.repeat(cut, len(_PLACES))
    inside = _solid_on_both_sides(points, corners[asked], vectors[asked], shells, places.reshape(-1, 3))
    single = np.sort(cut[inside.reshape(-1, len(_PLACES)).any(axis=1)])
    return Interior(tuple(whole), single, skipped)


def _patches_inside(points, faces, patch_of_face, shells, component_of_face, vectors, areas, budget):
    """The patches with solid on both sides, and how many the budget did not reach."""
    live = np.flatnonzero(patch_of_face >= 0)
    if len(live) == 0:
        return [], 0
    corners = points[faces]
    order = live[np.argsort(patch_of_face[live], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(patch_of_face[order])) + 1)
    whole_size = np.bincount(component_of_face[component_of_face >= 0])
    lower = np.array([shell.lower for shell in shells])
    upper = np.array([shell.upper for shell in shells])
    suspects = [
        group
        for group in groups
        if areas[group].any()
        and _may_be_inside(corners[group], lower, upper, partial=len(group) < whole_size[component_of_face[group[0]]])
    ]
    if not suspects:
        return [], 0
    suspects.sort(key=lambda group: (-areas[group].sum(), group[0]))
    middles = np.array([corners[group[np.argmax(areas[group])]].mean(axis=0) for group in suspects])
    reached = suspects[: budget.spend(middles, 2 * SAMPLES)]
    sampled = [group[spread_by_area(areas[group], SAMPLES)] for group in reached]
    # without area there are no sides to ask about
    sampled = [chosen[areas[chosen] > 0] for chosen in sampled]
    chosen = np.concatenate(sampled)
    inside = _solid_on_both_sides(points, corners[chosen], vectors[chosen], shells, corners[chosen].mean(axis=1))
    verdicts = np.split(inside, np.cumsum([len(asked) for asked in sampled])[:-1])
    whole = [group for group, verdict in zip(reached, verdicts, strict=True) if 2 * verdict.sum() > len(verdict)]
    return whole, len(suspects) - len(reached)


class _Budget:
    """Point-face pairs left to spend."""

    def __init__(self, shells: list[Shell]):
        self._shells = shells
        self._left = float(PAIRS)

    def spend(self, places: NDArray[np.float64], points_each: int) -> int:
        """How many of the places (p, 3), first ones first, can be asked at ``points_each`` points about each."""
        cost = np.zeros(len(places))
        for shell in self._shells:
            cost += points_each * len(shell.faces) * ((places >= shell.lower) & (places <= shell.upper)).all(axis=1)
        total = np.cumsum(cost)
        count = int(np.searchsorted(total, self._left, side="right"))
        # the first is asked whatever it costs
        count = min(max(count, 1), len(places))
        self._left -= total[count - 1] if count else 0.0
        return count


def _may_be_inside(corners, lower, upper, partial: bool) -> bool:
    """Whether a patch with these corners (f, 3, 3) can lie inside anything.

    It must meet the box, from lower (s, 3) to upper (s, 3), of a shell that is not itself; if it is only a
    part of a component, its own shell will do.
    """
    box = corners.reshape(-1, 3)
    least, greatest = box.min(axis=0), box.max(axis=0)
    near = ((least <= upper) & (greatest >= lower)).all(axis=1)
    itself = ((least == lower) & (greatest == upper)).all(axis=1)
    return int(near.sum()) > (0 if partial else int(itself.any()))


def _solid_on_both_sides(points, corners, vectors, shells, places) -> NDArray[np.bool_]:
    """(f,) for ``places`` (f, 3) on faces with corners (f, 3, 3) and area vectors (f, 3), twice their area long."""
    if len(places) == 0:
        return np.zeros(0, bool)
    perimeter = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).sum(axis=1)
    length = np.linalg.norm(vectors, axis=1)
    # a thousandth of the inradius (2 A / perimeter): close enough to see nothing but this face between
    step = vectors / length[:, None] * (1e-3 * length / perimeter)[:, None]
    front = winding_in_shells(places + step, points, shells)
    behind = winding_in_shells(places - step, points, shells)
    # the same sign on both sides: a face between a solid and its mirror image bounds both
    return (np.minimum(np.abs(front), np.abs(behind)) > SOLID) & (front * behind > 0)
