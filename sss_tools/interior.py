"""Surface that lies inside a solid: faces with matter on both sides, by the generalised winding number."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .winding import spread_by_area, winding_numbers

SOLID = 0.5
"""From this winding number on (in size), a point counts as inside a solid."""

SAMPLES = 8
"""Faces asked in each patch, where the budget allows."""

PAIRS = 60_000_000
"""Point-face pairs spent on one mesh: some three seconds."""


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

    patches  face indices of each patch all of whose samples lie inside
    faces    further single faces found inside, of patches that pass from outside to inside
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


def find_interior(points, faces, patch_of_face, shells: list[Shell], component_of_face) -> Interior:
    """The patches, and single faces of other patches, that have solid on both sides.

    points             (k, 3) float64
    faces              (m, 3) over points, consistently oriented in each patch
    patch_of_face      (m,), -1 for faces that take no part
    shells             what encloses volume
    component_of_face  (m,), -1 for faces that take no part
    Asks a few faces of each patch, largest patches first. The wall of a cavity has the void on one side
    and is not inside. A single patch that folds into itself is not found here: it has no edge where it does.
    """
    live = np.flatnonzero(patch_of_face >= 0)
    if not shells or len(live) == 0:
        return Interior()
    order = live[np.argsort(patch_of_face[live], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(patch_of_face[order])) + 1)
    corners = points[faces]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(vectors, axis=1) / 2
    whole_size = np.bincount(component_of_face[live])[component_of_face]
    lower = np.array([shell.lower for shell in shells])
    upper = np.array([shell.upper for shell in shells])
    suspects = [
        group
        for group in groups
        if _may_be_inside(corners[group], lower, upper, partial=len(group) < whole_size[group[0]])
    ]
    suspects.sort(key=lambda group: (-areas[group].sum(), group[0]))
    if not suspects:
        return Interior()

    # what one sample of each patch costs: both of its sides against every shell about it
    middles = np.array([corners[group[np.argmax(areas[group])]].mean(axis=0) for group in suspects])
    cost = np.zeros(len(suspects))
    for shell in shells:
        cost += 2 * len(shell.faces) * ((middles >= shell.lower) & (middles <= shell.upper)).all(axis=1)
    count = int(np.clip(PAIRS // max(cost.sum(), 1), 1, SAMPLES))
    reached = suspects[: max(int(np.searchsorted(np.cumsum(cost) * count, PAIRS, side="right")), 1)]

    # without area there are no sides to ask about
    sampled = [group[spread_by_area(areas[group], count)] for group in reached]
    sampled = [chosen[areas[chosen] > 0] for chosen in sampled]
    chosen = np.concatenate(sampled)
    inside = _solid_on_both_sides(points, corners[chosen], vectors[chosen], shells)
    verdicts = np.split(inside, np.cumsum([len(asked) for asked in sampled])[:-1])
    whole, single = [], [np.zeros(0, np.int64)]
    for group, asked, verdict in zip(reached, sampled, verdicts, strict=True):
        if len(verdict) and verdict.all():
            whole.append(group)
        else:
            single.append(asked[verdict])
    return Interior(tuple(whole), np.sort(np.concatenate(single)), len(suspects) - len(reached))


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


def _solid_on_both_sides(points, corners, vectors, shells) -> NDArray[np.bool_]:
    """(f,) for faces with corners (f, 3, 3) and area vectors (f, 3), twice their area long."""
    perimeter = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).sum(axis=1)
    length = np.linalg.norm(vectors, axis=1)
    # a thousandth of the inradius (2 A / perimeter): close enough to see nothing but this face between
    step = vectors / length[:, None] * (1e-3 * length / perimeter)[:, None]
    centroids = corners.mean(axis=1)
    front = winding_in_shells(centroids + step, points, shells)
    behind = winding_in_shells(centroids - step, points, shells)
    # the same sign on both sides: a face between a solid and its mirror image bounds both
    return (np.minimum(np.abs(front), np.abs(behind)) > SOLID) & (front * behind > 0)
