"""Which pixels take part in which passes: the noisy ones in more, without bias.

A mean over a number of samples that was chosen by these very samples is biased. Here other pixels choose. Each pixel
of a square of ``CLASSES`` belongs to a class; what class c of a tile does in the next round is decided by the samples
of class c + 1 in that tile, modulo the number of classes. Camera samples of two pixels are independent. So after r
decisions a pixel's number of samples depends on those of the r next classes, and on its own only after as many
decisions as there are classes: no more than one fewer are made. The mean of every pixel, and its standard error, are
as free of bias as with equal numbers of samples.

The mean over pixels of e_i(n_i), relative standard errors that fall with the root of the number of samples n_i, is
least for a given sum of n_i where all -de_i/dn_i = e_i / (2 n_i) are equal. A tile rests for a round where its
e_i / n_i is less than half of the mean, itself weighted by e_i / n_i so that few noisy tiles set the measure. The noise
of a sample is the next class's, the number of samples one's own: other classes have chosen it.

Tiles without any standard error, those of biased shaders, never rest.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from itertools import chain, groupby

import numpy as np
from numpy.typing import NDArray

from .output.film import Film

CLASSES = 5
"""Classes along each side of a square: 25 of them, which allow 24 decisions, the last after 24 576 passes."""
TILE = 20
"""Pixels along a tile: 16 pixels of each class, times three channels, tell its noise to 10 to 20 %."""
PILOT = 8
"""Passes before the first decision."""
LEAST_SHARE = 16
"""Nobody rests with fewer samples than one in so many passes: noise that showed in no pixel of a class may yet
come."""


_ENDS = [PILOT * 2 ** (k // 2) * (3 if k % 2 else 2) // 2 for k in range(CLASSES**2 - 1)]


def rounds(passes: Iterable[int]) -> Iterator[tuple[Iterator[int], bool]]:
    """The passes, ascending, by rounds, and whether a decision is due before each; lazily.

    Rounds end after 8, 12, 16, 24, 32, 48, ... passes, always the same, whichever passes are done when.
    """
    for number, part in groupby(passes, lambda index: bisect_right(_ENDS, index)):
        first = next(part)
        yield chain([first], part), number > 0 and first == _ENDS[number - 1]  # noqa: B031  used once, in two pieces


def resting(film: Film, target: float | None = None) -> NDArray[np.bool_]:
    """(h, w) the pixels that sit out the next round, after what the film holds.

    target  relative standard error with which a tile has enough, while the picture has not
    """
    noise, taken = _of_classes(film)
    noise = np.roll(noise, -1, axis=0)  # the next class speaks, and the samples are one's own
    known = np.isfinite(noise)
    error = np.where(known, noise, 0) / np.sqrt(np.maximum(taken, 1))
    need = error / np.maximum(taken, 1)
    # of each class by itself: a mean over all classes would tell a pixel of its own samples
    rests = known & (need < _weighted_mean(need, need) / 2)
    if target is not None:
        rests |= known & (error <= target) & (_weighted_mean(error, known) > target)
    scarce = taken * LEAST_SHARE < film.passes
    return _to_pixels(rests & ~scarce, film.hits.shape)


def _of_classes(film: Film) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(classes, rows, columns) mean relative deviation of a sample, NaN where it is not known, and samples of a pixel.

    The deviation is of object pixels where there are any, as ``Film.mean_relative_stderr`` has it.
    """
    mean, error = film.mean(), film.stderr()
    samples = film.samples()
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = np.where(mean > 0, error / mean, np.where(error == 0, 0, np.nan)).mean(axis=-1)
    relative *= np.sqrt(samples)
    usable = np.isfinite(relative)
    of_object = usable & film.object_pixels()
    of_object |= usable & (_to_pixels(_by_class(of_object) == 0, usable.shape))
    counts = _by_class(of_object)
    errors = _by_class(np.where(of_object, relative, 0))
    errors = np.divide(errors, counts, out=np.full(counts.shape, np.nan), where=counts > 0)
    return errors, _by_class(samples) / np.maximum(_by_class(np.ones(usable.shape)), 1)


def _weighted_mean(values: NDArray, weights: NDArray) -> NDArray[np.float64]:
    """(classes, 1, 1) mean over the tiles."""
    total = np.maximum(weights.sum(axis=(1, 2), keepdims=True), 1e-300)
    return (values * weights).sum(axis=(1, 2), keepdims=True) / total


def _by_class(values: NDArray) -> NDArray[np.float64]:
    """(classes, rows, columns) sums of (h, w) values over the pixels of each class in each tile."""
    height, width = values.shape
    padded = np.zeros((-(-height // TILE) * TILE, -(-width // TILE) * TILE))
    padded[:height, :width] = values
    rows, columns, step = padded.shape[0] // TILE, padded.shape[1] // TILE, TILE // CLASSES
    split = padded.reshape(rows, step, CLASSES, columns, step, CLASSES)
    return split.sum(axis=(1, 4)).transpose(1, 3, 0, 2).reshape(CLASSES**2, rows, columns)


def _to_pixels(values: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """(h, w) what is said of the class and tile of each pixel."""
    _, rows, columns = values.shape
    step = TILE // CLASSES
    split = values.reshape(CLASSES, CLASSES, rows, columns).transpose(2, 0, 3, 1)
    spread = np.broadcast_to(split[:, None, :, :, None, :], (rows, step, CLASSES, columns, step, CLASSES))
    return spread.reshape(rows * TILE, columns * TILE)[: shape[0], : shape[1]]
