"""The tracer's loop: emit, fly, intersect, interact, compact, refill.

All camera samples of a work unit go through one fixed set of slots; as paths end, new ones take their place.
What a sample's path does depends on its own stream alone, so results do not depend on slots, units or threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .scene.beams import beams
from .scene.camera import CameraRays
from .shaders.boundary import meet_boundary
from .shaders.fast_body import FastBody
from .shaders.opaque import meet_diffuse, meet_mirror
from .shaders.path import ROULETTE_BELOW, PathShader
from .tracing.paths import OUTSIDE, Paths
from .tracing.streams import Uniforms, stream_keys
from .tracing.tally import Tally
from .tracing.traced_scene import MISS, TracedScene

Float32 = NDArray[np.float32]
BLOCK = 16384
"""Slots of a worker: large enough to hide NumPy's call overhead, small enough for the second-level cache."""

_REFILL_AT = 1 / 2
_COMPACT_AT = 3 / 4
_MANY_SURFACES = 256
NOTHING = np.int16(-1)


@dataclass
class Samples:
    """Camera samples of one work unit.

    radiance      (3, m) float32
    first_object  (m,) int16 object that the sample met first, -1 for none
    """

    radiance: Float32
    first_object: NDArray[np.int16]
    tally: Tally = field(default_factory=Tally)


class Wavefront:
    """Traces camera samples; one instance a thread.

    fast_bodies  the objects that a shader other than path lights, by object index
    """

    def __init__(
        self,
        scene: TracedScene,
        camera: CameraRays,
        fast_bodies: Mapping[int, FastBody],
        seed: int,
        block: int = BLOCK,
    ):
        self.scene, self.camera, self.seed = scene, camera, seed
        self._paths = Paths(block, scene.media.count)
        self._uniforms = Uniforms(block)
        self._tally = Tally()
        self._path_shader = PathShader(scene, block, self._uniforms, self._tally)
        self._fast_bodies = fast_bodies
        # how each object answers a ray, for scenes with more than one kind of surface
        self._kind = [thing.shader for thing in scene.objects]

    def trace(self, pass_index: int, first_pixel: int, last_pixel: int) -> Samples:
        """Sample ``pass_index`` of the pixels in [first_pixel, last_pixel), counted along the rows."""
        paths, count = self._paths, last_pixel - first_pixel
        result = Samples(np.zeros((3, count), np.float32), np.full(count, NOTHING))
        self._first_unknown = np.ones(count, bool)
        self._beams = beams(self.scene.lights, pass_index) if self._fast_bodies else []
        paths.clear()
        emitted = 0
        while True:
            if emitted < count and paths.count <= paths.capacity * _REFILL_AT:
                new = min(paths.free, count - emitted)
                self._emit(pass_index, first_pixel, emitted, new)
                emitted += new
            if paths.count == 0:
                break
            self._step(result)
            living = np.count_nonzero(paths.alive)
            if living <= paths.count * _COMPACT_AT:
                paths.compact()
        result.tally = self._tally.take()
        result.tally.samples = count
        return result

    def _emit(self, pass_index: int, first_pixel: int, first_sample: int, count: int) -> None:
        samples = np.arange(first_sample, first_sample + count)
        streams = stream_keys(self.seed, pass_index, samples + first_pixel)
        jitter = np.stack(self._uniforms.draw(streams))
        direction = self.camera.directions(samples + first_pixel, jitter)
        self._paths.emit(self.camera.origin[:, None], direction, streams, samples)

    def _step(self, result: Samples) -> None:
        """Take every path one event further."""
        paths, shader = self._paths, self._path_shader
        limit = shader.fly(paths)
        distance, emitter_or_triangle = self._intersect(limit)
        inside = paths.owner != OUTSIDE
        hit = (emitter_or_triangle != -1) & paths.alive
        missed = (emitter_or_triangle == -1) & paths.alive
        collided = missed & inside
        escaped = np.flatnonzero(missed & ~inside)
        if len(escaped):
            background = self.scene.lights.background(paths.direction[:, escaped])
            result.radiance[:, paths.sample[escaped]] += paths.throughput[:, escaped] * background
            paths.alive[escaped] = False
        np.copyto(distance, 0, where=distance >= MISS)
        paths.origin += paths.direction * distance
        if shader.any_medium:
            shader.weigh_flights(paths, distance, collided)
            # for all paths whether they collide or not: streams must not depend on who shares the block
            shader.collide(paths, collided, result.radiance)
        index = np.flatnonzero(hit)
        if len(index):
            self._meet(index, emitter_or_triangle[index], result)
        self._roulette(collided)

    def _intersect(self, limit: Float32 | None) -> tuple[Float32, NDArray[np.int32]]:
        """Distance and triangle of what each path meets; triangle -1 for nothing, -2 - k for the k-th sphere light."""
        paths = self._paths
        distance, triangle = self.scene.closest(paths.origin, paths.direction, limit)
        self._tally.rays += int(np.count_nonzero(paths.alive))
        for k, sphere in enumerate(self.scene.lights.spheres):
            reach = sphere.distance(paths.origin, paths.direction)
            nearer = reach < distance
            np.copyto(distance, reach, where=nearer)
            np.copyto(triangle, np.int32(-2 - k), where=nearer)
        return distance, triangle

    def _meet(self, index: NDArray[np.intp], triangle: NDArray[np.int32], result: Samples) -> None:
        """What each surface does to the paths ``index`` that meet it."""
        paths, scene = self._paths, self.scene
        spheres = triangle < 0
        if spheres.any():
            self._meet_spheres(index[spheres], -2 - triangle[spheres], result)
            index, triangle = index[~spheres], triangle[~spheres]
        paths.origin[:, index] = scene.on_plane(paths.origin[:, index], triangle)
        paths.surfaces[index] += 1
        thing = scene.triangle_object[triangle]
        self._note_first(index, thing, result)
        for k, kind in enumerate(self._kind):
            here = np.flatnonzero(thing == k) if len(self._kind) > 1 or scene.lights.rectangles else slice(None)
            who, faces = index[here], triangle[here]
            if not len(who):
                continue
            if kind == "path":
                meet_boundary(scene, paths, who, faces, self._uniforms, self._tally, result.radiance)
            elif kind == "opaque":
                meet_diffuse(scene, paths, who, faces, self._uniforms, self._tally, result.radiance)
            elif kind == "mirror":
                meet_mirror(scene, paths, who, faces)
            else:
                self._fast_bodies[k].meet(
                    scene, paths, who, faces, self._beams, self._uniforms, self._tally, result.radiance
                )
        if scene.lights.rectangles:
            here = np.flatnonzero(thing < 0)
            self._meet_rectangles(index[here], triangle[here], result)

    def _note_first(self, index: NDArray[np.intp], thing: NDArray[np.int16], result: Samples) -> None:
        sample = self._paths.sample[index]
        new = self._first_unknown[sample]
        if new.any():
            result.first_object[sample[new]] = thing[new]
            self._first_unknown[sample[new]] = False

    def _meet_rectangles(self, index: NDArray[np.intp], triangle: NDArray[np.int32], result: Samples) -> None:
        """Add the radiance of rectangle lights seen from the front; they end every path."""
        paths, scene = self._paths, self.scene
        for k, rectangle in enumerate(scene.lights.rectangles):
            mine = index[(triangle - scene.first_light_triangle) // 2 == k]
            front = np.einsum("ij,ik->k", rectangle.normal, paths.direction[:, mine]) < 0
            seen = mine[front & ~paths.lit[mine]]
            result.radiance[:, paths.sample[seen]] += paths.throughput[:, seen] * rectangle.radiance
        paths.alive[index] = False

    def _meet_spheres(self, index: NDArray[np.intp], which: NDArray[np.int32], result: Samples) -> None:
        """Add the radiance of sphere lights; they end every path."""
        paths = self._paths
        self._note_first(index, np.full(len(index), NOTHING), result)
        for k, sphere in enumerate(self.scene.lights.spheres):
            seen = index[(which == k) & ~paths.lit[index]]
            result.radiance[:, paths.sample[seen]] += paths.throughput[:, seen] * sphere.radiance
        paths.alive[index] = False

    def _roulette(self, collided: NDArray[np.bool_]) -> None:
        """End faint paths, unbiased: survive with twice the largest channel, then weigh up to a half.

        Played after collisions and from the fourth surface on, so that a single reflection stays free of noise.
        Light that 256 surfaces keep inside a clear body without a collision would circle for ever: it goes on
        with probability 0.9 a time.
        """
        paths = self._paths
        largest = np.maximum.reduce(paths.throughput, axis=0)
        survival = 2 * largest
        np.copyto(survival, 1, where=(largest >= ROULETTE_BELOW) | ~(collided | (paths.surfaces > 3)))
        np.copyto(survival, np.minimum(survival, np.float32(0.9)), where=paths.surfaces > _MANY_SURFACES)
        index = np.flatnonzero((survival < 1) & paths.alive)
        if len(index):
            u, _ = self._uniforms.draw_at(paths.stream, index)
            chance = survival[index]
            lives = u < chance
            paths.alive[index[~lives]] = False
            index = index[lives]
            paths.throughput[:, index] /= chance[lives]
