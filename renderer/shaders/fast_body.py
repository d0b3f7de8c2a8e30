"""Objects lit by a shader other than path: scattered light from one call, the boundary's reflection as in path.

The dielectric boundary is the same for all shaders, so highlights and reflections do not jump where the shader
changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..optics.dielectric import fresnel_reflectance
from ..optics.microfacet import sample_visible_facet, turning, unmasked
from ..scene.beams import Beam
from ..tracing.paths import Paths
from ..tracing.traced_scene import TracedObject, TracedScene, offset_from
from ..tracing.transport import Transport
from . import plumb, scalar
from .direct_light import arriving, pick, received, worthwhile
from .local_frame import LocalFrame
from .surface import BodyOptics, SurfacePoints, outgoing_radiance

Float32 = NDArray[np.float32]

FAINT = 0.125
"""Throughput below which a body seen by reflection is lit by scalar where plumb is asked for: plumb's rays there would
cost a third of the frame for a few percent of its light."""


@dataclass(frozen=True)
class _Arrival:
    """Paths that meet a body.

    index             (n,) which
    position          (3, n) where
    direction         (3, n) of their flight
    facing, normal    (3, n) the triangle's normal and the shading normal, on their side
    """

    index: NDArray[np.intp]
    position: Float32
    direction: Float32
    facing: Float32
    normal: Float32

    @classmethod
    def of(cls, scene: TracedScene, paths: Paths, index: NDArray[np.intp], triangle: NDArray[np.int32]) -> _Arrival:
        """Of the paths ``index``, which stand on ``triangle`` (n,)."""
        geometric = np.take(scene.triangle_normal, triangle, axis=1)
        direction, position = paths.direction[:, index], paths.origin[:, index]
        side = -np.copysign(np.float32(1), np.einsum("ij,ij->j", direction, geometric))
        return cls(index, position, direction, geometric * side, scene.shading_normal(position, triangle) * side)


@dataclass
class FastBody:
    """An object with the shader module (plumb, scalar or diffuse) that lights it.

    curvature  (faces of the object, 3) float32 mean curvature at the corners, in the frame; None where the shader
               needs none
    ambient    (faces of the object, 3, 3) float32, see ``ambient_field``; None where there is none
    """

    thing: TracedObject
    shader: ModuleType
    optics: BodyOptics
    curvature: Float32 | None
    ambient: Float32 | None = None

    @property
    def probes(self) -> bool:
        """Whether it looks along the axes of constant environments."""
        return self.shader is plumb

    def meet(
        self, transport: Transport, index: NDArray[np.intp], triangle: NDArray[np.int32], beams: Sequence[Beam]
    ) -> None:
        """Add the body's scattered light to the paths ``index`` that meet it, and send them on by reflection."""
        scene, paths = transport.scene, transport.paths
        at = _Arrival.of(scene, paths, index, triangle)
        view_cosine = np.clip(-np.einsum("ij,ij->j", at.direction, at.normal), np.float32(1e-4), 1)
        points = self._points(scene, at.position, at.normal, triangle, -at.direction)
        exitance = self.exitance(scene, points, paths.throughput[:, index].max(axis=0), beams)
        transport.add(index, outgoing_radiance(exitance, view_cosine, self.optics.ior))
        assert self.thing.medium is not None
        eta = float(self.thing.medium.ior)
        if eta == 1:
            paths.alive[index] = False
        elif self.thing.roughness == 0:
            reflectance, _ = fresnel_reflectance(view_cosine, eta)
            paths.throughput[:, index] *= reflectance
            self._send_on(paths, at, at.direction + 2 * view_cosine * at.normal)
        else:
            self._reflect_rough(transport, at)

    def exitance(
        self, scene: TracedScene, points: SurfacePoints, throughput: Float32, beams: Sequence[Beam]
    ) -> Float32:
        """(3, n) exitance, by the faster scalar shader where little of it reaches the camera: ``throughput`` (n,)."""
        faint = throughput < FAINT
        if self.shader is not plumb or not faint.any():
            return self.shader.exitance(scene, points, self.optics, beams)
        result = np.empty((3, len(points)), np.float32)
        for columns, shader in ((np.flatnonzero(faint), scalar), (np.flatnonzero(~faint), plumb)):
            result[:, columns] = shader.exitance(scene, points.take(columns), self.optics, beams)
        return result

    def _points(
        self, scene: TracedScene, position: Float32, normal: Float32, triangle, viewer: Float32
    ) -> SurfacePoints:
        if self.curvature is None:
            return SurfacePoints(position, normal, np.zeros(len(triangle), np.float32), viewer)
        weights, face = scene.barycentric(position, triangle), triangle - self.thing.first_triangle
        curvature = np.einsum("ij,ji->j", weights, self.curvature[face])
        ambient = None if self.ambient is None else np.einsum("ij,jik->kj", weights, self.ambient[face])
        return SurfacePoints(position, normal, curvature, viewer, ambient)

    def _reflect_rough(self, transport: Transport, at: _Arrival) -> None:
        """The reflecting half of the GGX boundary, with the highlights of lights."""
        scene, paths = transport.scene, transport.paths
        index, alpha, eta = at.index, self.thing.roughness, self.optics.ior
        frame = LocalFrame(at.normal)
        view = frame.to_local(-at.direction)
        view[2] = np.maximum(view[2], np.float32(1e-4))
        for light in arriving(transport, index, at.position, skies=True):
            to_light = frame.to_local(light.direction)
            drawn, share = turning(view, to_light, eta, alpha)
            above = (to_light[2] > 0) & (np.einsum("ij,ij->j", at.facing, light.direction) > 0)
            value = np.where(above, drawn * share * unmasked(to_light[2], alpha), 0)
            lit, weight = worthwhile(transport, index, light, value, drawn)
            if len(lit):
                who = index[lit]
                arrived = received(transport, at.position[:, lit], at.facing[:, lit], pick(light, lit),
                                   paths.inside[:, who], paths.owner[who])  # fmt: skip
                transport.add(who, arrived, weight)
        u1, u2 = transport.draw(index)
        facet = sample_visible_facet(view, alpha, u1, u2)
        cos_in = np.clip(np.einsum("ij,ij->j", view, facet), 0, 1)
        reflectance, _ = fresnel_reflectance(cos_in, eta)
        turned = 2 * cos_in * facet - view
        weight = np.where(turned[2] > 0, reflectance * unmasked(turned[2], alpha), 0)
        paths.throughput[:, index] *= weight
        self._send_on(paths, at, frame.to_world(turned))
        if scene.lights.sampled:
            drawn, _ = turning(view, turned, eta, alpha)
            paths.density[index] = np.where(drawn > 0, drawn, np.inf)
            paths.flown[index] = 0

    @staticmethod
    def _send_on(paths: Paths, at: _Arrival, turned: Float32) -> None:
        keep_outside(turned, at.facing)
        paths.direction[:, at.index] = turned
        paths.origin[:, at.index] = offset_from(at.position, at.facing, np.ones(len(at.index), np.float32))
        paths.density[at.index] = np.inf


def keep_outside(turned: Float32, facing: Float32) -> None:
    """Mirror directions (3, n), in place, that a shading normal sent through the true surface, whose normals on the
    viewer's side are ``facing``: the light is kept, as in ``boundary``."""
    height = np.einsum("ij,ij->j", turned, facing)
    wrong = np.flatnonzero(height < 0)
    if len(wrong):
        turned[:, wrong] -= 2 * height[wrong] * facing[:, wrong]
