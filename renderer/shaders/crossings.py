"""Paths that stand at the surface of a translucent object: what is before it, and what beyond."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..tracing.paths import Paths
from ..tracing.shadow import cross
from ..tracing.traced_scene import TracedScene

Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class Crossings:
    """m paths at surfaces, a column each.

    index          (m,) which of the paths
    slot           (m,) object whose surface it is
    position       (3, m) on the surface
    direction      (3, m) unit, of travel
    near_normal    (3, m) unit geometric normal on the side the path comes from
    facing         (3, m) unit shading normal, towards where the path comes from
    before         (m,) owner of the medium the path is in; beyond: of the medium on the other side
    inside_before  (k, m) how often inside each object, as ``Paths.inside``; inside_beyond: on the other side
    eta            (m,) index of refraction beyond over before
    """

    index: NDArray[np.intp]
    slot: NDArray[np.intp]
    position: Float32
    direction: Float32
    near_normal: Float32
    facing: Float32
    before: NDArray[np.int16]
    beyond: NDArray[np.int16]
    inside_before: NDArray[np.int8]
    inside_beyond: NDArray[np.int8]
    eta: Float32

    @classmethod
    def of(cls, scene: TracedScene, paths: Paths, index: NDArray[np.intp], triangle: NDArray[np.int32]) -> Crossings:
        """The paths ``index`` at the hit points that are their origins, on ``triangle`` (m,)."""
        outward = np.take(scene.triangle_normal, triangle, axis=1)
        direction, position = paths.direction[:, index], paths.origin[:, index]
        entering = np.einsum("ij,ij->j", direction, outward) < 0
        slot = scene.slot_of_triangle[triangle]
        before, inside_before = paths.owner[index], paths.inside[:, index]
        inside_beyond = inside_before.copy()
        beyond = cross(inside_beyond, slot, entering)
        shading = scene.shading_normal(position, triangle)
        back = -np.copysign(np.float32(1), np.einsum("ij,ij->j", shading, direction))
        return cls(
            index=index,
            slot=slot,
            position=position,
            direction=direction,
            near_normal=outward * np.where(entering, np.float32(1), np.float32(-1)),
            facing=shading * back,
            before=before,
            beyond=beyond,
            inside_before=inside_before,
            inside_beyond=inside_beyond,
            eta=scene.media.ior[beyond] / scene.media.ior[before],
        )

    def take(self, columns: NDArray[np.intp]) -> Crossings:
        """The given columns."""
        return Crossings(*(getattr(self, entry.name)[..., columns] for entry in fields(self)))

    def contradictory(self, scene: TracedScene) -> NDArray[np.bool_]:
        """(m,) whether a crossing does not fit what was counted: leaving from outside, entering twice.

        Entering twice is sound where shells of one closed object overlap and their count is kept.
        """
        counted = np.take_along_axis(self.inside_before, self.slot[None], axis=0)[0]
        entering = np.take_along_axis(self.inside_beyond, self.slot[None], axis=0)[0] > counted
        overlaps = np.array([thing.shells_add_up for thing in scene.translucent])
        return np.where(entering, (counted > 0) & ~overlaps[self.slot], counted <= 0)
