"""The tracer's loop: emit, fly, meet surfaces, walk in media, refill.

As paths end, new ones are emitted, those of the next pass where one has been begun whole: blocks stay full, and
long paths never walk alone. What a sample's paths do depends on their own streams alone, so results do not depend on
blocks or threads.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .optics.multiple_importance import power_heuristic
from .scene.beams import Beam, beams, change
from .scene.camera import CameraRays
from .scene.lights import RectangleSource, SphereSource
from .shaders.blend import Blend, Choices
from .shaders.boundary import meet_boundary, split
from .shaders.fast_body import FastBody
from .shaders.opaque import meet_diffuse, meet_mirror
from .shaders.path import MediumWalk
from .strips import NOTHING, Strips, TracedStrip
from .tracing.acceleration import Acceleration
from .tracing.paths import Paths
from .tracing.roulette import play_at_surfaces
from .tracing.streams import Uniforms, stream_keys
from .tracing.tally import Tally
from .tracing.traced_scene import TracedScene
from .tracing.transport import Transport

Float32 = NDArray[np.float32]
BLOCK = 131072
"""Paths in flight of a worker. Many, although they do not fit into the second-level cache: between NumPy's calls
threads wait for each other. In a grey medium two threads bring 1.5 times the speed of one with 16 thousand, 1.9 times
with these; in dense ones, whose jumps work on small groups, 1.0 and 1.2 (``benchmarks/walks.py``)."""

_REFILL_AT = 1 / 2


class Wavefront:
    """Traces camera samples; one instance a thread.

    fast_bodies   the objects that a shader other than path lights, by object index
    acceleration  what makes walks shorter or cheaper and leaves their mean alone
    blends        the objects that several shaders light, by object index

    A path is in one of several places: flying outside, standing on a surface, or in one of the media. Each step
    takes all paths of the fullest place one event further.
    """

    def __init__(
        self,
        scene: TracedScene,
        camera: CameraRays,
        fast_bodies: Mapping[int, FastBody],
        seed: int,
        block: int = BLOCK,
        acceleration: Acceleration | None = None,
        blends: Mapping[int, Blend] | None = None,
    ):
        self.scene, self.camera, self.seed = scene, camera, seed
        block = max(block, 2)  # a path and its branch
        self._uniforms = Uniforms(block)
        self._tally = Tally()
        self._columns, self._beams = Columns(block), dict[int, list[Beam]]()
        self._places = [self._place(block) for _ in range(2 + scene.media.count)]
        self._outside, self._at_surfaces, *in_media = self._places
        self._flying, self._standing = self._outside.paths, self._at_surfaces.paths
        chosen = acceleration or Acceleration.none(scene.media.count)
        self._walks = [MediumWalk(place, slot, chosen) for slot, place in enumerate(in_media)]
        self._fast_bodies, self._blends = fast_bodies, blends or {}
        self._emitted = self._noted = self._steps = 0
        # how each object answers a ray, for scenes with more than one kind of surface
        self._kind = [thing.shader for thing in scene.objects]

    def _place(self, block: int) -> Transport:
        paths = Paths(block, self.scene.media.count)
        return Transport(self.scene, paths, self._uniforms, self._tally, self._columns.radiance)

    def trace(self, strips: Strips) -> Iterator[TracedStrip]:
        """Trace strips until there are no more, or they are stopped; each is given back when its last path has
        ended."""
        self._begin(strips.longest)
        # every path outside may still split in two
        branches = 2 if self._walks else 1
        while not strips.stopped:
            outside, inside = self._flying.count + self._standing.count, sum(walk.paths.count for walk in self._walks)
            taken = branches * outside + inside
            steps, age = self._columns.oldest(self._steps)
            ended = self._emitted - outside - inside
            room = max(strips.room(self._flying.capacity, ended, age), branches)
            if taken <= room * _REFILL_AT:
                yield from self._ended()
                strips.note(ended - self._noted, steps)
                self._noted = ended
                self._emit(strips, (room - taken) // branches)
            if any(place.paths.count for place in self._places):
                self._step()
            elif strips.over and self._columns.emitting is None:
                yield from self._ended()
                return
            else:
                strips.wait()
        self._tally.take()

    def _begin(self, longest: int) -> None:
        """Forget all paths and make room for strips of at most so many samples."""
        if not self._columns.fit(longest):
            self._columns = Columns(longest)
            for place in self._places:
                place.radiance = self._columns.radiance
        self._columns.clear()
        self._choices = Choices(self._blends, self._columns.count) if self._blends else None
        self._emitted = self._noted = self._steps = 0
        for place in self._places:
            place.paths.clear()

    def _emit(self, strips: Strips, room: int) -> None:
        """Emit the next camera samples, at most so many."""
        parts = []
        while room and self._turn_to_next(strips):
            parts.append(self._columns.emit(room))
            room -= len(parts[-1].columns)
        if not parts:
            return
        columns, pixels, passes = (np.concatenate(part) for part in zip(*parts, strict=True))
        streams = stream_keys(self.seed, passes, pixels)
        if self._choices is not None:
            self._choices.choose(columns, streams)
        direction = self.camera.directions(pixels, np.stack(self._uniforms.draw(streams)))
        self._flying.emit(self.camera.origin[:, None], direction, streams, columns)
        self._emitted += len(columns)

    def _turn_to_next(self, strips: Strips) -> bool:
        """Whether there is a strip whose samples can be emitted now."""
        columns = self._columns
        if columns.emitting is None:
            strip = None if columns.full else strips.take()
            if strip is None:
                return False
            columns.put(strip, self._steps)
        return True

    def _ended(self) -> Iterator[TracedStrip]:
        """The strips whose paths have all ended."""
        alive = (place.paths.sample for place in self._places)
        for strip, radiance, first_object in self._columns.ended(alive):
            tally = self._tally.take()
            tally.samples = len(first_object)
            yield TracedStrip(strip, radiance, first_object, tally)

    def _step(self) -> None:
        """Take the paths of the fullest place one event further."""
        places = [(self._flying.count, self._fly), (self._standing.count, self._stand)]
        for walk in self._walks:
            places.append((walk.paths.count, partial(walk.step, self._standing)))
        _, step = max(places, key=itemgetter(0))
        step()
        self._steps += 1

    def _fly(self) -> None:
        """Take the paths outside all media to the surfaces they meet; add the background that the others see."""
        paths = self._flying
        distance, triangle = self.scene.met(paths.origin, paths.direction)
        self._tally.rays += paths.count
        escaped = np.flatnonzero(triangle == -1)
        lights = self.scene.lights
        density = paths.density[escaped] if lights.skies else None
        self._outside.add(escaped, lights.background(paths.direction[:, escaped], density))
        np.copyto(distance, 0, where=triangle == -1)
        paths.origin += paths.direction * distance
        if lights.sampled:
            paths.flown += distance
        paths.triangle[:] = triangle
        paths.remove(escaped)
        paths.move(np.arange(paths.count), self._standing)

    def _stand(self) -> None:
        """Reflect, refract or end the paths that stand on surfaces, and send them where they now belong."""
        paths = self._standing
        self._meet()
        play_at_surfaces(paths, self._uniforms)
        paths.bury()
        for slot, walk in enumerate(self._walks):
            inside = np.flatnonzero(paths.owner == slot)
            entered = paths.move(inside, walk.paths)
            walk.enter(entered)
        paths.move(np.arange(paths.count), self._flying)

    def _meet(self) -> None:
        """What each surface does to the paths that stand on it."""
        paths, scene = self._standing, self.scene
        split(scene, paths, self._columns.count, self._choices)
        index, triangle = np.arange(paths.count), paths.triangle.copy()
        spheres = triangle < 0
        if spheres.any():
            self._meet_spheres(index[spheres], -2 - triangle[spheres])
            index, triangle = index[~spheres], triangle[~spheres]
        paths.origin[:, index] = scene.on_plane(paths.origin[:, index], triangle)
        paths.surfaces[index] += 1
        thing = scene.triangle_object[triangle]
        self._note_first(index, thing)
        for k, kind in enumerate(self._kind):
            here = np.flatnonzero(thing == k) if len(self._kind) > 1 or scene.lights.rectangles else slice(None)
            who, faces = index[here], triangle[here]
            if not len(who):
                continue
            if kind == "opaque":
                meet_diffuse(self._at_surfaces, who, faces)
            elif kind == "mirror":
                meet_mirror(self._at_surfaces, who, faces)
            elif k in self._blends:
                assert self._choices is not None
                chosen = self._choices.of(k, paths.sample[who])
                for number, body in enumerate(self._blends[k].bodies):
                    some = np.flatnonzero(chosen == number)
                    self._meet_body(body, who[some], faces[some])
            else:
                self._meet_body(self._fast_bodies.get(k), who, faces)
        if scene.lights.rectangles:
            here = np.flatnonzero(thing < 0)
            self._meet_rectangles(index[here], triangle[here])

    def _meet_body(self, body: FastBody | None, who: NDArray[np.intp], faces: NDArray[np.int32]) -> None:
        """What a translucent object does to paths that meet it, lit by path where ``body`` is None."""
        if not len(who):
            return
        if body is None:
            meet_boundary(self._at_surfaces, who, faces)
        else:
            for mine, lights in self._by_beams(body, who):
                body.meet(self._at_surfaces, who[mine], faces[mine], lights)

    def _by_beams(self, body: FastBody, who: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], list[Beam]]]:
        """Which of the paths ``who`` that meet ``body`` are lit by which beams: those of their pass."""
        lights = self.scene.lights
        of = np.zeros(len(who), np.int64)
        if change(lights, body.probes):
            of = self._columns.passes_of(self._standing.sample[who])
        for number in np.unique(of).tolist():
            if number not in self._beams:
                under_way = self._columns.passes
                self._beams = {one: known for one, known in self._beams.items() if one in under_way}
                self._beams[number] = beams(lights, number)
            yield np.flatnonzero(of == number), self._beams[number]

    def _note_first(self, index: NDArray[np.intp], thing: NDArray[np.int16]) -> None:
        # of a split path one branch is enough
        sample = self._standing.sample[index]
        first = np.flatnonzero(sample < self._columns.count)
        first = first[self._columns.first_unknown[sample[first]]]
        self._columns.first_object[sample[first]] = thing[first]
        self._columns.first_unknown[sample[first]] = False

    def _meet_rectangles(self, index: NDArray[np.intp], triangle: NDArray[np.int32]) -> None:
        """Add the radiance of rectangle lights seen from the front; they end every path."""
        paths, scene = self._standing, self.scene
        for k, rectangle in enumerate(scene.lights.rectangles):
            mine = index[(triangle - scene.first_light_triangle) // 2 == k]
            front = np.einsum("ij,ik->k", rectangle.normal, paths.direction[:, mine]) < 0
            self._add_met(mine[front], rectangle)
        paths.alive[index] = False

    def _meet_spheres(self, index: NDArray[np.intp], which: NDArray[np.int32]) -> None:
        """Add the radiance of sphere lights; they end every path."""
        paths = self._standing
        self._note_first(index, np.full(len(index), NOTHING))
        for k, sphere in enumerate(self.scene.lights.spheres):
            self._add_met(index[which == k], sphere)
        paths.alive[index] = False

    def _add_met(self, index: NDArray[np.intp], light: RectangleSource | SphereSource) -> None:
        """Add the radiance of a light to the paths that have met it, as far as they were not connected to it before."""
        paths = self._standing
        share = np.ones(len(index), np.float32)
        drawn = np.flatnonzero(np.isfinite(paths.density[index]))
        if len(drawn):
            who = index[drawn]
            vertex = paths.origin[:, who] - paths.flown[who] * paths.direction[:, who]
            share[drawn] = power_heuristic(paths.density[who], light.density(vertex))
        self._at_surfaces.add(index, light.radiance, share)
