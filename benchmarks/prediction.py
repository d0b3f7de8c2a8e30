"""Are the predicted errors honest? Judged on cases that the fit has not seen.

    PYTHONPATH=. python benchmarks/prediction.py [--cases N...] [--seeds K...] [--folds N] [--meshes FOLDER] [-o FOLDER]

For each case (see ``prediction_cases.py``) and several qualities: is the measured error of the chosen shader within the
tolerance, and is the predicted error within a factor of 2 of the measured? For path the measured error is the measured
noise of a sample over the square root of the passes that a render would take, which goes by the noise of its own first
passes (``renderer.enough``): these are of other random numbers. With ``--folds`` cases of the fit are judged, too: each
by a fit made anew, margins and all, without its tenth (or whatever part). Measurements are kept in out/prediction/.
Writes prediction.json and prediction.md into FOLDER, docs/ by default.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from benchmarks.calibrate_prediction import anchors, fitted
from benchmarks.prediction_cases import Case, measured_cases
from renderer.enough import FIRST, next_round
from renderer.shaders.prediction import SURE, Error, Fit, fits, parsed, predicted_errors, predicted_noise
from renderer.shaders.selection import CHEAPEST_FIRST, MOST_PASSES, Demand, noise_allowed, passes_within, shares_of

QUALITIES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, nargs="+", default=[106], help="of each seed, or one number for all")
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22])
    parser.add_argument("--folds", type=int, default=0, help="0: judge the stored fit")
    parser.add_argument("--meshes", type=Path, help="folder with further meshes, of which it takes those it knows")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=0.5, help="of CPU for each half of path's pictures")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    counts = options.cases * len(options.seeds) if len(options.cases) == 1 else options.cases
    drawn = (
        measured_cases(seed, count, options.meshes, options.threads, options.seconds)
        for seed, count in zip(options.seeds, counts, strict=True)
    )
    cases = list(chain.from_iterable(drawn))
    figures = judged(cases, folded(cases, options.folds) if options.folds else [fits()] * len(cases))
    figures["how"] = (
        f"Each is predicted by a fit, margins and all, without the part of {options.folds} that it belongs to."
        if options.folds
        else "The fit has not seen them."
    )
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "prediction.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(figures)
    (options.output / "prediction.md").write_text(text)
    print(text)


@dataclass(frozen=True)
class Judged:
    """A choice: which shader, and how its measured error compares.

    within, nearly       its tolerance, by the measured error; and to a standard error of that
    surely_over          by more than the measured error's doubt (19 in 20)
    planned, measured    the error predicted before the render, and measured
    told                 the error predicted in the end: for path that which its own passes tell
    consistent           whether a factor of 2 of ``told`` holds what is measured, to a standard error
    limited              whether path needs so many passes that their limit keeps it above its tolerance
    """

    shader: str
    within: bool
    nearly: bool
    surely_over: bool
    planned: float
    told: float
    measured: float
    consistent: bool
    limited: bool


def folded(cases: list[Case], folds: int) -> list[dict[str, Fit]]:
    """For each case a fit that has not seen it."""
    found, fixed = [], anchors()
    for fold in range(folds):
        print(f"fold {fold + 1} of {folds}", flush=True)
        found.append(parsed(fitted([case for k, case in enumerate(cases) if k % folds != fold], fixed)))
    return [found[k % folds] for k in range(len(cases))]


def judged(cases: list[Case], by: list[dict[str, Fit]]) -> dict:
    """Shares of the cases that are as predicted, each by its own fit."""
    ratios: dict[str, list[float]] = {name: [] for name in (*CHEAPEST_FIRST[:-1], "noise")}
    for case, fit in zip(cases, by, strict=True):
        for name, error in predicted_errors(case.look, fit).items():
            ratios[name].append(case.measured.errors[name].error / error.error)
        ratios["noise"].append(case.measured.noise.error / predicted_noise(case.look, fit).error)
    every = [(case, _chosen(case, fit, quality)) for case, fit in zip(cases, by, strict=True) for quality in QUALITIES]
    choices = [one for case, one in every if one.shader != "path" or (case.seen and case.seen[-1][0] >= FIRST)]
    kinds = {"all": choices} | {
        name: found for name in CHEAPEST_FIRST if (found := [one for one in choices if one.shader == name])
    }
    return {
        "cases": len(cases),
        "qualities": QUALITIES,
        "left_out": len(every) - len(choices),
        "over_by_the_limit_of_passes": sum(one.limited and not one.within for one in choices),
        "chosen": {kind: _shares(found) for kind, found in kinds.items()},
        "predicted_within_factor_2": {name: _factor_2(found) for name, found in ratios.items()},
        "median_measured_over_predicted": {name: float(np.median(found)) for name, found in ratios.items()},
    }


def _shares(choices: list[Judged]) -> dict[str, float]:
    return {
        "choices": len(choices),
        **{
            what: float(np.mean([getattr(one, what) for one in choices]))
            for what in ("within", "nearly", "surely_over")
        },
        "factor_2_planned": _factor_2([one.measured / one.planned for one in choices]),
        "factor_2": _factor_2([one.measured / one.told for one in choices]),
        "consistent": float(np.mean([one.consistent for one in choices])),
    }


def _chosen(case: Case, by: dict[str, Fit], quality: float) -> Judged:
    """What is chosen, held against what was measured."""
    demand, size = Demand(quality), case.look.size_px
    allowed = demand.tolerance(size)
    errors, noise = predicted_errors(case.look, by), predicted_noise(case.look, by)
    shares = shares_of({name: error.bound for name, error in errors.items()}, demand, size)
    shader = max(shares, key=shares.__getitem__)
    by_path = shares.pop("path", 0.0)
    quiet = noise_allowed(allowed, [error.error for error in errors.values()], by_path)
    passes, seen = _passes_of_path(case, noise, quiet, by_path)
    before = _error(errors, shares, noise, by_path / passes_within(by_path**0.5 * noise.bound, quiet))
    after = _error(errors, shares, seen, by_path / passes)
    found = _error(case.measured.errors, shares, case.measured.noise, by_path / passes)
    # what errors add up to is squared, without bias and at most: (sum of s b)^2 <= (sum of s) (sum of s b^2)
    squared, doubt = (sum(shares.values()) * sum(share * getattr(case.measured.errors[name], what)
                                                 for name, share in shares.items())
                      for what in ("squared", "doubt"))  # fmt: skip
    squared += case.measured.noise.error**2 * by_path / passes
    low, high = (max(squared + sign * doubt, 0.0) ** 0.5 for sign in (-1, 1))
    return Judged(
        shader, squared <= allowed**2, low <= allowed, squared - SURE * doubt > allowed**2, before, after, found,
        low <= 2 * after and high >= after / 2, shader == "path" and (seen.error / allowed) ** 2 > MOST_PASSES / 2,
    )  # fmt: skip


def _error(errors: Mapping[str, Error], shares: Mapping[str, float], noise: Error, left: float) -> float:
    """Of an object: its shaders' by their shares, and of path's variance the part ``left``."""
    return float(np.hypot(sum(share * errors[name].error for name, share in shares.items()), noise.error * left**0.5))


def _passes_of_path(case: Case, planned: Error, allowed: float, share: float) -> tuple[int, Error]:
    """Passes of a render that goes by its own noise, with a ``share`` of the samples by path, and the noise it has
    seen."""
    noise, done = planned, 0
    while True:
        noise = next((error for passes, error in reversed(case.seen) if passes <= share * done), noise)
        following = next_round(done, passes_within(share**0.5 * noise.bound, allowed))
        if following <= done:
            return done, noise
        done = following


def _factor_2(ratios: list[float]) -> float:
    return float((np.abs(np.log(ratios)) <= np.log(2)).mean()) if ratios else float("nan")


def markdown(figures: dict) -> str:
    """The page."""
    rows = "\n".join(
        f"| {name} | {100 * share:.0f} % | {figures['median_measured_over_predicted'][name]:.2f} |"
        for name, share in figures["predicted_within_factor_2"].items()
    )
    shares = ("within", "nearly", "surely_over", "factor_2_planned", "factor_2", "consistent")
    chosen = "\n".join(
        f"| {kind} | {one['choices']} | " + " | ".join(f"{100 * one[share]:.0f} %" for share in shares) + " |"
        for kind, one in figures["chosen"].items()
    )
    return f"""# Predicted errors

{figures["cases"]} cases, {len(figures["qualities"])} qualities each, from
{min(figures["qualities"]):g} to {max(figures["qualities"]):g} (`python benchmarks/prediction.py`): solids and scans,
rough and cut open ones, in media of 0.1 to 100 transport mean free paths, g from -0.9 to 0.95, index 1 to 1.8, under
skies, suns, lamps and points of light near, far and inside.

{figures["how"]}

Is the measured error of the chosen shader within the tolerance? The squared bias of a fast shader is measured without
bias but not without doubt: *to its doubt* counts what is within to a standard error of the measurement, *surely over*
what is above by more than 1.6. Is the predicted error within a factor of 2 of the measured? *Planned* is before the
render; *told* is what is known in the end, of path that which the noise of its own first passes tells.
{figures["left_out"]} choices of path are left out, in cases so slow that not even the passes of a first round were made
to tell their noise. {figures["over_by_the_limit_of_passes"]} choices of path are not within because a quality gives
{MOST_PASSES} passes at most; such a picture tells the error that it has.

| chosen | choices | within | to its doubt | surely over | factor 2, planned | factor 2, told | told, to its doubt |
|---|---:|---:|---:|---:|---:|---:|---:|
{chosen}

Over all cases, whether chosen or not:

| prediction | within a factor of 2 | median of measured over predicted |
|---|---:|---:|
{rows}
"""


if __name__ == "__main__":
    main()
