"""Error against time for one scene: which runs to make, in which order, and what they say.

The first turn goes up every sweep from a single pass, in steps, for as long as the time allotted to the sweep
lasts for all turns; it finds out how fast the machine is. Then the exact halves are rendered that everything is judged
by, then the further turns, each method after the other and in reversed order every other time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

from .accuracy import Truth
from .judges import Bias
from .measured_runs import Lab, PeerFailed, Run, Task
from .methods import FAST, SHADERS

STEP, LONG_STEP = 4, 16
"""From one number of passes to the next; the long one while even so many times the rendering is shorter than the
set-up, for the fast methods always: they have little noise to show."""
LEAST_POINTS = 2
"""Of every sweep, whatever the time."""
SHARES = {"path": 0.3, "plumb": 0.05, "scalar": 0.03, "diffuse": 0.03, "auto": 0.13, "mitsuba": 0.12}
REFERENCE_SHARE = 0.34
"""Of a scene's time. Both halves of the reference have some five times the passes of the longest run judged by them."""
METHODS = (*SHADERS, "auto", "mitsuba")
MOST_FAST_PASSES = 256
"""Then pixels have no jags left, and a fast method is as good as it gets."""
MOST_AUTO_PASSES = 64
SURE = 3.0
"""Standard errors of a bias that is more than chance. Products of noise have heavy tails: fewer would see biases in
short runs that have none."""
REFERENCE_SEEDS = (900_001, 900_002)


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    seconds    a scene, about
    turns      runs of every point
    qualities  of ``auto``
    """

    seconds: float = 540.0
    turns: int = 3
    qualities: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)


FULL = Effort()
QUICK = Effort(150.0, 2, (0.0, 0.5, 1.0))


@dataclass(frozen=True)
class Errors:
    """Of one run's picture, relative (see ``accuracy``). flip is None where the package is missing."""

    relative_mse: float
    flip: float | None

    @property
    def rms(self) -> float:
        """Relative root mean square error; NaN where chance took relMSE below zero."""
        return self.relative_mse**0.5 if self.relative_mse > 0 else float("nan")


@dataclass(frozen=True)
class Point:
    """All turns of one setting of one method, ``runs`` with ``errors``; bias where there are two turns."""

    method: str
    setting: str
    runs: tuple[Run, ...]
    errors: tuple[Errors, ...]
    bias: Bias | None

    def seconds(self, part: str = "seconds") -> tuple[float, float, float]:
        """Median, least and greatest of a time of ``Run``."""
        return _spread([getattr(run, part) for run in self.runs])

    def error(self, judge: str = "rms") -> tuple[float, float, float]:
        """Median, least and greatest of a judge of ``Errors``; NaN where it says nothing."""
        values = [value for errors in self.errors if (value := getattr(errors, judge)) is not None and value == value]
        return _spread(values) if values else (float("nan"),) * 3


def _spread(values: Sequence[float]) -> tuple[float, float, float]:
    return median(values), min(values), max(values)


@dataclass(frozen=True)
class Measured:
    """A scene with all of its points.

    without_peer  why Mitsuba is not among them, or None
    pixels        of the whole picture
    """

    scene: str
    source: str
    points: tuple[Point, ...]
    reference: tuple[Run, Run]
    truth_noise: float
    pixels: tuple[int, int]
    without_peer: str | None

    def of(self, method: str) -> list[Point]:
        """The points of one method, in the order of its sweep."""
        return [point for point in self.points if point.method == method]

    def pareto(self, part: str = "seconds", judge: str = "rms") -> list[Point]:
        """Points to which no other is both faster and better, from fast to slow."""
        usable = [point for point in self.points if point.error(judge)[0] == point.error(judge)[0]]
        front: list[Point] = []
        for point in sorted(usable, key=lambda point: (point.seconds(part)[0], point.error(judge)[0])):
            if not front or point.error(judge)[0] < front[-1].error(judge)[0]:
                front.append(point)
        return front


def measure(
    lab: Lab, scene: str, source: str, effort: Effort, peer: bool, remaining: Callable[[float], None] = lambda _: None
) -> Measured:
    """All runs of a scene, those that the lab does not know yet made now.

    peer       whether Mitsuba takes part
    remaining  is told about how many seconds the scene still takes, before each run

    Raises InputError for a scene that cannot be rendered.
    """
    measurement = _Measurement(lab, scene, source, effort, remaining, None if peer else "not installed")
    first = measurement.first_turn()
    reference = measurement.reference(first)
    runs = [*first, *measurement.further_turns(first)]
    without_peer = measurement.without_peer
    if without_peer is not None:
        runs = [one for one in runs if one.task.method != "mitsuba"]
    return judged(lab, scene, source, runs, reference, without_peer)


@dataclass
class _Measurement:
    """The runs of a scene, as they are made.

    without_peer  why Mitsuba takes no part, or None
    spent         seconds so far
    """

    lab: Lab
    scene: str
    source: str
    effort: Effort
    remaining: Callable[[float], None]
    without_peer: str | None
    spent: float = 0.0

    def first_turn(self) -> list[Run]:
        """Every sweep once: how far each goes is found out by the way."""
        runs = self._climb("path")
        for method in FAST:
            runs += self._climb(method)
        passes = _auto_passes(runs, self.effort)
        runs += [self._run(self._task("auto", passes, 0, quality)) for quality in self.effort.qualities]
        if self.without_peer is None:
            try:
                runs += self._climb("mitsuba")
            except PeerFailed as words:
                self._leave_peer_out(words)
        return runs

    def reference(self, first: Sequence[Run]) -> tuple[Run, Run]:
        """The exact halves that everything is judged by, as long as their share of the time lasts."""
        longest = [one for one in first if one.task.method == "path"][-1]
        share = REFERENCE_SHARE * self.effort.seconds
        each = share / 2 - (longest.seconds - longest.render)
        count = max(int(each / longest.render * longest.task.passes), STEP)
        later = (self.effort.turns - 1) * sum(one.seconds for one in first)
        one, two = (
            self._run(Task(self.scene, self.source, "reference", count, half, seed), (2 - half) * share / 2 + later)
            for half, seed in enumerate(REFERENCE_SEEDS)
        )
        return one, two

    def further_turns(self, first: Sequence[Run]) -> list[Run]:
        """The same runs again with other seeds, each method after the other and in reversed order every other time."""
        runs = []
        left = (self.effort.turns - 1) * sum(one.seconds for one in first)
        for turn in range(1, self.effort.turns):
            for known in first[:: -1 if turn % 2 else 1]:
                one = known.task
                try:
                    if one.method != "mitsuba" or self.without_peer is None:
                        runs.append(self._run(self._task(one.method, one.passes, turn, one.quality), left))
                except PeerFailed as words:
                    self._leave_peer_out(words)
                left -= known.seconds
        return runs

    def _climb(self, method: str) -> list[Run]:
        """The first turn of a sweep."""
        allotted = SHARES[method] * self.effort.seconds / self.effort.turns
        most = MOST_FAST_PASSES if method in FAST else 2**30
        runs = [self._run(self._task(method, 1, 0))]
        while True:
            setup, render = runs[-1].seconds - runs[-1].render, runs[-1].render
            step = LONG_STEP if method in FAST or LONG_STEP * render < setup else STEP
            passes = step * runs[-1].task.passes
            expected = setup + step * render
            late = sum(one.seconds for one in runs) + expected > allotted
            if passes > most or (late and len(runs) >= LEAST_POINTS):
                return runs
            runs.append(self._run(self._task(method, passes, 0)))

    def _task(self, method: str, passes: int, turn: int, quality: float | None = None) -> Task:
        return Task(self.scene, self.source, method, passes, turn, 1 + turn, quality)

    def _run(self, task: Task, left: float | None = None) -> Run:
        """Made or known; ``left`` seconds remain before it, None: what was not spent of the effort."""
        self.remaining(max(self.effort.seconds - self.spent, 0.0) if left is None else left)
        done = self.lab.run(task)
        self.spent += done.seconds
        return done

    def _leave_peer_out(self, words: PeerFailed) -> None:
        self.without_peer = f"it failed: {words}"


def _auto_passes(first: Sequence[Run], effort: Effort) -> int:
    """The most passes, of those in the sweep of path, with which ``auto`` stays within its time."""
    allotted = SHARES["auto"] * effort.seconds / effort.turns / len(effort.qualities)
    fitting = [one.task.passes for one in first if one.task.method == "path" and one.seconds <= allotted]
    return min(max(fitting, default=1), MOST_AUTO_PASSES)


def judged(
    lab: Lab, scene: str, source: str, runs: Sequence[Run], reference: tuple[Run, Run], without_peer: str | None
) -> Measured:
    """The runs of a scene held against its reference."""
    pictures = [lab.picture(half.task) for half in reference]
    truth = Truth(
        (pictures[0]["image"].astype(float), pictures[1]["image"].astype(float)),
        pictures[0]["where"] & pictures[1]["where"],
    )
    settings = dict.fromkeys((run.task.method, run.task.setting) for run in runs)
    points = []
    for method, setting in settings:
        mine = [run for run in runs if (run.task.method, run.task.setting) == (method, setting)]
        images = [lab.picture(run.task)["image"] for run in mine]
        errors = tuple(Errors(truth.relative_mse(image), _flip(truth, image)) for image in images)
        bias = truth.bias(images) if len(images) > 1 else None
        points.append(Point(method, setting, tuple(mine), errors, bias))
    points.sort(key=lambda point: METHODS.index(point.method))
    height, width = truth.where.shape
    noise = mean(half.stderr or float("nan") for half in reference) / 2**0.5
    return Measured(scene, source, tuple(points), reference, noise, (width, height), without_peer)


def _flip(truth: Truth, image) -> float | None:
    from importlib.util import find_spec

    return truth.flip(image) if find_spec("flip_evaluator") is not None else None


# ---- rows ----

COLUMNS = (
    "scene", "method", "passes", "quality", "turn", "seed", "seconds", "setup_seconds", "build_seconds",
    "render_seconds", "cpu_seconds", "relmse", "relative_rms_error", "mean_relative_stderr", "squared_bias",
    "squared_bias_stderr", "flip", "shaders", "load_average", "command",
)  # fmt: skip


def rows(measured: Measured) -> Iterable[dict[str, object]]:
    """One for every run, the reference's at the end; bias is that of all turns together."""
    for point in measured.points:
        for run, errors in zip(point.runs, point.errors, strict=True):
            yield {
                **_row(run),
                "relmse": errors.relative_mse,
                "relative_rms_error": errors.rms,
                "squared_bias": None if point.bias is None else point.bias.squared,
                "squared_bias_stderr": None if point.bias is None else point.bias.stderr,
                "flip": errors.flip,
            }
    for run in measured.reference:
        yield _row(run)


def _row(run: Run) -> dict[str, object]:
    task = run.task
    return {
        "scene": task.scene, "method": task.method, "passes": task.passes, "quality": task.quality, "turn": task.turn,
        "seed": task.seed, "seconds": run.seconds, "setup_seconds": run.setup, "build_seconds": run.build,
        "render_seconds": run.render, "cpu_seconds": run.cpu, "mean_relative_stderr": run.stderr,
        "shaders": run.shaders, "load_average": run.load, "command": run.command,
    }  # fmt: skip


def names(sources: Sequence[Path]) -> dict[str, Path]:
    """A name for each scene, its file's; numbered where two files have the same."""
    named: dict[str, Path] = {}
    for source in sources:
        name, count = source.stem, 1
        while name in named:
            count += 1
            name = f"{source.stem}-{count}"
        named[name] = source
    return named
