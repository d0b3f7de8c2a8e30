"""Fits the predicted errors of plumb, scalar and diffuse, and the noise of path, to measurements.

    PYTHONPATH=. python benchmarks/calibrate_prediction.py [--cases N] [--seeds K...] [--meshes FOLDER] [--dry]
                                                           [--recentre]

Cases are drawn by ``prediction_cases.py`` and measured by pilots (see ``renderer/pilot.py``); points of the stability
studies join them, which stand alone at the ends of their axes. What was measured is kept in out/prediction/, so that
the script can be ended and goes on. Remove that folder when a shader has changed.

The logarithm of each prediction is linear in few features; a ridge keeps the coefficients of what was hardly measured
near zero, and what can only do harm never makes a prediction smaller. Many errors are hardly told from noise: the fit
takes each for what it is expected to be, given its measurement and the fit before (Dempster et al. 1977, EM). Residuals
are those of cases left out one at a time.
Writes ``renderer/shaders/prediction.json``; ``--dry`` only prints it. ``--recentre`` keeps what is stored but for the
constants of the fast shaders, which it sets so that half of the cases whose errors are well told are more wrong than
predicted, and the margin, which it takes from all cases: best from such as the stored fit has not seen.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from benchmarks.prediction_cases import STORE, Case, measured_cases
from renderer.scene.admission import admit
from renderer.scene.scene_file import load_scene
from renderer.shaders.appearance import Appearance, appearance
from renderer.shaders.prediction import (
    FEATURES,
    FILE,
    LEAST,
    MOST,
    START,
    SURE,
    Error,
    features,
    parsed,
    predicted_errors,
)
from renderer.shaders.selection import Demand, shares_of
from renderer.study.stability_bench import QUICK, Bench
from renderer.study.studies import STUDIES

SHADERS = ("diffuse", "scalar", "plumb")
RIDGE = 1.0
QUALITIES = np.linspace(0, 0.8, 17)
CONFIDENCE, NOISE_CONFIDENCE = 0.96, 0.9
"""Of choices by the fit: a little more than 19 of 20, as others are somewhat worse than those it is made of."""
WELL_TOLD = 0.3
"""Standard error of a squared error, over it, up to which it tells where the middle is: others are mostly noise."""
HARMFUL = ("thin", "forward", "backward", "sharp", "concave", "shaped", "open", "light near", "view near")
GRID = np.linspace(np.log(LEAST), np.log(MOST), 120)
TURNS = 8
ANCHORS = {
    "mean-free-path": (0.001, 0.003, 0.03, 0.1, 0.3, 1.0, 10.0),
    "g": (-0.9, -0.5, 0.0, 0.5, 0.8, 0.97),
    "noise": (0.03, 0.2, 0.4, 0.8),
    "hole-position": (0.0,),
    "view-distance": (0.6, 1.0),
    "light-distance": (0.2, 1.05, 1.2, 2.0, 16.0),
    "terminator": (60.0, 120.0, 150.0),
    "ior": (1.0, 2.4),
    "corner": (20.0, 90.0),
    "wall": (1.0, 4.0, 16.0),
    "aspect": (1.5, 4.0, 16.0),
    "albedo": (0.5, 0.01, 1e-4),
}
"""Studies and values."""
EACH_ANCHOR = 4
"""Cases that each counts for: where an axis ends there are no others."""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200, help="of each seed")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--meshes", type=Path, help="folder with further meshes, of which it takes those it knows")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=0.5, help="of CPU for each half of path's pictures")
    parser.add_argument("--dry", action="store_true")
    parser.add_argument("--recentre", action="store_true", help="set constants and margin alone")
    options = parser.parse_args()
    cases = []
    drawn = (
        measured_cases(seed, options.cases, options.meshes, options.threads, options.seconds) for seed in options.seeds
    )
    for case in chain.from_iterable(drawn):
        cases.append(case)
        errors = ", ".join(f"{name} {100 * error.error:.2g} %" for name, error in case.measured.errors.items())
        print(f"{case.number} {case.name} {case.look.size_px:.3g} px, tau {case.look.depth:.3g}: {errors}", flush=True)
    if options.recentre:
        stored = recentred(json.loads(FILE.read_text()), cases)
    else:
        fixed = anchors()
        stored = {"cases": len(cases), "anchors": len(fixed), "fits": fitted(cases, fixed)}
    text = json.dumps(stored, indent=1) + "\n"
    print(text)
    if not options.dry:
        FILE.write_text(text)


def anchors() -> list[tuple[Appearance, Mapping[str, Error]]]:
    """Points of the stability studies, and what the fast shaders are wrong by there."""
    bench, found = Bench(STORE / "stability", QUICK), []
    (bench.folder / "scenes").mkdir(parents=True, exist_ok=True)
    for name, values in ANCHORS.items():
        for value in values:
            step = bench.step(STUDIES[name], value)
            scene, _ = admit(load_scene(STUDIES[name].scene(value).write(bench.folder / "scenes", f"{name}-{value:g}")))
            errors = {}
            for outcome in (step.outcome(shader) for shader in SHADERS):
                squared, doubt = outcome.here_squared_bias, outcome.here_stderr
                error, bound = (max(squared + more * doubt, doubt) ** 0.5 for more in (0, SURE))
                errors[outcome.method] = Error(error, bound, doubt)
            found.append((appearance(scene, scene.objects[0]), errors))
    return found


def fitted(cases: list[Case], fixed: Sequence[tuple[Appearance, Mapping[str, Error]]] = ()) -> dict[str, dict]:
    """Each prediction, with its residuals over ``cases``; ``fixed`` (see ``anchors``) join the fits of shaders."""
    fits: dict[str, dict] = {}
    predicted: dict[str, np.ndarray] = {}
    for name in (*SHADERS, "noise"):
        looks = [case.look for case in cases]
        found = [case.measured.noise if name == "noise" else case.measured.errors[name] for case in cases]
        if name != "noise":
            looks += [look for look, _ in fixed] * EACH_ANCHOR
            found += [errors[name] for _, errors in fixed] * EACH_ANCHOR
        rows = np.array([features(look) for look in looks])
        wanted = expected(rows, found)
        coefficients = solved(rows, wanted)
        left_out = np.array([rows[k] @ solved(np.delete(rows, k, 0), np.delete(wanted, k)) for k in range(len(cases))])
        residuals = wanted[: len(cases)] - left_out
        predicted[name] = np.exp(left_out)
        coefficients[0] -= np.log(START[name])
        fits[name] = {
            "coefficients": dict(zip(FEATURES, (round(float(c), 4) for c in coefficients), strict=True)),
            "scatter": round(float(residuals.std()), 3),
            "margin": round(float(np.exp(np.quantile(residuals, NOISE_CONFIDENCE))), 3),
            "within_factor_2": round(float((np.abs(residuals) <= np.log(2)).mean()), 3),
            "residual_quantiles": {
                f"{q:g}": round(float(np.quantile(residuals, q)), 3) for q in (0.05, 0.25, 0.5, 0.75, 0.9, 0.95)
            },
        }
    least = margin(cases, predicted)
    for name in SHADERS:
        fits[name]["margin"] = least
    return fits


def recentred(stored: dict, cases: list[Case]) -> dict:
    """What is stored, its fast shaders' constants moved by the median of measured over predicted, all by the same, and
    with the margin that these cases ask for."""
    by = parsed(stored["fits"])
    predicted = {name: np.array([predicted_errors(case.look, by)[name].error for case in cases]) for name in SHADERS}
    found = [(case.measured.errors[name], predicted[name][k]) for name in SHADERS for k, case in enumerate(cases)]
    told = [error.error / expected for error, expected in found if error.doubt < WELL_TOLD * error.squared]
    factor = float(np.median(told))
    least = margin(cases, {name: np.minimum(factor * predicted[name], MOST) for name in SHADERS})
    for name in SHADERS:
        fit = stored["fits"][name]
        fit["coefficients"]["one"] = round(fit["coefficients"]["one"] + float(np.log(factor)), 4)
        fit["margin"] = least
    return stored | {"recentred_by": {"cases": len(cases), "factor": round(factor, 3)}}


def margin(cases: list[Case], predicted: Mapping[str, np.ndarray]) -> float:
    """The least factor on predicted errors with which ``CONFIDENCE`` of the choices of fast shaders are within the
    tolerance, as they were measured, over ``QUALITIES``; each case predicted by a fit without it."""
    for factor in np.arange(1.0, 4.0, 0.05):
        within = []
        for k, case in enumerate(cases):
            for quality in QUALITIES:
                demand, size = Demand(quality), case.look.size_px
                shares = shares_of({name: factor * predicted[name][k] for name in SHADERS}, demand, size)
                if "path" not in shares:
                    errors = [(share, case.measured.errors[name]) for name, share in shares.items()]
                    squared = sum(share * error.squared for share, error in errors)
                    within.append(squared <= demand.tolerance(size) ** 2)
        if np.mean(within) >= CONFIDENCE:
            break
    return round(float(factor), 3)


def expected(rows: np.ndarray, found: Sequence[Error]) -> np.ndarray:
    """(n,) logarithms of the errors: the mean of each, given its square's measurement and a fit to all, in turns."""
    plain = np.log(np.clip([error.error for error in found], LEAST, MOST))
    squared, doubt = np.array([[error.squared, error.doubt] for error in found]).T
    doubtful = np.flatnonzero(doubt > 0)
    wanted, spread = plain.copy(), np.zeros(len(rows))
    for _ in range(TURNS if len(doubtful) else 0):
        prior = rows @ solved(rows, wanted)
        scatter = max(float(np.sqrt(np.mean((wanted - prior) ** 2 + spread))), 0.3)
        misfit = (squared[doubtful, None] - np.exp(2 * GRID)) / doubt[doubtful, None]
        chance = -(misfit**2 + ((GRID - prior[doubtful, None]) / scatter) ** 2) / 2
        weights = np.exp(chance - chance.max(axis=1, keepdims=True))
        weights /= weights.sum(axis=1, keepdims=True)
        wanted[doubtful] = weights @ GRID
        spread[doubtful] = weights @ GRID**2 - wanted[doubtful] ** 2
    return wanted


def solved(rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(k,) coefficients."""
    # the constant is free; what is blurred within a pixel shows less, never more, and at most in proportion
    penalty = np.sqrt(RIDGE) * np.diag([1e-5, *np.ones(rows.shape[1] - 1)])
    lowest, highest = np.full(len(FEATURES), -np.inf), np.full(len(FEATURES), np.inf)
    lowest[[FEATURES.index(name) for name in (*HARMFUL, "blur")]] = 0
    highest[FEATURES.index("blur")] = 1
    whole = np.concatenate([rows, penalty]), np.concatenate([wanted, np.zeros(len(penalty))])
    return lsq_linear(*whole, bounds=(lowest, highest)).x


if __name__ == "__main__":
    main()
