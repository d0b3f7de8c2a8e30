"""How benchmarks/against_mitsuba.py turns short runs into seconds to an error."""

import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
SHAPE = (10, 20, 3)


@pytest.fixture
def reckoning(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import against_mitsuba

    yield against_mitsuba
    for name in ("against_mitsuba", "first_figures", "peer_scenes"):
        sys.modules.pop(name, None)


def run(sigma, rate, setup=1.0, mean=0.5, seconds=10.0):
    """A run whose every pixel has the same relative noise."""
    return {
        "mean": np.full(SHAPE, mean), "variance": np.full(SHAPE, (sigma * mean) ** 2), "samples": rate * seconds,
        "freedom": 1000, "object_pixels": np.ones(SHAPE[:2], bool), "setup": setup, "setup_cpu": setup,
        "render": seconds, "cpu": 2 * seconds, "memory": 10**8,
    }  # fmt: skip


def compared(reckoning, reference=None):
    runs = {reckoning.OURS: [run(1.0, 50)], **{kind: [run(2.0, 20)] for kind in reckoning.PEERS}}
    return reckoning.Comparison(runs, reference)


def test_seconds_are_setup_and_the_samples_that_two_percent_needs(reckoning):
    figures = compared(reckoning).figures(reckoning.OURS)
    # (1 / 0.02)^2 = 2500 samples a pixel
    for measure in ("rms", "mean"):
        assert figures.seconds(measure) == pytest.approx(1 + 2500 / 50, rel=1e-3)  # c4 of a thousand
        assert figures.seconds(measure, cpu=True) == pytest.approx(1 + 2500 / 25, rel=1e-3)


def test_ratio_is_that_to_the_fastest_peer(reckoning):
    comparison = compared(reckoning)
    comparison.runs["llvm_ad_rgb 64"] = [run(2.0, 40)]
    assert comparison.best("rms") == "llvm_ad_rgb 64"
    assert reckoning.Row("scene", comparison).ratio("rms") == pytest.approx((1 + 10000 / 40) / 51)


def test_peer_whose_rare_samples_are_missing_does_not_count(reckoning):
    """Too dark by a tenth with noise of a thousandth; and noise that a few pixels have all of."""
    comparison = compared(reckoning)
    comparison.runs["scalar_rgb 5"] = [run(0.5, 1000, mean=0.45)]
    peaked = run(0.5, 1000)
    peaked["variance"][0, 0] *= 1000
    comparison.runs["scalar_rgb 64"] = [peaked]
    assert [kind for kind in reckoning.PEERS if not comparison.trusted(kind)] == ["scalar_rgb 5", "scalar_rgb 64"]
    assert comparison.best("rms") not in ("scalar_rgb 5", "scalar_rgb 64")


def test_noise_is_relative_to_the_reference_where_there_is_one(reckoning):
    figures = compared(reckoning, np.full(SHAPE, 0.25)).figures(reckoning.OURS)
    assert figures.sigma["rms"] == pytest.approx(2.0)
