"""Charts of error against time: one curve a method, repeated runs with intervals, what cannot be beaten ringed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .drawing import COLOURS, LABELS, MARKERS, log_ticks, pyplot, save
from .methods import FAST
from .speed import METHODS, SURE, Measured, Point

PANELS = (
    ("seconds", "rms", "whole command, build included", "relative RMS error"),
    ("render", "rms", "rendering alone", "relative RMS error"),
    ("seconds", "flip", "whole command, build included", "FLIP (0: same to the eye)"),
)


def draw(measured: Measured, folder: Path, name: str) -> None:
    """PNG and SVG of one scene: RMS error over the command's time, over rendering alone, and FLIP."""
    plot = pyplot()
    panels = [panel for panel in PANELS if any(point.error(panel[1])[0] > 0 for point in measured.points)]
    figure, axes = plot.subplots(1, len(panels), figsize=(4.9 * len(panels), 4.6), squeeze=False)
    for axis, (part, judge, title, label) in zip(axes[0], panels, strict=True):
        _panel(axis, measured, part, judge)
        axis.set_title(title)
        axis.set_xlabel("wall seconds")
        axis.set_ylabel(label)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 9))
    width, height = measured.pixels
    figure.suptitle(f"{measured.scene}, {width} x {height} pixels: lower left is better", fontweight="bold")
    save(figure, folder, name)


def _panel(axis: Any, measured: Measured, part: str, judge: str) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    for method in METHODS:
        points = [point for point in measured.of(method) if point.error(judge)[0] > 0]
        if points:
            _curve(axis, method, points, part, judge)
        if judge == "rms" and method in FAST:
            _floor(axis, measured.of(method), method)
    front = measured.pareto(part, judge)
    axis.plot(
        [point.seconds(part)[0] for point in front], [point.error(judge)[0] for point in front],
        "o", markersize=12, markerfacecolor="none", markeredgecolor="#666666", markeredgewidth=1.2, zorder=1,
        label="no other is faster and better",
    )  # fmt: skip
    if judge == "rms":
        _slope(axis, measured.of("path"), part)
    log_ticks(axis.xaxis)
    log_ticks(axis.yaxis)


def _curve(axis: Any, method: str, points: list[Point], part: str, judge: str) -> None:
    times = np.array([point.seconds(part) for point in points])
    errors = np.array([point.error(judge) for point in points])
    bars = [np.stack([middle - least, most - middle]) for middle, least, most in (errors.T, times.T)]
    axis.errorbar(
        times[:, 0], errors[:, 0], yerr=bars[0], xerr=bars[1], color=COLOURS[method], marker=MARKERS[method],
        markersize=5, markerfacecolor="none" if method == "auto" else COLOURS[method], linewidth=1.3,
        linestyle=":" if method == "auto" else "-", elinewidth=0.8, capsize=2, label=LABELS.get(method, method),
        zorder=3 if method == "auto" else 2,
    )  # fmt: skip
    if method == "auto":
        _name_qualities(axis, points, times, errors)


def _name_qualities(axis: Any, points: list[Point], times: np.ndarray, errors: np.ndarray) -> None:
    """One label for all qualities that chose the same shaders."""
    chosen: dict[str, list[int]] = {}
    for k, point in enumerate(points):
        chosen.setdefault(point.runs[0].shaders, []).append(k)
    for places in chosen.values():
        qualities = [points[k].runs[0].task.quality or 0.0 for k in places]
        text = f"q {min(qualities):g}" + (f" to {max(qualities):g}" if len(qualities) > 1 else "")
        axis.annotate(
            text, (times[places, 0].max(), errors[places, 0].mean()), xytext=(7, 5), textcoords="offset points",
            fontsize=8,
        )  # fmt: skip


def _floor(axis: Any, points: list[Point], method: str) -> None:
    """The bias of the most passes, where it is more than chance, as a dashed line."""
    if points and (bias := points[-1].bias) is not None and bias.squared > SURE * bias.stderr:
        axis.axhline(bias.size, color=COLOURS[method], linestyle=(0, (4, 3)), linewidth=0.9, zorder=1)


def _slope(axis: Any, points: list[Point], part: str) -> None:
    """Slope -1/2, through the best point of path: what independent samples do."""
    usable = [point for point in points if point.error()[0] > 0]
    if not usable:
        return
    time, error = usable[-1].seconds(part)[0], usable[-1].error()[0]
    low, high = axis.get_xlim()
    bounds = axis.get_ylim()
    times = np.array([low, high])
    axis.plot(times, error * np.sqrt(time / times), color="#888888", linewidth=0.8, zorder=0, label="slope -1/2")
    axis.set_xlim(low, high)
    axis.set_ylim(bounds)
