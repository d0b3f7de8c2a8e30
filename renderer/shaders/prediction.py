"""How wrong will each shader be? Predicted from how the object stands in the picture, calibrated by measurements.

The error of a shader is the root mean square of its difference from path over the object's pixels and channels, as a
share of the object's mean radiance. What was known before of balls and ellipsoids is the start,

    diffuse  (min(0.6, 1.6 tau^-1.35) min(1, 2 l_d / p) + shape) + 0.01
    plumb    ball(tau) + shape
    scalar   plumb + 0.3 unlit                   (+ in quadrature, tau = inradius over transport mean free path)

and a fit in the logarithm corrects it: error = start * exp(sum c_k f_k), with the features f_k of ``features``. The
coefficients, how far the fit is off and the factor that 19 of 20 cases stay below lie in ``prediction.json``, which
``benchmarks/calibrate_prediction.py`` writes and ``benchmarks/prediction.py`` judges on cases it has not seen. The
noise of path, the standard deviation of one camera sample, is predicted likewise from a start of 1.7.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .appearance import Appearance

FILE = Path(__file__).with_name("prediction.json")
FEATURES = ("one", "depth", "depth squared", "aspect", "unlit", "even", "absorbed", "roundness", "blur")
LEAST, MOST = 0.003, 5.0
"""Errors beyond these are not predicted: the first is the noise of the measurements."""
FAST_NOISE = 0.15
"""Standard deviation of one sample of a fast shader: edges, and the places on lights with an extent."""
START_NOISE = 1.7


@dataclass(frozen=True)
class Fit:
    """The correction of one start.

    coefficients  of ``FEATURES``
    scatter       standard deviation of measured over predicted, in the logarithm
    margin        factor on the prediction that 19 of 20 measured errors stay below
    """

    coefficients: tuple[float, ...]
    scatter: float
    margin: float


@dataclass(frozen=True)
class Error:
    """A predicted relative error, and a ``bound`` that it exceeds in one case of twenty."""

    error: float
    bound: float


def predicted_errors(look: Appearance) -> dict[str, Error]:
    """Error of each shader but path, by name."""
    return {name: _corrected(name, start, look) for name, start in starts(look).items()}


def predicted_noise(look: Appearance) -> Error:
    """Standard deviation of a camera sample of path over the mean radiance: root mean square over the object."""
    return _corrected("noise", START_NOISE, look)


def starts(look: Appearance) -> dict[str, float]:
    """The errors before the fit."""
    tau = max(look.depth, 1e-3)
    ball = float(np.interp(np.log(tau), np.log([0.5, 1, 2, 5]), [0.07, 0.045, 0.03, 0.014]))
    shape = next(error for limit, error in ((1.1, 0.03), (2, 0.15), (4, 0.25), (np.inf, 0.6)) if look.aspect <= limit)
    plumb = float(np.hypot(ball, shape))
    blur = min(1.0, 2 * look.diffusion / look.footprint)
    return {
        "diffuse": float(np.hypot(min(0.6, 1.6 * tau**-1.35) * blur, shape)) + 0.01,
        "scalar": float(np.hypot(plumb, 0.3 * look.unlit)),
        "plumb": plumb,
    }


def features(look: Appearance) -> NDArray[np.float64]:
    """(k,) what the corrections are linear in, see ``FEATURES``; bounded, so that none is far from all measured."""
    depth = np.log(np.clip(look.depth, 0.1, 100))
    return np.array([
        1.0,
        depth,
        depth**2,
        np.log(np.clip(look.aspect, 1, 10)),
        look.unlit,
        look.even,
        -np.log(np.clip(look.absorbed, 1e-3, 1)),
        -np.log(np.clip(look.roundness, 0.02, 1)),
        np.log(np.clip(2 * look.diffusion / max(look.footprint, 1e-30), 0.05, 1)),
    ])  # fmt: skip


def _corrected(name: str, start: float, look: Appearance) -> Error:
    fit = fits()[name]
    error = float(np.clip(start * np.exp(features(look) @ fit.coefficients), LEAST, MOST))
    return Error(error, error * fit.margin)


@cache
def fits() -> dict[str, Fit]:
    """What ``prediction.json`` holds."""
    stored = json.loads(FILE.read_text())
    return {
        name: Fit(tuple(fit["coefficients"][feature] for feature in FEATURES), fit["scatter"], fit["margin"])
        for name, fit in stored["fits"].items()
    }
