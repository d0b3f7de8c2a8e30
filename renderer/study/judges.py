"""Judges of a picture against another: errors, what the eye sees of them, and whether chance explains them.

Pictures are (h, w, 3) linear radiance. ``where`` (h, w) bool chooses pixels; all of them where it is None. No single
judge is enough: relMSE is blind to where errors are, FLIP to errors the eye forgives, z-tests to whatever is smaller
than the noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sss_tools.errors import InputError

Float64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

FLOOR = 0.01
"""Keeps dark pixels from ruling relative errors; in units of radiance (squared for relMSE), so pictures should be of
the order of 1."""
HISTOGRAM_BINS = 10


# ---- errors ----


def relative_mse(
    image: ArrayLike,
    reference: ArrayLike,
    reference_stderr: ArrayLike | None = None,
    where: Mask | None = None,
    floor: float = FLOOR,
) -> float:
    """relMSE = mean[(a - r)^2 / (r^2 + floor)] over pixels and channels.

    reference_stderr  (h, w, 3) standard error of the reference: its square is taken off the squared difference, so
                      that the result is the image's own error, and may be below zero by chance
    """
    a, r = _chosen(image, where), _chosen(reference, where)
    squared = (a - r) ** 2
    if reference_stderr is not None:
        squared = squared - _chosen(reference_stderr, where) ** 2
    return float((squared / (r * r + floor)).mean())


def symmetric_error(image: ArrayLike, reference: ArrayLike, where: Mask | None = None, floor: float = FLOOR) -> float:
    """Mean of |a - r| / ((a + r) / 2 + floor): too bright and too dark by the same factor count the same."""
    a, r = _chosen(image, where), _chosen(reference, where)
    return float((np.abs(a - r) / ((a + r) / 2 + floor)).mean())


def flip(image: ArrayLike, reference: ArrayLike, where: Mask | None = None) -> float:
    """Mean HDR-FLIP, 0 (the same to the eye) to 1, over the chosen pixels.

    What an eye sees that flips between the two at 67 pixels a degree, at the worst of several exposures, which the
    reference sets.

    Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics short papers.
    Raises InputError where the package flip-evaluator is missing.
    """
    try:
        import flip_evaluator
    except ImportError:
        raise InputError("FLIP", "needs the package flip-evaluator", "pip install 'sss-tools[peers]'") from None
    pictures = [np.ascontiguousarray(np.maximum(picture, 0), np.float32) for picture in (reference, image)]
    errors, _, _ = flip_evaluator.evaluate(*pictures, "HDR", applyMagma=False, computeMeanError=False)
    return float(_chosen(np.asarray(errors).reshape(pictures[0].shape[:2]), where).mean())


@dataclass(frozen=True)
class Bias:
    """A mean squared bias and the standard error of that estimate; below zero by chance."""

    squared: float
    stderr: float

    @property
    def size(self) -> float:
        """The bias, root mean square; zero where the estimate is below zero."""
        return float(np.sqrt(max(self.squared, 0.0)))


def cross_half_bias(
    first: ArrayLike,
    second: ArrayLike,
    reference: ArrayLike,
    reference_stderr: ArrayLike | None = None,
    where: Mask | None = None,
) -> Bias:
    """mean[(M1 - S)(M2 - S)]: the squared bias of a method from two independent halves of its samples.

    MSE = bias^2 + variance; the noise of the halves is independent and cancels in the product, that of the reference
    S does not: pass its standard error to have its square taken off. The stated error counts the spread over pixels
    and channels, which is right where their noise is independent.
    """
    s = _chosen(reference, where)
    products = (_chosen(first, where) - s) * (_chosen(second, where) - s)
    if reference_stderr is not None:
        products = products - _chosen(reference_stderr, where) ** 2
    return Bias(float(products.mean()), float(products.std(ddof=1) / np.sqrt(products.size)))


# ---- tests ----


def sidak(false_alarm: float, tests: int) -> float:
    """Level of each of ``tests`` that together raise a false alarm with probability ``false_alarm``.

        1 - (1 - false_alarm)^(1 / tests)

    Exact for independent tests, cautious for those that tend to agree (Sidak 1967, JASA 62:626).
    """
    return float(-np.expm1(np.log1p(-false_alarm) / tests))


@dataclass(frozen=True, eq=False)
class Estimate:
    """A picture with its noise.

    mean     (h, w, 3) radiance
    stderr   (h, w, 3) standard error of the mean
    samples  from which a pixel's standard error was estimated
    """

    mean: ArrayLike
    stderr: ArrayLike
    samples: int


def with_rare_samples(image: Estimate, samples: int, other: Estimate, other_samples: int) -> Estimate:
    """The picture with a standard error that does not forget rare bright samples it has not met.

    The larger of its own and of what the other picture's would be with as many samples a pixel. Where a few samples
    in a million carry much of the light, those who lack them are too dark and too sure of it, and z-tests raise false
    alarms at any rate. A longer picture has met them. Cautious where the other renderer samples worse.
    """
    scaled = np.asarray(other.stderr, float) * np.sqrt(other_samples / samples)
    return Estimate(image.mean, np.maximum(image.stderr, scaled), image.samples)


@dataclass(frozen=True, eq=False)
class TileTest:
    """Whether chance explains the differences of two pictures, tile by tile.

    corner      (k, 2) top row and left column of each tile
    difference  (k, 3) of the tiles' means, relative to the reference's
    noise       (k, 3) standard error of that, with the noise of both
    z, p        (k, 3) Welch's statistic and its two-sided p-value
    level       p-value below which a tile raises an alarm
    uniformity  (3,) p-values of the chi-square tests that each channel's p are spread evenly over [0, 1], which sees
                many small errors; NaN for too few tiles
    false_alarm of the whole family: tiles, channels and histograms
    """

    corner: NDArray[np.intp]
    difference: Float64
    noise: Float64
    z: Float64
    p: Float64
    level: float
    uniformity: Float64
    false_alarm: float

    @property
    def agrees(self) -> bool:
        """Whether no test of the family raises an alarm; values that are not finite do."""
        return bool((self.p >= self.level).all() and not (self.uniformity < self.level).any())

    @property
    def detects(self) -> float:
        """Relative error that every single tile would show with probability 0.95: the noisiest tile's."""
        from scipy import special

        return float((special.ndtri(1 - self.level / 2) + special.ndtri(0.95)) * self.noise.max())

    def summary(self) -> str:
        """What was found, in a line."""
        worst = np.unravel_index(np.argmin(np.nan_to_num(self.p, nan=-1)), self.p.shape)
        row, column = self.corner[worst[0]]
        uniform = ", ".join(f"{p:.2g}" for p in self.uniformity)
        return (
            f"{len(self.p)} tiles: worst z {self.z[worst]:.2f} (p {self.p[worst]:.2g}, alarm below {self.level:.2g}) "
            f"at row {row}, column {column}, channel {worst[1]}, {100 * self.difference[worst]:+.2f} +- "
            f"{100 * self.noise[worst]:.2f} %; chi-square of p-values: p = {uniform}; family-wise false alarms "
            f"{self.false_alarm:.2g}"
        )


def compare_tiles(
    image: Estimate, reference: Estimate, where: Mask | None = None, size: int = 8, false_alarm: float = 1e-3
) -> TileTest:
    """Welch's t-test of each tile of ``size`` x ``size`` pixels, with the noise of both pictures.

    Tiles of which ``where`` has at least half are tested, over the pixels it has. The degrees of freedom of a tile's
    variance are those of the sum over its pixels (Satterthwaite 1946), pixels taken as independent.

    Blind to errors below ``TileTest.detects``, and to rare bright samples that neither picture has met yet: standard
    errors are estimates, too small before such samples come. Jung et al. 2020, "Detecting Bias in Monte Carlo
    Renderers using Welch's t-test", JCGT 9(2); Subr & Arvo 2007, "Statistical Hypothesis Testing for Assessing Monte
    Carlo Estimators".

    Raises ValueError for pictures of different shapes, and where no tile is left.
    """
    from scipy import stats

    a, r = np.asarray(image.mean, float), np.asarray(reference.mean, float)
    if a.shape != r.shape or a.ndim != 3:
        raise ValueError(f"pictures of shapes {a.shape} and {r.shape}")
    mask = np.ones(a.shape[:2], bool) if where is None else np.asarray(where, bool)
    pixels = _tiles(mask[..., None].astype(float), size)[..., 0]
    chosen = pixels >= size * size / 2
    if not chosen.any():
        raise ValueError(f"no tile of {size} x {size} pixels has half of them chosen")

    def sums(values) -> Float64:
        return _tiles(np.where(mask[..., None], values, 0), size)[chosen]

    variances = [np.asarray(part.stderr, float) ** 2 for part in (image, reference)]
    variance = sums(variances[0] + variances[1])
    squares = sum(sums(v * v) / max(part.samples - 1, 1) for v, part in zip(variances, (image, reference), strict=True))
    total, difference = sums(r), sums(a - r)
    with np.errstate(divide="ignore", invalid="ignore"):
        # without any noise a difference is certain, and no difference is no difference
        z = np.where((variance == 0) & (difference == 0), 0.0, difference / np.sqrt(variance))
        freedom = np.where(squares > 0, variance**2 / squares, np.inf)
        relative, noise = difference / total, np.sqrt(variance) / total
    p = 2 * stats.t.sf(np.abs(z), freedom)
    uniformity = np.array([uniform_p(p[:, k]) for k in range(3)])
    level = sidak(false_alarm, p.size + 3)
    return TileTest(size * np.argwhere(chosen), relative, noise, z, p, level, uniformity, false_alarm)


def uniform_p(p: ArrayLike, bins: int = HISTOGRAM_BINS) -> float:
    """p-value of Pearson's chi-square test that independent p-values are uniform over [0, 1]; NaN for fewer than
    five a bin."""
    from scipy import stats

    values = np.ravel(np.asarray(p, float))
    if len(values) < 5 * bins:
        return float("nan")
    counts, _ = np.histogram(values, bins, (0.0, 1.0))
    expected = len(values) / bins
    return float(stats.chi2.sf(((counts - expected) ** 2 / expected).sum(), bins - 1))


# ---- arrays ----


def _chosen(values: ArrayLike, where: Mask | None) -> Float64:
    array = np.asarray(values, float)
    return array if where is None else array[where]


def _tiles(values: Float64, size: int) -> Float64:
    """(rows, columns, ...) sums over tiles; tiles at the right and lower edges may be cut."""
    height, width = values.shape[:2]
    padded = np.pad(values, ((0, -height % size), (0, -width % size), (0, 0)))
    return padded.reshape(padded.shape[0] // size, size, padded.shape[1] // size, size, -1).sum(axis=(1, 3))
