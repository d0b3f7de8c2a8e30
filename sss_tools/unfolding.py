"""What a small file may unfold to: archives, references and repetition multiply, and a stranger chooses the factor.

The bound is the same everywhere: a fixed amount that no machine minds, or a factor of what was really sent, where that
is more. Everything here raises ValueError, with the rest of a sentence about the file.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Any

MOST_TEXT = 64 * 2**20
"""Bytes of text (XML) that any file may unfold to; trees of text take ten times their length."""

MOST_GEOMETRY = 256 * 2**20
"""Bytes of coordinates and indices that any file may unfold to."""

MOST_IMAGE = 512 * 2**20
"""Bytes of pixels that any file may unfold to: 8192 x 4096 of three float32, and some."""

FACTOR = 100
"""Times its own size that a large file may unfold to. Deflated meshes in XML reach 10 to 30."""

MOST_NODES = 100_000
"""Placements of bodies; each takes some 100 microseconds."""

MOST_LEVELS = 256
"""Nodes inside each other. Modellers stay below 50."""


def check_text(unfolded: int, size: int) -> None:
    """Refuse so many bytes of text in a file of ``size`` bytes."""
    _check(unfolded, size, MOST_TEXT, "text")


def check_geometry(unfolded: int, size: int) -> None:
    """Refuse so many bytes of geometry in a file of ``size`` bytes."""
    _check(unfolded, size, MOST_GEOMETRY, "geometry")


def check_image(unfolded: int, size: int) -> None:
    """Refuse so many bytes of pixels in a file of ``size`` bytes."""
    _check(unfolded, size, MOST_IMAGE, "pixels")


def _check(unfolded: int, size: int, free: int, what: str) -> None:
    most = max(free, FACTOR * size)
    if unfolded > most:
        raise ValueError(f"its {size} bytes unfold to {unfolded} bytes of {what}, more than {most}")


def check_tree(
    roots: Iterable[Hashable],
    children: Callable[[Any], Iterable[Hashable]],
    weight: Callable[[Any], int] = lambda node: 0,
) -> int:
    """The total weight of all places a graph unfolds to, each node counted as often as a way leads to it.

    Refuses nodes that contain themselves, more than ``MOST_LEVELS`` levels, and more than ``MOST_NODES`` places.
    """
    # places below and including each node, levels, weight; None while its children are looked at
    known: dict[Hashable, tuple[int, int, int] | None] = {}
    places = total = 0
    for root in roots:
        stack = [root]
        while stack:
            node = stack[-1]
            below = list(children(node))
            if node not in known:
                known[node] = None
                stack += [child for child in below if child not in known]
                if any(child in known and known[child] is None for child in below):
                    raise ValueError("a node of its scene contains itself")
                continue
            stack.pop()
            if known[node] is None:
                parts = [part for child in below if (part := known[child]) is not None]
                known[node] = (
                    1 + sum(part[0] for part in parts),
                    1 + max((part[1] for part in parts), default=0),
                    weight(node) + sum(part[2] for part in parts),
                )
        found = known[root]
        assert found is not None
        places, total = places + found[0], total + found[2]
        if found[1] > MOST_LEVELS:
            raise ValueError(f"its scene has {found[1]} levels of nodes, more than {MOST_LEVELS}")
        if places > MOST_NODES:
            raise ValueError(f"its scene unfolds to more than {MOST_NODES} nodes")
    return total
