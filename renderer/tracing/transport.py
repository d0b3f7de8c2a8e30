"""What surfaces and media work with when they light paths and send them on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .paths import Paths
from .streams import Uniforms
from .tally import Tally
from .traced_scene import TracedScene

Float32 = NDArray[np.float32]


@dataclass(slots=True)
class Transport:
    """Paths in one place of a tracer, and what they share with those in its other places.

    scene     where they are
    paths     in flight
    uniforms  makes their random numbers
    tally     where is counted what happens to them
    radiance  (3, samples) where they add the light that they find, see ``Paths.sample``
    """

    scene: TracedScene
    paths: Paths
    uniforms: Uniforms
    tally: Tally
    radiance: Float32

    def draw(self, index: NDArray[np.intp]) -> tuple[Float32, Float32]:
        """The next two uniforms (m,) of the paths ``index``."""
        return self.uniforms.draw_at(self.paths.stream, index)

    def add(self, index: NDArray[np.intp], *light: Float32) -> None:
        """Add light, a product, to the paths ``index`` (m,), of which no two belong to one sample: their throughput
        times each of the arrays, broadcast to (3, m)."""
        found = self.paths.throughput[:, index]
        for factor in light:
            found = found * factor
        self.radiance[:, self.paths.sample[index]] += found
