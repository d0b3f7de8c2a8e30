"""The page about error against time: charts, what was measured behind them, and the thesis beside it."""

from __future__ import annotations

from collections.abc import Sequence

from .drawing import LABELS
from .machine import sentence
from .speed import SURE, Measured, Point

TARGETS = (0.1, 0.02)
FAR = 5.0
"""Times nearer to the target than what was measured, an error is marked as reckoned from afar."""
THESIS_PIXELS = 500 * 500
THESIS = (
    ("path, 1 pass", "path", 1, 0.12, 0.17),
    ("path, 100 passes", "path", 100, 4.66, 6.27),
    ("path, 500 passes", "path", 500, 23.47, 29.61),
    ("path, 1000 passes", "path", 1000, 67.51, None),
    ("plumb", "plumb", 1, 0.11, 0.11),
    ("scalar", "scalar", 1, 0.03, 0.04),
)
"""Seconds of the thesis (Wadkien 2008, Koblenz): bunny and Buddha, 500 x 500 pixels, eight cores at 3 GHz."""


def page(scenes: Sequence[Measured], about: dict[str, str], quick: bool, left_out: Sequence[str] = ()) -> str:
    """Markdown; charts are ``SCENE.png`` beside it."""
    turns = max(len(point.runs) for measured in scenes for point in measured.points)
    loads = [run.load for measured in scenes for point in measured.points for run in point.runs]
    crowded = max(loads) > 2 * int(about["cores"])
    busy = ": the machine was busy, and times are longer than they need be" * crowded
    lines = [
        "# Speed against accuracy",
        "",
        "Error of every method against the time it takes, on every scene that was asked for, whoever wins. "
        f"Machine: {sentence(about)}. {'Quick run, good for a first look. ' * quick}{turns} run{'s' * (turns > 1)} of "
        "every point, in turns, each in a process of its own; points are medians, bars reach from the least to the "
        f"greatest. Between {min(loads):.1f} and {max(loads):.1f} processes wanted a core meanwhile{busy}.",
        "",
        "Errors are those of the object's pixels, relative: sqrt(relMSE), relMSE = mean[(a - r)^2 / (r^2 + 0.01)] of "
        "pictures divided by the mean of the reference, whose r below the line is smoothed over 5 x 5 pixels. The "
        "reference is two independent path-traced halves S1, S2 "
        "of other random numbers than all runs; its own noise cancels in (a - S1)(a - S2). Bias is "
        "sqrt(mean[(M1 - S1)(M2 - S2)]) over pairs of independent runs, from which the noise of the method cancels as "
        "well; a dashed line in the chart where it is more than three standard errors above nothing. Noise is the mean "
        "relative standard error that the renderer itself states. Rings mark what no other point beats both in time "
        "and in error. `speed.csv` has a row for every run, with the command that makes it again from the folder that "
        "`sss-chart` was started in.",
        "",
    ]  # fmt: skip
    lines += _race(scenes)
    for measured in scenes:
        lines += _scene(measured)
    lines += _thesis(scenes)
    if left_out:
        lines += ["## Left out", "", *(f"- {text}" for text in left_out), ""]
    return "\n".join(lines)


def _race(scenes: Sequence[Measured]) -> list[str]:
    """Who is first at given errors."""
    methods = [method for method in ("path", "mitsuba", "plumb", "scalar", "diffuse")
               if any(measured.of(method) for measured in scenes)]  # fmt: skip
    lines = ["## Seconds to an error", ""]
    lines += [
        "Whole commands. For path and Mitsuba reckoned from their longest runs, set-up + rendering x (error / "
        f"target)^2, with ~ where those were more than {FAR:g} times as wrong; the others with the fewest passes that "
        "are good enough, or never.", "",
    ]  # fmt: skip
    for target in TARGETS:
        lines += [
            f"| to {100 * target:g} % | {' | '.join(LABELS.get(method, method) for method in methods)} | first |",
            f"|---|{'---:|' * len(methods)}---|",
        ]
        for measured in scenes:
            times = {method: _seconds_to(measured.of(method), target) for method in methods}
            cells = [
                f"{'~' * _is_far(measured.of(method), target)}{time:.3g}" if time is not None
                else "never" if measured.of(method) else "-"
                for method, time in times.items()
            ]  # fmt: skip
            reached = {method: time for method, time in times.items() if time is not None}
            first = min(reached, key=reached.__getitem__) if reached else "none"
            lines.append(f"| {measured.scene} | {' | '.join(cells)} | **{LABELS.get(first, first)}** |")
        lines.append("")
    return lines


def _seconds_to(points: Sequence[Point], target: float) -> float | None:
    """Of a whole command; None: never, or not measured."""
    usable = [point for point in points if point.error()[0] > 0]
    if not usable:
        return None
    if points[0].method in ("path", "mitsuba"):
        last = usable[-1]
        whole, render = last.seconds()[0], last.seconds("render")[0]
        return whole - render + render * (last.error()[0] / target) ** 2
    return next((point.seconds()[0] for point in usable if point.error()[0] <= target), None)


def _is_far(points: Sequence[Point], target: float) -> bool:
    usable = [point.error()[0] for point in points if point.error()[0] > 0]
    return points[0].method in ("path", "mitsuba") and usable[-1] > FAR * target


def _scene(measured: Measured) -> list[str]:
    width, height = measured.pixels
    halves = measured.reference
    lines = [
        f"## {measured.scene}", "",
        f"![error against time, {measured.scene}]({measured.scene}.png)", "",
        f"{width} x {height} pixels; reference of 2 x {halves[0].task.passes} passes, noise "
        f"{100 * measured.truth_noise:.2g} %, {sum(run.seconds for run in halves):.0f} s"
        + (f"; without Mitsuba: {measured.without_peer}" if measured.without_peer else "") + ".",
        "",
        "| method | setting | seconds | least - most | of it set-up | build | CPU s | error % | noise % | bias % | "
        "FLIP | shaders |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|",
    ]  # fmt: skip
    front = measured.pareto()
    longest = {point.method: point for point in measured.points if point.method != "auto"}
    for point in measured.points:
        middle, least, most = point.seconds()
        error, noise, flip = point.error()[0], point.runs[0].stderr, point.error("flip")[0]
        cells = [
            LABELS.get(point.method, point.method) + (" (front)" if point in front else ""), point.setting,
            f"{middle:.2f}", f"{least:.2f} - {most:.2f}", f"{point.seconds('setup')[0]:.2f}",
            f"{point.seconds('build')[0]:.2f}", f"{point.seconds('cpu')[0]:.1f}",
            f"{100 * error:.3g}" if error == error else "< noise of the reference",
            "" if noise is None else f"{100 * noise:.3g}",
            _bias(point) if point is longest.get(point.method) else "",
            f"{flip:.4f}" if flip == flip else "", point.runs[0].shaders,
        ]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    lines.append("")
    return lines


def _bias(point: Point) -> str:
    """In per cent; what chance explains is given as the size it could hide."""
    if point.bias is None:
        return ""
    hidden = 100 * (max(point.bias.squared, 0) + SURE * point.bias.stderr) ** 0.5
    found = point.bias.squared > SURE * point.bias.stderr
    return f"{100 * point.bias.size:.3g}" if found else f"none seen, < {hidden:.2g}"


def _thesis(scenes: Sequence[Measured]) -> list[str]:
    names = " | ".join(measured.scene for measured in scenes)
    lines = [
        "## Beside the thesis", "",
        "Seconds of rendering alone, as the thesis has them (500 x 500 pixels, eight cores at 3 GHz, compiled code), "
        "and ours on the machine above, **scaled to 500 x 500 pixels** by the number of pixels, which is "
        "unkind to small pictures. Ours for numbers of passes that were not measured are scaled from the nearest, in "
        "italics. Other machine, other scenes, and its passes "
        "are not ours: its walks have a greatest depth and no exact boundary. A pass of ours leaves so much noise "
        "(mean relative standard error of one pass, last row) that only the errors above make times comparable.", "",
        f"| | thesis, bunny | Buddha | {names} |",
        f"|---|---:|---:|{'---:|' * len(scenes)}",
    ]  # fmt: skip
    for label, method, passes, bunny, buddha in THESIS:
        cells = [f"{bunny:g}", "-" if buddha is None else f"{buddha:g}"]
        cells += [_scaled(measured, method, passes) for measured in scenes]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    cells = ["-", "-", *(_pass_noise(measured) for measured in scenes)]
    lines += [f"| noise of one pass of path | {' | '.join(cells)} |", ""]
    return lines


def _scaled(measured: Measured, method: str, passes: int) -> str:
    points = measured.of(method)
    if not points:
        return "-"
    width, height = measured.pixels
    scale = THESIS_PIXELS / (width * height)
    exact = next((point for point in points if point.runs[0].task.passes == passes), None)
    if exact is not None:
        return f"{scale * exact.seconds('render')[0]:.3g}"
    # the nearest measured number of passes above, or the longest
    count = [point.runs[0].task.passes for point in points]
    nearest = next((k for k, number in enumerate(count) if number >= passes), len(points) - 1)
    return f"*{scale * points[nearest].seconds('render')[0] * passes / count[nearest]:.3g}*"


def _pass_noise(measured: Measured) -> str:
    noise = [(point.runs[0].stderr, point.runs[0].task.passes) for point in measured.of("path")]
    known = [stderr * passes**0.5 for stderr, passes in noise if stderr is not None]
    return f"{100 * known[-1]:.0f} %" if known else "-"
