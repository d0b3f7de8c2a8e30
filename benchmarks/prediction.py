"""Are the predicted errors honest? Judged on cases that the fit has not seen.

    PYTHONPATH=. python benchmarks/prediction.py [--cases N] [--meshes FOLDER] [--threads N] [-o FOLDER]

For each case (see ``prediction_cases.py``) and several qualities: is the measured error of the chosen shader within the
tolerance, and is the predicted error within a factor of 2 of the measured? For path the measured error is the measured
noise of a sample over the square root of the passes that the quality takes. Measurements are kept in out/prediction/.
Writes prediction.json and prediction.md into FOLDER, docs/ by default.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.prediction_cases import Case, measured_cases
from renderer.shaders.prediction import predicted_errors, predicted_noise
from renderer.shaders.selection import CHEAPEST_FIRST, Demand, passes_within, shares_of

SEED = 2
QUALITIES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)
STORE = Path("out/prediction/held_out.jsonl")


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--meshes", type=Path, help="folder with further meshes, of which it takes those it knows")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    cases = list(measured_cases(SEED, options.cases, options.meshes, STORE, options.threads))
    figures = judged(cases)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "prediction.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(figures)
    (options.output / "prediction.md").write_text(text)
    print(text)


def judged(cases: list[Case]) -> dict:
    """Shares of the cases that are as predicted."""
    ratios: dict[str, list[float]] = {name: [] for name in (*CHEAPEST_FIRST[:-1], "noise")}
    for case in cases:
        for name, error in predicted_errors(case.look).items():
            ratios[name].append(case.measured.errors[name].error / error.error)
        ratios["noise"].append(case.measured.noise.error / predicted_noise(case.look).error)
    within: dict[str, list[bool]] = {"fast": [], "path": []}
    chosen_ratios, chosen = [], dict.fromkeys(CHEAPEST_FIRST, 0)
    for case in cases:
        for quality in QUALITIES:
            ok, ratio, shader = _chosen(case, quality)
            within["path" if shader == "path" else "fast"].append(ok)
            chosen_ratios.append(ratio)
            chosen[shader] += 1
    return {
        "cases": len(cases),
        "choices": {kind: len(found) for kind, found in within.items()},
        "chosen": chosen,
        "within_tolerance": {kind: float(np.mean(found)) for kind, found in within.items() if found},
        "chosen_predicted_within_factor_2": _factor_2(chosen_ratios),
        "predicted_within_factor_2": {name: _factor_2(found) for name, found in ratios.items()},
        "median_measured_over_predicted": {name: float(np.median(found)) for name, found in ratios.items()},
    }


def _chosen(case: Case, quality: float) -> tuple[bool, float, str]:
    """Whether what is chosen is within the tolerance, its measured error over the predicted, and its name."""
    demand, size = Demand(quality), case.look.size_px
    errors, noise = predicted_errors(case.look), predicted_noise(case.look)
    shares = shares_of({name: error.bound for name, error in errors.items()}, demand, size)
    passes = passes_within(noise.error, demand.tolerance(size))
    measured = {name: error.error for name, error in case.measured.errors.items()}
    measured["path"] = case.measured.noise.error * passes**-0.5
    predicted = {name: error.error for name, error in errors.items()} | {"path": noise.error * passes**-0.5}
    found, expected = (sum(share * of[name] for name, share in shares.items()) for of in (measured, predicted))
    return found <= demand.tolerance(size), found / expected, max(shares, key=shares.__getitem__)


def _factor_2(ratios: list[float]) -> float:
    return float((np.abs(np.log(ratios)) <= np.log(2)).mean())


def markdown(figures: dict) -> str:
    """The page."""
    rows = "\n".join(
        f"| {name} | {100 * share:.0f} % | {figures['median_measured_over_predicted'][name]:.2f} |"
        for name, share in figures["predicted_within_factor_2"].items()
    )
    chosen = ", ".join(f"{name} {count}" for name, count in figures["chosen"].items())

    def percent(kind: str) -> str:
        share = figures["within_tolerance"].get(kind)
        return "none" if share is None else f"{100 * share:.0f} %"

    return f"""# Predicted errors

{figures["cases"]} cases that the fit has not seen (`python benchmarks/prediction.py`), {len(QUALITIES)} qualities each.

The measured error of the chosen shader is within the tolerance in {percent("fast")} of {figures["choices"]["fast"]}
choices of a fast shader, whose bounds are held against it, and in {percent("path")} of {figures["choices"]["path"]} of
path, whose passes follow from the noise predicted for it ({chosen}). It is within a factor of 2 of the predicted in
{100 * figures["chosen_predicted_within_factor_2"]:.0f} % of all.

| prediction | within a factor of 2 | median of measured over predicted |
|---|---:|---:|
{rows}
"""


if __name__ == "__main__":
    main()
