"""Floors and walls: Lambertian and mirror surfaces, and the patch that stands in for missing surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.phase import around, spherical
from ..tracing.paths import CHANCE
from ..tracing.traced_scene import offset_from
from ..tracing.transport import Transport
from .direct_light import arriving, pick, received, worthwhile

Float32 = NDArray[np.float32]
Indices = NDArray[np.intp]


def cosine_direction(normal: Float32, u1: Float32, u2: Float32) -> Float32:
    """(3, n) directions around unit normals with density cos / pi: uniform on the disk, lifted (Malley's method)."""
    return around(normal, spherical(np.sqrt(1 - u1), u2, np.empty_like(normal)))


def meet_diffuse(transport: Transport, index: Indices, triangle: NDArray[np.int32]) -> None:
    """Light the Lambertian points where the paths ``index`` are, and send the paths on by the cosine.

    Lights with an extent are found both ways: sampled here, and met by the path that goes on. Even skies are only met.
    """
    scene, paths = transport.scene, transport.paths
    geometric = np.take(scene.triangle_normal, triangle, axis=1)
    direction, position = paths.direction[:, index], paths.origin[:, index]
    side = -np.copysign(np.float32(1), np.einsum("ij,ij->j", direction, geometric))
    facing = geometric * side
    shading = scene.shading_normal(position, triangle) * side
    reflectance = scene.reflectance[:, scene.triangle_object[triangle]]
    paths.throughput[:, index] *= reflectance
    for light in arriving(transport, index, position, skies=True):
        value = _lambert(shading, facing, light.direction)
        lit, weight = worthwhile(transport, index, light, value, value)
        if len(lit):
            who = index[lit]
            arrived = received(transport, position[:, lit], facing[:, lit], pick(light, lit),
                               paths.inside[:, who], paths.owner[who])  # fmt: skip
            transport.add(who, arrived, weight)
    u1, u2 = transport.draw(index)
    turned = cosine_direction(shading, u1, u2)
    paths.alive[index] &= np.einsum("ij,ij->j", turned, facing) > 0
    paths.direction[:, index] = turned
    paths.origin[:, index] = offset_from(position, facing, np.ones_like(side))
    if scene.lights.sampled:
        paths.density[index], paths.flown[index] = _lambert(shading, facing, turned), 0
    paths.branch[index] = CHANCE


def _lambert(shading: Float32, facing: Float32, direction: Float32) -> Float32:
    """(n,) cosine over pi, which is scattering function times cosine and density of the directions drawn, for white."""
    cosine = np.einsum("ij,ij->j", shading, direction)
    above = (cosine > 0) & (np.einsum("ij,ij->j", facing, direction) > 0)
    return np.where(above, cosine * np.float32(1 / np.pi), 0)


def meet_mirror(transport: Transport, index: Indices, triangle: NDArray[np.int32]) -> None:
    """Reflect the paths ``index`` at a perfect mirror."""
    scene, paths = transport.scene, transport.paths
    geometric = np.take(scene.triangle_normal, triangle, axis=1)
    direction, position = paths.direction[:, index], paths.origin[:, index]
    side = -np.copysign(np.float32(1), np.einsum("ij,ij->j", direction, geometric))
    shading = scene.shading_normal(position, triangle)
    turned = direction - 2 * np.einsum("ij,ij->j", direction, shading) * shading
    wrong = np.einsum("ij,ij->j", turned, geometric) * side <= 0
    turned[:, wrong] = (direction - 2 * np.einsum("ij,ij->j", direction, geometric) * geometric)[:, wrong]
    paths.throughput[:, index] *= scene.reflectance[:, scene.triangle_object[triangle]]
    paths.direction[:, index] = turned
    paths.origin[:, index] = offset_from(position, geometric, side)
    paths.density[index] = np.inf


def patch_radiance(transport: Transport, index: Indices, facing: Float32) -> Float32:
    """(3, n) radiance of white Lambertian patches where the paths ``index`` are, shadows left out; ``facing`` (3, n).

    Multiplied by the material's colour this is what a path returns that has left through a hole, or slipped
    through the surface: "infinitely long" inside, it would have taken on the material's colour (Wadkien 2008).
    """
    u1, u2 = transport.draw(index)
    total = transport.scene.lights.background(cosine_direction(facing, u1, u2))
    for light in arriving(transport, index, transport.paths.origin[:, index]):
        cosine = np.maximum(np.einsum("ij,ij->j", facing, light.direction), 0)
        total += light.irradiance * (cosine / np.float32(np.pi))
    return total
