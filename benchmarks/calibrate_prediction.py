"""Fits the predicted errors of plumb, scalar and diffuse, and the noise of path, to measurements.

    PYTHONPATH=. python benchmarks/calibrate_prediction.py [--cases N] [--meshes FOLDER] [--threads N] [--dry]

Cases are drawn by ``prediction_cases.py`` and measured by pilots (see ``renderer/pilot.py``); what was measured is kept
in out/prediction/, so that the script can be ended and goes on. Remove that folder when a shader has changed. The
logarithm of each prediction is linear in few features; a ridge keeps the coefficients of what was hardly measured near
zero. Residuals are those of cases left out one at a time.
Writes ``renderer/shaders/prediction.json``; ``--dry`` only prints it.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from benchmarks.prediction_cases import Case, measured_cases
from renderer.shaders.prediction import FEATURES, FILE, LEAST, MOST, START, features
from renderer.shaders.selection import Demand, shares_of

SEED = 1
RIDGE = 2.0
QUALITIES = np.linspace(0, 0.8, 17)
CONFIDENCE = 0.95
STORE = Path("out/prediction/fit.jsonl")


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--meshes", type=Path, help="folder with further meshes, of which it takes those it knows")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--dry", action="store_true")
    options = parser.parse_args()
    cases = []
    for case in measured_cases(SEED, options.cases, options.meshes, STORE, options.threads):
        cases.append(case)
        errors = ", ".join(f"{name} {100 * error.error:.2g} %" for name, error in case.measured.errors.items())
        print(f"{case.number} {case.name} {case.look.size_px:.3g} px, tau {case.look.depth:.3g}: {errors}", flush=True)
    stored = {"cases": len(cases), "fits": fitted(cases)}
    text = json.dumps(stored, indent=1) + "\n"
    print(text)
    if not options.dry:
        FILE.write_text(text)


def fitted(cases: list[Case]) -> dict[str, dict]:
    """The correction of each prediction, with its residuals."""
    fits: dict[str, dict] = {}
    predicted: dict[str, np.ndarray] = {}
    rows = np.array([features(case.look) for case in cases])
    for name in ("diffuse", "scalar", "plumb", "noise"):
        found = np.array([_found(case, name) for case in cases])
        coefficients, residuals = ridge(rows, np.log(np.clip(found, LEAST, MOST) / START[name]))
        ratio = np.exp(np.abs(residuals))
        predicted[name] = found / np.exp(residuals)
        fits[name] = {
            "coefficients": dict(zip(FEATURES, (round(float(c), 4) for c in coefficients), strict=True)),
            "scatter": round(float(residuals.std()), 3),
            "margin": 1.0,
            "within_factor_2": round(float((ratio <= 2).mean()), 3),
            "residual_quantiles": {
                f"{q:g}": round(float(np.quantile(residuals, q)), 3) for q in (0.05, 0.25, 0.5, 0.75, 0.95)
            },
        }
    least = margin(cases, predicted)
    for name in ("diffuse", "scalar", "plumb"):
        fits[name]["margin"] = least
    return fits


def margin(cases: list[Case], predicted: dict[str, np.ndarray]) -> float:
    """The least factor on predicted errors with which ``CONFIDENCE`` of the choices of fast shaders are within the
    tolerance, over ``QUALITIES``; each case predicted by a fit without it."""
    for factor in np.arange(1.0, 4.0, 0.05):
        within = []
        for k, case in enumerate(cases):
            for quality in QUALITIES:
                demand, size = Demand(quality), case.look.size_px
                shares = shares_of(
                    {name: factor * predicted[name][k] for name in START if name != "noise"}, demand, size
                )
                if "path" not in shares:
                    error = sum(share * _found(case, name) for name, share in shares.items())
                    within.append(error <= demand.tolerance(size))
        if np.mean(within) >= CONFIDENCE:
            break
    return round(float(factor), 3)


def _found(case: Case, name: str) -> float:
    return case.measured.noise.error if name == "noise" else case.measured.errors[name].error


def ridge(rows: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients, and the residuals (n,) of each case by a fit without it."""
    coefficients = _solved(rows, wanted)
    every = np.arange(len(rows))
    return coefficients, np.array([wanted[k] - rows[k] @ _solved(rows[every != k], wanted[every != k]) for k in every])


def _solved(rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    # the constant is free; what is blurred within a pixel shows less, never more, and at most in proportion
    penalty = np.sqrt(RIDGE) * np.diag([1e-5, *np.ones(rows.shape[1] - 1)])
    lowest, highest = np.full(len(FEATURES), -np.inf), np.full(len(FEATURES), np.inf)
    lowest[FEATURES.index("blur")], highest[FEATURES.index("blur")] = 0, 1
    whole = np.concatenate([rows, penalty]), np.concatenate([wanted, np.zeros(len(penalty))])
    return lsq_linear(*whole, bounds=(lowest, highest)).x


if __name__ == "__main__":
    main()
