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
from ..tracing.acceleration import Acceleration
from ..tracing.distance_grid import Scratch
from ..tracing.paths import CHANCE, Paths
from ..tracing.roulette import play_at_collisions, walks_are_long
from ..tracing.traced_scene import MISS
from ..tracing.transport import Transport
from .lost_paths import lose
from .point_light import light_collisions
from .refracted_light import light_through_facets
from .rough_light import RoughLight

NAME = "path"

_BEYOND, _CLEAR = RAY_OFFSET, np.float32(2.5e-7)
"""How far rays look beyond a collision, and how far collisions stay from the surface before them, unit-size frame.
Places are rounded by up to 2.1e-7 (see ``RAY_OFFSET``): some would lie outside, from where paths leak. Flights more
oblique than 1 to 4 are left to chance."""

Float32 = NDArray[np.float32]


class MediumWalk:
    """One worker's paths inside the medium of the object ``slot``.

    Those that ``flies_on`` marks have a direction already; the others stand at a collision and are to be scattered.
    """

    def __init__(self, transport: Transport, slot: int, acceleration: Acceleration):
        self.transport, self.slot = transport, slot
        self.paths, self._uniforms, self._tally = transport.paths, transport.uniforms, transport.tally
        scene, capacity = transport.scene, transport.paths.capacity
        self._guide, self._jumps, self._grid = acceleration.guides[slot], acceleration.jumps[slot], acceleration.grid
        media = scene.media
        self._sigma_t, self._sigma_s = media.sigma_t[:, slot, None], media.sigma_s[:, slot, None]
        self._albedo = media.albedo[:, slot, None]
        self._achromatic = bool((self._sigma_t == self._sigma_t[0]).all())
        self._g = media.g[slot]
        self._lone = scene.lights.lone
        self._lights_sampled, self._lit = scene.lights.sampled, scene.lit_collisions[slot]
        self._rough_light = RoughLight(transport, slot, self._grid) if self._lit.rough else None
        thing = scene.translucent[slot]
        # rounded positions on a flat side of the box are not outside
        self._centre = (thing.lower + thing.upper) / 2
        self._half = (thing.upper - thing.lower) / 2 + RAY_OFFSET
        self._long_walks = walks_are_long(float(self._half.min() * self._sigma_t.max()), float(self._g))
        self._flight, self._bound = np.empty((2, capacity), np.float32)
        self._turned = np.empty((3, capacity), np.float32)
        self._scratch = Scratch(capacity)
        self._jumps_from = np.float32(self._jumps.pays_from() if self._jumps else np.inf)

    def enter(self, entered: slice) -> None:
        """Paths that come from a surface fly on from it. Guided ones are led out the way they came, or, in the dark,
        towards the only light."""
        paths = self.paths
        paths.flies_on[entered] = True
        if self._guide is None:
            return
        normal = self.transport.scene.triangle_normal.take(paths.triangle[entered], axis=1)
        if self._lone is None:
            paths.axis[:, entered], paths.led[entered] = normal, True
            return
        towards = self._lone.illuminate(paths.origin[:, entered]).direction
        paths.axis[:, entered], paths.led[entered] = towards, np.einsum("ij,ij->j", normal, towards) < 0

    def step(self, standing: Paths) -> None:
        """Scatter the paths and take them to their next collision; those that meet a surface go to ``standing``."""
        paths = self.paths
        self._end_or_light()
        bound = self._reach(paths.origin)
        if self._jumps is not None and bound is not None:
            self._jump(bound)
        u, u_cosine, u_turn = self._uniforms.draw_three(paths.stream)
        flight = exponential(u, self._flight[: paths.count])
        weigh = None
        if self._guide is None:
            turned = spherical(sample_henyey_greenstein(self._g, u_cosine), u_turn, self._turned[:, : paths.count])
            if self._g != 0:
                turned = around(paths.direction, turned)
        else:
            turned, weigh = self._turn_guided(self._guide, u_cosine, u_turn, flight)
        if self._lit.areas:
            np.copyto(paths.density, self._density(slice(None), turned), where=~paths.flies_on)
        np.copyto(paths.direction, turned, where=~paths.flies_on)
        if self._achromatic:
            arrived, triangle = self._travel(flight, self._sigma_t[0], bound)
        else:
            arrived, triangle = self._fly_chromatic(flight, bound)
        if weigh is not None:
            paths.throughput *= weigh(flight, arrived)
        paths.triangle[arrived] = triangle
        if self._lights_sampled:
            self._note_flown(arrived, flight[arrived])
        paths.move(arrived, standing)
        if self._achromatic:
            # the flight's density cancels extinction; what is left at a collision is the albedo
            paths.throughput *= self._albedo
        paths.flies_on[:] = False
        paths.surfaces[:] = 0
        paths.branch[:] = CHANCE
        self._lose_leaked()

    def _end_or_light(self) -> None:
        """At the collisions: next-event estimation, then roulette."""
        paths = self.paths
        collided = ~paths.flies_on
        self._tally.collisions += int(np.count_nonzero(collided))
        if self._lit.inside:
            light_collisions(self.transport, collided.nonzero()[0], self.slot, self._density)
        if self._lit.facets:
            light_through_facets(self.transport, collided.nonzero()[0], self.slot)
        if self._rough_light is not None:
            self._rough_light.light(collided.nonzero()[0])
        play_at_collisions(paths, self._uniforms, self._long_walks)
        paths.bury()

    def _density(self, index: NDArray[np.intp] | slice, direction: Float32) -> Float32:
        """(m,) density per steradian with which collisions turn the paths ``index`` to ``direction`` (3, m)."""
        if self._guide is None:
            before = self.paths.direction[:, index]
            return henyey_greenstein(np.einsum("ij,ij->j", before, direction), self._g)
        return self._guide.density(np.einsum("ij,ij->j", self.paths.axis[:, index], direction))

    def _note_flown(self, arrived: NDArray[np.intp], flight: Float32) -> None:
        """Keep account of where the directions of the paths that meet a surface were drawn, and how."""
        paths = self.paths
        since_surface = paths.flies_on[arrived]
        paths.flown[arrived] = paths.flown[arrived] * since_surface + flight
        if not self._lit.areas:
            paths.density[arrived[~since_surface]] = np.inf

    def _reach(self, position: Float32) -> Float32 | None:
        """(n,) how far around the positions (3, n) there is no surface for sure; None where nothing is known."""
        if self._grid is None:
            return None
        return self._grid.distance(position, self._bound[: position.shape[1]], self._scratch)

    def _jump(self, bound: Float32) -> None:
        """Take the paths that are deep inside to the surface of a ball around them, and update their ``bound``."""
        paths = self.paths
        deep = ((bound >= self._jumps_from) & ~paths.flies_on).nonzero()[0]
        if not len(deep):
            return
        assert self._jumps is not None and self._grid is not None
        uniforms = [*self._uniforms.draw_at(paths.stream, deep), *self._uniforms.draw_at(paths.stream, deep)]
        position, direction = paths.origin[:, deep], np.empty((3, len(deep)), np.float32)
        which = self._jumps.index_of(bound[deep])
        paths.throughput[:, deep] *= self._jumps.jump(which, uniforms, position, direction)
        paths.origin[:, deep], paths.direction[:, deep] = position, direction
        paths.flies_on[deep] = True
        paths.density[deep] = np.inf
        bound[deep] = self._grid.distance(position, np.empty(len(deep), np.float32), self._scratch)

    def _turn_guided(self, guide: Guide, u_cosine: Float32, u_turn: Float32, flight: Float32):
        """New directions, and what gives the flights' weights. Stretches those of ``flight`` that are guided."""
        paths, local = self.paths, self._turned[:, : self.paths.count]
        guided = u_cosine < guide.share
        u = np.where(guided, u_cosine * guide.inverse_share, (u_cosine - guide.share) * guide.inverse_rest)
        plain = paths.flies_on.copy()
        if self._lone is not None:
            np.copyto(u, u_cosine, where=~paths.led)
            guided &= paths.led
            plain |= ~paths.led
        cosine = np.where(guided, guide.sample_cosine(u), 2 * u - 1)
        turned = around(paths.axis, spherical(cosine, u_turn, local))
        guided &= ~plain
        np.divide(flight, guide.rate(cosine), out=flight, where=guided)

        def weigh(flown: Float32, arrived: NDArray[np.intp]) -> Float32:
            weight = guide.weight(cosine, flown, arrived)
            np.copyto(weight, 1, where=plain)
            return weight

        return turned, weigh

    def _fly_chromatic(self, flight: Float32, bound: Float32 | None):
        """Draw the flight for one channel and weigh all by the balance heuristic."""
        paths = self.paths
        choice, _ = self._uniforms.draw(paths.stream)
        chances = channel_probabilities(paths.throughput, self._albedo)
        arrived, triangle = self._travel(flight, self._sigma_t[choose_channel(chances, choice), 0], bound)
        reach = np.where(flight < MISS, flight, 0)
        factor = collision_weight(reach, self._sigma_s, self._sigma_t, chances)
        factor[:, arrived] = surface_weight(reach[arrived], self._sigma_t, chances[:, arrived])
        paths.throughput *= factor
        return arrived, triangle

    def _travel(
        self, flight: Float32, sigma_t: Float32, bound: Float32 | None
    ) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
        """Move the paths by ``flight`` (n,) mean free paths, or to the surface they meet before: which, and where.

        ``flight`` becomes the distance moved, ``MISS`` for paths that would fly on for ever. Triangle -2 - k is the
        k-th sphere light.
        """
        paths = self.paths
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            flight /= sigma_t
        np.copyto(flight, MISS, where=~(flight < MISS))
        if bound is None:
            origin, direction, limit = paths.origin, paths.direction, flight
        else:
            near = (flight >= bound).nonzero()[0]
            origin, direction, limit = paths.origin[:, near], paths.direction[:, near], flight[near]
        distance, triangle = self.transport.scene.met(origin, direction, limit + _BEYOND)
        self._tally.rays += len(limit)
        hit = (triangle != -1).nonzero()[0]
        beyond = distance[hit] > limit[hit]
        arrived, just_before = hit[~beyond], hit[beyond]
        gap = distance[just_before] - limit[just_before]
        triangle, ahead = triangle[arrived], triangle[just_before]
        if bound is None:
            flight[arrived] = distance[arrived]
        else:
            flight[near[arrived]] = distance[arrived]
            arrived, just_before = near[arrived], near[just_before]
        step = np.multiply(paths.direction, flight, out=self._turned[:, : paths.count])
        np.add(paths.origin, step, out=paths.origin)
        if len(just_before):
            self._keep_clear(just_before, ahead, gap)
        return arrived, triangle

    def _keep_clear(self, index: NDArray[np.intp], triangle: NDArray[np.int32], gap: Float32) -> None:
        """Draw the paths ``index``, which collide ``gap`` (m,) before ``triangle``, back to where rounding cannot take
        them through it: a quarter of a millionth of the scene."""
        faces = (triangle >= 0).nonzero()[0]
        index, normal = index[faces], np.take(self.transport.scene.triangle_normal, triangle[faces], axis=1)
        cosine = np.einsum("ij,ij->j", self.paths.direction[:, index], normal)
        height = gap[faces] * np.abs(cosine)
        low = (height < _CLEAR).nonzero()[0]
        back = np.copysign(_CLEAR - height[low], -cosine[low])
        self.paths.origin[:, index[low]] += normal[:, low] * back

    def _lose_leaked(self) -> None:
        """End paths that collide outside their object's bounding box: they have slipped through its surface."""
        paths = self.paths
        off = np.subtract(paths.origin, self._centre, out=self._turned[:, : paths.count])
        np.abs(off, out=off)
        # written so that positions that are not numbers count as outside
        lost = np.flatnonzero(~(off <= self._half).all(axis=0))
        if len(lost):
            paths.origin[:, lost] = np.clip(np.nan_to_num(paths.origin[:, lost]), -1, 1)
            lose(self.transport, lost, self.slot)
            paths.remove(lost)
