"""Frames in which every object is lit by a fast shader behind a smooth boundary: traced without the wavefront.

Paths neither branch nor walk there. What a camera ray meets is lit by one call and sends on one reflection, so
blocks of rays go from reflection to reflection in step, and need little more than an origin, a direction and a
number. The picture is the wavefront's, which takes all other scenes, to rounding; it takes half its time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from .face_table import FaceTable, Meeting, Met, Rays
from .optics.dielectric import fresnel_reflectance
from .scene.beams import beams
from .scene.camera import CameraRays
from .scene.coverage import covered_pixels
from .shaders.blend import Blend, Choices
from .shaders.fast_body import FastBody, keep_outside
from .shaders.surface import SurfacePoints, exit_share
from .strips import NOTHING, Strip, Strips, TracedStrip
from .tracing.paths import ROULETTE_BELOW
from .tracing.roulette import FREE_SURFACES, LASTING, MANY_SURFACES
from .tracing.streams import Uniforms, stream_keys
from .tracing.tally import Tally
from .tracing.traced_scene import TracedScene

Float32 = NDArray[np.float32]

BLOCK = 16384
"""Rays in step: their arrays stay in the second-level cache."""


Group = TypeVar("Group", Rays, Meeting)


def applies_to(scene: TracedScene, bodies: Mapping[int, FastBody], blends: Mapping[int, Blend]) -> bool:
    """Whether all objects are lit by fast shaders, by one or by several, and none has a rough boundary."""
    lit = [*bodies.values(), *(body for blend in blends.values() for body in blend.bodies)]
    return len(bodies) + len(blends) == len(scene.objects) and all(
        body is not None and (body.thing.roughness == 0 or body.optics.ior == 1) for body in lit
    )


class Frames:
    """What is the same in all frames of a scene; threads share it."""

    def __init__(
        self,
        scene: TracedScene,
        camera: CameraRays,
        bodies: Mapping[int, FastBody],
        seed: int,
        blends: Mapping[int, Blend] | None = None,
    ):
        self.scene, self.bodies, self.seed, self.blends = scene, bodies, seed, blends or {}
        # the last one of several looks up most
        dearest = {index: body for index, blend in self.blends.items() if (body := blend.bodies[-1]) is not None}
        self.table = FaceTable(scene, {**bodies, **dearest})
        self.look_from(camera)

    def look_from(self, camera: CameraRays) -> None:
        """Go on with another camera; no frame may be under way."""
        self.camera = camera
        width, height = camera.resolution
        self.covered = np.ones(width * height, bool)
        if not self.scene.lights.spheres:
            self.covered = covered_pixels(camera, self.scene.vertices, self.scene.triangles)


class DirectTracer:
    """Traces camera samples as ``Wavefront`` does; one instance a thread."""

    def __init__(self, frames: Frames):
        self._frames = frames
        self._uniforms = Uniforms(BLOCK)

    def trace(self, strips: Strips) -> Iterator[TracedStrip]:
        """As ``Wavefront.trace``, one strip at a time."""
        while not strips.stopped:
            strip = strips.take()
            if strip is None:
                if strips.over:
                    return
                strips.wait()
                continue
            traced = self._traced(strip, strips)
            if traced is not None:
                strips.note(len(strip.pixels), 0)
                yield traced

    def _traced(self, strip: Strip, strips: Strips) -> TracedStrip | None:
        """The strip with its samples; None where they are no longer wanted."""
        pixels, covered = strip.pixels, self._frames.covered[strip.pixels]
        frame = _Frame(self._frames, self._uniforms, strip.pass_index, pixels)
        surfaces = 0
        meeting = [frame.from_camera(sample) for sample in _parts(np.flatnonzero(covered))]
        while meeting:
            surfaces += 1
            reflected = []
            for part in _blocks(meeting):
                if strips.stopped:
                    return None
                reflected.append(frame.roulette(frame.light(part), surfaces))
            meeting = [frame.cast(part) for part in _blocks(reflected)]
        frame.see_nothing(np.flatnonzero(~covered))
        tally = Tally()
        tally.rays, tally.samples = frame.rays, len(pixels)
        return TracedStrip(strip, frame.radiance.T, frame.first_object, tally)


def _parts(columns: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return [columns[start : start + BLOCK] for start in range(0, len(columns), BLOCK)]


def _blocks(rays: list[Group]) -> Iterator[Group]:
    """All rays, in blocks that are full, or nearly."""
    rays = [each for each in rays if len(each)]
    if 2 * sum(map(len, rays)) > BLOCK * len(rays):
        yield from rays
    elif rays:
        kind = type(rays[0])
        columns = [[getattr(each, column.name) for each in rays] for column in fields(kind)]
        whole = kind(*(np.concatenate(column, axis=-1) for column in columns))
        yield from (whole.take(slice(start, start + BLOCK)) for start in range(0, len(whole), BLOCK))


class _Frame:
    """One picture, or part of one, in the making.

    pixels  (n,) of the samples
    """

    def __init__(self, frames: Frames, uniforms: Uniforms, pass_index: int, pixels: NDArray[np.int64]):
        self._scene, self._camera, self._table, self._bodies = frames.scene, frames.camera, frames.table, frames.bodies
        self._blends, self._choices = frames.blends, None
        if frames.blends:
            self._choices = Choices(frames.blends, len(pixels))
            self._choices.choose(np.arange(len(pixels)), stream_keys(frames.seed, pass_index, pixels))
        self._seed, self._pass, self._pixels, self._uniforms = frames.seed, pass_index, pixels, uniforms
        self._beams = beams(frames.scene.lights, pass_index)
        # a sample's channels side by side, as the film has them
        self.radiance = np.zeros((len(pixels), 3), np.float32)
        self.first_object = np.full(len(pixels), NOTHING)
        self.rays = 0

    def from_camera(self, sample: NDArray[np.intp]) -> Meeting:
        """What camera rays meet that is an object."""
        stream, direction = self._look(sample)
        origin = np.broadcast_to(self._camera.origin[:, None], direction.shape)
        met = self.cast(Rays(origin, direction, np.ones(len(sample), np.float32), stream, sample))
        self.first_object[met.sample] = self._scene.triangle_object.take(met.triangle)
        return met

    def see_nothing(self, sample: NDArray[np.intp]) -> None:
        """Add the sky that camera rays see that meet nothing."""
        self.rays += len(sample)
        if self._scene.lights.even:
            self.radiance[sample] = self._scene.lights.background(np.zeros((3, 1), np.float32)).T
            return
        for part in _parts(sample):
            self.radiance[part] = self._scene.lights.background(self._look(part)[1]).T

    def _look(self, sample: NDArray[np.intp]) -> tuple[NDArray[np.uint64], Float32]:
        pixel = self._pixels[sample]
        stream = stream_keys(self._seed, self._pass, pixel)
        return stream, self._camera.directions(pixel.astype(np.int32), np.stack(self._uniforms.draw(stream)))

    def cast(self, rays: Rays) -> Meeting:
        """Follow rays; add the lights and the sky that they meet, and keep what meets an object."""
        scene = self._scene
        self.rays += len(rays)
        distance, triangle, u, v = scene.met_with_place(rays.origin, rays.direction)
        objects = np.flatnonzero((triangle >= 0) & (triangle < scene.first_light_triangle))
        if len(objects) < len(rays):
            self._meet_lights(rays, triangle)
        columns = (each.take(objects, axis=-1) for each in (*vars(rays).values(), distance, triangle, u, v))
        return Meeting(*columns)

    def _meet_lights(self, rays: Rays, triangle: NDArray[np.int32]) -> None:
        """Add the radiance of the sky and of lights with an extent; they end every ray."""
        lights = self._scene.lights
        sky = np.flatnonzero(triangle == -1)
        seen = np.zeros((3, 1), np.float32) if lights.even else rays.direction.take(sky, axis=1)
        self._add(rays, sky, lights.background(seen))
        for k, sphere in enumerate(lights.spheres):
            self._add(rays, np.flatnonzero(triangle == -2 - k), sphere.radiance)
        for k, rectangle in enumerate(lights.rectangles):
            met = np.flatnonzero((triangle - self._scene.first_light_triangle) // 2 == k)
            front = np.einsum("ij,ik->k", rectangle.normal, rays.direction.take(met, axis=1)) < 0
            self._add(rays, met[front], rectangle.radiance)

    def _add(self, rays: Rays, which: NDArray[np.intp], radiance: Float32) -> None:
        if len(which):
            # every sample has one ray
            self.radiance[rays.sample[which]] += (rays.throughput[which] * radiance).T

    def light(self, rays: Meeting) -> Rays:
        """Add the scattered light of the objects that rays meet; their reflections."""
        met = self._table.at(rays)
        thing = self._scene.triangle_object.take(rays.triangle)
        reflectance = np.zeros(len(rays), np.float32)
        for body, mine in self._lit(thing, rays.sample):
            if len(mine) == len(rays):
                reflectance = self._scattered(body, rays, met)
            elif len(mine):
                reflectance[mine] = self._scattered(body, rays.take(mine), met.take(mine))
        turned = (2 * met.cosine) * met.normal
        turned += rays.direction
        keep_outside(turned, met.facing)
        going = np.flatnonzero(reflectance > 0)
        origin = met.facing * RAY_OFFSET
        origin += met.position
        reflected = Rays(origin, turned, rays.throughput * reflectance, rays.stream, rays.sample)
        return reflected if len(going) == len(rays) else reflected.take(going)

    def _lit(self, thing: NDArray[np.int16], sample: NDArray[np.intp]) -> Iterator[tuple[FastBody, NDArray[np.intp]]]:
        """Who lights which of the rays that meet the objects ``thing`` (n,)."""
        for index, body in self._bodies.items():
            yield body, np.flatnonzero(thing == index)
        for index, blend in self._blends.items():
            assert self._choices is not None
            here = np.flatnonzero(thing == index)
            chosen = self._choices.of(index, sample[here])
            for number, one in enumerate(blend.bodies):
                assert one is not None
                yield one, here[chosen == number]

    def _scattered(self, body: FastBody, rays: Meeting, met: Met) -> Float32:
        """Add the light that leaves ``body`` along rays; the boundary's reflectance (n,) there."""
        points = SurfacePoints(met.position, met.normal, met.curvature, -rays.direction, met.ambient)
        exitance = body.exitance(self._scene, points, rays.throughput, self._beams)
        reflectance, _ = fresnel_reflectance(met.cosine, body.optics.ior)
        exitance *= rays.throughput * (1 - reflectance) * exit_share(body.optics.ior)
        self.radiance[rays.sample] += exitance.T
        return reflectance

    def roulette(self, rays: Rays, surfaces: int) -> Rays:
        """See ``tracing.roulette.play_at_surfaces``."""
        if surfaces <= FREE_SURFACES or not len(rays):
            return rays
        chance = np.minimum(rays.throughput / (2 * ROULETTE_BELOW), 1)
        if surfaces > MANY_SURFACES:
            chance = np.minimum(chance, LASTING)
        u, _ = self._uniforms.draw(rays.stream)
        lives = np.flatnonzero(u < chance)
        rays = rays.take(lives)
        return replace(rays, throughput=rays.throughput / chance[lives])
