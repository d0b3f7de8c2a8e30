"""Measures the steps of a sweep.

At each value the exact picture is rendered as two halves, as long as a time for it lasts, and the faster shaders as
two pictures of other random numbers. Errors are relative biases (``accuracy.Truth.bias``), free of noise but for the
stated standard error.
"""

from __future__ import annotations

import json
import math
import shlex
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from hashlib import blake2b
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..render import Renderer
from ..report import rare_event_warnings
from ..scene.scene_file import load_scene
from ..shaders.appearance import appearance
from ..shaders.selection import select, tolerance
from .accuracy import Truth
from .measured_runs import add_to_log, read_log
from .methods import SHADERS, options, settings
from .stability import QUALITIES, Choice, Found, Outcome, Step
from .studies import Study

HALF_SEEDS, FAST_SEEDS, TRUTH_SEEDS = (1, 2), (3, 4), (5, 6)
"""Apart from each other: a shader draws the same places in a pixel from the same seed."""
FAST_PASSES = 16
PILOT_PASSES, MOST_PASSES = 8, 1024
BLOCK = 2
"""Pixels along a side of the squares whose means are judged: less noise, and nothing in these pictures is smaller."""


@dataclass(frozen=True)
class Effort:
    """seconds of rendering that each half of an exact picture takes, about."""

    seconds: float
    stride: int = 1


FULL, QUICK = Effort(6.0), Effort(1.2, 2)


@dataclass
class Bench:
    """Measures steps, in ``folder``, and keeps them in a log there."""

    folder: Path
    effort: Effort

    def __post_init__(self) -> None:
        self._truths: dict[str, tuple[Truth, str]] = {}
        self._log = self.folder / "steps.jsonl"
        self._known: dict[str, Step] = {}
        for entry in read_log(self._log):
            try:
                self._known[entry["key"]] = _step(entry["step"])
            except (KeyError, TypeError):
                continue

    def values(self, study: Study) -> tuple[float, ...]:
        """Of the sweep, as the effort has it: every ``stride``-th, and the last."""
        values = study.values[:: self.effort.stride]
        return values if values[-1] == study.values[-1] else (*values, study.values[-1])

    def known(self, study: Study, value: float) -> Step | None:
        """The step, where an earlier session measured it."""
        return self._known.get(self._key(study, value))

    def step(self, study: Study, value: float) -> Step:
        """The step, measured now if need be. Its scene is written below ``scenes``."""
        known = self.known(study, value)
        if known is not None:
            return known
        done = self._measure(study, value)
        self._known[self._key(study, value)] = done
        add_to_log(self._log, {"key": self._key(study, value), "step": asdict(done)})
        return done

    def _key(self, study: Study, value: float) -> str:
        case = study.scene(value)
        told = [case.medium, case.lights, case.camera, case.seed, self.effort.seconds]
        digest = blake2b(json.dumps(told, default=list).encode(), digest_size=8)
        for mesh in case.meshes:
            digest.update(mesh.vertices.tobytes() + mesh.faces.tobytes())
        return f"{study.name} {value:g} {digest.hexdigest()}"

    def _measure(self, study: Study, value: float) -> Step:
        name = f"{study.name}-{value:g}"
        case = study.scene(value)
        scenes = self.folder / "scenes"
        scenes.mkdir(parents=True, exist_ok=True)
        path = case.write(scenes, name)
        shift = 10 * case.seed
        halves, renderer, passes, cpu = self._exact(path, [seed + shift for seed in HALF_SEEDS])
        here = _filled(renderer)
        pixels = here
        commands = _commands(path, "path", passes, [seed + shift for seed in HALF_SEEDS])
        if study.truth is not None:
            truth, commands = self._truth(study, scenes)
            pixels = here & truth.where
            truth = Truth(truth.halves, pixels)
        own = Truth((halves[0], halves[1]), pixels)
        noise = float(np.nanmean([one.film.mean_relative_stderr() for one in renderer]))
        outcomes = []
        for method in SHADERS:
            if method == "path":
                images, rare, seeds = halves, _rare(renderer), HALF_SEEDS
            else:
                seeds = FAST_SEEDS
                images, rare, cpu = self._fast(path, method, [seed + shift for seed in seeds])
            count = passes if method == "path" else FAST_PASSES
            against_own = own.bias(images) if method != "path" else None
            against = truth.bias(images) if study.truth is not None else against_own
            judge = truth if study.truth is not None else own
            difference = judge.difference(np.mean(images, axis=0))
            outcomes.append(Outcome(
                method, count,
                *((against.squared, against.stderr) if against is not None else (0.0, 0.0)),
                *((against_own.squared, against_own.stderr) if against_own is not None else (0.0, 0.0)),
                *(difference if against is not None else (0.0, 0.0)),
                noise if method == "path" else None, cpu, rare,
                _commands(path, method, count, [seed + shift for seed in seeds]),
            ))  # fmt: skip
        checked = renderer[0].scene
        choices, size = [], 0.0
        for quality in QUALITIES:
            plan = select(checked, quality)[0]
            size = appearance(checked, checked.objects[0]).size_px
            choices.append(Choice(quality, plan.shader, tolerance(quality, size), plan.predicted_error))
        return Step(value, size, int(pixels.sum()), tuple(outcomes), tuple(choices), renderer[0].plans[0].hole_handling,
                    commands)  # fmt: skip

    def _exact(self, path: Path, seeds: Sequence[int]) -> tuple[list[NDArray], list[Renderer], int, float]:
        """Images of the path shader, one a seed, with as many passes as the effort lasts for; CPU seconds of one."""
        scene, cpu, passes = load_scene(path), 0.0, PILOT_PASSES
        renderers: list[Renderer] = []
        for seed in seeds:
            renderer = Renderer(scene, settings("path", seed))
            begun = time.process_time()
            renderer.run(range(PILOT_PASSES))
            if not renderers:
                each = (time.process_time() - begun) / PILOT_PASSES
                # a power of two: the same on the next machine but for one that is much faster or slower
                wanted = 2 ** round(math.log2(max(self.effort.seconds / max(each, 1e-6), 1)))
                passes = min(max(wanted, PILOT_PASSES), MOST_PASSES)
            renderer.run(range(PILOT_PASSES, passes))
            cpu += (time.process_time() - begun) / len(seeds)
            renderers.append(renderer)
        return [_blocks(one.film.mean()) for one in renderers], renderers, passes, cpu

    def _fast(self, path: Path, method: str, seeds: Sequence[int]) -> tuple[list[NDArray], str, float]:
        scene, images, renderers, cpu = load_scene(path), [], [], 0.0
        for seed in seeds:
            renderer = Renderer(scene, settings(method, seed))
            begun = time.process_time()
            renderer.run(range(FAST_PASSES))
            cpu += (time.process_time() - begun) / len(seeds)
            images.append(_blocks(renderer.film.mean()))
            renderers.append(renderer)
        return images, _rare(renderers), cpu

    def _truth(self, study: Study, scenes: Path) -> tuple[Truth, str]:
        """The exact picture that all values are judged by, rendered once a session, and the commands that make it."""
        assert study.truth is not None
        if study.name not in self._truths:
            path = study.truth().write(scenes, f"{study.name}-truth")
            halves, renderers, passes, _ = self._exact(path, TRUTH_SEEDS)
            where = _filled(renderers)
            self._truths[study.name] = (
                Truth((halves[0], halves[1]), where), _commands(path, "path", passes, TRUTH_SEEDS)
            )  # fmt: skip
        return self._truths[study.name]


def _blocks(image: NDArray) -> NDArray:
    """(h / BLOCK, w / BLOCK, ...) means of squares of pixels."""
    height, width = (size - size % BLOCK for size in image.shape[:2])
    return image[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean(axis=(1, 3))


def _filled(renderers: Sequence[Renderer]) -> NDArray[np.bool_]:
    """The squares that the object fills."""
    pixels = np.logical_and.reduce([renderer.film.object_pixels() for renderer in renderers])
    return _blocks(pixels.astype(float))[..., 0] == 1


def _commands(path: Path, method: str, passes: int, seeds: Sequence[int]) -> str:
    """From the folder of the CSV."""
    return " && ".join(
        shlex.join(["sss-render", f"scenes/{path.name}", *options(method), "--passes", str(passes), "--seed", str(seed),
                    "-o", f"{path.stem}-{method}-{seed}.npz"])
        for seed in seeds
    )  # fmt: skip


def _rare(renderers: Sequence[Renderer]) -> str:
    return "; ".join(dict.fromkeys(text for renderer in renderers for text in rare_event_warnings(renderer)))


def _step(entry: dict) -> Step:
    outcomes = tuple(Outcome(**outcome) for outcome in entry.pop("outcomes"))
    choices = tuple(Choice(**choice) for choice in entry.pop("choices"))
    return Step(outcomes=outcomes, choices=choices, **entry)


def sweep(bench: Bench, study: Study, advance: Callable[[Step, bool], None] = lambda step, made: None) -> Found:
    """All steps of a study; ``advance`` is told of each, and whether it was measured now."""
    steps = []
    for value in bench.values(study):
        made = bench.known(study, value) is None
        steps.append(bench.step(study, value))
        advance(steps[-1], made)
    return Found(study, tuple(sorted(steps, key=lambda step: step.value)))
