"""Balls that shine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ...optics.phase import around, spherical
from ..description import SphereLight
from .illumination import Illumination, column, inverse

Float32 = NDArray[np.float32]


class SphereSource:
    """A shining ball, met by rays in closed form (no tessellation, no bias)."""

    def __init__(self, light: SphereLight, frame: UnitFrame):
        self.center = column(frame.points_in(light.center))
        self.radius = np.float32(light.radius / frame.scale)
        self.radiance = column(light.radiance)

    def distance(self, origin: Float32, direction: Float32) -> Float32:
        """(n,) distance at which rays from outside meet the ball, inf where they do not.

        The nearer root of |o + t d - c| = r, with the discriminant taken from the distance between centre and
        ray: it does not cancel far away (Haines et al. 2019, Ray Tracing Gems, ch. 7, eq. 5).
        """
        offset = self.center - origin
        along = np.einsum("ij,ij->j", offset, direction)
        beside = offset - along * direction
        remainder = self.radius * self.radius - np.einsum("ij,ij->j", beside, beside)
        near = along - np.sqrt(np.maximum(remainder, 0))
        return np.where((remainder > 0) & (near > 0), near, np.float32(np.inf))

    def sample(self, position: Float32, u1: Float32, u2: Float32) -> Illumination:
        """Light from a random direction within the cone the ball fills, uniform in solid angle; none inside it."""
        offset, distance, spread, solid_angle = self._cone(position)
        local = spherical(1 - u1 * spread, u2, np.empty_like(offset))
        direction = around(offset / np.maximum(distance, np.float32(1e-20)), local)
        reach = np.minimum(self.distance(position, direction), distance)
        return Illumination(direction, reach, self.radiance * solid_angle, inverse(solid_angle), self)

    def density(self, position: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws directions from ``position`` (3, n)."""
        return inverse(self._cone(position)[3])

    def _cone(self, position: Float32) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """To the centre from ``position`` (3, n): vector (3, n), distance, 1 - cosine of the cone that the ball
        fills, and its solid angle, (n,) each."""
        offset = self.center - position
        distance = np.sqrt(np.einsum("ij,ij->j", offset, offset))
        sine2 = np.minimum((self.radius / np.maximum(distance, self.radius)) ** 2, 1)
        # 1 - cos without cancellation for small balls
        spread = sine2 / (1 + np.sqrt(1 - sine2))
        solid_angle = np.where(distance > self.radius, np.float32(2 * np.pi) * spread, np.float32(0))
        return offset, distance, spread, solid_angle
