"""What others would do for the scattered light of a body: rivals of the fast shaders, as shaders.

Each is called like ``renderer.shaders.plumb.exitance`` and answers with the exitance (3, n) under directional beams.
None of them takes part in rendering.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from renderer.optics.dielectric import boundary_mismatch, diffuse_external_reflectance, transmittance
from renderer.shaders import diffuse
from renderer.shaders.light_line import follow
from renderer.shaders.surface import BodyOptics, SurfacePoints, cosine_to
from renderer.tracing.traced_scene import TracedScene
from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET

Float32 = NDArray[np.float32]

POINTS_PER_PATCH = 2.0
"""Points of the dipole's integration for each square transport mean free path of surface."""
MOST_POINTS = 12_000
_STEPS = 16384
"""Steps of the table of the profile over distance."""
PAIRS = 2**21
"""Pairs of points worked on at a time."""


class Lambert:
    """Diffuse reflection of a half-space of the medium, with shadows: ``renderer.shaders.diffuse``."""

    NAME = "Lambert"
    exitance = staticmethod(diffuse.exitance)


class LambertBehind:
    """Lambert in front, and behind it |x| e^{-k d} with the chord d towards the light (Green 2004, GPU Gems 16)."""

    NAME = "Lambert + exp(-kd)"

    @staticmethod
    def exitance(caster, points: SurfacePoints, body: BodyOptics, beams) -> Float32:
        """(3, n) exitance."""
        total = diffuse.exitance(caster, points, body, beams)
        attenuation = np.sqrt(3 * body.medium.sigma_a * body.medium.reduced_extinction).astype(np.float32)
        for x, chord, irradiance in _behind(caster, points, body, beams):
            total += np.maximum(-x, 0) * np.exp(-attenuation[:, None] * chord) * irradiance
        return total


class Thesis:
    """The thesis' plumb: lit parts by the material's colour, unlit ones by the colour darkened with the stretch,

        colour |x| (1 - d / penetration depth),

    its penetration depth set to where diffuse light has fallen to 1 %, ln(100)/k.
    """

    NAME = "thesis"

    @staticmethod
    def exitance(caster, points: SurfacePoints, body: BodyOptics, beams) -> Float32:
        """(3, n) exitance."""
        total = diffuse.exitance(caster, points, body, beams)
        attenuation = np.sqrt(3 * body.medium.sigma_a * body.medium.reduced_extinction).astype(np.float32)
        depth = np.log(np.float32(100)) / attenuation
        for x, chord, irradiance in _behind(caster, points, body, beams):
            left = np.maximum(1 - chord / depth[:, None], 0)
            total += body.diffuse_albedo[:, None] * np.maximum(-x, 0) * left * irradiance
        return total


class Wrap:
    """Wrap lighting, A max(0, (x + w)/(1 + w)), without shadows: A and w are fitted to the answer, channel by channel,
    so that no tuning could do better in the mean square."""

    NAME = "wrap, best fitted"

    def __init__(self) -> None:
        self.width, self.strength = np.zeros(3), np.zeros(3)

    def fit(self, x: NDArray, answer: NDArray) -> None:
        """The best of 41 widths to exitance ``answer`` (n, 3) at cosines ``x`` (n,)."""
        widths = np.linspace(0, 2, 41)
        shape = np.maximum(0, (x + widths[:, None]) / (1 + widths[:, None]))
        strength = np.maximum(shape @ answer, 0) / np.maximum((shape * shape).sum(axis=1), 1e-12)[:, None]
        error = ((strength[:, None] * shape[..., None] - answer) ** 2).sum(axis=1)
        best = error.argmin(axis=0)
        self.width, self.strength = widths[best], strength[best, np.arange(3)]

    def exitance(self, caster, points: SurfacePoints, body: BodyOptics, beams) -> Float32:
        """(3, n) exitance."""
        total = np.zeros((3, len(points)), np.float32)
        for beam in beams:
            direction, _, irradiance = beam.at(points.position)
            width = self.width[:, None]
            wrapped = np.maximum(0, (cosine_to(points.normal, direction) + width) / (1 + width))
            total += (self.strength[:, None] * wrapped).astype(np.float32) * irradiance
        return total


class Dipole:
    """The dipole (Jensen, Marschner, Levoy & Hanrahan 2001, eq. 4), integrated over points on the whole surface,

        B(x) = sum_i R_d(|x - x_i|) E_i T_i dA,

    with shadows on the points. Offline: as many operations as points in the picture times points on the body.
    """

    NAME = "dipole 2001"

    def __init__(self, mesh: Mesh, traced: TracedScene):
        self._mesh, self._traced = mesh, traced

    @cached_property
    def _cloud(self) -> tuple[Float32, Float32, float]:
        traced = self._traced
        medium = traced.objects[0].medium
        assert medium is not None
        area = self._mesh.area / traced.frame.scale**2
        wanted = POINTS_PER_PATCH * area * float(medium.reduced_extinction.max()) ** 2
        count = int(np.clip(wanted, 4000, MOST_POINTS))
        number = np.arange(count)
        cumulative = np.cumsum(self._mesh.face_areas)
        face = np.searchsorted(cumulative, (number + 0.5) / count * cumulative[-1])
        # the R2 sequence (Roberts 2018), folded into the triangle
        u, v = (0.7548776662466927 * number) % 1, (0.5698402909980532 * number) % 1
        beyond = u + v > 1
        u, v = np.where(beyond, 1 - u, u)[:, None], np.where(beyond, 1 - v, v)[:, None]
        a, b, c = traced.frame.points_in(self._mesh.vertices)[self._mesh.faces[face]].swapaxes(0, 1)
        place = (a + u * (b - a) + v * (c - a)).T.astype(np.float32)
        return place, self._mesh.face_normals[face].T.astype(np.float32), area / count

    def exitance(self, caster, points: SurfacePoints, body: BodyOptics, beams) -> Float32:
        """(3, n) exitance."""
        place, normal, patch = self._cloud
        entering = np.zeros((3, place.shape[1]), np.float32)
        for beam in beams:
            direction, distance, irradiance = beam.at(place)
            x = cosine_to(normal, direction)
            open_ = ~caster.occluded(place + RAY_OFFSET * normal, direction, np.minimum(distance, np.float32(1e37)))
            entering += np.where((x > 0) & open_, x * transmittance(np.maximum(x, 0), body.ior), 0) * irradiance
        lit = np.flatnonzero(entering.any(axis=0))
        place, entering = place[:, lit].T, entering[:, lit] * np.float32(patch)
        total = np.zeros((3, len(points)), np.float32)
        step = max(PAIRS // max(len(lit), 1), 1)
        reach = 2 * body.bounding_radius
        distance = ((np.arange(_STEPS) + 0.5) * (reach / _STEPS)).astype(np.float32)
        profiles = [self._profile(distance * distance, body, channel) for channel in range(3)]
        for start in range(0, len(points), step):
            here = points.position[:, start : start + step].T
            square = ((here * here).sum(axis=1)[:, None] + (place * place).sum(axis=1)) - 2 * here @ place.T
            np.maximum(square, 0, out=square)
            place_in_table = (np.sqrt(square, out=square) * np.float32(_STEPS / reach)).astype(np.int32)
            for channel in range(3):
                profile = profiles[channel].take(place_in_table, mode="clip")
                total[channel, start : start + step] = profile @ entering[channel]
        return total

    @staticmethod
    def _profile(square: Float32, body: BodyOptics, channel: int) -> Float32:
        extinction = np.float32(body.medium.reduced_extinction[channel])
        albedo = np.float32(body.medium.reduced_albedo[channel])
        attenuation = extinction * np.sqrt(3 * (1 - albedo))
        real = 1 / extinction
        virtual = real * np.float32(1 + 4 / 3 * boundary_mismatch(body.ior))
        profile = np.zeros_like(square)
        for depth in (real, virtual):
            distance = np.sqrt(square + depth * depth)
            profile += depth * (1 + attenuation * distance) * np.exp(-attenuation * distance) / distance**3
        return profile * (albedo / np.float32(4 * np.pi))


def _behind(caster, points: SurfacePoints, body: BodyOptics, beams):
    """Cosine, chord towards the light (inf where it is unlit by other means) and irradiance, beam by beam."""
    for beam in beams:
        direction, distance, irradiance = beam.at(points.position)
        x = cosine_to(points.normal, direction)
        chord = np.full(len(x), np.inf, np.float32)
        dark = np.flatnonzero(x < 0)
        if len(dark):
            some = points.take(dark)
            line = follow(caster, body, some.position - some.normal * RAY_OFFSET, direction.take(dark, axis=1),
                          distance[dark], np.ones(len(dark), bool))  # fmt: skip
            chord[dark] = np.where(line.blocked, np.inf, np.nan_to_num(line.chord + line.depth, nan=np.inf))
        yield x, chord, irradiance


def outgoing_share(ior: float) -> float:
    """pi (1 - Fe): exitance over radiance before the view's transmittance."""
    return float(np.pi * (1 - diffuse_external_reflectance(ior)))
