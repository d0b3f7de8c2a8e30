"""Studies of stability as charts, a CSV, a page, and the list of bounds found."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from sss_tools.errors import InputError

from . import stability_chart
from .drawing import write, write_csv
from .machine import machine, sentence
from .methods import SHADERS
from .stability import BOUND, PROMISES_FALSE_ALARM, TARGET, Found, Step
from .stability_bench import FAST_PASSES, FULL, QUICK, Bench, sweep
from .studies import Study

COLUMNS = (
    "study", "value", "method", "passes", "relative_rms_bias", "squared_bias", "squared_bias_stderr",
    "squared_bias_here", "squared_bias_here_stderr", "difference_of_means", "difference_stderr",
    "mean_relative_stderr", "cpu_seconds", "object_pixels_across", "squares_judged", "hole_handling", "auto",
    "rare_events", "commands", "truth_commands",
)  # fmt: skip


def make(
    studies: Sequence[Study], folder: Path, quick: bool, tell: Callable[[str, float], None] = lambda text, share: None
) -> list[Found]:
    """Run the studies, or find that they have been run, and write everything into ``folder``.

    tell  is told what was measured, and the share of what was to be measured that is done

    Raises InputError for a folder that cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot be made ({error.strerror})", "choose another folder") from None
    bench = Bench(folder, QUICK if quick else FULL)
    asked = [(study, value) for study in studies for value in bench.values(study)]
    missing = sum(bench.known(study, value) is None for study, value in asked)
    done, found = 0, []
    for study in studies:

        def advance(step: Step, made: bool, name: str = study.name) -> None:
            nonlocal done
            done += made
            if made:
                tell(f"{name}: {step.value:g}", done / missing)

        found.append(sweep(bench, study, advance))
        stability_chart.draw(found[-1], folder, study.name)
        write_csv(folder / "stability.csv", COLUMNS, (row for one in found for row in rows(one)))
        write(folder / "stability.md", page(found, quick).encode())
        write(folder / "limits.md", limits(found, quick).encode())
    return found


def rows(found: Found) -> Iterator[dict[str, object]]:
    """One for each value and method."""
    for step in found.steps:
        auto = " ".join(f"{choice.quality:g}:{choice.shader}" for choice in step.choices)
        for outcome in step.outcomes:
            yield {
                "study": found.study.name, "value": step.value, "method": outcome.method, "passes": outcome.passes,
                "relative_rms_bias": outcome.error, "squared_bias": outcome.squared_bias,
                "squared_bias_stderr": outcome.stderr, "squared_bias_here": outcome.here_squared_bias,
                "squared_bias_here_stderr": outcome.here_stderr, "difference_of_means": outcome.difference,
                "difference_stderr": outcome.difference_stderr, "mean_relative_stderr": outcome.noise,
                "cpu_seconds": outcome.cpu, "object_pixels_across": step.size_px, "squares_judged": step.judged,
                "hole_handling": step.handling, "auto": auto, "rare_events": outcome.rare,
                "commands": outcome.commands, "truth_commands": step.truth_commands,
            }  # fmt: skip


def page(found: Sequence[Found], quick: bool) -> str:
    """Markdown; charts are ``STUDY.png`` beside it."""
    lines = [
        "# Stability", "",
        "Every method while one parameter walks through its point of failure. Machine: "
        f"{sentence(machine())}." + (" Quick run: every other value, short renders." if quick else ""), "",
        *_method(), "",
        *_table(found),
    ]  # fmt: skip
    for one in found:
        lines += _study(one)
    return "\n".join(lines)


def _method() -> list[str]:
    return [
        "Errors are relative RMS biases over the object's pixels, sqrt(mean[(M1 - S1)(M2 - S2) / (S^2 + 0.01)]) of two "
        f"independent pictures of the method ({FAST_PASSES} passes) and two of the exact path shader, both divided by "
        "the mean of the latter; noise cancels, and bars are two standard errors of what is left. The exact picture "
        "is that of the same scene, unless the study says that one picture is right for all values (a closed ball, a "
        "fine ball); only there can the path shader be wrong. Its price is in the middle panel: CPU seconds to "
        f"{100 * TARGET:g} % noise. The strip below shows what `auto` chooses at five qualities; a cross where the "
        "choice is more wrong against the exact picture of its own scene than it allows itself (one-sided z-tests, "
        f"false alarms of a whole study {PROMISES_FALSE_ALARM:g}). `stability.csv` has the commands that make each "
        "point's pictures again, from its folder.",
    ]


def _table(found: Sequence[Found]) -> list[str]:
    lines = [
        "## Bounds found", "",
        f"Where each method stays within {100 * BOUND:g} %, ends interpolated between the values measured; \"all\" is "
        "all of the sweep, ~ says that noise could move an end. Degradation is gradual where no step of the sweep "
        "changes an error by more than the bound.",
        "",
        f"| study | swept | {' | '.join(SHADERS)} | `auto` leaves in time | rare events |",
        f"|---|---|{'---|' * len(SHADERS)}---|---|",
    ]  # fmt: skip
    for one in found:
        cells = [f"[{one.study.name}](#{one.study.name})", one.study.axis]
        cells += [bounds(one, method) for method in SHADERS]
        broken, rare = one.broken(), one.rare()
        cells.append("yes" if not broken else f"no, {len(broken)} of {sum(len(step.choices) for step in one.steps)}")
        cells.append("within budget" if not rare else f"beyond at {_values(step.value for step, _ in rare)}")
        lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""]


def bounds(found: Found, method: str) -> str:
    """The ranges in which a method is usable, in words."""
    if method == "path" and found.study.truth is None:
        return "exact"
    ranges, unsure = found.usable(method), "~ " * found.unsure(method)
    if not ranges:
        return f"{unsure}nowhere"
    low, high = found.steps[0].value, found.steps[-1].value
    words = []
    for start, end in ranges:
        if start <= low and end >= high:
            words.append("all")
        elif start <= low:
            words.append(f"to {_rounded(end)}")
        elif end >= high:
            words.append(f"from {_rounded(start)}")
        else:
            words.append(f"{_rounded(start)} to {_rounded(end)}")
    return unsure + ", ".join(words)


def _study(found: Found) -> list[str]:
    study = found.study
    lines = [f"## {study.name}", "", f"{study.title} ({study.axis}.)", "",
             f"![{study.title}]({study.name}.png)", ""]  # fmt: skip
    for method in SHADERS:
        if method == "path" and study.truth is None:
            continue
        jump = found.greatest_jump(method)
        how = "gradually" if jump <= BOUND else f"by steps of up to {100 * jump:.0f} %"
        lines.append(f"- {method}: within {100 * BOUND:g} % {bounds(found, method)}; degrades {how}.")
    prices = [(step.outcome("path").seconds_to_target, step.value) for step in found.steps]
    (least, at_least), (most, at_most) = min(prices), max(prices)
    lines.append(
        f"- path costs from {least:.3g} (at {at_least:g}) to {most:.3g} CPU seconds (at {at_most:g}) to "
        f"{100 * TARGET:g} % noise."
    )
    lines += [f"- `auto` at quality {choice.quality:g} and {step.value:g}: {choice.shader} is "
              f"{100 * max(step.outcome(choice.shader).here_squared_bias, 0) ** 0.5:.0f} % wrong, "
              f"{100 * choice.allowed:.2g} % allowed, {100 * (choice.predicted or 0):.2g} % predicted."
              for step, choice in found.broken()]  # fmt: skip
    if not found.broken():
        lines.append("- `auto` leaves every method before it fails, at all qualities.")
    lines += [
        f"- Rare events, {outcome.method} at {step.value:g}: {outcome.rare.split(';')[0]}."
        for step, outcome in found.rare()
    ]
    if not found.rare():
        lines.append("- Rare events are within budget everywhere.")
    if study.blind_to:
        lines.append(f"- Blind to {study.blind_to}.")
    return [*lines, ""]


def limits(found: Sequence[Found], quick: bool) -> str:
    """The page of bounds: the table, then each study in which a method leaves its bound."""
    lines = [
        "# Limits", "",
        "Where each method fails, marked from measured data (`sss-chart stability`). "
        f"{sentence(machine())}." + " Quick run: every other value, short renders." * quick, "",
        "How errors are measured is said in accuracy.md; holes, noise and far-off meshes are judged by the clean mesh, "
        "so that path can be wrong there, and it is told so by sss-check and by warnings of rare events.", "",
        *_table(found),
        "## What `auto` does not handle", "",
    ]  # fmt: skip
    broken = [(one, step, choice) for one in found for step, choice in one.broken()]
    lines += _promises(broken) if broken else ["Nothing: it leaves every method before it fails.", ""]
    for one in found:
        failing = [method for method in SHADERS if bounds(one, method) not in ("all", "exact")]
        if failing:
            lines += [f"## {one.study.name}", "", f"{one.study.title} Beyond 10 % somewhere: {', '.join(failing)}.",
                      "", f"![{one.study.title}]({one.study.name}.png)", ""]  # fmt: skip
    return "\n".join(lines)


def _promises(broken: Sequence[tuple]) -> list[str]:
    lines = [
        "| study | value | quality | chosen | wrong by | allowed | predicted |",
        "|---|---:|---:|---|---:|---:|---:|",
    ]
    for one, step, choice in broken:
        wrong = 100 * max(step.outcome(choice.shader).here_squared_bias, 0) ** 0.5
        lines.append(
            f"| {one.study.name} | {step.value:g} | {choice.quality:g} | {choice.shader} | {wrong:.0f} % | "
            f"{100 * choice.allowed:.2g} % | {100 * (choice.predicted or 0):.2g} % |"
        )
    return [*lines, ""]


def _rounded(value: float) -> str:
    """To two figures."""
    return f"{float(f'{value:.2g}'):g}"


def _values(values: Iterable[float]) -> str:
    return ", ".join(f"{value:g}" for value in dict.fromkeys(values))
