"""How many passes are enough? The first ones of the picture itself tell how noisy path is, better than any prediction.

A picture whose passes the quality decides goes on in rounds, each at most three times as long as all before: at the end
of each the last paths walk alone, and the fewer rounds the better. After each round
the noise of a camera sample is measured over every object, and the picture is done when it has as many passes as its
most demanding object needs for its noise to be within its tolerance: surely so, at the upper end of what was measured.
What is decided depends on the samples alone, so it is the same for any threads. Stopping by the noise that was seen
favours pictures that happen to show little of it; the upper end outweighs that (``benchmarks/prediction.py``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .output.film import Film
from .render import Renderer
from .shaders.prediction import Error
from .shaders.selection import Plan, passes_within

FIRST, LEAST = 4, 2
"""Passes of the first round, at most: fewer say too little of rare bright samples; and at least: one says nothing."""
SURE = 2.5
"""Standard errors between the square of a measured noise and its bound: with half as many, 1 in 7 pictures would stop
too soon (``benchmarks/prediction.py``)."""
GROWTH = 4
"""Passes after a round are at most so many times those before."""
FEW_PIXELS, FEW_PATHS = 8, 32
"""Fewer pixels without edges, and fewer samples by path, tell nothing."""


def rounds(renderer: Renderer, planned: int) -> Iterator[tuple[int, int]]:
    """How many passes the film is to have after each round, and how many are expected in the end.

    planned  what is expected before the first; all there is where path lights nothing

    The film is to have them when the next round is asked for.
    """
    if not any("path" in plan.shares for plan in renderer.plans):
        yield planned, planned
        return
    needed, done = planned, renderer.film.passes
    while True:
        if done:
            needed = passes_needed(renderer.film, renderer.object_id, renderer.plans)
        last = next_round(done, needed)
        if last <= done:
            return
        yield last, needed
        done = max(last, renderer.film.passes)


def next_round(done: int, needed: int) -> int:
    """How many passes there are after the next round; ``done`` where there is none."""
    return max(done, min(max(needed, LEAST), max(GROWTH * done, FIRST)))


def passes_needed(film: Film, object_id: NDArray, plans: Sequence[Plan]) -> int:
    """As many as the most demanding object needs, by the noise seen so far; where none can be told, as it was planned.

    object_id  (h, w) index of the object in the middle of each pixel, -1 for none
    """
    return max((_needed(film, object_id == index, plan) for index, plan in enumerate(plans)), default=1)


def _needed(film: Film, where: NDArray[np.bool_], plan: Plan) -> int:
    if plan.noise_allowed is None:
        return plan.passes
    if not where.any():
        return 1  # behind others, or out of the picture
    noise = noise_seen(film, where, plan.shares["path"])
    return plan.passes if noise is None else passes_within(noise.bound, plan.noise_allowed)


def noise_seen(film: Film, where: NDArray[np.bool_], share: float = 1.0) -> Error | None:
    """Standard deviation of a camera sample over the mean, root mean square over the pixels ``where`` (h, w) of one
    object that path lights for a ``share`` of the samples, and what it hardly exceeds; None where too little is
    known."""
    filled = where & film.object_pixels()
    where = filled if filled.sum() >= FEW_PIXELS else where
    if film.passes < 2 or where.sum() < 2 or share * film.passes * where.sum() < FEW_PATHS:
        return None
    variance = film.variance()[where].mean(axis=1)
    variance = variance[np.isfinite(variance)]
    mean = float(film.mean()[where].mean())
    if len(variance) < 2 or not mean > 0:
        return None
    doubt = float(variance.std(ddof=1)) / len(variance) ** 0.5
    squared = float(variance.mean())
    # the mean is noisy as well
    lowest = max(mean - SURE * (squared / (film.passes * len(variance))) ** 0.5, mean / 2)
    return Error(squared**0.5 / mean, (squared + SURE * doubt) ** 0.5 / lowest)
