"""Monte Carlo through the medium: the reference.

A path flies an exponential distance, scatters, meets the boundary, is reflected or refracted, and goes on until
it leaves the scene or roulette ends it. Without holes and with lights that can be met, the expected image is the
exact solution of the radiative transfer equation (Chandrasekhar 1950, ch. I).

Paths carry radiance over the squared index of refraction, which a boundary changes by reflection alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.dielectric import diffuse_external_reflectance, fresnel_reflectance, transmittance
from ..optics.free_flight import (
    channel_probabilities,
    choose_channel,
    collision_weight,
    exponential,
    surface_weight,
)
from ..optics.microfacet import sample_visible_facet, scatter, unmasked
from ..optics.phase import around, henyey_greenstein, sample_henyey_greenstein, spherical
from ..tracing.paths import OUTSIDE, Paths
from ..tracing.shadow import cross
from ..tracing.shadow import transmittance as shadow_transmittance
from ..tracing.streams import Uniforms
from ..tracing.tally import Tally
from ..tracing.traced_scene import MISS, TracedScene, offset_from
from .direct_light import pick, received_outside
from .local_frame import LocalFrame
from .opaque import patch_radiance

NAME = "path"
ROULETTE_BELOW = np.float32(0.25)
"""Throughput below which roulette plays: later thresholds cost 10-25 % on thick bodies, earlier ones deep shadow."""

Float32 = NDArray[np.float32]
Indices = NDArray[np.intp]


class PathShader:
    """Flights, collisions and boundaries of the paths of one worker; its buffers hold ``capacity`` paths."""

    def __init__(self, scene: TracedScene, capacity: int, uniforms: Uniforms, tally: Tally):
        self.scene, self.media, self.tally = scene, scene.media, tally
        self._uniforms = uniforms
        self._flight = np.empty(capacity, np.float32)
        self._turned = np.empty((3, capacity), np.float32)
        self._chances: Float32 | None = None
        self.any_medium = self.media.count > 0
        # light without extent is sampled: at collisions where the boundary is invisible, at rough boundaries,
        # and where paths leave through smooth ones
        self._points = scene.lights.points
        self._sampled_inside = bool(self._points) and bool(scene.slot_is_matched.any())

    # -- between surfaces ------------------------------------------------------------------------------------

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
        if self._sampled_inside:
            self._light_collisions(paths, np.flatnonzero(collided & paths.alive), radiance)
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
            beyond = (paths.origin < thing.lower) | (paths.origin > thing.upper)
            lost = beyond.any(axis=0) & collided & (paths.owner == slot)
            if lost.any():
                self._lose(paths, np.flatnonzero(lost), slot, radiance)

    def _lose(self, paths: Paths, index: Indices, slot: int, radiance: Float32) -> None:
        """End paths that are where no path of a closed solid can be, with the material's colour.

        Those inside left through a hole, and the patch faces where they went; those outside see an inner side
        through a hole, and it faces them.
        """
        thing = self.scene.translucent[slot]
        facing = paths.direction[:, index] * np.where(paths.owner[index] == OUTSIDE, np.float32(-1), np.float32(1))
        patch = patch_radiance(
            self.scene, paths.origin[:, index], facing, lambda: self._uniforms.draw_at(paths.stream, index)
        )
        radiance[:, paths.sample[index]] += paths.throughput[:, index] * thing.colour * patch
        paths.alive[index] = False
        if thing.hole_handling == "strict":
            self.tally.leaked += len(index)
        else:
            self.tally.terminated += len(index)

    def _light_collisions(self, paths: Paths, index: Indices, radiance: Float32) -> None:
        """Add what lights without extent send to collisions behind invisible boundaries."""
        index = index[self.scene.slot_is_matched[paths.owner[index]]]
        if not len(index):
            return
        position, direction = paths.origin[:, index], paths.direction[:, index]
        owner, sample = paths.owner[index], paths.sample[index]
        for source in self._points:
            light = source.illuminate(position)
            mu = np.einsum("ij,ij->j", direction, light.direction)
            phase = np.empty_like(mu)
            for slot, g in enumerate(self.media.g):
                np.copyto(phase, henyey_greenstein(mu, g), where=owner == slot)
            visible = shadow_transmittance(
                self.scene, self.media, position, light, paths.inside[:, index], owner, self.tally
            )
            radiance[:, sample] += paths.throughput[:, index] * light.irradiance * (phase * visible)

    # -- at the boundary -------------------------------------------------------------------------------------

    def meet_boundary(self, paths: Paths, index: Indices, triangle: NDArray[np.int32], radiance: Float32) -> None:
        """Reflect or refract the paths ``index`` where they meet the ``triangle`` (m,) of a translucent object.

        Their origins are the hit points. Paths whose crossing contradicts a closed surface end.
        """
        scene = self.scene
        geometric = np.take(scene.triangle_normal, triangle, axis=1)
        direction = paths.direction[:, index]
        cosine = np.einsum("ij,ij->j", direction, geometric)
        entering = cosine < 0
        slot = scene.slot_of_triangle[triangle]
        sound = self._sound(paths, index, slot, entering)
        if not sound.all():
            for k in np.unique(slot[~sound]):
                self._lose(paths, index[~sound & (slot == k)], k, radiance)
            index, triangle, slot, entering = index[sound], triangle[sound], slot[sound], entering[sound]
            geometric, direction, cosine = geometric[:, sound], direction[:, sound], cosine[sound]
            if not len(index):
                return
        inside = paths.inside[:, index]
        beyond = cross(inside, slot, entering)
        before = paths.owner[index]
        ior = self.media.ior
        eta = ior[beyond] / ior[before]
        position = paths.origin[:, index]
        # normal on the side the path comes from
        facing = scene.shading_normal(position, triangle)
        facing = facing * -np.copysign(np.float32(1), np.einsum("ij,ij->j", facing, direction))
        side = -np.copysign(np.float32(1), cosine)  # of the geometric normal, where the path comes from
        u_choice, u1 = self._uniforms.draw_at(paths.stream, index)
        passes = (beyond == before) | (eta == 1)
        rough = ~passes & (self._roughness(slot) > 0)
        reflected = np.zeros(len(index), bool)
        turned = direction.copy()
        smooth = np.flatnonzero(~passes & ~rough)
        if len(smooth):
            self._smooth(direction, facing, eta, u_choice, smooth, turned, reflected)
        if rough.any():
            self._rough(paths, index, np.flatnonzero(rough), direction, facing, side * geometric, eta, beyond, slot,
                        u_choice, u1, turned, reflected, radiance)  # fmt: skip
        # keep to the side that was decided, whatever the shading normal says
        outward = np.where(reflected, side, -side)
        wrong = (np.einsum("ij,ij->j", turned, geometric) * outward) <= 0
        if wrong.any():
            turned[:, wrong] -= 2 * np.einsum("ij,ij->j", turned, geometric)[wrong] * geometric[:, wrong]
        through = np.flatnonzero(~reflected)
        crossed = index[through]
        left = through[(beyond[through] == OUTSIDE) & (before[through] != OUTSIDE) & ~rough[through] & ~passes[through]]
        if self._points and len(left):
            self._light_exits(paths, index[left], geometric[:, left], slot[left], radiance)
        paths.inside[:, crossed] = inside[:, through]
        paths.owner[crossed] = beyond[through]
        paths.scattered[index] &= paths.owner[index] != OUTSIDE
        paths.lit[index] &= passes
        paths.direction[:, index] = turned
        paths.origin[:, index] = offset_from(position, geometric, outward)

    def _roughness(self, slot: NDArray[np.intp]) -> Float32:
        return np.array([thing.roughness for thing in self.scene.translucent], np.float32)[slot]

    def _sound(self, paths: Paths, index: Indices, slot: NDArray[np.intp], entering: NDArray[np.bool_]):
        """(m,) whether each crossing fits what was counted: no leaving from outside, no entering twice."""
        counted = paths.inside[slot, index]
        sound = entering | (counted > 0)
        for k, thing in enumerate(self.scene.translucent):
            if thing.hole_handling == "strict" or not thing.shells_add_up:
                sound &= ~((slot == k) & entering & (counted > 0))
        return sound

    def _smooth(self, direction, facing, eta, u, chosen, turned, reflected) -> None:
        """Snell's law and Fresnel's choice for the columns ``chosen``; fills ``turned`` and ``reflected``."""
        d, n, ratio = direction[:, chosen], facing[:, chosen], eta[chosen]
        cos_in = np.minimum(-np.einsum("ij,ij->j", d, n), 1)
        reflectance, cos_out = fresnel_reflectance(cos_in, ratio)
        bounce = u[chosen] < reflectance
        inverse = 1 / ratio
        along = np.where(bounce, 2 * cos_in, cos_in * inverse - cos_out)
        new = np.where(bounce, 1, inverse) * d + along * n
        new /= np.sqrt(np.einsum("ij,ij->j", new, new))
        turned[:, chosen], reflected[chosen] = new, bounce

    def _rough(self, paths, index, chosen, direction, facing, geometric, eta, beyond, slot, u_choice, u1,
               turned, reflected, radiance) -> None:  # fmt: skip
        """GGX reflection or refraction of the columns ``chosen``, and light without extent through it."""
        members = index[chosen]
        u2, _ = self._uniforms.draw_at(paths.stream, members)
        for k, thing in enumerate(self.scene.translucent):
            mine = np.flatnonzero(slot[chosen] == k)
            if not len(mine) or thing.roughness == 0:
                continue
            columns, who = chosen[mine], members[mine]
            normal, ratio, alpha = facing[:, columns], eta[columns], thing.roughness
            frame = LocalFrame(normal)
            view = frame.to_local(-direction[:, columns])
            if self._points:
                self._light_rough(
                    paths, who, frame, view, geometric[:, columns], ratio, beyond[columns], alpha, radiance
                )
            facet = sample_visible_facet(view, alpha, u1[columns], u2[mine])
            cos_in = np.clip(np.einsum("ij,ij->j", view, facet), 0, 1)
            reflectance, cos_out = fresnel_reflectance(cos_in, ratio)
            bounce = u_choice[columns] < reflectance
            inverse = 1 / ratio
            new = np.where(bounce, 2 * cos_in, cos_in * inverse - cos_out) * facet - np.where(bounce, 1, inverse) * view
            new /= np.sqrt(np.einsum("ij,ij->j", new, new))
            # single scattering: what ends on the wrong side would meet a second facet, and is lost
            valid = np.where(bounce, new[2] > 0, new[2] < 0)
            paths.throughput[:, who] *= np.where(valid, unmasked(new[2], alpha), 0)
            paths.alive[who] &= valid
            turned[:, columns], reflected[columns] = frame.to_world(new), bounce

    # -- lights without extent -------------------------------------------------------------------------------

    def _light_rough(self, paths, who, frame, view, geometric, eta, beyond, alpha, radiance) -> None:
        """Connect rough boundary points to point and directional lights, by reflection or transmission.

        geometric  (3, m) normal on the viewer's side
        """
        position, owner = paths.origin[:, who], paths.owner[who]
        for source in self._points:
            light = source.illuminate(position)
            to_light = frame.to_local(light.direction)
            value = scatter(view, to_light, eta, alpha)
            # lights stand outside: reflection for viewers outside, transmission for those inside
            side = np.einsum("ij,ij->j", geometric, light.direction)
            outside = np.where(side > 0, owner, beyond) == OUTSIDE
            useful = np.flatnonzero((value > 0) & outside & (side * to_light[2] > 0))
            if len(useful):
                lit_side = geometric[:, useful] * np.sign(side[useful])
                arrived = received_outside(self.scene, position[:, useful], lit_side, pick(light, useful), self.tally)
                radiance[:, paths.sample[who[useful]]] += paths.throughput[:, who[useful]] * arrived * value[useful]

    def _light_exits(self, paths: Paths, index: Indices, normal: Float32, slot, radiance: Float32) -> None:
        """Light of points and directions for paths that leave a smooth boundary from inside.

        Such light cannot be met by chance nor connected straight on. The exit is taken for diffuse: by
        reciprocity the light enters here with T(x), x = N.L, and spreads like diffuse light,

            w E0 max(x, 0) T(x) / (pi (1 - Fe))

        the separable form of the BSSRDF (Jensen et al. 2001, eq. 5). Energy is exact in a furnace; the sideways shift
        of the refracted beam is lost: 2-3 % on bodies of 20 transport mean free paths radius, 11-16 % at 2.
        """
        index_scattered = paths.scattered[index]
        index, normal, slot = index[index_scattered], normal[:, index_scattered], slot[index_scattered]
        if not len(index):
            return
        position = paths.origin[:, index]
        ior = self.media.ior[slot]
        inverse_share = np.array([1 / (1 - diffuse_external_reflectance(float(x))) for x in self.media.ior[:-1]])[slot]
        for source in self._points:
            light = source.illuminate(position)
            x = np.einsum("ij,ij->j", normal, light.direction)
            lit = np.flatnonzero(x > 0)
            if len(lit):
                arrived = received_outside(self.scene, position[:, lit], normal[:, lit], pick(light, lit), self.tally)
                entering = x[lit] * transmittance(x[lit], ior[lit]) * inverse_share[lit] / np.pi
                weight = paths.throughput[:, index[lit]] * entering.astype(np.float32)
                radiance[:, paths.sample[index[lit]]] += weight * arrived
