"""Does the error fall and the time rise with every step of --quality?

    PYTHONPATH=. python benchmarks/quality.py [--size PIXELS] [--steps N] [--most Q] [--reference N] [--work FOLDER]
                                              [-o FOLDER]

Six scenes. A step is rendered as ``sss-render --quality`` does, in rounds that go by the noise seen. Its error is the
root mean square over the object's pixels and channels against path at ``--reference`` passes, the reference's own noise
taken off, over the mean. Where path lights all of it the picture's own standard error is taken, which is surer. Seconds
are CPU seconds of the passes: set-up is left out, and short renders are repeated, of which the fastest counts.

Steps are compared pixel by pixel, so that what they have in common cancels: an error *rises* where the mean square of
one step is above that of the step before by more than two standard errors of their difference, a time *falls* where it
is below that of the step before by more than a tenth, what such clocks are good for. A step is *dominated* by another
that is surely less wrong and surely faster. Steps with the same shares and passes are the same picture.

What was measured is kept in --work, and an interrupted run goes on there; remove it when a shader or the choice of
shaders has changed. Writes quality_steps.json, quality_steps.md and images/quality_steps.png into FOLDER, docs/ by
default.
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
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import EnvironmentLight, Scene
from renderer.scene.staging import frame_camera
from renderer.shaders.selection import picture_passes
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
SURE = 2.0
"""Standard errors of a difference."""
CLOCK = 0.1
"""Relative differences of CPU seconds that say nothing."""
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

    def same_as(self, other: Step) -> bool:
        """Whether the picture is the same."""
        return self.shares == other.shares and self.passes == other.passes

    def more_wrong_by(self, other: Step) -> float:
        """How far its mean square is above that of ``other``, in standard errors of the difference."""
        difference = np.subtract(self.squares, other.squares)
        doubt = float(difference.std(ddof=1)) / len(difference) ** 0.5
        return float(difference.mean()) / max(doubt, 1e-30)

    def dominated_by(self, other: Step) -> bool:
        """Whether ``other`` is surely less wrong and surely faster."""
        return self.more_wrong_by(other) > SURE and other.seconds < (1 - CLOCK) * self.seconds


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=24)
    parser.add_argument("--steps", type=int, default=11)
    parser.add_argument("--most", type=float, default=1.0, help="highest quality")
    parser.add_argument("--reference", type=int, default=2048, help="passes")
    parser.add_argument("--work", type=Path, default=Path("out/quality"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    found = {}
    for name in SCENES:
        found[name] = sweep(name, options)
        print(name, verdict(found[name]), flush=True)
    (options.output / "images").mkdir(parents=True, exist_ok=True)
    draw(found, options.output / "images" / "quality_steps.png")
    figures = {name: [_row(step) for step in steps] for name, steps in found.items()}
    (options.output / "quality_steps.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(found, options)
    (options.output / "quality_steps.md").write_text(text)
    print(text)


def sweep(name: str, options) -> list[Step]:
    """The steps of one scene, as far as they were measured before from the store."""
    medium, solid, lights = SCENES[name]
    mesh = solid()
    scene = Scene("mm", frame_camera(mesh, (options.size, options.size)), lights, (body(name, medium, mesh),))
    scene = admit(scene)[0]
    stem = f"{name.replace(',', '').replace(' ', '_')}_{options.size}"
    store = options.work / f"{stem}_{options.reference}.jsonl"
    steps = [Step(**json.loads(line)) for line in store.read_text().splitlines()] if store.exists() else []
    reference = _reference(scene, options.work / f"{stem}.npz", options.reference)
    for quality in np.linspace(0, options.most, options.steps)[len(steps) :]:
        steps.append(measured(scene, round(float(quality), 6), reference))
        with store.open("a") as file:
            file.write(json.dumps(asdict(steps[-1])) + "\n")
        print(name, _row(steps[-1]), flush=True)
    return steps


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


def measured(scene: Scene, quality: float, reference: Film) -> Step:
    """A step, rendered."""
    renderer = Renderer(scene, Settings(quality=quality, threads=1))
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
    pairs = pairwise(steps)
    return [b.quality for a, b in pairs if not b.same_as(a) and b.seconds < (1 - CLOCK) * a.seconds]


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


def draw(found: dict[str, list[Step]], file: Path) -> None:
    """Error against time, a line for each scene."""
    plots = pyplot()
    figure, axes = plots.subplots(figsize=(7, 4.2))
    for (name, steps), colour in zip(found.items(), COLOURS.values(), strict=False):
        axes.loglog(
            [s.seconds for s in steps], [100 * s.error for s in steps], "o-", ms=3, lw=1, color=colour, label=name
        )
    axes.set(xlabel="CPU seconds", ylabel="error, %", title="--quality from 0 (left) to 1 (right)")
    axes.legend()
    figure.savefig(file, dpi=130, facecolor="white")
    plots.close(figure)


def markdown(found: dict[str, list[Step]], options) -> str:
    """A table for each scene."""
    parts = []
    for name, steps in found.items():
        rows = "\n".join(
            f"| {one.quality:.1f} | {', '.join(f'{n} {100 * s:.0f} %' for n, s in one.shares.items())} | "
            f"{one.passes} | {one.seconds:.2g} | {100 * one.error:.2g} % | {100 * one.tolerance:.2g} % |"
            for one in steps
        )
        parts.append(f"## {name[0].upper()}{name[1:]}: {verdict(steps)}\n\n"
                     "| quality | shaders | passes | CPU s | error | tolerance |\n|---:|---|---:|---:|---:|---:|\n"
                     f"{rows}\n")  # fmt: skip
    good = sum(verdict(steps) == "monotone" for steps in found.values())
    return f"""# The steps of --quality

Six scenes, {options.size} pixels square, {options.steps} steps each: in {good} of {len(found)} the error falls and the
time rises with every step, and none is beaten by another in both. Errors are root mean squares over object pixels and
channels as a share of the mean, against path at {options.reference} passes, whose noise is taken off; where path lights
all of the object they are its own standard error. Two steps are held against each other pixel by pixel: an error rises
if it is above the one before by more than {SURE:g} standard errors of their difference. Seconds are CPU seconds of the
passes without set-up, and tell apart what differs by {100 * CLOCK:.0f} %. Steps with the same shares and passes are the
same picture. Made by `benchmarks/quality.py`.

![Error against time](images/quality_steps.png)

{chr(10).join(parts)}"""


if __name__ == "__main__":
    main()
