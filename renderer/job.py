"""A render from the first pass to the written file: budgets, progress, checkpoints, the report."""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError
from sss_tools.memory import peak_memory

from . import adaptive, enough
from .cluster.queue import ClusterLost
from .cluster.renderer import ClusterRenderer
from .output import image, passes
from .output.film import Film
from .output.image import Picture
from .render import Renderer, planned_hash
from .scene.description import (
    DirectionalLight,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    SphereLight,
    Translucent,
)
from .scene.holes import HoleReport, in_mesh_units
from .shaders.selection import Plan
from .stages import Stages

DEFAULT_PASSES = 64
REFRESH_EVERY, REFRESH_SHARE = 1.0, 0.05
"""Checkpoint and preview are written at most once in so many seconds, and take at most this share of the time each."""
RETRY_EVERY = 30.0
"""Seconds until what could not be written is tried again: somebody may have made room on a full disk."""
LEAST_PASSES_FOR_ERROR = 4
"""A target error is not met by fewer: of two samples the square root of the variance is 20 % too small in the mean, of
four 8 %."""
LEAK_BUDGET, LOSS_BUDGET = 1e-5, 1e-3
"""Share of the paths that may contradict a closed surface, and that may be lost at holes, before it is worth a
warning."""
MUCH_LEAKED = 1e-3
"""Share of the paths from which on leaks of one object show."""


@dataclass(frozen=True)
class Budget:
    """When a render is done. ``first`` is the number of its first pass.

    last          one past the last pass; None where seconds or target_error decide
    seconds       wall seconds since ``started`` until the file is written
    target_error  mean relative standard error over object pixels
    adaptive      noisy pixels take part in more passes than others, see ``adaptive``
    started       when the command began, by ``time.monotonic``: clocks may be set while a render runs
    by_noise      ``last`` is a guess: the first passes tell how many are enough, see ``enough``
    expected      one past the last pass, as far as is known
    """

    first: int = 0
    last: int | None = DEFAULT_PASSES
    seconds: float | None = None
    target_error: float | None = None
    adaptive: bool = False
    started: float = 0.0
    by_noise: bool = False
    expected: int | None = None

    def left(self, done: passes.Ranges) -> range | list[int]:
        """The passes still to do."""
        if self.last is None:
            return range(max((stop for _, stop in done), default=self.first), sys.maxsize)
        return [index for start, stop in passes.missing(done, self.first, self.last) for index in range(start, stop)]


def execute(
    renderer: Renderer,
    output: Path,
    budget: Budget,
    resume: bool = False,
    aovs: dict[str, NDArray] | None = None,
    progress: Callable[[float, float, str], None] | None = None,
    preview: Path | None = None,
) -> Picture:
    """Render until the budget is used up and write the picture.

    preview   a picture that is kept up to date while rendering, of any kind
    progress  is told what is done, of how much, and in which words

    A checkpoint beside the output keeps what is done of a render that dies; ``resume`` goes on from it, or from the
    output itself where that is an npz. On KeyboardInterrupt and ClusterLost the whole passes so far are written, and
    the exception goes on. Raises InputError where the output cannot be written or there is nothing that fits to resume.
    """
    image.check_writable(output)
    checkpoint = checkpoint_path(output)
    kept = [_Refreshed(checkpoint, time.monotonic() + REFRESH_EVERY)]
    if preview is not None:
        image.check_writable(preview)
        if preview.resolve() in (output.resolve(), checkpoint.resolve()):
            raise InputError(preview, "is a file of the render itself", "give --preview another name")
        kept.insert(0, _Refreshed(preview))  # what somebody waits for comes first
    if resume:
        renderer.film = _resumed(renderer.film, output, checkpoint)
    error = float("nan")

    def finished() -> bool:
        if budget.seconds is not None:
            return seconds_left() <= 0
        return budget.target_error is not None and _enough(renderer.film, error, budget.target_error)

    def seconds_left() -> float:
        assert budget.seconds is not None
        writing = max(0.1, *(file.seconds for file in kept)) * len(kept)
        return budget.started + budget.seconds - time.monotonic() - writing

    def after_pass(index: int) -> bool:
        nonlocal error
        now = time.monotonic()
        if budget.target_error is not None:
            error = renderer.film.mean_relative_stderr()
        for file in kept:
            file.refresh(renderer, budget)
        if progress is not None:
            progress(*_progress(renderer, budget, now, error))
        return finished()

    def write() -> Picture:
        with renderer.stages.stage("write"):
            picture = renderer.picture(time.monotonic() - budget.started, aovs)
            try:
                image.write(output, picture)
            except InputError as error:
                raise _rescued(error, picture, checkpoint) from None
        if preview is not None:
            _Refreshed(preview).refresh(renderer, budget)
        return picture

    try:
        if resume:
            error = renderer.film.mean_relative_stderr()
        if not (resume and renderer.film.passes and finished()):
            for budget in _rounds(renderer, budget):  # noqa: B020  progress goes by the last
                _run(renderer, budget, after_pass, seconds_left if budget.seconds else None)
    except (KeyboardInterrupt, ClusterLost):
        if renderer.film.passes:
            write()
            if output.suffix != ".npz":
                image.write(checkpoint, renderer.picture(time.monotonic() - budget.started))
            else:
                checkpoint.unlink(missing_ok=True)
        raise
    picture = write()
    checkpoint.unlink(missing_ok=True)
    return picture


def _rounds(renderer: Renderer, budget: Budget) -> Iterator[Budget]:
    """The budget; where noise decides, with as many passes as what was seen so far asks for, round after round."""
    if not budget.by_noise:
        yield budget
        return
    assert budget.last is not None
    for last, needed in enough.rounds(renderer, budget.last - budget.first):
        yield replace(budget, last=budget.first + last, expected=budget.first + needed)


def _run(
    renderer: Renderer,
    budget: Budget,
    after_pass: Callable[[int], bool],
    seconds_left: Callable[[], float] | None,
) -> None:
    """Add the passes that the budget asks for."""
    left = budget.left(renderer.film.ranges)
    if not budget.adaptive:
        renderer.film.resting[:] = False
        renderer.run(left, after_pass, seconds_left)
        return
    for part, decide in adaptive.rounds(left):
        if decide:
            renderer.film.resting = adaptive.resting(renderer.film, budget.target_error)
        if not renderer.run(part, after_pass, seconds_left, ~renderer.film.resting):
            return


def _enough(film: Film, error: float, target: float) -> bool:
    """Whether the film has so small an error; where none can be measured, whether it has the default passes."""
    if not np.isfinite(error):
        return film.passes >= DEFAULT_PASSES
    return error <= target and film.passes >= LEAST_PASSES_FOR_ERROR


@dataclass
class _Refreshed:
    """A file that is written again and again, whole or not at all, from ``due`` on.

    seconds  what writing it took the last time
    failed   whether it could not be written once
    """

    path: Path
    due: float = 0.0
    seconds: float = 0.0
    failed: bool = False

    def refresh(self, renderer: Renderer, budget: Budget) -> None:
        """Write the film so far, if it is time."""
        start = time.monotonic()
        if start < self.due:
            return
        try:
            image.write(self.path, renderer.picture(start - budget.started))
        except InputError as error:
            # the render goes on without
            if not self.failed:
                warnings.warn(f"{error.line()}; it is tried again every {RETRY_EVERY:g} s", stacklevel=2)
            self.failed, self.due = True, time.monotonic() + RETRY_EVERY
            return
        end = time.monotonic()
        self.seconds = end - start
        self.due = end + max(REFRESH_EVERY, self.seconds / REFRESH_SHARE)


def checkpoint_path(output: Path) -> Path:
    """Where the film of an unfinished render to ``output`` is kept."""
    return output.with_name(f"{output.name}.unfinished.npz")


def _rescued(error: InputError, picture: Picture, checkpoint: Path) -> InputError:
    """Keep what was rendered for an output that cannot be written, beside it or in the folder for temporary files;
    the error to raise."""
    for place in (checkpoint, Path(tempfile.mkdtemp(prefix="sss-render-"), checkpoint.name)):
        try:
            image.write(place, picture)
        except InputError:
            continue
        remedy = "use --resume" if place == checkpoint else f"move it to {checkpoint} and use --resume"
        return InputError(error.subject, f"{error.problem}; all passes are in {place}", f"make room, then {remedy}")
    return error


def _resumed(blank: Film, output: Path, checkpoint: Path) -> Film:
    """The film to go on with."""
    source = next((path for path in (checkpoint, output) if path.suffix == ".npz" and path.is_file()), None)
    if source is None:
        raise InputError(checkpoint, "there is nothing to resume", "leave --resume out")
    film = image.read(source).film
    try:
        blank.merge(film)
    except ValueError as error:
        raise InputError(
            source, f"belongs to another render ({error})", "leave --resume out, or undo the change"
        ) from None
    return film


def _progress(renderer: Renderer, budget: Budget, now: float, error: float) -> tuple[float, float, str]:
    film = renderer.film
    text = f"pass {film.passes}"
    if budget.seconds is not None:
        return now - budget.started, budget.seconds, text
    if budget.target_error is not None:
        done = (budget.target_error / error) ** 2 if np.isfinite(error) and error > 0 else 0.0
        return min(done, 1.0), 1.0, text
    assert budget.last is not None
    return film.passes, (budget.expected or budget.last) - budget.first, text


def rare_event_warnings(renderer: Renderer) -> list[str]:
    """What the user should know of rare events that were not rare enough."""
    tally = renderer.tally
    found = []
    for index, (leaked, *place) in sorted(tally.leaks.items()):
        if _beyond(int(leaked), LEAK_BUDGET * tally.samples):
            found.append(_leak_warning(renderer, index, int(leaked), np.array(place) / leaked))
    if _beyond(tally.terminated, LOSS_BUDGET * tally.samples):
        found.append(
            f"{tally.terminated} of {tally.samples} paths ({tally.terminated / tally.samples:.1e}) ended at holes, "
            "with the colour of the material: light near them is wrong; repair the mesh with sss-check --unsafe-fixes"
        )
    if renderer.film.non_finite:
        share = renderer.film.non_finite / max(renderer.film.hits.size * renderer.film.passes, 1)
        found.append(f"{renderer.film.non_finite} samples ({share:.1e} of all) were not finite and are left out")
    return found


def _leak_warning(renderer: Renderer, index: int, leaked: int, place: NDArray) -> str:
    """What is said of an object with so many leaks; ``place`` is their mean, in the frame of the tracer."""
    thing, samples = renderer.scene.objects[index], renderer.tally.samples
    x, y, z = in_mesh_units(thing, renderer.traced.frame.points_out(place)[None])[0]
    much = "" if leaked <= MUCH_LEAKED * samples else ": light there is wrong"
    return (
        f"{thing.name}: {leaked} of {samples} paths ({leaked / samples:.1e}; {LEAK_BUDGET:.0e} would be usual) "
        f"contradicted a surface taken for closed, in the mean at ({x:.4g}, {y:.4g}, {z:.4g}) in the mesh's "
        f"units{much}; check the mesh with sss-check, or use --hole-handling terminate"
    )


def _beyond(count: int, expected: float) -> bool:
    """Whether chance would hardly (2 in a thousand) make so many of so many expected."""
    return count > expected + 3 * expected**0.5 + 1


def report(
    renderer: Renderer, picture: Picture, version: str, total: float, budget: Budget | None = None
) -> dict[str, Any]:
    """The JSON object of ``--report``; ``total`` wall seconds of the command."""
    film, tally, seconds = picture.film, renderer.tally, renderer.stages.seconds
    error = film.mean_relative_stderr()
    stages = {name: seconds.get(name, 0.0) for name in ("load", "check", "close", "build", "render", "write")}
    stages |= {name: seconds[name] for name in ("pilot",) if name in seconds}
    rendered_now = max(renderer.added, 1)
    target = None if budget is None else budget.target_error
    return {
        "schema": "sss-render/1",
        "version": version,
        "scene_hash": film.scene_hash,
        "seed": film.seed,
        "objects": plans_with_holes(renderer.plans, renderer.holes),
        "built": built(renderer.stages),
        "passes": film.passes,
        "pass_ranges": [list(span) for span in film.ranges],
        "seconds": {"total": total, **stages, "frame": stages["render"] / rendered_now},
        "rays": tally.rays,
        "bounces": tally.collisions,
        "mean_relative_stderr": float(error) if np.isfinite(error) else None,
        "target_error": target,
        "target_met": None if target is None else bool(error <= target),
        "adaptive": bool(budget is not None and budget.adaptive),
        "samples": int(film.samples().sum()),
        "rare_events": {
            "leaked_rays": tally.leaked,
            "parity_contradictions": tally.contradicted,
            "terminated_at_holes": tally.terminated,
            "non_finite": film.non_finite,
        },
        "light_methods": light_methods(renderer),
        "peak_memory": peak_memory(),
        **({"cluster": asdict(renderer.traffic)} if isinstance(renderer, ClusterRenderer) else {}),
    }


def plans_with_holes(plans: list[Plan], holes: list[HoleReport]) -> list[dict[str, Any]]:
    """For each object its plan, and of the report on its holes what the plan does not say."""
    said = ("handling", "reason")
    return [
        {**asdict(plan), "holes": {name: value for name, value in asdict(hole).items() if name not in said}}
        for plan, hole in zip(plans, holes, strict=True)
    ]


def built(stages: Stages) -> dict[str, Any]:
    """Seconds that each thing built took: for the whole scene, and for objects by name. What is not there was not
    needed."""
    return {"scene": stages.parts.get("", {}), "objects": {k: v for k, v in stages.parts.items() if k}}


def plan_report(
    scene: Scene, plans: list[Plan], holes: list[HoleReport], passes: int, version: str, stages: Stages
) -> dict[str, Any]:
    """The JSON object of ``--report`` where nothing is rendered."""
    return {
        "schema": "sss-render/1",
        "version": version,
        "scene_hash": planned_hash(scene, plans),
        "objects": plans_with_holes(plans, holes),
        "passes": passes,
        "explained_only": True,
        "seconds": stages.seconds,
    }


def light_methods(renderer: Renderer) -> list[dict[str, str]]:
    """How lights get into media, and the known bias, for each object lit by the path shader: lights without extent, and
    lights that are found both by sampling them and by chance. Even skies are met by chance, without bias."""
    kinds = {type(light) for light in renderer.scene.lights}
    sampled = [name for kind, name in ((RectangleLight, "rectangles"), (SphereLight, "balls")) if kind in kinds]
    if renderer.traced.lights.skies:
        sampled.append("uneven skies")
    methods = []
    for thing, plan in zip(renderer.scene.objects, renderer.plans, strict=True):
        if "path" not in plan.shares or not isinstance(thing.material, Translucent):
            continue
        if thing.material.medium.ior == 1:
            where = "at collisions"
        elif thing.material.roughness > 0:
            where = "through the rough boundary"
        else:
            where = ""
        if kinds & {PointLight, DirectionalLight}:
            if where:
                method, bias = f"next-event estimation {where}", "none"
            else:
                method, bias = _through_facets(renderer, thing)
            methods.append({"object": thing.name, "lights": "without extent", "method": method, "known_bias": bias})
        if sampled:
            method = f"next-event estimation {where} and chance, weighed" if where else "chance"
            methods.append({"object": thing.name, "lights": ", ".join(sampled), "method": method, "known_bias": "none"})
    return methods


def _through_facets(renderer: Renderer, thing: SceneObject) -> tuple[str, str]:
    """Method and bias behind a smooth boundary."""
    traced = renderer.traced
    index = renderer.scene.objects.index(thing)
    mine = [beams for beams in traced.beams if traced.triangle_object[beams.first_triangle] == index]
    mirrored = min(len(beams.generations) for beams in mine) - 1
    missing = max(float(beams.missing.max()) for beams in mine)
    method = "next-event estimation through each facet"
    if mirrored:
        method += f", also after {mirrored} reflection{'s' * (mirrored > 1)} inside"
    bias = (
        f"light reflected inside {'more often ' * bool(mirrored)}before its first collision is not found: "
        f"{100 * missing:.2g} % of what enters"
    )
    if thing.normals == "smooth":
        bias += "; light is bent at flat facets, the camera's rays at interpolated normals"
    slot = [one.index for one in traced.translucent].index(index)
    if traced.holds_light[:, slot].any():
        bias += "; of a light inside, all that the boundary reflects before its first collision"
    media = [(one.medium, one.roughness) for one in traced.translucent]
    if sum(medium is not None and medium.ior != 1 and roughness == 0 for medium, roughness in media) > 1:
        bias += "; nor light that comes through another body with a smooth boundary"
    return method, bias


def guide_arrays(renderer: Renderer, names: list[str]) -> dict[str, NDArray]:
    """Arrays by name for ``--aov``, of the rays through the pixels' centres.

    depth (h, w) float32, scene units along the ray, inf for none; normal (h, w, 3) float32, geometric, outward;
    predicted_error (h, w) float32, relative, of the object's shader, NaN where none is predicted; shader_id is in
    every picture anyway
    """
    known = {"depth", "normal", "predicted_error", "shader_id"}
    for name in names:
        if name not in known:
            raise InputError(f"--aov {name}", "is no such array", f"choose from {', '.join(sorted(known))}")
    if not names:
        return {}
    traced, camera = renderer.traced, renderer.camera
    width, height = camera.resolution
    directions = camera.centre_directions()
    distance, triangle = traced.closest(np.repeat(camera.origin[:, None], directions.shape[1], axis=1), directions)
    depth = np.where(triangle >= 0, distance * np.float32(traced.frame.scale), np.float32(np.inf))
    normal = np.where(triangle >= 0, traced.triangle_normal[:, triangle], 0)
    errors = [np.nan if plan.predicted_error is None else plan.predicted_error for plan in renderer.plans]
    arrays = {
        "depth": depth.reshape(height, width),
        "normal": normal.T.reshape(height, width, 3),
        "predicted_error": np.array([*errors, np.nan])[renderer.object_id],
    }
    return {name: np.ascontiguousarray(arrays[name], np.float32) for name in names if name in arrays}


def merged(parts: list[Path]) -> Picture:
    """The picture of all parts of one render. Raises InputError for parts that do not belong together."""
    for path in parts:
        if parts.count(path) > 1:
            raise InputError(path, "is named twice", "name each part once")
    return image.merge({path: image.read(path) for path in parts})
