"""How wrong will each shader be? Predicted from how the object stands in the picture, by a fit to measurements.

The error of a shader is the root mean square of its difference from path over the object's pixels and channels, as a
share of the object's mean radiance; the noise of path is the standard deviation of one camera sample, likewise. Both
are predicted as

    START * exp(sum c_k f_k)

with the features f_k of ``features``. The coefficients, how far the fit is off and the factor with which 19 of 20
choices prove right lie in ``prediction.json``, which ``benchmarks/calibrate_prediction.py`` writes and
``benchmarks/prediction.py`` judges on cases it has not seen. Formulas of balls and ellipsoids in place of the constant
start, with steps by aspect, made the fit worse: a scatter of 0.72 in place of 0.58 in the logarithm.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .appearance import Appearance

FILE = Path(__file__).with_name("prediction.json")
FEATURES = (
    "one", "depth", "depth squared", "thin", "unlit", "even", "absorbed", "blur", "forward", "backward", "sharp",
    "concave", "shaped", "open", "matched", "index", "extended", "light near", "view near", "unlit depth",
    "unlit flatness", "even depth", "even thin", "even flatness", "uneven depth",
)  # fmt: skip
SURE = 1.645
"""Standard errors between a measured square and its bound: 19 of 20 are below."""
LEAST, MOST = 0.003, 10.0
"""Errors beyond these are not predicted: the first is the noise of the measurements."""
FAST_NOISE = 0.15
"""Standard deviation of one sample of a fast shader: edges, and the places on lights with an extent."""
START = {"diffuse": 0.3, "scalar": 0.1, "plumb": 0.1, "noise": 1.7}
"""Where nothing was measured."""


@dataclass(frozen=True)
class Fit:
    """What one prediction is made of.

    coefficients  of ``FEATURES``
    scatter       standard deviation of measured over predicted, in the logarithm
    margin        factor on the prediction that makes the bound: of fast shaders that with which 19 of 20 choices are
                  within the tolerance, of noise that which 9 of 10 cases do not exceed
    """

    coefficients: tuple[float, ...]
    scatter: float
    margin: float


@dataclass(frozen=True)
class Error:
    """A relative error, and the ``bound`` that is held against the tolerance.

    doubt  standard error of the error's square, where it was measured
    """

    error: float
    bound: float
    doubt: float = 0.0

    @property
    def squared(self) -> float:
        """The error's square; where it was measured the estimate without bias, which may be below zero by chance."""
        return self.bound**2 - SURE * self.doubt if self.doubt else self.error**2


def predicted_errors(look: Appearance, by: Mapping[str, Fit] | None = None) -> dict[str, Error]:
    """Error of each shader but path, by name, after the fit ``by``; None: the one that is stored."""
    return {name: _predicted(name, look, by) for name in ("diffuse", "scalar", "plumb")}


def predicted_noise(look: Appearance, by: Mapping[str, Fit] | None = None) -> Error:
    """Standard deviation of a camera sample of path over the mean radiance: root mean square over the object."""
    return _predicted("noise", look, by)


def features(look: Appearance) -> NDArray[np.float64]:
    """(k,) what the logarithms are linear in, see ``FEATURES``; bounded, so that none is far from all measured."""
    depth = np.log(np.clip(look.depth, 0.05, 200))
    thin = max(-depth, 0.0)
    flatness = -np.log(np.clip(look.roundness, 0.02, 1))
    sharp, concave = look.sharp**0.5, look.concave**0.5
    return np.array([
        1.0,
        depth,
        depth**2,
        thin,
        look.unlit,
        look.even,
        -np.log(np.clip(look.absorbed, 1e-3, 1)),
        np.log(np.clip(2 * look.diffusion / max(look.footprint, 1e-30), 0.05, 1)),
        -np.log(1 - np.clip(look.g, 0, 0.97)),
        float(np.clip(-look.g, 0, 1)),
        sharp,
        concave,
        max(sharp, concave, min(flatness, 1.0)),
        min(look.open, 0.25) ** 0.5,
        float(look.ior < 1.05),
        np.log(np.clip(look.ior, 1, 3)),
        look.extended,
        float(np.clip(look.light_near - 0.9, 0, 1)),
        min(look.view_near, 2.0),
        look.unlit * depth,
        look.unlit * flatness,
        look.even * depth,
        look.even * thin,
        look.even * flatness,
        abs(look.g) * depth,
    ])  # fmt: skip


def _predicted(name: str, look: Appearance, by: Mapping[str, Fit] | None) -> Error:
    fit = (by or fits())[name]
    error = float(np.clip(START[name] * np.exp(features(look) @ fit.coefficients), LEAST, MOST))
    return Error(error, error * fit.margin)


@cache
def fits() -> dict[str, Fit]:
    """What ``prediction.json`` holds."""
    return parsed(json.loads(FILE.read_text())["fits"])


def parsed(stored: Mapping[str, dict]) -> dict[str, Fit]:
    """Fits as the file has them."""
    return {
        name: Fit(tuple(fit["coefficients"][feature] for feature in FEATURES), fit["scatter"], fit["margin"])
        for name, fit in stored.items()
    }
