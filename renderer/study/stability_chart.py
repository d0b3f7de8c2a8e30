"""Charts of a sweep: errors, the price of the exact picture, and what ``auto`` chooses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .drawing import COLOURS, MARKERS, log_ticks, pyplot, save
from .methods import SHADERS
from .stability import BOUND, TARGET, Found

LEAST_SHOWN = 3e-3
"""Errors below are drawn here: chance took them down."""


def draw(found: Found, folder: Path, name: str) -> None:
    """PNG and SVG: errors over the parameter, CPU seconds of path to the target noise, the choices of ``auto``."""
    plot = pyplot()
    figure, (errors, price, choices) = plot.subplots(
        3, 1, figsize=(7.0, 6.8), sharex=True, height_ratios=(3.2, 1.3, 1.0)
    )
    study = found.study
    if study.log:
        errors.set_xscale("log")
    _errors(errors, found)
    _price(price, found)
    _choices(choices, found)
    choices.set_xlabel(study.axis)
    if study.log:
        log_ticks(choices.xaxis)
    figure.suptitle(study.title, fontweight="bold")
    save(figure, folder, name)


def _errors(axis: Any, found: Found) -> None:
    axis.set_yscale("log")
    values, least = np.array([step.value for step in found.steps]), BOUND
    for method in SHADERS:
        if method == "path" and found.study.truth is None:
            continue
        outcomes = [step.outcome(method) for step in found.steps]
        bounds = np.array([[outcome.squared_bias + k * outcome.stderr for k in (-2, 0, 2)] for outcome in outcomes])
        low, middle, high = np.sqrt(np.maximum(bounds, LEAST_SHOWN**2)).T
        least = min(least, float(low.min()))
        sure = np.array([outcome.certain for outcome in outcomes])
        colour = COLOURS[method]
        axis.errorbar(values, middle, yerr=[middle - low, high - middle], color=colour, linewidth=1.3, elinewidth=0.8,
                      capsize=2, label=method)  # fmt: skip
        for chosen, face in ((sure, colour), (~sure, "white")):
            axis.plot(values[chosen], middle[chosen], MARKERS[method], color=colour, markersize=5, markerfacecolor=face)
        for start, end in found.usable(method):
            for edge in (start, end):
                if values.min() < edge < values.max():
                    axis.plot(edge, BOUND, "|", color=colour, markersize=16, markeredgewidth=2)
    axis.axhline(BOUND, color="#888888", linestyle=(0, (4, 3)), linewidth=0.9)
    axis.annotate(f"usable below {100 * BOUND:g} %", (1, BOUND), xycoords=("axes fraction", "data"), xytext=(0, 3),
                  textcoords="offset points", ha="right", fontsize=8, color="#666666", zorder=0)  # fmt: skip
    axis.set_ylim(bottom=max(0.7 * least, 0.9 * LEAST_SHOWN))
    axis.set_ylabel("relative RMS bias")
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    axis.set_title("hollow: no more than chance explains; ticks on the dashed line: bounds", fontsize=8)
    log_ticks(axis.yaxis)


def _price(axis: Any, found: Found) -> None:
    axis.set_yscale("log")
    values = [step.value for step in found.steps]
    seconds = [step.outcome("path").seconds_to_target for step in found.steps]
    axis.plot(values, seconds, color=COLOURS["path"], marker="o", markersize=4)
    # a decade at least, so that little looks like little
    axis.set_ylim(0.4 * np.nanmin(seconds), 2.5 * np.nanmax(seconds))
    axis.set_ylabel(f"path: CPU s to {100 * TARGET:g} %")
    log_ticks(axis.yaxis)


def _choices(axis: Any, found: Found) -> None:
    """A row for each quality, a square for each value, crossed where the promise is not kept."""
    axis.grid(False)
    qualities = [choice.quality for choice in found.steps[0].choices]
    for step in found.steps:
        for row, choice in enumerate(step.choices):
            axis.plot(step.value, row, "s", color=COLOURS[choice.shader], markersize=9)
            if step.broken(choice, found.level):
                axis.plot(step.value, row, "x", color="white", markersize=6, markeredgewidth=1.8)
    axis.set_yticks(range(len(qualities)), [f"{quality:g}" for quality in qualities])
    axis.set_ylim(-0.7, len(qualities) - 0.3)
    axis.set_ylabel("auto: q")
    shown = dict.fromkeys(choice.shader for step in found.steps for choice in step.choices)
    for shader in shown:
        axis.plot([], [], "s", color=COLOURS[shader], label=shader)
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.05), fontsize=8, handletextpad=0.2)
