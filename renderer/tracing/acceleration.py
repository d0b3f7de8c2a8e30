"""What makes walks in media shorter or cheaper, and leaves the expected picture alone; chosen from the scene alone.

Samples must not depend on how many passes are asked for, or parts rendered apart would not add up bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..optics.ball_jump import BallJumps, ball_jumps
from ..optics.guided_flight import Guide
from .distance_grid import DistanceGrid, Walks, choose_resolution
from .traced_scene import TracedObject, TracedScene

JUMP_ALBEDO, JUMP_INRADIUS = 0.97, 10
"""Least albedo and mean inradius (mean free paths) of bodies in which ball jumps pay."""


@dataclass(frozen=True)
class Acceleration:
    """Of the media of a scene, by slot.

    grid    distances to the surface, None where looking them up does not pay
    jumps   ball jumps, for media with many collisions
    guides  flights guided out of the medium
    """

    grid: DistanceGrid | None
    jumps: tuple[BallJumps | None, ...]
    guides: tuple[Guide | None, ...]

    @classmethod
    def none(cls, media: int) -> Acceleration:
        """Plain walks."""
        return cls(None, (None,) * media, (None,) * media)
