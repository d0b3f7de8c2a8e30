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
    """What is looked up of a triangle, side by side in one row.

    rows     (t, 8) float32: its unit normal, its plane's distance, curvature at its corners; and a zero, as rows of
             32 bytes are gathered fastest
    normals  (t, 9) float32 or None: shading normal at each corner; None where shading normals are those of triangles
    ambient  (t, 9) float32 or None: exitance at each corner, see ``ambient_field``
    """

    def __init__(self, scene: TracedScene, bodies: Mapping[int, FastBody]):
        count = len(scene.triangle_plane)
        self.rows = np.zeros((count, 8), np.float32)
        self.rows[:, :3] = scene.triangle_normal.T
        self.rows[:, 3] = scene.triangle_plane
        self.normals = None if scene.faceted else np.ascontiguousarray(scene.corner_normals().reshape(-1, 9))
        self.ambient = None
        if any(body.ambient is not None for body in bodies.values()):
            self.ambient = np.full((count, 9), np.nan, np.float32)
        for body in bodies.values():
            first = body.thing.first_triangle
            if body.curvature is not None:
                self.rows[first : first + len(body.curvature), 4:7] = body.curvature
            if self.ambient is not None and body.ambient is not None:
                self.ambient[first : first + len(body.ambient)] = body.ambient.reshape(-1, 9)

    def at(self, rays: Meeting) -> Met:
        """The points where they do."""
        columns = np.ascontiguousarray(self.rows.take(rays.triangle, axis=0).T)
        flat, plane = columns[:3], columns[3]
        weights = 1 - rays.u - rays.v, rays.u, rays.v
        position = rays.direction * rays.distance
        position += rays.origin
        # back onto the plane, see ``TracedScene.on_plane``
        height = _dot(flat, position)
        height -= plane
        position -= height * flat
        cosine = _dot(rays.direction, flat)
        side = -np.copysign(np.float32(1), cosine)
        normal = flat
        if self.normals is not None:
            normal = _mixed(self.normals, rays.triangle, weights)
            length = np.sqrt(_dot(normal, normal))
            nothing = np.flatnonzero(length < np.float32(1e-6))
            if len(nothing):
                normal[:, nothing], length[nothing] = flat[:, nothing], 1
            normal *= side / length
            cosine = _dot(rays.direction, normal)
        flat *= side
        cosine = np.clip(np.abs(cosine) if normal is flat else -cosine, np.float32(1e-4), 1)
        curvature = _weighted(columns[4:7], weights)
        ambient = None if self.ambient is None else _mixed(self.ambient, rays.triangle, weights)
        return Met(position, flat, normal, cosine, curvature, ambient)


def _mixed(corners: Float32, triangle: NDArray[np.int32], weights: tuple[Float32, Float32, Float32]) -> Float32:
    """(3, n) of a table of vectors at the corners, (t, 9)."""
    columns = np.ascontiguousarray(corners.take(triangle, axis=0).T)
    return _weighted((columns[0:3], columns[3:6], columns[6:9]), weights)


def _weighted(corners, weights: tuple[Float32, Float32, Float32]) -> Float32:
    """Sum of three arrays with weights; the first one's memory becomes the result."""
    first, second, third = corners
    first *= weights[0]
    first += weights[1] * second
    first += weights[2] * third
    return first


def _dot(a: Float32, b: Float32) -> Float32:
    return np.einsum("ij,ij->j", a, b)
