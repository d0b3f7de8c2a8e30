"""Fits the predicted errors of plumb, scalar and diffuse, and the noise of path, to measurements.

    PYTHONPATH=. python benchmarks/calibrate_prediction.py [--cases N] [--meshes FOLDER] [--threads N] [--dry]

Cases are drawn by ``prediction_cases.py`` and measured by pilots (see ``renderer/pilot.py``); what was measured is kept
in out/prediction/, so that the script can be ended and goes on. Remove that folder when a shader has changed. The
correction of each prediction in the logarithm is linear in few features; a ridge keeps the coefficients of what was
hardly measured near zero, where the prediction is the one before. Residuals are those of cases left out one at a time.
Writes ``renderer/shaders/prediction.json``; ``--dry`` only prints it.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.prediction_cases import Case, measured_cases
from renderer.shaders.prediction import FEATURES, FILE, LEAST, MOST, START_NOISE, features, starts

SEED = 1
RIDGE = 1.0
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
    fits = {}
    rows = np.array([features(case.look) for case in cases])
    for name in ("diffuse", "scalar", "plumb", "noise"):
        start, found = (np.array(column) for column in zip(*(_pair(case, name) for case in cases), strict=True))
        coefficients, residuals = ridge(rows, np.log(np.clip(found, LEAST, MOST) / start))
        ratio = np.exp(np.abs(residuals))
        fits[name] = {
            "coefficients": dict(zip(FEATURES, (round(float(c), 4) for c in coefficients), strict=True)),
            "scatter": round(float(residuals.std()), 3),
            "margin": round(float(max(np.exp(np.quantile(residuals, CONFIDENCE)), 1)), 3),
            "within_factor_2": round(float((ratio <= 2).mean()), 3),
            "residual_quantiles": {
                f"{q:g}": round(float(np.quantile(residuals, q)), 3) for q in (0.05, 0.25, 0.5, 0.75, 0.95)
            },
        }
    return fits


def _pair(case: Case, name: str) -> tuple[float, float]:
    """The start of the prediction, and what was measured."""
    if name == "noise":
        return START_NOISE, case.measured.noise.error
    return starts(case.look)[name], case.measured.errors[name].error


def ridge(rows: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients, and the residuals (n,) of each case by a fit without it.

    With the hat matrix H these are r_i / (1 - H_ii) (Allen 1974, "The relationship between variable selection and data
    augmentation", Technometrics 16).
    """
    # the constant is free
    penalty = RIDGE * np.diag([1e-9, *np.ones(rows.shape[1] - 1)])
    inverse = np.linalg.inv(rows.T @ rows + penalty)
    coefficients = inverse @ rows.T @ wanted
    leverage = np.einsum("ij,jk,ik->i", rows, inverse, rows)
    return coefficients, (wanted - rows @ coefficients) / np.maximum(1 - leverage, 1e-3)


if __name__ == "__main__":
    main()
