"""Paths that are where no path of a closed solid can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..tracing.paths import OUTSIDE
from ..tracing.transport import Transport
from .opaque import patch_radiance


def lose(transport: Transport, index: NDArray[np.intp], slot: int) -> None:
    """End the paths ``index``, lost by the object ``slot``, with the colour of its material.

    Those inside left through a hole, and the patch that is lit for them faces where they went; those outside see
    an inner side through a hole, and it faces them. Where the object was taken for closed they are leaks.
    """
    paths, thing = transport.paths, transport.scene.translucent[slot]
    facing = paths.direction[:, index] * np.where(paths.owner[index] == OUTSIDE, np.float32(-1), np.float32(1))
    transport.add(index, thing.colour, patch_radiance(transport, index, facing))
    paths.alive[index] = False
    if thing.taken_for_closed:
        # beyond the box only chance tells how far a path went
        transport.tally.leak(thing.index, np.clip(paths.origin[:, index], thing.lower, thing.upper))
    else:
        transport.tally.terminated += len(index)
