"""All lights of a scene, by what one can do with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ...optics.multiple_importance import power_heuristic
from ..description import DirectionalLight, EnvironmentLight, Light, PointLight, RectangleLight, SphereLight
from .environment import Environment
from .points import DirectionalSource, PointSource
from .rectangle import RectangleSource
from .sphere import SphereSource

Float32 = NDArray[np.float32]


class LightSet:
    """All lights of a scene, in its frame, by what one can do with them."""

    def __init__(self, lights: Sequence[Light], frame: UnitFrame):
        self.environments = [Environment(light) for light in lights if isinstance(light, EnvironmentLight)]
        self.points: list[PointSource | DirectionalSource] = []
        self.rectangles: list[RectangleSource] = []
        self.spheres: list[SphereSource] = []
        for light in lights:
            if isinstance(light, PointLight):
                self.points.append(PointSource.of(light, frame))
            elif isinstance(light, DirectionalLight):
                self.points.append(DirectionalSource.of(light))
            elif isinstance(light, RectangleLight):
                self.rectangles.append(RectangleSource(light, frame))
            elif isinstance(light, SphereLight):
                self.spheres.append(SphereSource(light, frame))

        self.skies = [environment for environment in self.environments if environment.sampled]

    @property
    def sampled(self) -> bool:
        """Whether there are lights that are found by drawing points on them as well as by chance."""
        return bool(self.rectangles or self.spheres or self.skies)

    @property
    def lone(self) -> PointSource | DirectionalSource | None:
        """The light without extent that is all the light there is."""
        others = self.environments or self.rectangles or self.spheres
        return self.points[0] if len(self.points) == 1 and not others else None

    @property
    def even(self) -> bool:
        """Whether the background is the same in all directions."""
        return all(environment.constant is not None for environment in self.environments)

    def background(self, direction: Float32, density: Float32 | None = None) -> Float32:
        """(3, n) radiance that rays meet when they leave the scene along ``direction``.

        density  (n,) with which the directions were drawn where skies were sampled too, see ``Paths``: what is met is
                 weighed for that; None where they were not
        """
        total = np.zeros_like(direction)
        for environment in self.environments:
            seen = environment.radiance(direction)
            if density is not None and environment.sampled:
                seen = seen * power_heuristic(density, environment.density(direction))
            total += seen
        return total
