"""What a render reports: what was done and why, what it took, how light got in, and rare events to be warned of."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.memory import peak_memory

from .cluster.renderer import ClusterRenderer
from .job import Budget
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

LEAK_BUDGET, LOSS_BUDGET = 1e-5, 1e-3
"""Share of the paths that may contradict a closed surface, and that may be lost at holes, before it is worth a
warning."""
MUCH_LEAKED = 1e-3
"""Share of the paths from which on leaks of one object show."""


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
