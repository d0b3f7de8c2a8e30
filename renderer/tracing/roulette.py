"""Russian roulette: faint paths end, and those that survive make up for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .paths import Paths
from .streams import Uniforms

FREE_SURFACES, MANY_SURFACES = 3, 256
LASTING = np.float32(0.9)
MANY_STEPS = 2**14


def walks_are_long(inradius: float, g: float) -> bool:
    """Whether walks in a body of so many mean free paths, at most, may take more than ``MANY_STEPS``: the slowest ones
    in a ball, by diffusion, end at a rate of one in 3 (1 - g) (R / pi)^2 steps."""
    return 3 * (1 - g) * (inradius / np.pi) ** 2 > MANY_STEPS


def play_at_collisions(paths: Paths, uniforms: Uniforms, long_walks: bool) -> None:
    """Paths below their threshold f survive with probability w/(2 f), w their largest channel, then weigh 2 f.

    So do, where walks are long, half of those with so many steps behind them as ``MANY_STEPS`` or a power of two times
    that: a walk that sets out from the surface of a white body takes more than n steps with a probability in proportion
    to 1/sqrt(n), until n is the square of the body's size in mean free paths. All would wait for the last, which takes
    millions in a large body. Where a share s of the paths has ``MANY_STEPS``, weights then have a variance of
    3.4 s sqrt(n / MANY_STEPS) at most, n being that square.
    """
    paths.steps += 1
    largest = np.maximum.reduce(paths.throughput, axis=0)
    index = ((largest < paths.faint) & ~paths.flies_on).nonzero()[0]
    _survive(paths, uniforms, index, largest[index] / (2 * paths.faint[index]))
    if long_walks:
        due = ((paths.steps >= MANY_STEPS) & (paths.steps & (paths.steps - 1) == 0)).nonzero()[0]
        _survive(paths, uniforms, due, np.full(len(due), np.float32(0.5)))


def play_at_surfaces(paths: Paths, uniforms: Uniforms) -> None:
    """The same from the fourth surface in a row on, so that a single reflection stays free of noise.

    Light that 256 surfaces keep inside a clear body without a collision would circle for ever: it goes on with
    probability 0.9 a time.
    """
    index = np.flatnonzero(paths.surfaces > FREE_SURFACES)
    if not len(index):
        return
    largest, faint = np.maximum.reduce(paths.throughput[:, index], axis=0), paths.faint[index]
    chance = np.where(largest < faint, largest / (2 * np.maximum(faint, np.float32(1e-30))), 1)
    np.minimum(chance, LASTING, out=chance, where=paths.surfaces[index] > MANY_SURFACES)
    endangered = chance < 1
    _survive(paths, uniforms, index[endangered], chance[endangered])


def _survive(paths: Paths, uniforms: Uniforms, index: NDArray[np.intp], chance: NDArray[np.float32]) -> None:
    """Let the paths ``index`` live with the given probability, and divide by it."""
    if not len(index):
        return
    u, _ = uniforms.draw_at(paths.stream, index)
    lives = u < chance
    paths.alive[index[~lives]] = False
    paths.throughput[:, index[lives]] /= chance[lives]
