"""Lights in the unit-size frame: what they send where, and how to draw a point on them.

Radiance is the same in every frame; the intensity of a point light, in power per solid angle, is divided by the
squared scale so that intensity over squared distance stays the scene's irradiance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ..optics.multiple_importance import power_heuristic
from .description import DirectionalLight, EnvironmentLight, Light, PointLight, RectangleLight, SphereLight
from .sky_sampling import SkySampler

Float32 = NDArray[np.float32]

UNEVEN_SKY = 3.0
"""Unevenness (``SkySampler``) from which on skies are sampled: a sky white above and black below has 2."""


def _unit(vector) -> NDArray[np.float64]:
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def column(vector) -> Float32:
    """Three numbers as (3, 1) float32, to stand for all points."""
    return np.asarray(vector, np.float32).reshape(3, 1)


@dataclass(frozen=True)
class Illumination:
    """Light that arrives at n points from one direction each.

    direction   (3, n) float32 unit vectors towards the light
    distance    (n,) float32 to the light, inf where it is infinitely far
    irradiance  (3, n) or (3, 1) float32 on a plane across the beam, unoccluded
    density     (n,) float32 per steradian with which the direction was drawn; None of lights without extent
    ball        the shining ball that the light comes from, which does not shade itself
    """

    direction: Float32
    distance: Float32
    irradiance: Float32
    density: Float32 | None = None
    ball: SphereSource | None = None


class Environment:
    """Radiance from infinitely far away.

    sampled  whether directions are worth drawing from where it is bright; else it is met by chance
    """

    def __init__(self, light: EnvironmentLight):
        self.constant = None if light.radiance is None else column(light.radiance)
        self.sampled = False
        if light.image is not None:
            self._image = np.ascontiguousarray(np.moveaxis(light.image, -1, 0), np.float32)
            self._turn = np.float32(light.rotation / 360)
            self._sampler = SkySampler(self._image)
            self.sampled = not self._sampler.dark and self._sampler.unevenness >= UNEVEN_SKY

    def radiance(self, direction: Float32) -> Float32:
        """(3, n) radiance seen along unit ``direction`` (3, n), (3, 1) where it is the same everywhere.

        Images are interpolated bilinearly between the centres of their pixels, around the seam too. Row 0 is
        +y, the centre column -z, columns grow towards +x.
        """
        if self.constant is not None:
            return self.constant
        _, height, width = self._image.shape
        across, down = self._place(direction)
        x, y = across * width - np.float32(0.5), np.clip(down * height - np.float32(0.5), 0, height - 1)
        left, top = np.floor(x).astype(np.int64), np.minimum(np.floor(y).astype(np.int64), height - 1)
        fx, fy = x - left, y - top
        right, bottom = (left + 1) % width, np.minimum(top + 1, height - 1)
        left %= width
        image = self._image
        upper = image[:, top, left] * (1 - fx) + image[:, top, right] * fx
        lower = image[:, bottom, left] * (1 - fx) + image[:, bottom, right] * fx
        return upper * (1 - fy) + lower * fy

    def _place(self, direction: Float32) -> tuple[Float32, Float32]:
        """(n,) shares of the way across and down the image."""
        # counter-clockwise from above turns -z towards -x, against the growth of the columns
        across = (np.arctan2(direction[0], -direction[2]) / np.float32(2 * np.pi) + np.float32(0.5) + self._turn) % 1
        return across, np.arccos(np.clip(direction[1], -1, 1)) / np.float32(np.pi)

    def density(self, direction: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws the unit directions (3, n)."""
        return self._sampler.density(*self._place(direction))

    def sample(self, position: Float32, u1: Float32, u2: Float32) -> Illumination:
        """Light from a random direction, as if all of it came from there."""
        across, cosine, density = self._sampler.sample(u1, u2)
        turn = np.float32(2 * np.pi) * (across - np.float32(0.5) - self._turn)
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
        direction = np.stack([sine * np.sin(turn), cosine, -sine * np.cos(turn)])
        far = np.full(len(cosine), np.inf, np.float32)
        irradiance = np.divide(self.radiance(direction), density, out=np.zeros_like(direction), where=density > 0)
        return Illumination(direction, far, irradiance, density)


class PointSource:
    """A point light; ``illuminate`` as for every source without extent."""

    def __init__(self, position: Float32, intensity: Float32):
        self.position, self.intensity = position, intensity

    @classmethod
    def of(cls, light: PointLight, frame: UnitFrame) -> PointSource:
        """The light in the frame."""
        return cls(column(frame.points_in(light.position)),
                   column(np.asarray(light.intensity, float) / frame.scale**2))  # fmt: skip

    def illuminate(self, position: Float32) -> Illumination:
        """What arrives at ``position`` (3, n)."""
        return _from_point(self.position, position, self.intensity)


class DirectionalSource:
    """Parallel light."""

    def __init__(self, towards: Float32, irradiance: Float32):
        self.towards, self.irradiance = towards, irradiance

    @classmethod
    def of(cls, light: DirectionalLight) -> DirectionalSource:
        """The light, which is the same in every frame."""
        return cls(column(-_unit(light.direction)), column(light.irradiance))

    def illuminate(self, position: Float32) -> Illumination:
        """What arrives at ``position`` (3, n)."""
        n = position.shape[1]
        direction = np.broadcast_to(self.towards, (3, n))
        return Illumination(np.ascontiguousarray(direction), np.full(n, np.inf, np.float32), self.irradiance)


def _from_point(source: Float32, position: Float32, intensity: Float32) -> Illumination:
    offset = source - position
    squared = np.maximum(np.einsum("ij,ij->j", offset, offset), np.float32(1e-20))
    distance = np.sqrt(squared)
    return Illumination(offset / distance, distance, intensity / squared)


class RectangleSource:
    """A rectangle that shines from its front; its two triangles stand among the scene's."""

    def __init__(self, light: RectangleLight, frame: UnitFrame):
        normal = _unit(np.asarray(light.target, float) - light.center)
        across = _unit(np.cross(light.up, normal))
        upward = np.cross(normal, across)
        half = np.asarray(light.half, float) / frame.scale
        center = frame.points_in(light.center)
        self.normal, self.radiance = column(normal), column(light.radiance)
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        self.vertices = np.array([center + a * half[0] * across + b * half[1] * upward for a, b in corners])
        self.triangles = np.array([[0, 1, 2], [0, 2, 3]])
        self._center, self._half = center[:, None], half
        self._axes = np.stack([across, upward, normal])

    def sample(self, position: Float32, u1, u2) -> Illumination:
        """Light from a random point of the rectangle, as if all of it came from there.

        Points are uniform in the solid angle that the rectangle fills (``spherical_rectangle``), so the irradiance,
        radiance times solid angle, has no noise. ``u1`` and ``u2`` are (n,) or numbers in [0, 1). Nothing arrives
        behind the rectangle.
        """
        local = self._axes @ (position - self._center)
        point, solid_angle = spherical_rectangle(local, self._half, u1, u2)
        offset = point - local
        distance = np.sqrt(np.einsum("ij,ij->j", offset, offset))
        direction = (self._axes.T @ offset / np.maximum(distance, 1e-20)).astype(np.float32)
        arriving = np.where(local[2] > 0, solid_angle, 0).astype(np.float32)
        return Illumination(direction, distance.astype(np.float32), self.radiance * arriving, _inverse(arriving))

    def density(self, position: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws directions from ``position`` (3, n); 0 behind."""
        local = self._axes @ (position - self._center)
        solid_angle = spherical_rectangle(local, self._half, 0.5, 0.5)[1]
        return _inverse(np.where(local[2] > 0, solid_angle, 0).astype(np.float32))


def _inverse(solid_angle: Float32) -> Float32:
    """One over it, 0 for 0."""
    return np.divide(1, solid_angle, out=np.zeros_like(solid_angle), where=solid_angle > 0)


def spherical_rectangle(viewer: NDArray[np.float64], half, u1, u2) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of a rectangle that are uniform in solid angle, (3, n), and the solid angle it fills, (n,) steradians.

    viewer  (3, n) float64 in the rectangle's frame: its middle at the origin, its sides along x and y
    half    half its sides

    Urena, Fajardo & King 2013, "An area-preserving parametrization for spherical rectangles", CGF 32(4), listing 1.
    The solid angle is a difference of angles; where it is below 1e-6 the rectangle counts as flat and far, with points
    uniform in area.
    """
    x0, x1 = -half[0] - viewer[0], half[0] - viewer[0]
    y0, y1 = -half[1] - viewer[1], half[1] - viewer[1]
    # the rectangle lies at negative z of the viewer, whichever side that is on
    z0 = np.minimum(-np.abs(viewer[2]), -1e-12)
    squared = z0 * z0
    n0, n1 = -y0 / np.sqrt(squared + y0 * y0), x1 / np.sqrt(squared + x1 * x1)
    n2, n3 = y1 / np.sqrt(squared + y1 * y1), -x0 / np.sqrt(squared + x0 * x0)
    start = 2 * np.pi - np.arccos(-n2 * n3) - np.arccos(-n3 * n0)
    solid_angle = np.arccos(-n0 * n1) + np.arccos(-n1 * n2) - start
    turn = u1 * solid_angle + start
    sine = np.sin(turn)
    slope = (np.cos(turn) * n0 - n2) / np.where(sine == 0, 1e-300, sine)
    cosine = np.clip(np.copysign(1 / np.sqrt(slope * slope + n0 * n0), slope), -1, 1)
    x = np.clip(-cosine * z0 / np.sqrt(np.maximum(1 - cosine * cosine, 1e-12)), x0, x1)
    reach = np.sqrt(x * x + squared)
    h0, h1 = y0 / np.sqrt(reach * reach + y0 * y0), y1 / np.sqrt(reach * reach + y1 * y1)
    h = h0 + u2 * (h1 - h0)
    y = np.clip(h * reach / np.sqrt(np.maximum(1 - h * h, 1e-12)), y0, y1)
    far = solid_angle < 1e-6
    if far.any():
        x, y = np.where(far, x0 + u1 * (x1 - x0), x), np.where(far, y0 + u2 * (y1 - y0), y)
        distance2 = x * x + y * y + squared
        solid_angle = np.where(far, 4 * half[0] * half[1] * -z0 / distance2**1.5, solid_angle)
    return np.stack([viewer[0] + x, viewer[1] + y, np.zeros_like(x)]), solid_angle


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
        from ..optics.phase import around, spherical

        offset, distance, spread, solid_angle = self._cone(position)
        local = spherical(1 - u1 * spread, u2, np.empty_like(offset))
        direction = around(offset / np.maximum(distance, np.float32(1e-20)), local)
        reach = np.minimum(self.distance(position, direction), distance)
        return Illumination(direction, reach, self.radiance * solid_angle, _inverse(solid_angle), self)

    def density(self, position: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws directions from ``position`` (3, n)."""
        return _inverse(self._cone(position)[3])

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


def fibonacci_directions(count: int) -> Float32:
    """(3, count) unit vectors spread evenly over the sphere (Swinbank & Purser 2006, QJRMS 132, eq. 1-2)."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    turn = k * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z]).astype(np.float32)
