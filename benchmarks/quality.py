"""Does the error fall and the time rise with every step of --quality?

    PYTHONPATH=. python benchmarks/quality.py [--size PIXELS] [--steps N] [--most Q] [--reference N] [--scenes NAME...]
                                              [--work FOLDER] [-o FOLDER]

Six scenes, each by prediction and with ``--pilot``, whose seconds are told apart. A step is rendered as ``sss-render
--quality`` does, in rounds that go by the noise seen. Its error is the root mean square over the object's pixels and
channels against path at ``--reference`` passes, the reference's own noise taken off, over the mean. Where path lights
all of it the picture's own standard error is taken, which is surer. Seconds are CPU seconds of the passes: set-up is
left out, and short renders are repeated, of which the fastest counts.

Steps are compared pixel by pixel, so that what they have in common cancels: an error *rises* where the mean square of
one step is above that of the step before by more than two standard errors of their difference, a time *falls* where it
is below that of the step before by more than a tenth and 20 ms, what clocks and pictures of a hundred pixels are good
for. A step is *dominated* by another that is surely less wrong and surely faster.

What was measured is kept in --work, and an interrupted run goes on there; remove it when a shader or the choice of
shaders has changed. Writes quality_steps.json, quality_steps.md and images/quality_steps.png into FOLDER, docs/ by
default, unless only some of the scenes are asked for.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.dolly import LIGHTS, body
from renderer.enough import rounds
from renderer.output.film import Film
from renderer.pilot import measure
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import EnvironmentLight, Scene
from renderer.scene.staging import frame_camera
from renderer.shaders.appearance import appearance
from renderer.shaders.prediction import Error, predicted_errors
from renderer.shaders.selection import Measured, picture_passes
from renderer.study.drawing import COLOURS, pyplot
from sss_tools import shapes
from sss_tools.elephant import elephant

SKY = (EnvironmentLight(radiance=np.ones(3)),)
SCENES = {
    "ball of jade, sun": ("jade", lambda: shapes.icosphere(1.0, 4), LIGHTS),
    "ball of marble, sky": ("marble", lambda: shapes.icosphere(1.0, 4), SKY),
    "torus of wax, sun": ("wax", lambda: shapes.torus(1.0, 0.35), LIGHTS),
    "flat ellipsoid of milk, sun": ("milk", lambda: shapes.ellipsoid((1.0, 1.0, 0.3), 4), LIGHTS),
    "box of wax, sky": ("wax", lambda: shapes.box((1.0, 0.6, 0.8)), SKY),
    "elephant of jade, sun": ("jade", elephant, LIGHTS),
}
WAYS = "by prediction", "with --pilot"
SURE = 2.0
"""Standard errors of a difference."""
CLOCK, TICK = 0.1, 0.02
"""Differences of CPU seconds that say nothing: relative, and in seconds. Small pictures are mostly calls."""
SHORT, REPEATS = 1.0, 50
"""CPU seconds below which renders are repeated, as often."""


@dataclass(frozen=True)
class Step:
    """A quality, and what it gave.

    shares     of the camera samples, by shader
    seconds    CPU seconds of the passes
    tolerance  relative error allowed
    squares    (pixels) squared error, mean of the channels, over the square of the mean radiance; without bias
    """

    quality: float
    shares: dict[str, float]
    passes: int
    seconds: float
    tolerance: float
    squares: list[float]

    @property
    def error(self) -> float:
        """Relative root mean square."""
        return max(float(np.mean(self.squares)), 0.0) ** 0.5

    def more_wrong_by(self, other: Step) -> float:
        """How far its mean square is above that of ``other``, in standard errors of the difference."""
        difference = np.subtract(self.squares, other.squares)
        doubt = float(difference.std(ddof=1)) / len(difference) ** 0.5
        return float(difference.mean()) / max(doubt, 1e-30)

    def faster_than(self, other: Step) -> bool:
        """Whether its seconds are surely fewer."""
        return self.seconds < (1 - CLOCK) * other.seconds - TICK

    def dominated_by(self, other: Step) -> bool:
        """Whether ``other`` is surely less wrong and surely faster."""
        return self.more_wrong_by(other) > SURE and other.faster_than(self)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=24)
    parser.add_argument("--steps", type=int, default=11)
    parser.add_argument("--most", type=float, default=1.0, help="highest quality")
    parser.add_argument("--reference", type=int, default=2048, help="passes")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES), metavar="NAME", help="only these")
    parser.add_argument("--work", type=Path, default=Path("out/quality"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    found = {}
    for name in options.scenes:
        found[name] = sweeps(name, options)
        print(name, {way: verdict(steps) for way, steps in found[name].steps.items()}, flush=True)
    if len(found) < len(SCENES):
        return
    (options.output / "images").mkdir(parents=True, exist_ok=True)
    draw(found, options.output / "images" / "quality_steps.png")
    figures = {
        name: {
            "predicted": one.predicted,
            "measured": one.measured,
            "pilot_seconds": one.pilot_seconds,
            "steps": {way: [_row(step) for step in steps] for way, steps in one.steps.items()},
        }
        for name, one in found.items()
    }
    (options.output / "quality_steps.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(found, options)
    (options.output / "quality_steps.md").write_text(text)
    print(text)


@dataclass(frozen=True)
class Sweeps:
    """What was found of a scene.

    steps                by ``WAYS``
    predicted, measured  error of each fast shader: before the render, and by the pilot
    pilot_seconds        CPU seconds that the pilot took
    """

    steps: dict[str, list[Step]]
    predicted: dict[str, float]
    measured: dict[str, float]
    pilot_seconds: float


def sweeps(name: str, options) -> Sweeps:
    """The steps of one scene, as far as they were measured before from the store."""
    medium, solid, lights = SCENES[name]
    mesh = solid()
    scene = Scene("mm", frame_camera(mesh, (options.size, options.size)), lights, (body(name, medium, mesh),))
    scene = admit(scene)[0]
    stem = f"{name.replace(',', '').replace(' ', '_')}_{options.size}"
    reference = _reference(scene, options.work / f"{stem}.npz", options.reference)
    pilot, seconds = _pilot(scene, options.work / f"{stem}_pilot.json")
    found = {}
    for way, known in zip(WAYS, (None, pilot), strict=True):
        store = options.work / f"{stem}_{options.reference}_{way.split()[-1]}.jsonl"
        steps = [Step(**json.loads(line)) for line in store.read_text().splitlines()] if store.exists() else []
        for quality in np.linspace(0, options.most, options.steps)[len(steps) :]:
            steps.append(measured(scene, round(float(quality), 6), reference, known))
            with store.open("a") as file:
                file.write(json.dumps(asdict(steps[-1])) + "\n")
            print(name, way, _row(steps[-1]), flush=True)
        found[way] = steps
    (thing,) = scene.objects
    predicted = {shader: error.error for shader, error in predicted_errors(appearance(scene, thing)).items()}
    return Sweeps(
        found, predicted, {shader: error.error for shader, error in pilot[thing.name].errors.items()}, seconds
    )


def _pilot(scene: Scene, store: Path) -> tuple[dict[str, Measured], float]:
    """What ``--pilot`` finds, and the CPU seconds that it takes."""
    (thing,) = scene.objects
    if not store.exists():
        start = time.process_time()
        found = measure(scene, Settings(threads=1))[thing.name]
        store.write_text(json.dumps(asdict(found) | {"seconds": time.process_time() - start}))
    known = json.loads(store.read_text())
    errors = {shader: Error(**error) for shader, error in known["errors"].items()}
    return {thing.name: Measured(errors, Error(**known["noise"]))}, known["seconds"]


def _reference(scene: Scene, store: Path, passes: int) -> Film:
    """Path at so many passes."""
    if store.exists():
        with np.load(store) as arrays:
            film = Film.from_arrays(dict(arrays))
        if film.passes == passes:
            return film
    renderer = Renderer(scene, Settings(shader="path", seed=99, threads=1))
    renderer.run(range(passes))
    np.savez(store, **renderer.film.arrays())
    return renderer.film


def measured(scene: Scene, quality: float, reference: Film, pilot: dict[str, Measured] | None) -> Step:
    """A step, rendered; ``pilot``: what one found."""
    renderer = Renderer(scene, Settings(quality=quality, threads=1), measured=pilot)
    renderer.run([0])  # what is built at first use is set-up
    (plan,) = renderer.plans
    taken: list[float] = []
    while not taken or (sum(taken) < SHORT and len(taken) < REPEATS):
        renderer.film = Film.blank(renderer.film.resolution, renderer.film.scene_hash, renderer.film.seed)
        start = time.process_time()
        for passes, _ in rounds(renderer, picture_passes(renderer.plans)):
            renderer.run(range(renderer.film.passes, passes))
        taken.append(time.process_time() - start)
    film, where = renderer.film, reference.object_pixels()
    if set(plan.shares) == {"path"} and film.passes > 1:
        squares = film.stderr()[where] ** 2
    else:
        squares = (film.mean()[where] - reference.mean()[where]) ** 2 - reference.stderr()[where] ** 2
    level = float(reference.mean()[where].mean())
    by_pixel: NDArray[np.float64] = squares.mean(axis=1) / level**2
    return Step(quality, plan.shares, film.passes, min(taken), float(plan.tolerance or 0), by_pixel.tolist())


def rises(steps: list[Step]) -> list[float]:
    """Qualities at which the error is above that of the step before."""
    return [b.quality for a, b in pairwise(steps) if b.more_wrong_by(a) > SURE]


def falls(steps: list[Step]) -> list[float]:
    """Qualities at which the time is below that of the step before."""
    return [b.quality for a, b in pairwise(steps) if b.faster_than(a)]


def dominated(steps: list[Step]) -> list[float]:
    """Qualities that another one beats in both."""
    return [one.quality for one in steps if any(one.dominated_by(other) for other in steps)]


def verdict(steps: list[Step]) -> str:
    """In a few words."""
    wrong = {"error rises": rises(steps), "time falls": falls(steps), "dominated": dominated(steps)}
    said = [f"{what} at {', '.join(f'{q:g}' for q in where)}" for what, where in wrong.items() if where]
    return "; ".join(said) or "monotone"


def _row(step: Step) -> dict:
    """What is told of a step."""
    return {**{k: v for k, v in asdict(step).items() if k != "squares"}, "error": step.error}


def draw(found: dict[str, Sweeps], file: Path) -> None:
    """Error against time, a line for each scene."""
    plots = pyplot()
    figure, both = plots.subplots(1, 2, figsize=(11, 4.4), sharex=True, sharey=True)
    for axes, way in zip(both, WAYS, strict=True):
        for (name, one), colour in zip(found.items(), COLOURS.values(), strict=False):
            seconds, errors = zip(*((step.seconds, 100 * step.error) for step in one.steps[way]), strict=True)
            axes.loglog(seconds, errors, "o-", ms=3, lw=1, color=colour, label=name)
        axes.set(xlabel="CPU seconds", title=f"--quality from 0 (left) to 1 (right), {way}")
    both[0].set_ylabel("error, %")
    both[0].legend()
    figure.savefig(file, dpi=130, facecolor="white")
    plots.close(figure)


def markdown(found: dict[str, Sweeps], options) -> str:
    """Two tables for each scene."""
    good = [sum(verdict(one.steps[way]) == "monotone" for one in found.values()) for way in WAYS]
    return f"""# The steps of --quality

Six scenes, {options.size} pixels square, {options.steps} steps each. In {good[0]} of {len(found)} by prediction,
and in {good[1]} with `--pilot`, the error falls and the time rises with every step, and none is beaten by
another in both. Where that is not so a fast shader is less wrong than predicted: path, which replaces it, is asked for
no less noise than the prediction says that shader is wrong. A pilot knows better.

Errors are root mean squares over object pixels and channels as a share of the mean, against path at {options.reference}
passes, whose noise is taken off; where path lights all of the object they are its own standard error. Two steps are
held against each other pixel by pixel: an error rises if it is above the one before by more than {SURE:g} standard
errors of their difference. Seconds are CPU seconds of the passes without set-up and pilot, and tell apart what differs
by more than {100 * CLOCK:.0f} % and {1000 * TICK:.0f} ms: frames of fast shaders take 1 to 3 ms at this size. Made by
`benchmarks/quality.py`.

![Error against time](images/quality_steps.png)

{chr(10).join(_section(name, one) for name, one in found.items())}"""


def _section(name: str, one: Sweeps) -> str:
    """A scene."""
    expected = ", ".join(
        f"{shader} {_percent(error)} ({_percent(one.measured[shader])})" for shader, error in one.predicted.items()
    )
    parts = [f"## {name[0].upper()}{name[1:]}\n\nPredicted errors, and as the pilot measured them in "
             f"{one.pilot_seconds:.2g} CPU seconds: {expected}.\n"]  # fmt: skip
    for way, steps in one.steps.items():
        rows = "\n".join(
            f"| {step.quality:.1f} | {', '.join(f'{n} {100 * s:.3g} %' for n, s in step.shares.items())} | "
            f"{step.passes} | {step.seconds:.2g} | {_percent(step.error)} | {_percent(step.tolerance)} |"
            for step in steps
        )
        head = "| quality | shaders | passes | CPU s | error | tolerance |\n|---:|---|---:|---:|---:|---:|"
        parts.append(f"{way.capitalize()}: {verdict(steps)}.\n\n{head}\n{rows}\n")
    return "\n".join(parts)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


if __name__ == "__main__":
    main()
