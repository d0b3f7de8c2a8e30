"""What each component is for: the body itself, a void in it, something buried in it, or a mere sheet."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .interior import Shell, winding_in_shells
from .parts import Parts
from .patches import patch_of_face
from .winding import spread_by_area

Role = Literal["solid", "cavity", "internal", "sheet"]

ASKED = 16
"""Patches of a component, the largest, that are asked whether they lie in another one."""


def find_roles(parts: Parts, intersecting: NDArray[np.int64]) -> tuple[list[Role], NDArray[np.bool_]]:
    """The role of each component, and which are solids turned inside out.

    What counts is how the *other* enclosing components wind round most of a component's area: with its own
    orientation it bounds a void (opposite signs) or lies in matter (equal signs).

    intersecting  (p, 2) pairs of faces that meet others
    """
    roles: list[Role] = ["sheet"] * parts.count
    inverted = np.zeros(parts.count, bool)
    numbers = np.flatnonzero(parts.encloses)
    patch = _patches_between_components(parts, intersecting)
    for number in numbers.tolist():
        apart = (parts.lower[numbers] > parts.upper[number]) | (parts.upper[numbers] < parts.lower[number])
        around = ~apart.any(axis=1) & (numbers != number)
        others = [parts.shells[index] for index in np.flatnonzero(around)]
        outside = _winding_round(parts, number, others, patch) if others else 0.0
        if abs(outside) < 0.5:
            roles[number] = "solid"
            inverted[number] = parts.sign[number] < 0
        else:
            roles[number] = "cavity" if outside * parts.sign[number] < 0 else "internal"
    return roles, inverted


def _patches_between_components(parts: Parts, intersecting: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m,) the patch of each face that meets no other component, -1 for the others."""
    component = parts.topology.component_of_face
    both = component[intersecting]
    return patch_of_face(parts.topology, np.unique(intersecting[both[:, 0] != both[:, 1]]))


def _winding_round(parts: Parts, number: int, others: list[Shell], patch: NDArray[np.int64]) -> float:
    """How the shells ``others`` wind round a component: the median over its area.

    All of a patch lies on one side of the others, so one of its faces speaks for it. Where there is one patch
    alone several are asked, as others with holes wind by a fraction; where every face is cut, there is none.
    """
    group = parts.groups[number]
    corners = parts.points[parts.faces[group]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.argsort(patch[group], kind="stable")
    pieces = np.split(order, np.flatnonzero(np.diff(patch[group][order])) + 1)
    whole = [piece for piece in pieces if patch[group[piece[0]]] >= 0]
    each = 1 if len(whole) > 1 else 5 if whole else ASKED
    whole = sorted(whole or [np.arange(len(group))], key=lambda piece: -areas[piece].sum())[:ASKED]
    asked = [piece[spread_by_area(areas[piece], each)] for piece in whole]
    weight = np.concatenate(
        [np.full(len(one), areas[piece].sum() / len(one)) for one, piece in zip(asked, whole, strict=True)]
    )
    winding = winding_in_shells(corners[np.concatenate(asked)].mean(axis=1), parts.points, others)
    order = np.argsort(winding, kind="stable")
    middle = np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)
    return float(winding[order[min(middle, len(order) - 1)]])
