"""Lights without extent: points and parallel beams. No path can meet them by chance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ..description import DirectionalLight, PointLight
from .illumination import Illumination, column, unit

Float32 = NDArray[np.float32]


class PointSource:
    """A point light: (3, 1) position, and intensity, power per solid angle, in the frame."""

    def __init__(self, position: Float32, intensity: Float32):
        self.position, self.intensity = position, intensity

    @classmethod
    def of(cls, light: PointLight, frame: UnitFrame) -> PointSource:
        """The light in the frame."""
        intensity = np.asarray(light.intensity, float) / frame.scale**2
        return cls(column(frame.points_in(light.position)), column(intensity))

    def illuminate(self, position: Float32) -> Illumination:
        """What arrives at ``position`` (3, n)."""
        offset = self.position - position
        squared = np.maximum(np.einsum("ij,ij->j", offset, offset), np.float32(1e-20))
        distance = np.sqrt(squared)
        return Illumination(offset / distance, distance, self.intensity / squared)


class DirectionalSource:
    """Parallel light: (3, 1) unit vector towards it, and irradiance across the beam."""

    def __init__(self, towards: Float32, irradiance: Float32):
        self.towards, self.irradiance = towards, irradiance

    @classmethod
    def of(cls, light: DirectionalLight) -> DirectionalSource:
        """The light, which is the same in every frame."""
        return cls(column(-unit(light.direction)), column(light.irradiance))

    def illuminate(self, position: Float32) -> Illumination:
        """What arrives at ``position`` (3, n)."""
        n = position.shape[1]
        direction = np.broadcast_to(self.towards, (3, n))
        return Illumination(np.ascontiguousarray(direction), np.full(n, np.inf, np.float32), self.irradiance)
