"""Statistical assertions that state what they can see, and refuse to pass when they can see nothing.

Each takes ``false_alarm``, the probability that sound code fails on a fresh seed, and ``detects``, the error that
must be found with probability ``POWER``. Seeds are fixed in daily use, so that a failure repeats; set
SSS_TEST_SEED to another number for fresh ones.
"""

from __future__ import annotations

import os

import numpy as np
from scipy import stats

POWER = 0.95
"""Probability with which an error of the stated size is found."""

LEAST_EXPECTED = 5
"""Bins that expect fewer counts are pooled: below, chi-square's tail is not chi-square's (Cochran 1954)."""


def seed(number: int) -> int:
    """``number`` in daily use; another one, the same for the whole run, with SSS_TEST_SEED set."""
    return number + 1_000_003 * int(os.environ.get("SSS_TEST_SEED", "0"))


def shared_rate(false_alarm: float, tests: int) -> float:
    """The rate of each of ``tests`` independent tests that together raise a false alarm with ``false_alarm``.

    Sidak 1967, JASA 62:626.
    """
    return -np.expm1(np.log1p(-false_alarm) / tests)


def assert_mean(samples, expected: float, *, false_alarm: float, detects: float, what: str = "mean") -> None:
    """Two-sided test that the mean of independent samples is ``expected`` (Student's t).

    samples  (n,) numbers, or (mean, standard error, n)
    detects  error of the mean, in its own unit, that is found with probability ``POWER`` or more

    Fails too where the standard error is too large to see ``detects``, and for anything not finite.
    """
    mean, stderr, n = _summary(samples)
    if n < 2 or not np.isfinite([mean, stderr, expected]).all():
        raise AssertionError(f"{what}: mean {mean} with standard error {stderr} of {n} samples, expected {expected}")
    critical = stats.t.isf(false_alarm / 2, n - 1)
    visible = (critical + stats.t.isf(1 - POWER, n - 1)) * stderr
    error = mean - expected
    z = error / stderr if stderr > 0 else np.inf * np.sign(error) if error else 0.0
    facts = (
        f"{what}: {mean:.7g} +- {stderr:.2g} ({n} samples), expected {expected:.7g}: z = {z:.2f}, "
        f"alarm beyond {critical:.2f} (false alarms {false_alarm:.2g}); errors of {visible:.2g} are seen, "
        f"{detects:.2g} must be; SSS_TEST_SEED={os.environ.get('SSS_TEST_SEED', '0')}"
    )
    if visible > detects:
        raise AssertionError(f"too few samples to see what must be seen. {facts}")
    if abs(z) > critical:
        raise AssertionError(f"wrong mean. {facts}")


def _summary(samples) -> tuple[float, float, int]:
    if isinstance(samples, tuple):
        mean, stderr, n = samples
        return float(mean), float(stderr), int(n)
    values = np.asarray(samples, float)
    if values.ndim != 1:
        raise ValueError(f"samples must be (n,) or (mean, standard error, n), not of shape {values.shape}")
    n = len(values)
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(n)) if n > 1 else np.nan, n


def assert_distribution(observed, expected, *, false_alarm: float, detects: float, what: str = "counts") -> None:
    """Pearson's chi-square test that counts come from a distribution.

    observed  (k,) or (k, l) counts of independent samples
    expected  probabilities of the same bins, or anything in proportion to them
    detects   root mean square of the relative error of the probabilities, weighted by them, that is found with
              probability ``POWER`` or more (noncentrality n detects^2)

    Bins that expect fewer than ``LEAST_EXPECTED`` counts are pooled. Fails too for counts where none can be, and
    where there are too few samples to see ``detects``.
    """
    counts, weights = np.ravel(np.asarray(observed, float)), np.ravel(np.asarray(expected, float))
    if counts.shape != weights.shape or not np.isfinite(weights).all() or (weights < 0).any():
        raise ValueError(f"{counts.shape} counts against {weights.shape} probabilities, finite and not negative")
    total = counts.sum()
    impossible = counts[weights == 0].sum()
    if impossible:
        raise AssertionError(f"{what}: {impossible:g} of {total:g} samples where there can be none")
    counts, mean = _pooled(counts[weights > 0], weights[weights > 0] * (total / weights.sum()))
    if len(counts) < 2:
        raise AssertionError(f"{what}: {total:g} samples fill {len(counts)} bins, which tells nothing")
    freedom = len(counts) - 1
    statistic = float(((counts - mean) ** 2 / mean).sum())
    critical = stats.chi2.isf(false_alarm, freedom)
    power = stats.ncx2.sf(critical, freedom, total * detects**2)
    worst = int(np.argmax(np.abs(counts - mean) / np.sqrt(mean)))
    facts = (
        f"{what}: chi-square {statistic:.1f} of {freedom} degrees of freedom ({total:g} samples), p = "
        f"{stats.chi2.sf(statistic, freedom):.2g}, alarm beyond {critical:.1f} (false alarms {false_alarm:.2g}); a "
        f"relative error of {detects:.2g} is seen with probability {power:.3f}; worst bin {worst}: {counts[worst]:g} "
        f"for {mean[worst]:.1f}; SSS_TEST_SEED={os.environ.get('SSS_TEST_SEED', '0')}"
    )
    if power < POWER:
        raise AssertionError(f"too few samples to see what must be seen. {facts}")
    if statistic > critical:
        raise AssertionError(f"wrong distribution. {facts}")


def _pooled(counts, mean):
    """Bins in ascending order of what they expect, the small ones put together until each expects enough."""
    order = np.argsort(mean, kind="stable")
    counts, mean = counts[order], mean[order]
    small = int(np.searchsorted(mean, LEAST_EXPECTED))
    if small == 0:
        return counts, mean
    group = np.floor(np.cumsum(mean[:small]) / (2 * LEAST_EXPECTED)).astype(int)
    pooled_counts, pooled_mean = np.bincount(group, counts[:small]), np.bincount(group, mean[:small])
    filled = pooled_mean > 0
    counts = np.concatenate([pooled_counts[filled], counts[small:]])
    mean = np.concatenate([pooled_mean[filled], mean[small:]])
    # groups at the ends may still be short: into their neighbours
    while len(mean) > 1 and mean.min() < LEAST_EXPECTED:
        k = int(mean.argmin())
        to = k - 1 if k == len(mean) - 1 else k + 1
        counts[to] += counts[k]
        mean[to] += mean[k]
        counts, mean = np.delete(counts, k), np.delete(mean, k)
    return counts, mean
