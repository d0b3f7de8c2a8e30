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
from ..optics.phase import around, sample_henyey_greenstein, spherical
from ..tracing.paths import OUTSIDE, Paths
from ..tracing.streams import Uniforms
from ..tracing.tally import Tally
from ..tracing.traced_scene import MISS, TracedScene
from . import point_light
from .lost_paths import lose

NAME = "path"
ROULETTE_BELOW = np.float32(0.25)
"""Throughput below which roulette plays: later thresholds cost 10-25 % on thick bodies, earlier ones deep shadow."""

Float32 = NDArray[np.float32]


class PathShader:
    """Flights and collisions of the paths of one worker; its buffers hold ``capacity`` paths.

    What happens at surfaces is in ``boundary``.
    """

    def __init__(self, scene: TracedScene, capacity: int, uniforms: Uniforms, tally: Tally):
        self.scene, self.media, self.tally = scene, scene.media, tally
        self._uniforms = uniforms
        self._flight = np.empty(capacity, np.float32)
        self._turned = np.empty((3, capacity), np.float32)
        self._chances: Float32 | None = None
        self.any_medium = self.media.count > 0
        self._lights_reach_inside = bool(scene.lights.points) and bool((self.media.ior[:-1] == 1).any())

    def fly(self, paths: Paths) -> Float32 | None:
        """(n,) how far each path flies before it collides; ``MISS`` outside, None where no object has a medium."""
        if not self.any_medium:
            return None
        media, owner = self.media, paths.owner
        u, choice = self._uniforms.draw(paths.stream)
        limit = exponential(u, self._flight[: paths.count])
        if media.achromatic:
            sigma_t = media.of(media.sigma_t[0], owner)
        else:
            self._chances = channel_probabilities(paths.throughput, media.of(media.albedo, owner))
            channel = choose_channel(self._chances, choice)
            sigma_t = media.sigma_t[channel, owner]
        with np.errstate(divide="ignore", invalid="ignore"):
            np.divide(limit, sigma_t, out=limit)
        np.copyto(limit, MISS, where=sigma_t == 0)
        return limit

    def weigh_flights(self, paths: Paths, distance: Float32, collided: NDArray[np.bool_]) -> None:
        """Multiply throughputs by what the flights' lengths and ends make of them."""
        media = self.media
        if media.achromatic:
            # the flight's density cancels extinction; what is left at a collision is the albedo
            factor = media.of(media.albedo, paths.owner)
            np.copyto(factor, 1, where=~collided)
        else:
            assert self._chances is not None
            sigma_t, sigma_s = media.of(media.sigma_t, paths.owner), media.of(media.sigma_s, paths.owner)
            reach = np.where(paths.owner == OUTSIDE, 0, distance)
            factor = np.where(
                collided,
                collision_weight(reach, sigma_s, sigma_t, self._chances),
                surface_weight(reach, sigma_t, self._chances),
            )
        paths.throughput *= factor

    def collide(self, paths: Paths, collided: NDArray[np.bool_], radiance: Float32) -> None:
        """Scatter the paths where ``collided`` into new directions; their origins are the places already."""
        self._lose_leaked(paths, collided, radiance)
        if self._lights_reach_inside:
            point_light.light_collisions(
                self.scene, paths, np.flatnonzero(collided & paths.alive), self.tally, radiance
            )
        u_cosine, u_turn = self._uniforms.draw(paths.stream)
        for slot, g in enumerate(self.media.g):
            here = collided if self.media.count == 1 else collided & (paths.owner == slot)
            turned = self._turned[:, : paths.count]
            spherical(sample_henyey_greenstein(g, u_cosine), u_turn, turned)
            if g != 0:
                turned = around(paths.direction, turned)
            np.copyto(paths.direction, turned, where=here)
        np.copyto(paths.scattered, True, where=collided)
        np.copyto(paths.lit, False, where=collided)
        np.copyto(paths.surfaces, 0, where=collided)
        self.tally.collisions += int(np.count_nonzero(collided))

    def _lose_leaked(self, paths: Paths, collided: NDArray[np.bool_], radiance: Float32) -> None:
        """End paths that collide outside their object's bounding box: they have slipped through its surface."""
        for slot, thing in enumerate(self.scene.translucent):
            # rounded positions on a flat side of the box are not outside
            beyond = (paths.origin < thing.lower - RAY_OFFSET) | (paths.origin > thing.upper + RAY_OFFSET)
            lost = beyond.any(axis=0) & collided & (paths.owner == slot)
            if lost.any():
                lose(self.scene, paths, np.flatnonzero(lost), slot, self._uniforms, self.tally, radiance)
