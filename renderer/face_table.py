"""Rays in step, and what they meet: places, normals and curvature on the objects' faces, interpolated.

All that is looked up of a face stands in one row of a table, and is weighed by the place within the face that Embree
returns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .shaders.fast_body import FastBody
from .tracing.traced_scene import TracedScene

Float32 = NDArray[np.float32]


class _Columns:
    """Arrays with a column a ray."""

    def take(self, columns: NDArray[np.intp] | slice) -> Self:
        """Those at ``columns``."""
        return type(self)(*(
            value if value is None else value[..., columns] if isinstance(columns, slice) else value.take(columns, -1)
            for value in vars(self).values()
        ))  # fmt: skip


@dataclass(frozen=True)
class Rays(_Columns):
    """Rays of one generation.

    origin, direction  (3, n) float32
    throughput         (n,) float32: radiance found next, times this, reaches the camera
    stream             (n,) uint64 state of the random numbers
    sample             (n,) where the radiance adds up
    """

    origin: Float32
    direction: Float32
    throughput: Float32
    stream: NDArray[np.uint64]
    sample: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.throughput)


@dataclass(frozen=True)
class Meeting(Rays):
    """Rays that meet triangles of objects.

    distance  (n,) float32 until there
    triangle  (n,) int32
    u, v      (n,) float32 weights of its second and third corner where it is met
    """

    distance: Float32
    triangle: NDArray[np.int32]
    u: Float32
    v: Float32


@dataclass(frozen=True)
class Met(_Columns):
    """Points where rays meet objects.

    position, facing, normal  (3, n) float32: on the triangle, its normal on the ray's side, the shading normal there
    cosine                    (n,) float32 between ray and shading normal, above 0
    curvature                 (n,) float32 mean curvature
    ambient                   (3, n) float32 or None, see ``SurfacePoints``
    """

    position: Float32
    facing: Float32
    normal: Float32
    cosine: Float32
    curvature: Float32
    ambient: Float32 | None = None


class FaceTable:
    """What is looked up of a triangle, side by side in one row: its plane, and normal and curvature at its corners.

    rows     (t, 16) float32: normal and curvature of each corner, normal of the triangle, its plane's distance
    ambient  (t, 9) float32 or None: exitance at each corner, see ``ambient_field``
    """

    def __init__(self, scene: TracedScene, bodies: Mapping[int, FastBody]):
        count = len(scene.triangle_plane)
        self.rows = np.zeros((count, 16), np.float32)
        corners = self.rows[:, :12].reshape(count, 3, 4)
        corners[:, :, :3] = scene.corner_normals()
        for body in bodies.values():
            if body.curvature is not None:
                first = body.thing.first_triangle
                corners[first : first + len(body.curvature), :, 3] = body.curvature
        self.ambient = None
        if any(body.ambient is not None for body in bodies.values()):
            self.ambient = np.full((count, 9), np.nan, np.float32)
            for body in bodies.values():
                if body.ambient is not None:
                    first = body.thing.first_triangle
                    self.ambient[first : first + len(body.ambient)] = body.ambient.reshape(-1, 9)
        self.rows[:, 12:15] = scene.triangle_normal.T
        self.rows[:, 15] = scene.triangle_plane

    def at(self, rays: Meeting) -> Met:
        """The points where they do."""
        columns = np.ascontiguousarray(self.rows.take(rays.triangle, axis=0).T)
        flat, plane = columns[12:15], columns[15]
        position = rays.direction * rays.distance
        position += rays.origin
        # back onto the plane, see ``TracedScene.on_plane``
        height = _dot(flat, position)
        height -= plane
        position -= height * flat
        mixed = columns[0:4]
        mixed *= 1 - rays.u - rays.v
        mixed += rays.u * columns[4:8]
        mixed += rays.v * columns[8:12]
        normal = mixed[:3]
        length = np.sqrt(_dot(normal, normal))
        nothing = np.flatnonzero(length < np.float32(1e-6))
        if len(nothing):
            normal[:, nothing], length[nothing] = flat[:, nothing], 1
        side = np.copysign(np.float32(1), -_dot(rays.direction, flat))
        normal *= side / length
        flat *= side
        cosine = np.clip(-_dot(rays.direction, normal), np.float32(1e-4), 1)
        ambient = None
        if self.ambient is not None:
            columns = np.ascontiguousarray(self.ambient.take(rays.triangle, axis=0).T)
            ambient = columns[0:3]
            ambient *= 1 - rays.u - rays.v
            ambient += rays.u * columns[3:6]
            ambient += rays.v * columns[6:9]
        return Met(position, flat, normal, cosine, mixed[3], ambient)


def _dot(a: Float32, b: Float32) -> Float32:
    return np.einsum("ij,ij->j", a, b)
