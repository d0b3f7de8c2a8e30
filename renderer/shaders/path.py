"""Monte Carlo through the medium: the reference.

A path flies an exponential distance, scatters, meets the boundary, is reflected or refracted, and goes on until
it leaves the scene or roulette ends it. Without holes and with lights that can be met, the expected image is the
exact solution of the radiative transfer equation (Chandrasekhar 1950, ch. I).

Paths carry radiance over the squared index of refraction, which a boundary changes by reflection alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from ..optics.free_flight import (
    channel_probabilities,
    choose_channel,
    collision_weight,
    exponential,
    surface_weight,
)
from ..optics.guided_flight import Guide
from ..optics.phase import around, henyey_greenstein, sample_henyey_greenstein, spherical
from ..tracing.paths import CHANCE, Paths
from ..tracing.roulette import play_at_collisions
from ..tracing.streams import Uniforms
from ..tracing.tally import Tally
from ..tracing.traced_scene import MISS, TracedScene
from . import point_light
from .lost_paths import lose

NAME = "path"

Float32 = NDArray[np.float32]


class MediumWalk:
    """One worker's paths inside one object's medium, up to ``capacity`` of them.

    entering   paths that fly on in the direction they have
    colliding  paths that stand at a collision and are to be scattered
    """

    def __init__(
        self,
        scene: TracedScene,
        slot: int,
        capacity: int,
        uniforms: Uniforms,
        tally: Tally,
        guide: Guide | None = None,
    ):
        self.scene, self.slot, self.tally, self.guide = scene, slot, tally, guide
        self.entering, self.colliding = (Paths(capacity, scene.media.count) for _ in range(2))
        media = scene.media
        self._sigma_t, self._sigma_s = media.sigma_t[:, slot, None], media.sigma_s[:, slot, None]
        self._albedo = media.albedo[:, slot, None]
        self._achromatic = bool((self._sigma_t == self._sigma_t[0]).all())
        self._g = media.g[slot]
        self._lit_inside = bool(scene.lights.points) and media.ior[slot] == 1
        thing = scene.translucent[slot]
        # rounded positions on a flat side of the box are not outside
        self._centre = (thing.lower + thing.upper) / 2
        self._half = (thing.upper - thing.lower) / 2 + RAY_OFFSET
        self._uniforms = uniforms
        self._flight = np.empty(capacity, np.float32)
        self._turned = np.empty((3, capacity), np.float32)

    @property
    def count(self) -> int:
        """Paths in this medium."""
        return self.entering.count + self.colliding.count

    def clear(self) -> None:
        """Forget all paths."""
        self.entering.clear()
        self.colliding.clear()

    def fly_on(self, standing: Paths, radiance: Float32) -> None:
        """Take the entering paths to their first collision; those that meet a surface first go to ``standing``."""
        paths = self.entering
        u, choice, _ = self._uniforms.draw_three(paths.stream)
        flight = exponential(u, self._flight[: paths.count])
        self._finish(paths, flight, choice, None, standing, radiance)
        self.colliding.append(paths, np.arange(paths.count))
        paths.clear()

    def scatter(self, standing: Paths, radiance: Float32) -> None:
        """Scatter the colliding paths and take them to their next collision, or to ``standing``."""
        paths = self.colliding
        self.tally.collisions += paths.count
        if self._lit_inside:
            point_light.light_collisions(self.scene, paths, self.slot, self.tally, radiance)
        play_at_collisions(paths, self._uniforms)
        paths.bury()
        u, u_cosine, u_turn = self._uniforms.draw_three(paths.stream)
        flight = exponential(u, self._flight[: paths.count])
        turned, stretch = self._turned[:, : paths.count], None
        choice = u_cosine
        if self.guide is None:
            if not self._achromatic:
                choice, _ = self._uniforms.draw(paths.stream)
            spherical(sample_henyey_greenstein(self._g, u_cosine), u_turn, turned)
            if self._g != 0:
                turned = around(paths.direction, turned)
        else:
            turned, stretch = self._scatter_guided(paths, u_cosine, u_turn, flight)
        np.copyto(paths.direction, turned)
        self._finish(paths, flight, choice, stretch, standing, radiance)

    def _scatter_guided(self, paths: Paths, u_cosine: Float32, u_turn: Float32, flight: Float32):
        """New directions, and what the guide's weights need: see ``Guide``. Stretches the flights drawn."""
        guide, local = self.guide, self._turned[:, : paths.count]
        assert guide is not None
        guided = u_cosine < guide.share
        u = np.where(guided, u_cosine * guide.inverse_share, (u_cosine - guide.share) * guide.inverse_rest)
        cosine = np.where(guided, guide.sample_cosine(u), sample_henyey_greenstein(self._g, u))
        spherical(cosine, u_turn, local)
        axis = paths.axis
        if self._g != 0:
            axis = np.where(guided, axis, paths.direction)
        turned = around(axis, local)
        phase = None
        if self._g != 0:
            cosine = np.einsum("ij,ij->j", paths.axis, turned)
            phase = henyey_greenstein(np.einsum("ij,ij->j", paths.direction, turned), self._g).astype(np.float32)
        np.divide(flight, guide.rate(cosine), out=flight, where=guided)
        return turned, (cosine, phase)

    def _finish(
        self,
        paths: Paths,
        flight: Float32,
        choice: Float32,
        guided: tuple[Float32, Float32 | None] | None,
        standing: Paths,
        radiance: Float32,
    ) -> None:
        """Fly ``flight`` (n,) mean free paths, or to the next surface, and weigh."""
        chances = None
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if self._achromatic:
                flight /= self._sigma_t[0]
            else:
                chances = channel_probabilities(paths.throughput, self._albedo)
                flight /= self._sigma_t[choose_channel(chances, choice), 0]
        np.copyto(flight, MISS, where=~(flight < MISS))
        arrived, triangle = self._travel(paths, flight)
        if guided is not None and self.guide is not None:
            paths.throughput *= self.guide.weight(*guided, flight, arrived)
        if chances is not None:
            reach = np.where(flight < MISS, flight, 0)
            factor = collision_weight(reach, self._sigma_s, self._sigma_t, chances)
            factor[:, arrived] = surface_weight(reach[arrived], self._sigma_t, chances[:, arrived])
            paths.throughput *= factor
        paths.triangle[arrived] = triangle
        paths.move(arrived, standing)
        if chances is None:
            # the flight's density cancels extinction; what is left at a collision is the albedo
            paths.throughput *= self._albedo
        paths.scattered[:] = True
        paths.lit[:] = False
        paths.surfaces[:] = 0
        paths.branch[:] = CHANCE
        self._lose_leaked(paths, radiance)

    def _travel(self, paths: Paths, flight: Float32) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
        """Move the paths, shortening ``flight`` in place to where they meet a surface: which, and its triangle.

        Triangle -2 - k is the k-th sphere light.
        """
        distance, triangle = self.scene.closest(paths.origin, paths.direction, flight)
        self.tally.rays += paths.count
        for k, sphere in enumerate(self.scene.lights.spheres):
            reach = sphere.distance(paths.origin, paths.direction)
            nearer = reach < distance
            np.copyto(distance, reach, where=nearer)
            np.copyto(triangle, np.int32(-2 - k), where=nearer)
        arrived = np.flatnonzero(triangle != -1)
        flight[:] = distance
        step = np.multiply(paths.direction, flight, out=self._turned[:, : paths.count])
        np.add(paths.origin, step, out=paths.origin)
        return arrived, triangle[arrived]

    def _lose_leaked(self, paths: Paths, radiance: Float32) -> None:
        """End paths that collide outside their object's bounding box: they have slipped through its surface."""
        off = np.subtract(paths.origin, self._centre, out=self._turned[:, : paths.count])
        np.abs(off, out=off)
        # written so that positions that are not numbers count as outside
        lost = np.flatnonzero(~(off <= self._half).all(axis=0))
        if len(lost):
            paths.origin[:, lost] = np.clip(np.nan_to_num(paths.origin[:, lost]), -1, 1)
            lose(self.scene, paths, lost, self.slot, self._uniforms, self.tally, radiance)
            paths.remove(lost)
