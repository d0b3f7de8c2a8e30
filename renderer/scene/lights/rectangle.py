"""Rectangles that shine, and points on them that are uniform in solid angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import UnitFrame

from ..description import RectangleLight
from .illumination import Illumination, column, inverse, unit

Float32 = NDArray[np.float32]

WIDE = 0.05
"""Steradians from which on single precision is enough for a rectangle: its error is a 50 000th of that."""


class RectangleSource:
    """A rectangle that shines from its front; its two triangles stand among the scene's."""

    def __init__(self, light: RectangleLight, frame: UnitFrame):
        normal = unit(np.asarray(light.target, float) - light.center)
        across = unit(np.cross(light.up, normal))
        upward = np.cross(normal, across)
        half = np.asarray(light.half, float) / frame.scale
        center = frame.points_in(light.center)
        self.normal, self.radiance = column(normal), column(light.radiance)
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        self.vertices = np.array([center + a * half[0] * across + b * half[1] * upward for a, b in corners])
        self.triangles = np.array([[0, 1, 2], [0, 2, 3]])
        self._center, self._half = center[:, None], half
        self._axes = np.stack([across, upward, normal])
        # from any place in the frame's unit box, seen face to face
        self.wide = 4 * half[0] * half[1] > WIDE * (np.linalg.norm(center) + np.sqrt(0.75)) ** 2

    def sample(self, position: Float32, u1, u2) -> Illumination:
        """Light from a random point of the rectangle, as if all of it came from there.

        Points are uniform in the solid angle that the rectangle fills (``spherical_rectangle``), so the irradiance,
        radiance times solid angle, has no noise. ``u1`` and ``u2`` are (n,) or numbers in [0, 1). Nothing arrives
        behind the rectangle.
        """
        direction, distance, arriving = self._sample(position, u1, u2, np.float64)
        return Illumination(direction, distance, self.radiance * arriving, inverse(arriving))

    def sample_at(self, position: Float32, share: NDArray[np.float64]) -> Illumination:
        """As ``sample`` with the same two numbers everywhere, without density; single precision where ``wide``.

        The solid angle is then wrong by some 1e-6 steradians, in a fifth of the time.
        """
        kind = np.float32 if self.wide else np.float64
        u1, u2 = share.astype(kind)
        direction, distance, arriving = self._sample(position, u1, u2, kind)
        return Illumination(direction, distance, self.radiance * arriving)

    def _sample(self, position: Float32, u1, u2, kind: type[np.floating]) -> tuple[Float32, Float32, Float32]:
        """Direction (3, n), distance (n,), and the solid angle (n,) from which light comes."""
        axes, half = self._axes.astype(kind), self._half.astype(kind)
        local = axes @ (position - self._center.astype(kind))
        point, solid_angle = spherical_rectangle(local, half, u1, u2)
        offset = point - local
        distance = np.sqrt(np.einsum("ij,ij->j", offset, offset))
        direction = (axes.T @ offset / np.maximum(distance, kind(1e-20))).astype(np.float32, copy=False)
        arriving = np.where(local[2] > 0, solid_angle, 0).astype(np.float32, copy=False)
        return direction, distance.astype(np.float32, copy=False), arriving

    def density(self, position: Float32) -> Float32:
        """(n,) density per steradian with which ``sample`` draws directions from ``position`` (3, n); 0 behind."""
        local = self._axes @ (position - self._center)
        solid_angle = spherical_rectangle(local, self._half, 0.5, 0.5)[1]
        return inverse(np.where(local[2] > 0, solid_angle, 0).astype(np.float32))


def spherical_rectangle(viewer: NDArray, half, u1, u2) -> tuple[NDArray, NDArray]:
    """Points of a rectangle that are uniform in solid angle, (3, n), and the solid angle it fills, (n,) steradians.

    viewer  (3, n) float64 in the rectangle's frame: its middle at the origin, its sides along x and y; or float32
            where an error of 1e-6 steradians does no harm
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
    slope = (np.cos(turn) * n0 - n2) / np.where(sine == 0, np.finfo(sine.dtype).tiny, sine)
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
