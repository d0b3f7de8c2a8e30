"""The film: what all camera samples so far add up to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import passes
from .passes import Ranges

Float64 = NDArray[np.float64]

MOST_PIXELS = 2**26
"""A film keeps some 60 bytes a pixel: 4 GB at this size, 8192 x 8192."""

_LONGEST_TEXT = 1024
"""Bytes."""

_ARRAYS = ("sum", "sum_of_squares", "hits", "left_out", "biased")
_UNEVEN_ARRAYS = ("skipped", "resting")
"""In files only of films whose pixels do not all take part in all passes."""


@dataclass(eq=False)
class Film:
    """Sums over camera samples; a pass is one sample in every pixel that takes part in it.

    Arrays are (h, w, ...), row 0 on top.

    scene_hash      of the scene that the samples are of
    seed            of the random numbers
    sum             (h, w, 3) float64, of radiance
    sum_of_squares  (h, w, 3) float64, of squared radiance
    hits            (h, w) int32, samples that met a translucent object first
    left_out        (h, w) int32, samples with a channel that is NaN or infinite: counted, and not in the sums
    biased          (h, w) bool, pixels with samples of a shader whose standard error says nothing of its error
    skipped         (h, w) int32, passes that a pixel took no part in
    resting         (h, w) bool, pixels that take no part in the passes of the round under way (see ``adaptive``)
    ranges          the passes done

    Sums of n float64 numbers >= 0 are off by at most (n - 1) 1.1e-16 of their value, in whatever order they
    are added (Higham 2002, Accuracy and Stability of Numerical Algorithms, eq. 4.4); radiance and its square
    are exact in float64, coming from float32. So films of up to 4000 passes, split and merged in any way, agree
    to 1e-12 without relying on roundings to cancel, and far larger ones do in practice. Passes added to one
    film in the same order give the same bits.
    """

    scene_hash: str
    seed: int
    sum: Float64
    sum_of_squares: Float64
    hits: NDArray[np.int32]
    left_out: NDArray[np.int32]
    biased: NDArray[np.bool_]
    skipped: NDArray[np.int32]
    resting: NDArray[np.bool_]
    ranges: Ranges = ()

    @classmethod
    def blank(cls, resolution: tuple[int, int], scene_hash: str = "", seed: int = 0) -> Film:
        """A film without samples. ``resolution`` is (width, height)."""
        width, height = resolution
        flat, colour = (height, width), (height, width, 3)
        return cls(
            scene_hash,
            seed,
            sum=np.zeros(colour),
            sum_of_squares=np.zeros(colour),
            hits=np.zeros(flat, np.int32),
            left_out=np.zeros(flat, np.int32),
            biased=np.zeros(flat, bool),
            skipped=np.zeros(flat, np.int32),
            resting=np.zeros(flat, bool),
        )

    @property
    def passes(self) -> int:
        """How many passes are done."""
        return passes.count(self.ranges)

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height."""
        height, width = self.hits.shape
        return width, height

    @property
    def non_finite(self) -> int:
        """Samples left out, over all pixels."""
        return int(self.left_out.sum())

    def add_pass(
        self,
        index: int,
        radiance: NDArray[np.float32],
        hit: NDArray[np.bool_],
        biased: NDArray[np.bool_] | None = None,
        chosen: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add pass number ``index``.

        radiance  (h, w, 3) float32
        hit       (h, w) bool, whether the sample met a translucent object first
        biased    (h, w) bool, whether a biased shader made it; None: nowhere
        chosen    (h, w) bool, pixels that have a sample; None: all

        An interrupt leaves the film with the whole pass or without it. Raises ValueError for another shape and
        for a pass that was added before.
        """
        for name, array, shape in (("radiance", radiance, self.sum.shape), ("hit", hit, self.hits.shape)):
            if array.shape != shape:
                raise ValueError(f"{name} has shape {array.shape}, the film needs {shape}")
        ranges = passes.united(self.ranges, ((index, index + 1),))
        left_out = None
        # whether there are any is seldom asked in vain, and six times cheaper than where
        if not np.isfinite(radiance).all():
            finite = np.logical_and.reduce(np.isfinite(radiance), axis=-1)
            radiance = np.where(finite[..., None], radiance, np.float32(0))
            left_out = ~finite if chosen is None else ~finite & chosen
        if chosen is not None:
            radiance, hit = radiance * chosen[..., None], hit & chosen
        self._take(
            ranges,
            self.sum + radiance,
            self.sum_of_squares + np.square(radiance, dtype=np.float64),
            self.hits + hit,
            self.left_out if left_out is None else self.left_out + left_out,
            self.biased if biased is None else self.biased | biased,
            self.skipped if chosen is None else self.skipped + ~chosen,
            self.resting,
        )

    def merge(self, other: Film) -> None:
        """Add the passes of another film of the same scene, seed and size.

        Raises ValueError, saying what differs, for a film that does not belong to this one or has passes in
        common with it.
        """
        for name in ("resolution", "scene_hash", "seed"):
            mine, theirs = getattr(self, name), getattr(other, name)
            if mine != theirs:
                raise ValueError(f"the {name.replace('_', ' ')} differs: {mine} and {theirs}")
        self._take(
            passes.united(self.ranges, other.ranges),
            self.sum + other.sum,
            self.sum_of_squares + other.sum_of_squares,
            self.hits + other.hits,
            self.left_out + other.left_out,
            self.biased | other.biased,
            self.skipped + other.skipped,
            self.resting | other.resting,
        )

    def _take(self, ranges, total, squares, hits, left_out, biased, skipped, resting) -> None:
        # new arrays, put in place by plain assignments, between which no interrupt is delivered
        self.ranges, self.sum, self.sum_of_squares = ranges, total, squares
        self.hits, self.left_out, self.biased = hits, left_out, biased
        self.skipped, self.resting = skipped, resting

    def mean(self) -> Float64:
        """(h, w, 3) mean radiance; NaN in pixels without a sample."""
        return _ratio(self.sum, self.samples()[..., None])

    def stderr(self) -> Float64:
        """(h, w, 3) standard error of the mean, sqrt(s^2 / n) with the unbiased variance s^2.

        NaN in pixels with fewer than two samples, and in biased ones.
        """
        error = np.sqrt(_ratio(self.variance(), self.samples()[..., None]))
        error[self.biased] = np.nan
        return error

    def variance(self) -> Float64:
        """(h, w, 3) unbiased variance of a camera sample, biased or not; NaN in pixels with fewer than two samples."""
        n = self.samples()[..., None]
        # rounding can leave a few ulps below zero where all samples are equal
        return np.maximum(_ratio(self.sum_of_squares - self.sum * _ratio(self.sum, n), n - 1), 0)

    def _repr_png_(self) -> bytes | None:
        """How notebooks show it: the picture so far, as a PNG file would; None before the first pass."""
        if self.passes == 0:
            return None
        from .image import film_png

        return film_png(self)

    def object_pixels(self) -> NDArray[np.bool_]:
        """(h, w) pixels whose every camera sample met a translucent object first."""
        taken = self.passes - self.skipped
        return (self.hits == taken) & (taken > 0)

    def mean_relative_stderr(self) -> float:
        """Mean of stderr / mean over object pixels and channels.

        Means that are zero are left out, and so is what has no standard error; NaN where nothing remains.
        """
        where = self.object_pixels()
        mean, error = self.mean()[where], self.stderr()[where]
        usable = (mean > 0) & np.isfinite(error)
        return float((error[usable] / mean[usable]).mean()) if usable.any() else float("nan")

    def samples(self) -> NDArray[np.int32]:
        """(h, w) samples in the sums."""
        return np.int32(self.passes) - self.left_out - self.skipped

    def arrays(self) -> dict[str, NDArray]:
        """Everything needed to go on or to merge, for a file."""
        return {
            "film_scene_hash": np.array(self.scene_hash),
            "film_seed": np.array(str(self.seed)),
            "film_ranges": np.array(self.ranges, np.int64).reshape(-1, 2),
            **{f"film_{name}": getattr(self, name) for name in _ARRAYS},
            **{f"film_{name}": array for name in _UNEVEN_ARRAYS if (array := getattr(self, name)).any()},
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray]) -> Film:
        """The film that ``arrays`` were made of. Raises KeyError or ValueError for arrays of no film."""
        if arrays["film_hits"].ndim != 2 or not 0 < arrays["film_hits"].size <= MOST_PIXELS:
            raise ValueError(f"hits has shape {arrays['film_hits'].shape}")
        if any(arrays[name].ndim or arrays[name].nbytes > _LONGEST_TEXT for name in ("film_scene_hash", "film_seed")):
            raise ValueError("scene hash and seed are no short texts")
        even = np.zeros(arrays["film_hits"].shape)
        uneven = {"skipped": even.astype(np.int32), "resting": even.astype(bool)}
        film = cls(
            scene_hash=str(arrays["film_scene_hash"]),
            seed=int(str(arrays["film_seed"])),
            ranges=passes.checked(arrays["film_ranges"]),
            **{name: arrays[f"film_{name}"] for name in _ARRAYS},
            **{name: arrays.get(f"film_{name}", zeros) for name, zeros in uneven.items()},
        )
        blank = cls.blank(film.resolution)
        for name in (*_ARRAYS, *_UNEVEN_ARRAYS):
            array, like = getattr(film, name), getattr(blank, name)
            if array.shape != like.shape or array.dtype != like.dtype:
                raise ValueError(f"{name} is {array.dtype} of shape {array.shape}")
        film._check_sums()
        return film

    def _check_sums(self) -> None:
        """Raise ValueError for counts and sums that no passes add up to."""
        if self.passes > np.iinfo(np.int32).max:
            raise ValueError(f"{self.passes} passes are more than can be counted")
        for name in ("hits", "left_out", "skipped"):
            counts = getattr(self, name)
            if counts.min() < 0 or counts.max() > self.passes:
                raise ValueError(f"{name} has counts that {self.passes} passes cannot have")
        if (self.left_out + self.skipped > self.passes).any():
            raise ValueError("more samples are left out than there are")
        if not np.isfinite(self.sum).all() or not np.isfinite(self.sum_of_squares).all():
            raise ValueError("its sums are not finite")


def _ratio(numerator: NDArray, denominator: NDArray) -> Float64:
    """Numerator over denominator, NaN where the denominator is not above zero."""
    out = np.full(np.broadcast_shapes(numerator.shape, denominator.shape), np.nan)
    return np.divide(numerator, denominator, out=out, where=denominator > 0)
