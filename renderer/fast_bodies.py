"""What faster shaders need to know of their objects: built for those that use them, and for no others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .shaders import FAST_SHADERS, diffuse, plumb
from .shaders.ambient_field import corner_field
from .shaders.blend import Blend
from .shaders.fast_body import FastBody
from .shaders.selection import Plan
from .shaders.surface import BodyOptics
from .stages import Stages
from .tracing.traced_scene import TracedObject, TracedScene

_FIELD_FACES = 2**17
"""Faces at whose corners a constant environment's light is found beforehand, however small the picture."""


def fast_bodies(
    traced: TracedScene, plans: list[Plan], pixels: int, threads: int, stages: Stages
) -> tuple[dict[int, FastBody], dict[int, Blend]]:
    """What the faster shaders need, for the objects that use them and no others; and those that use several."""
    even = any(environment.constant is not None for environment in traced.lights.environments)
    media = {thing.index: thing.medium for thing in traced.objects}
    bodies: dict[int, FastBody] = {}
    blends: dict[int, Blend] = {}
    for thing, plan in zip(traced.objects, plans, strict=True):
        names = [name for name in plan.shares if name in FAST_SHADERS]
        if not names or thing.medium is None:
            continue
        radius = float(np.linalg.norm(thing.upper - thing.lower)) / 2
        others = {index: medium for index, medium in media.items() if index != thing.index}
        optics = BodyOptics.prepare(thing.index, thing.medium, radius, others)
        curvature = field = None
        if names != [diffuse.NAME]:
            with stages.part(plan.name, "curvature"):
                curvature = _corner_curvature(traced, thing)
            with stages.part(plan.name, "table of balls"):
                _ = optics.tables  # now, and not in every thread at once
        # else frames themselves are sooner done
        if curvature is not None and plumb.NAME in names and even and len(curvature) <= max(pixels, _FIELD_FACES):
            with stages.part(plan.name, "light of the sky at corners"):
                field = _ambient_field(traced, thing, optics, curvature, threads)
        made = {
            name: FastBody(
                thing,
                FAST_SHADERS[name],
                optics,
                None if name == diffuse.NAME else curvature,
                field if name == plumb.NAME else None,
            )
            for name in names
        }
        if len(plan.shares) == 1:
            bodies[thing.index] = made[names[0]]
        else:
            lit = tuple(made.get(name) for name in plan.shares)
            blends[thing.index] = Blend(thing.index, lit, tuple(plan.shares.values()))
    return bodies, blends


def _ambient_field(traced, thing: TracedObject, optics: BodyOptics, curvature, threads: int) -> NDArray[np.float32]:
    mesh = traced.scene.objects[thing.index].mesh
    points = np.empty_like(mesh.topology.points)
    own = traced.triangles[thing.first_triangle : thing.first_triangle + len(mesh.faces)]
    points[mesh.topology.faces] = traced.vertices[own]
    return corner_field(mesh, points, curvature, lambda some, axes: plumb.ambient(traced, some, optics, axes), threads)


def _corner_curvature(traced: TracedScene, thing: TracedObject) -> NDArray[np.float32]:
    from sss_tools.curvature import mean_curvature

    mesh = traced.scene.objects[thing.index].mesh
    return (mean_curvature(mesh)[mesh.faces] * traced.frame.scale).astype(np.float32)
