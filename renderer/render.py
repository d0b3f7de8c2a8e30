"""From a scene and settings to a film: check, choose, build, then pass after pass."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import blake2b
from queue import Empty, SimpleQueue

import numpy as np
from numpy.typing import NDArray

from . import direct
from .fast_bodies import fast_bodies
from .output.film import Film
from .output.image import Picture
from .scene.admission import admit
from .scene.camera import CameraRays
from .scene.description import Camera, Scene
from .scene.fingerprint import scene_hash
from .scene.holes import HoleReport, close_holes
from .shaders import selection
from .shaders.selection import DEFAULT_QUALITY, Measured, Plan
from .stages import Stages
from .strips import NOTHING, Assembly, Strips, TracedStrip
from .tracing.acceleration import Acceleration
from .tracing.memory import keep_freed_memory
from .tracing.tally import Tally
from .tracing.traced_scene import TracedScene
from .wavefront import Wavefront

SHADER_ID = {"path": 0, "plumb": 1, "scalar": 2, "diffuse": 3}
"""In pictures; opaque objects and the background have -1."""
_STRIP, _FRAME_STRIP = 2**13, 2**19
"""Camera samples of a strip, at most: where paths walk, it is kept until the longest has ended; frames of fast shaders
are done faster in large pieces, of at least ``_STRIP`` and at most this."""


@dataclass(frozen=True)
class Settings:
    """What the user asks of a render.

    shader, hole_handling  "auto", or one for all objects
    quality                in [0, 1], see ``selection``
    target_error           relative error allowed, in place of what the quality allows
    seed                   of the random numbers
    threads                None: as many as there are cores
    """

    shader: str = "auto"
    hole_handling: str = "auto"
    quality: float = DEFAULT_QUALITY
    seed: int = 0
    threads: int | None = None
    target_error: float | None = None


class Renderer:
    """A scene made ready: checked, shaders chosen, ray caster and tables built.

    scene    as it was given, its objects checked
    plans    what is done with each object, and why
    holes    what was done at the holes of each object
    sources  by object name, where the verdict on its mesh comes from
    film     the passes so far
    added    how many of them this renderer made
    tally    counts over all passes of this renderer
    stages   seconds for check, build and render

    passes    as many as there will be; None: what the tolerance asks for, which the plans then say
    measured  by object name, what pilots found (see ``pilot``)

    Raises InputError for a camera inside an object.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        passes: int | None = None,
        stages: Stages | None = None,
        measured: Mapping[str, Measured] | None = None,
    ):
        self.settings, self.stages, self.tally = settings, stages or Stages(), Tally()
        self.scene, self.sources, self.plans = planned(scene, settings, passes, self.stages, measured)
        keep_freed_memory()
        closed, self.holes, self.plans = closed_for_light(self.scene, self.plans, self.stages)
        with self.stages.stage("build"):
            with self.stages.part("", "triangles and beams of light"):
                handling = [plan.hole_handling for plan in self.plans]
                self.traced = TracedScene(closed, [_dearest(plan) for plan in self.plans], handling)
            self.camera = CameraRays(scene.camera, self.traced.frame)
            width, height = scene.camera.resolution
            threads = settings.threads or os.cpu_count() or 1
            self._fast_bodies, self._blends = fast_bodies(self.traced, self.plans, width * height, threads, self.stages)
            self.acceleration = _acceleration(self.traced, width * height, self.stages)
            self._frames = None
            if direct.applies_to(self.traced, self._fast_bodies, self._blends):
                self._frames = direct.Frames(self.traced, self.camera, self._fast_bodies, settings.seed, self._blends)
            self.shader_id, self.object_id = self._identify()
        self.film = Film.blank(scene.camera.resolution, planned_hash(scene, self.plans), settings.seed)
        self.added = 0
        # their buffers outlive the threads of one ``run``
        self._idle: SimpleQueue[Wavefront | direct.DirectTracer] = SimpleQueue()
        self._under_way: Strips | None = None

    def forget_buffers(self) -> None:
        """Drop what is kept for the next ``run``, which then takes new memory: for renderers that may stay idle."""
        with suppress(Empty):
            while True:
                self._idle.get_nowait()

    def look_from(self, camera: Camera) -> None:
        """Begin a new film from another camera; whatever was built for the scene stays.

        The shaders stay those chosen for the first camera. Nobody asks whether the camera is inside an object.
        """
        self.scene = replace(self.scene, camera=camera, hash="")
        self.camera = CameraRays(camera, self.traced.frame)
        if self._frames is not None:
            self._frames.look_from(self.camera)
        self.shader_id, self.object_id = self._identify()
        self.film = Film.blank(camera.resolution, "", self.settings.seed)
        self.added, self._idle = 0, SimpleQueue()

    def run(
        self,
        passes: Iterable[int],
        done: Callable[[int], bool] | None = None,
        seconds_left: Callable[[], float] | None = None,
        chosen: NDArray[np.bool_] | None = None,
    ) -> bool:
        """Add passes to the film, in the order given; whether all were added.

        done          is told the number of each pass when it is in the film; where it returns True, no more are
                      begun, and those under way are dropped. On KeyboardInterrupt the film keeps the passes so far
        seconds_left  how long the caller wants to go on: passes are begun as long as they will probably end in time,
                      and those that are not whole when the time is over are dropped, unless there would be none.
                      So the picture misses what the longest paths carry: if a share d of the passes of n pixels is
                      dropped, the longest d/n of the paths or less, a bias of that order relative to the mean
        chosen        (h, w) bool, the pixels that take part; None: all
        """
        threads = self.settings.threads or os.cpu_count() or 1
        pixels = np.arange(self.film.hits.size) if chosen is None else np.flatnonzero(chosen)
        longest = _STRIP
        if self._frames is not None:
            longest = min(max(len(pixels) // (2 * threads) + 1, _STRIP), _FRAME_STRIP)
        strips = self._under_way = Strips(passes, pixels, threads, longest, seconds_left)
        assembly, results = Assembly(len(pixels)), SimpleQueue[TracedStrip | BaseException | None]()
        tracing = threads
        with self.stages.stage("render"), ThreadPoolExecutor(threads) as pool:
            try:
                for _ in range(threads):
                    pool.submit(self._trace, strips, results)
                while tracing:
                    enough = self.film.passes or assembly.any_whole
                    result = results.get(timeout=max(seconds_left(), 0) if seconds_left and enough else None)
                    if isinstance(result, BaseException):
                        raise result
                    if result is None:
                        tracing -= 1
                        continue
                    self.tally.add(result.tally)
                    for index, radiance, first_object in assembly.add(result):
                        self._add(index, radiance, first_object, chosen)
                        strips.note_added()
                        if done is not None and done(index):
                            return False
                return strips.exhausted and not strips.stopped
            except Empty:
                for index, radiance, first_object in assembly.rest():
                    self._add(index, radiance, first_object, chosen)
                    if done is not None:
                        done(index)
                return False
            finally:
                strips.stop()

    def stop(self) -> None:
        """End a ``run`` of another thread now: passes under way are dropped, the film keeps those before."""
        if self._under_way is not None:
            self._under_way.stop()

    def _trace(self, strips: Strips, results: SimpleQueue[TracedStrip | BaseException | None]) -> None:
        """Trace strips until there are no more; ends with None, or with what went wrong."""
        try:
            tracer = self._idle.get_nowait()
        except Empty:
            tracer = self._tracer()
        try:
            for traced in tracer.trace(strips):
                results.put(traced)
            results.put(None)
        except BaseException as error:
            results.put(error)
        finally:
            self._idle.put(tracer)

    def picture(self, seconds: float, aovs: dict[str, NDArray] | None = None) -> Picture:
        """What is written to a file; ``seconds`` is the wall time to state in it."""
        return Picture(self.film, seconds, self.shader_id, self.object_id, aovs or {})

    def _tracer(self) -> Wavefront | direct.DirectTracer:
        if self._frames is not None:
            return direct.DirectTracer(self._frames)
        return Wavefront(
            self.traced,
            self.camera,
            self._fast_bodies,
            self.settings.seed,
            acceleration=self.acceleration,
            blends=self._blends,
        )

    def _add(
        self, index: int, radiance: NDArray[np.float32], first: NDArray[np.int16], chosen: NDArray[np.bool_] | None
    ) -> None:
        """Add pass ``index``, samples of the ``chosen`` pixels, to the film."""
        if chosen is None:
            radiance, first = radiance.reshape(self.film.sum.shape), first.reshape(self.film.hits.shape)
        else:
            here, there = radiance, first
            radiance, first = np.zeros(self.film.sum.shape, np.float32), np.full(chosen.shape, NOTHING)
            radiance[chosen], first[chosen] = here, there
        # -1, nothing, is the last entry
        translucent = np.array([*(thing.medium is not None for thing in self.traced.objects), False])
        biased = self._fast_bodies.keys() | self._blends.keys()
        fast = np.array([*(thing.index in biased for thing in self.traced.objects), False])
        self.film.add_pass(index, radiance, translucent[first], fast[first], chosen)
        self.added += 1
        self.tally.non_finite = self.film.non_finite

    def _identify(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Shader and object that the ray through each pixel's centre meets first, (h, w) each."""
        width, height = self.scene.camera.resolution
        directions = self.camera.centre_directions()
        origins = np.repeat(self.camera.origin[:, None], directions.shape[1], axis=1)
        _, triangle = self.traced.closest(origins, directions)
        thing = np.where(triangle >= 0, self.traced.triangle_object[triangle], -1).astype(np.int32)
        shaders = np.array([*(SHADER_ID.get(plan.shader, -1) for plan in self.plans), -1], np.int32)
        return shaders[thing].reshape(height, width), thing.reshape(height, width)


def planned(
    scene: Scene,
    settings: Settings,
    passes: int | None = None,
    stages: Stages | None = None,
    measured: Mapping[str, Measured] | None = None,
) -> tuple[Scene, dict[str, str], list[Plan]]:
    """The checked scene, where each verdict comes from by object name, and what would be done; as in ``Renderer``."""
    with (stages or Stages()).stage("check"):
        checked, sources = admit(scene)
    plans = selection.select(
        checked,
        settings.quality,
        settings.shader,
        settings.hole_handling,
        passes,
        target_error=settings.target_error,
        measured=measured,
        threads=settings.threads,
    )
    return checked, sources, plans


def closed_for_light(
    scene: Scene, plans: list[Plan], stages: Stages | None = None
) -> tuple[Scene, list[HoleReport], list[Plan]]:
    """The scene as rays shall meet it, what was done at holes, and the plans that say so (see ``scene.holes``)."""
    with (stages or Stages()).stage("close"):
        handling, reasons = zip(*((plan.hole_handling, plan.reason) for plan in plans), strict=True)
        closed, holes = close_holes(scene, [_dearest(plan) for plan in plans], handling, reasons)
    plans = [
        replace(plan, hole_handling=hole.handling, reason=hole.reason) for plan, hole in zip(plans, holes, strict=True)
    ]
    return closed, holes, plans


def _dearest(plan: Plan) -> str:
    """Of an object's shaders the one that needs most to be known of it."""
    return list(plan.shares)[-1] if plan.shares else plan.shader


def planned_hash(scene: Scene, plans: list[Plan]) -> str:
    """Hexadecimal digest of the scene and of what is done with its objects: samples of two films with equal hash
    and seed may be added up."""
    digest = blake2b(digest_size=16)
    digest.update((scene.hash or scene_hash(scene)).encode())
    for plan in plans:
        shaders = plan.shader if len(plan.shares) < 2 else repr(plan.shares)
        digest.update(f"|{shaders}|{plan.hole_handling}".encode())
    return digest.hexdigest()


def _acceleration(traced: TracedScene, pixels: int, stages: Stages) -> Acceleration:
    start = time.perf_counter()
    acceleration = Acceleration.chosen(traced, pixels)
    if acceleration.grid is not None:
        stages.parts.setdefault("", {})["distance grid and ball jumps"] = time.perf_counter() - start
    return acceleration
