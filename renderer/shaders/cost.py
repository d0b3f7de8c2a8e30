"""How long will each shader take? CPU seconds of one thread, from pixels, passes, lights and collisions.

    seconds = passes * pixels * (c + d * lights)              plumb, scalar, diffuse
    seconds = passes * pixels * (c + d * collisions)          path

over the number of threads. The collisions of a path are those of ``tracing.distance_grid.Walks``. The constants were
measured on one machine (an AMD EPYC, see docs/walks.md and docs/fast_frames.md) and set-up is left out: the
prediction tells shaders apart, and is right to a factor of two or so elsewhere.
"""

from __future__ import annotations

import numpy as np

from ..scene.description import SceneObject, Translucent
from ..tracing.distance_grid import Walks
from .appearance import Appearance

SECONDS = {"diffuse": (0.8e-6, 0.25e-6), "scalar": (0.8e-6, 0.3e-6), "plumb": (0.9e-6, 0.75e-6), "path": (4e-6, 0.5e-6)}
"""c and d of each shader, for camera samples that meet the object."""


def predicted_seconds(shader: str, thing: SceneObject, look: Appearance, passes: int, threads: int) -> float:
    """Wall seconds that the samples of ``thing`` take in so many passes."""
    fixed, each = SECONDS[shader]
    count = collisions(thing) if shader == "path" else look.lights
    return passes * look.pixels * (fixed + each * count) / max(threads, 1)


def collisions(thing: SceneObject) -> float:
    """Of a path that enters ``thing``, in the channel with most."""
    mesh = thing.mesh
    if not isinstance(thing.material, Translucent) or not mesh.area > 0:
        return 0.0
    medium = thing.material.medium
    extinction = float(np.max(medium.sigma_t))
    if not extinction > 0:
        return 0.0
    albedo = float(np.max(medium.single_scattering_albedo))
    return Walks(1, mesh.area, mesh.volume, 1 / extinction, albedo, float(np.max(medium.ior))).collisions
