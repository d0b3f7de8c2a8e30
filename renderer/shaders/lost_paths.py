"""Paths that are where no path of a closed solid can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..tracing.paths import OUTSIDE, Paths
from ..tracing.streams import Uniforms
from ..tracing.tally import Tally
from ..tracing.traced_scene import TracedScene
from .opaque import patch_radiance


def lose(
    scene: TracedScene,
    paths: Paths,
    index: NDArray[np.intp],
    slot: int,
    uniforms: Uniforms,
    tally: Tally,
    radiance: NDArray[np.float32],
) -> None:
    """End the paths ``index``, lost by the object ``slot``, with the colour of its material.

    Those inside left through a hole, and the patch that is lit for them faces where they went; those outside see
    an inner side through a hole, and it faces them. Where the object was taken for closed they are leaks.
    """
    thing = scene.translucent[slot]
    facing = paths.direction[:, index] * np.where(paths.owner[index] == OUTSIDE, np.float32(-1), np.float32(1))
    patch = patch_radiance(scene, paths.origin[:, index], facing, lambda: uniforms.draw_at(paths.stream, index))
    radiance[:, paths.sample[index]] += paths.throughput[:, index] * thing.colour * patch
    paths.alive[index] = False
    if thing.taken_for_closed:
        # beyond the box only chance tells how far a path went
        tally.leak(thing.index, np.clip(paths.origin[:, index], thing.lower, thing.upper))
    else:
        tally.terminated += len(index)
