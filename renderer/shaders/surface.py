"""What the fast shaders share: surface points, a body's optics, and exitance turned into radiance.

Lengths are in the scene's unit-size frame. Exitance is the power that scattered light carries out through a
unit of surface, per colour channel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sss_tools.medium import Medium, diffuse_reflectance

from ..optics import lookup
from ..optics.ball import BallTable, ball_table
from ..optics.dielectric import diffuse_external_reflectance, fresnel_reflectance
from ..optics.emergence import EmergenceTable, emergence_table, scattered_once
from ..optics.slab import diffusion

Float32 = NDArray[np.float32]

BLOCK = 16384
"""Points worked on at a time: few enough for the second-level cache, and enough that threads seldom wait for each
other between NumPy's calls (a plumb frame on two cores takes a fifth less than with 8192)."""

_RADII = np.float32(lookup.RADII[0]), np.float32(lookup.RADII[-1])
_FAINT_SHARE = 1e-3
"""Share of light scattered once below which it is not looked for."""


class Caster(Protocol):
    """The whole scene as rays see it; see ``sss_tools.rays.RayCaster``.

    triangle_object  (t,) int16 object of each triangle, -1 for the geometry of lights
    triangle_normal  (3, t) float32 unit outward geometric normals
    """

    triangle_object: NDArray[np.int16]
    triangle_normal: Float32

    def closest(self, origin: Float32, direction: Float32, limit: Float32 | None = None):
        """Distance (n,) and triangle (n,), -1 for none."""

    def occluded(self, origin: Float32, direction: Float32, limit: Float32 | None = None) -> NDArray[np.bool_]:
        """(n,) whether anything lies within ``limit``."""


class Beam(Protocol):
    """Light that comes from one place, or a constant environment (``ambient``) of ``radiance`` (3,)."""

    @property
    def ambient(self) -> bool:
        """Whether the light comes from everywhere alike."""

    @property
    def radiance(self) -> Float32 | None:
        """(3,), ambient beams only."""

    @property
    def axes(self) -> Float32 | None:
        """(3, k) directions to probe an ambient beam with."""

    def at(self, position: Float32) -> tuple[Float32, Float32, Float32]:
        """Direction to the light (3, n), distance (n,) (inf if far), irradiance across the beam (3, n)."""


@dataclass(frozen=True)
class SurfacePoints:
    """Points on one body's surface.

    position   (3, n) float32
    normal     (3, n) float32 unit length, outward
    curvature  (n,) float32 mean curvature, 1/length, positive for a ball
    viewer     (3, n) float32 unit direction to the viewer; None where only the exitance matters
    ambient    (3, n) float32 exitance under radiance 1 from everywhere as far as it is known beforehand, else NaN;
               None where nothing is
    """

    position: Float32
    normal: Float32
    curvature: Float32
    viewer: Float32 | None = None
    ambient: Float32 | None = None

    def __len__(self) -> int:
        return self.position.shape[1]

    def take(self, columns: NDArray[np.intp]) -> SurfacePoints:
        """The points at ``columns``."""
        viewer, ambient = (None if a is None else a.take(columns, axis=1) for a in (self.viewer, self.ambient))
        return SurfacePoints(self.position.take(columns, axis=1), self.normal.take(columns, axis=1),
                             self.curvature.take(columns), viewer, ambient)  # fmt: skip

    def blocks(self) -> Iterator[tuple[slice, SurfacePoints]]:
        """At most ``BLOCK`` points at a time, with their place."""
        for start in range(0, len(self), BLOCK):
            part = slice(start, min(start + BLOCK, len(self)))
            position, normal, curvature = (np.ascontiguousarray(a[..., part], np.float32)
                                           for a in (self.position, self.normal, self.curvature))  # fmt: skip
            viewer, ambient = (None if a is None else a[:, part] for a in (self.viewer, self.ambient))
            yield part, SurfacePoints(position, normal, curvature, viewer, ambient)

    def under_even_light(self, found: Callable[[SurfacePoints], Float32]) -> Float32:
        """(3, n) exitance under radiance 1 from everywhere: ``ambient``, and where it is not known ``found``."""
        if self.ambient is None:
            return found(self)
        result = self.ambient.copy()
        unknown = np.flatnonzero(np.isnan(result[0]))
        if len(unknown):
            result[:, unknown] = found(self.take(unknown))
        return result


@dataclass(frozen=True, eq=False)
class BodyOptics:
    """What a body does with light, made ready for lookup.

    object_index     which object's triangles bound it
    medium           coefficients per unit of the frame
    bounding_radius  half the diagonal of its bounding box
    depth_weights    (k,) float32 for each object of the scene: a length inside it weighs that many times the same
                     length in this body when light passes through on its way here; infinite for opaque ones
    """

    object_index: int
    medium: Medium
    bounding_radius: float
    depth_weights: Float32

    @classmethod
    def prepare(
        cls, object_index: int, medium: Medium, bounding_radius: float, others: dict[int, Medium | None] | None = None
    ) -> BodyOptics:
        """The optics of object ``object_index``; tables are built or read when a shader first asks for them.

        others  medium of every other object, None for opaque ones. Objects not named are taken for opaque.
        """
        others = others or {}
        # one more at the end: index -1 is the geometry of lights, which is opaque
        weights = np.full(max([object_index, *others]) + 2, np.inf, np.float32)
        own = _mean_extinction(medium)
        for index, other in others.items():
            if other is not None:
                weights[index] = _mean_extinction(other) / own
        weights[object_index] = 1.0
        return cls(object_index, medium, float(bounding_radius), weights)

    @cached_property
    def channels(self) -> int:
        """How many differ, and rows that lookups return: 3, or 1 in a grey medium, where one stands for all."""
        values = np.stack([self.medium.reduced_albedo, self.transport_length])
        return 1 if (values == values[:, :1]).all() else 3

    @cached_property
    def tables(self) -> list[BallTable]:
        """Ball and slab of each channel."""
        return [ball_table(float(a), self.ior) for a in self.medium.reduced_albedo[: self.channels]]

    @property
    def ior(self) -> float:
        """Index of refraction inside over outside."""
        return float(self.medium.ior)

    @cached_property
    def transport_length(self) -> Float32:
        """(3,) transport mean free paths."""
        return np.asarray(self.medium.transport_mean_free_path, np.float32)

    @cached_property
    def diffuse_albedo(self) -> Float32:
        """(3,) share of diffuse light that a half-space sends back, the boundary's own reflection left out."""
        return np.asarray(diffuse_reflectance(self.medium), np.float32)

    def weight_of(self, triangle_object: NDArray[np.int16]) -> Float32:
        """(n,) ``depth_weights`` of objects by index; opaque for -1 and for objects unknown here."""
        # as unsigned, -1 is beyond all others, and clipping leads to the last entry, which is infinite
        return self.depth_weights.take(triangle_object.astype(np.uint16), mode="clip")

    def rows(self, radius: Float32) -> list[lookup.Rows]:
        """Table rows of each channel for radii (n,) in the frame; the same object where channels agree."""
        octaves = lookup.octaves(radius)
        lengths = self.transport_length[: self.channels]
        first = lookup.rows_at(octaves - np.log2(lengths[0]))
        return [first if length == lengths[0] else lookup.rows_at(octaves - np.log2(length)) for length in lengths]

    def places(self, x: Float32, radius: Float32) -> list[lookup.Places]:
        """Where balls stand in the tables of each channel: cosines (n,) and radii (n,) in the frame."""
        columns = lookup.columns_at(x)
        rows = self.rows(radius)
        first = lookup.places(rows[0], columns)
        return [first if each is rows[0] else lookup.places(each, columns) for each in rows]

    def ball_exitance(self, x: Float32, radius: Float32, at: list[lookup.Places] | None = None) -> Float32:
        """(channels, n) B(x; R)/E0 at cosines (n,) and radii (n,) in the frame.

        at  the ``places`` of both, where they are known
        """
        at = at or self.places(x, radius)
        return np.stack([lookup.interpolate(t.ball, place) for t, place in zip(self.tables, at, strict=True)])

    @cached_property
    def emergence(self) -> list[EmergenceTable]:
        """Directions of each channel's light."""
        return [emergence_table(float(a), self.ior) for a in self.medium.reduced_albedo[: self.channels]]

    def seen(
        self,
        exitance: Float32,
        x: Float32,
        radius: Float32,
        points: SurfacePoints,
        direction: Float32,
        at: list[lookup.Places] | None = None,
    ) -> None:
        """Turn exitance (channels, n) of balls under a beam into what the viewer sees of it, in place.

        That is the exitance of a surface that is as bright from all sides and sends the viewer the same radiance:
        the exitance times the ball's share and directions of light scattered often, plus the ball's light scattered
        once (``optics.emergence``). Nothing is done where nobody views.

        at  the ``places`` of x and radius, where they are known
        """
        if points.viewer is None:
            return
        view = np.clip(cosine_to(points.normal, points.viewer), np.float32(1e-3), 1)
        _, inside = fresnel_reflectance(view, self.ior)
        # v' = v/eta + (mu' - mu/eta) n
        to_light = cosine_to(direction, points.viewer) * np.float32(1 / self.ior)
        sideways = to_light - view * np.float32(1 / self.ior) * x
        to_light = sideways + inside * x
        at = at or self.places(x, radius)
        once, length = np.zeros_like(x), np.float32(0)
        for channel, (table, place) in enumerate(zip(self.emergence, at, strict=True)):
            share = lookup.interpolate(table.share, place)
            if self.transport_length[channel] != length:
                length = self.transport_length[channel]
                paths = np.clip(radius / length, *_RADII)
                counts = np.flatnonzero(share > _FAINT_SHARE)
                once = np.zeros_like(x)
                cosine, far, leaving, turned = (each.take(counts) for each in (x, paths, inside, to_light))
                once[counts] = scattered_once(cosine, far, leaving, turned, self.ior)
            falls = sideways / paths
            falls *= lookup.interpolate(table.slope, place)
            stretched = 1 + np.abs(falls)
            often = np.where(falls > 0, 1 / stretched, stretched)
            often *= (1 - share) * (np.float32(table.norm) + np.float32(table.norm * table.depth) * inside)
            exitance[channel] *= often
            # not bent with the rest: over a ball that is all but dark it would be anything
            exitance[channel] += np.float32(table.unit * self.medium.reduced_albedo[channel]) * once

    def slab_exitance(self, x: Float32, thickness: Float32) -> Float32:
        """(channels, n) exitance of the slab per irradiance, at signed cosines; see ``BallTable.slab``."""
        at = self.places(x, thickness * np.float32(0.5))
        return np.stack([lookup.interpolate(t.slab, place) for t, place in zip(self.tables, at, strict=True)])

    def uniform_exitance(self, radius: Float32) -> Float32:
        """(channels, n) exitance of balls under constant radiance 1."""
        rows = self.rows(radius)
        return np.stack([lookup.interpolate_rows(t.uniform, r) for t, r in zip(self.tables, rows, strict=True)])

    def passed_on(self, before: Float32, depth: Float32) -> Float32:
        """(channels, n) share of diffuse light left when ``depth`` (n,) is added to a way of ``before`` (n,) inside.

            sinh k(before + 2 z_b) / sinh k(before + depth + 2 z_b)

        the flux through a layer between its extrapolated surfaces: 1/length without absorption, exponential with.
        """
        k, z_b, unit = (value[: self.channels, None] for value in (*self._diffusion, self.transport_length))
        near = k * (before / unit + 2 * z_b)
        far = near + k * (depth / unit)
        return np.exp(near - far) * np.expm1(-2 * near) / np.expm1(-2 * far)

    def curvature_radius(self, curvature: Float32) -> Float32:
        """(n,) 1/H, where the surface is flat or hollow the bounding radius, which bounds it everywhere."""
        return np.reciprocal(np.maximum(curvature, np.float32(1 / self.bounding_radius)))

    @cached_property
    def _diffusion(self) -> tuple[Float32, Float32]:
        k, z_b = diffusion(self.medium.reduced_albedo, self.medium.ior)
        # a trace of absorption keeps 0/0 away: 1e-4 per transport length
        return np.maximum(k, 1e-4).astype(np.float32), z_b.astype(np.float32)


def _mean_extinction(medium: Medium) -> float:
    return float(np.mean(medium.reduced_extinction))


def outgoing_radiance(exitance: Float32, cos_view: Float32, ior: float) -> Float32:
    """(3, n) radiance towards a viewer at outer cosines ``cos_view`` (n,) of scattered light.

        L = B T(mu)/(pi (1 - Fe))

    Inside, the light is taken for diffuse; the boundary shapes it. The integral over the hemisphere returns B.
    """
    reflectance, _ = fresnel_reflectance(cos_view, ior)
    shape = 1 - reflectance
    shape *= exit_share(ior)
    return exitance * shape


def exit_share(ior: float) -> float:
    """1/(pi (1 - Fe)), per steradian; see ``outgoing_radiance``."""
    return 1 / (np.pi * (1 - diffuse_external_reflectance(float(ior))))


def sum_in_blocks(
    points: SurfacePoints, beams: Iterable[Beam], shade: Callable[[SurfacePoints, Beam], Float32]
) -> Float32:
    """(3, n) float32 sum over beams of ``shade(block, beam)``, a block of points at a time."""
    beams = list(beams)
    total = np.zeros((3, len(points)), np.float32)
    for part, block in points.blocks():
        for beam in beams:
            total[:, part] += shade(block, beam)
    return total


def cosine_to(normal: Float32, direction: Float32) -> Float32:
    """(n,) x = N.L, kept within [-1, 1]."""
    x = np.einsum("ij,ij->j", normal, direction)
    return np.clip(x, -1, 1, out=x)
