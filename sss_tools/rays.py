"""The Embree wrapper: closest hits, bounded hits and occlusion, for the rules and the renderer alike.

Embree works in single precision. Callers move their geometry to the centre and scale it to unit size in
double precision first (``UnitFrame``); then the offset below holds at any scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

RAY_OFFSET = np.float32(1e-6)
"""How far from its face, along the geometric normal, a ray starts (unit-size frame).

In a unit-size frame no coordinate exceeds 0.5 for the objects themselves. A hit point ``origin + t * direction``
is rounded in the product and in the sum, each by at most half an ulp of a number below 1 (6.0e-8), in each of
three coordinates: less than 2 * sqrt(3) * 6.0e-8 = 2.1e-7 off the true point. Embree's ``t`` adds a few ulps
more. Some five times that bound, and still walls of a hundred-thousandth of the object's size stay solid.
"""


@dataclass(frozen=True)
class UnitFrame:
    """Maps scene coordinates to a frame in which a box is centred at the origin and its longest side is 1.

    centre  (3,) float64, scene units
    scale   scene units per unit of the frame
    """

    centre: NDArray[np.float64]
    scale: float

    @classmethod
    def around(cls, lower, upper) -> UnitFrame:
        """The frame of the box with the corners ``lower`` and ``upper``, (3,) each."""
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        longest = float((upper - lower).max())
        return cls((lower + upper) / 2, longest if longest > 0 else 1.0)

    def points_in(self, points) -> NDArray[np.float64]:
        """(..., 3) scene coordinates to the frame's."""
        return (np.asarray(points, float) - self.centre) / self.scale

    def points_out(self, points) -> NDArray[np.float64]:
        """(..., 3) the frame's coordinates to the scene's."""
        return np.asarray(points, float) * self.scale + self.centre


class RayCaster:
    """Triangles that rays can hit.

    vertices   (n, 3) in a unit-size frame
    triangles  (m, 3) indices

    Rays go one by one through Embree in robust mode, which closes all but about one gap in a hundred thousand
    at shared edges and vertices; callers count what slips through.
    """

    def __init__(self, vertices, triangles):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        vertices = np.ascontiguousarray(vertices, np.float32)
        triangles = np.ascontiguousarray(triangles, np.int32)
        if len(triangles) == 0:
            raise ValueError("a ray caster needs at least one triangle")
        if not np.isfinite(vertices).all():
            raise ValueError("a ray caster needs finite vertices")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ValueError(f"triangle indices must lie in [0, {len(vertices)})")
        self._scene = EmbreeScene(robust=True)
        self._geometry = TriangleMesh(self._scene, vertices, triangles)

    def closest(self, origin: Float32, direction: Float32, limit: Float32 | None = None):
        """The first triangle along each ray.

        origin, direction  (3, n) float32
        limit              (n,) float32, how far each ray reaches; None for no limit. Bounded rays are several
                           times cheaper: Embree visits only the boxes within reach.
        Returns distance (n,) float32 (the limit, or 1e37, where nothing is hit) and triangle (n,) int32
        (-1 where nothing is hit).
        """
        # embreex writes the hit distances into the array of limits
        reach = None if limit is None else np.array(limit, np.float32)
        hits = self._scene.run(origin.T, direction.T, reach, output=1)
        return hits["tfar"], hits["primID"]

    def closest_with_place(self, origin: Float32, direction: Float32):
        """As ``closest`` without limit, and where on its triangle each ray ends.

        Returns distance and triangle, and the weights (n,) float32 of the triangle's second and third corner; the
        first one's is what they leave of 1.
        """
        hits = self._scene.run(origin.T, direction.T, None, output=1)
        return hits["tfar"], hits["primID"], hits["u"], hits["v"]

    def occluded(self, origin: Float32, direction: Float32, limit: Float32 | None = None) -> NDArray[np.bool_]:
        """(n,) whether anything lies within ``limit`` along each ray."""
        reach = None if limit is None else np.array(limit, np.float32)
        return self._scene.run(origin.T, direction.T, reach, query="OCCLUDED") >= 0


__all__ = ["RAY_OFFSET", "RayCaster", "UnitFrame"]
