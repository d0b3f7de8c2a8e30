"""Arrays beside the picture that say what is seen: for compositing, denoisers and whoever asks why."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError

from .render import Renderer


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
    depth = np.full(len(distance), np.inf, np.float32)
    depth[triangle >= 0] = distance[triangle >= 0] * np.float32(traced.frame.scale)
    normal = np.where(triangle >= 0, traced.triangle_normal[:, triangle], 0)
    errors = [np.nan if plan.predicted_error is None else plan.predicted_error for plan in renderer.plans]
    arrays = {
        "depth": depth.reshape(height, width),
        "normal": normal.T.reshape(height, width, 3),
        "predicted_error": np.array([*errors, np.nan])[renderer.object_id],
    }
    return {name: np.ascontiguousarray(arrays[name], np.float32) for name in names if name in arrays}
