"""A render from the first pass to the written file: budgets, progress, checkpoints, the report."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError

from .output import image, passes
from .output.film import Film
from .output.image import Picture
from .render import Renderer
from .scene.description import DirectionalLight, PointLight, RectangleLight, SceneObject, SphereLight, Translucent

DEFAULT_PASSES = 64
CHECKPOINT_EVERY = 1.0
"""Seconds between checkpoints; each costs a few percent of that."""


@dataclass(frozen=True)
class Budget:
    """When a render is done. ``first`` is the number of its first pass.

    last          one past the last pass; None where seconds or target_error decide
    seconds       wall seconds since ``started`` until the file is written
    target_error  mean relative standard error over object pixels
    started       when the command began, by ``time.time``
    """

    first: int = 0
    last: int | None = DEFAULT_PASSES
    seconds: float | None = None
    target_error: float | None = None
    started: float = 0.0

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
) -> Picture:
    """Render until the budget is used up and write the picture.

    progress  is told what is done, of how much, and in which words

    A checkpoint beside the output keeps what is done of a render that dies; ``resume`` goes on from it, or from the
    output itself where that is an npz. On KeyboardInterrupt the whole passes so far are written, and the exception
    goes on. Raises InputError where the output cannot be written or there is nothing that fits to resume.
    """
    image.check_writable(output)
    checkpoint = checkpoint_path(output)
    if resume:
        renderer.film = _resumed(renderer.film, output, checkpoint)
    written_at = pass_at = time.time()
    pass_seconds = 0.0

    def finished() -> bool:
        if budget.seconds is not None:
            # one more pass and the writing must still fit
            return time.time() + pass_seconds + 0.2 > budget.started + budget.seconds
        if budget.target_error is not None:
            error = renderer.film.mean_relative_stderr()
            measured = np.isfinite(error)
            return (measured and error <= budget.target_error) or (
                not measured and renderer.film.passes >= DEFAULT_PASSES
            )
        return False

    def seconds_left() -> float:
        assert budget.seconds is not None
        return budget.started + budget.seconds - time.time()

    def after_pass(index: int) -> bool:
        nonlocal written_at, pass_at, pass_seconds
        now = time.time()
        pass_seconds, pass_at = now - pass_at, now
        if now - written_at >= CHECKPOINT_EVERY:
            image.write(checkpoint, renderer.picture(now - budget.started))
            written_at = time.time()
        if progress is not None:
            progress(*_progress(renderer, budget, now))
        return finished()

    def write() -> Picture:
        with renderer.stages.stage("write"):
            picture = renderer.picture(time.time() - budget.started, aovs)
            image.write(output, picture)
        return picture

    try:
        if not (resume and renderer.film.passes and finished()):
            renderer.run(budget.left(renderer.film.ranges), after_pass, seconds_left if budget.seconds else None)
    except KeyboardInterrupt:
        if renderer.film.passes:
            write()
            if output.suffix != ".npz":
                image.write(checkpoint, renderer.picture(time.time() - budget.started))
        raise
    picture = write()
    checkpoint.unlink(missing_ok=True)
    return picture


def checkpoint_path(output: Path) -> Path:
    """Where the film of an unfinished render to ``output`` is kept."""
    return output.with_name(f"{output.name}.unfinished.npz")


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


def _progress(renderer: Renderer, budget: Budget, now: float) -> tuple[float, float, str]:
    film = renderer.film
    text = f"pass {film.passes}"
    if budget.seconds is not None:
        return now - budget.started, budget.seconds, text
    if budget.target_error is not None:
        error = film.mean_relative_stderr()
        done = (budget.target_error / error) ** 2 if np.isfinite(error) and error > 0 else 0.0
        return min(done, 1.0), 1.0, text
    assert budget.last is not None
    return film.passes, budget.last - budget.first, text


def report(renderer: Renderer, picture: Picture, version: str, total: float) -> dict[str, Any]:
    """The JSON object of ``--report``; ``total`` wall seconds of the command."""
    film, tally, seconds = picture.film, renderer.tally, renderer.stages.seconds
    error = film.mean_relative_stderr()
    stages = {name: seconds.get(name, 0.0) for name in ("load", "check", "build", "render", "write")}
    rendered_now = max(tally.samples // (film.resolution[0] * film.resolution[1]), 1)
    return {
        "schema": "sss-render/1",
        "version": version,
        "scene_hash": film.scene_hash,
        "seed": film.seed,
        "objects": [asdict(plan) for plan in renderer.plans],
        "passes": film.passes,
        "pass_ranges": [list(span) for span in film.ranges],
        "seconds": {"total": total, **stages, "frame": stages["render"] / rendered_now},
        "rays": tally.rays,
        "bounces": tally.collisions,
        "mean_relative_stderr": float(error) if np.isfinite(error) else None,
        "rare_events": {
            "leaked_rays": tally.leaked,
            "terminated_at_holes": tally.terminated,
            "non_finite": film.non_finite,
        },
        "light_methods": light_methods(renderer),
        "peak_memory": peak_memory(),
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
        if plan.shader != "path" or not isinstance(thing.material, Translucent):
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
    return method, bias


def peak_memory() -> int | None:
    """Greatest resident memory of this process so far, bytes; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def guide_arrays(renderer: Renderer, names: list[str]) -> dict[str, NDArray]:
    """Arrays by name for ``--aov``, of the rays through the pixels' centres.

    depth (h, w) float32, scene units along the ray, inf for none; normal (h, w, 3) float32, geometric, outward
    """
    known = {"depth", "normal"}
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
    arrays = {"depth": depth.reshape(height, width), "normal": normal.T.reshape(height, width, 3)}
    return {name: np.ascontiguousarray(arrays[name], np.float32) for name in names}


def merged(parts: list[Path]) -> Picture:
    """The picture of all parts of one render. Raises InputError for parts that do not belong together."""
    for path in parts:
        if parts.count(path) > 1:
            raise InputError(path, "is named twice", "name each part once")
    return image.merge({path: image.read(path) for path in parts})
