"""Light without extent connected to collisions through rough boundaries.

    w p(d, o) exp(-sigma_t t) f(o, l) E0 / q(o)

A direction o is drawn at the collision, leads to the boundary after t, and there the light is connected to it by the
boundary's scattering function f (``point_light.light_rough``). Paths that come straight from such collisions are not
connected to those lights again where they meet a rough boundary; without this they would find by chance alone the few
directions that a boundary sends the light in.

o is drawn from the phase function or, half of the time, from the light behind the facets of the boundary as it is
straight towards the light, where the surface mostly is alike: Walter et al. 2007, eq. 40, with visible facets.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..optics.microfacet import sample_visible_facet, turning
from ..optics.phase import around, henyey_greenstein, sample_henyey_greenstein, spherical
from ..scene.lights import DirectionalSource, PointSource
from ..tracing import depth_roulette
from ..tracing.distance_grid import DistanceGrid, Scratch
from ..tracing.paths import Paths
from ..tracing.transport import Transport
from .crossings import Crossings
from .local_frame import LocalFrame
from .point_light import light_rough

Float32 = NDArray[np.float32]

_GUIDED = np.float32(0.5)
"""Share of the directions that is drawn from the light behind facets, where there are any."""
_WIDER = 0.1
"""Added to the roughness there: the boundary where a direction ends is turned against the one straight ahead."""


class RoughLight:
    """Connects the collisions of one worker's paths in the medium ``slot``; ``grid`` says which are near a surface."""

    def __init__(self, transport: Transport, slot: int, grid: DistanceGrid | None):
        self.transport, self._grid = transport, grid
        scene, paths = transport.scene, transport.paths
        # copies of the paths stand at the boundary and are lit as if they had flown there
        self._ends = Paths(paths.capacity, scene.media.count)
        self._bound, self._scratch = np.empty(paths.capacity, np.float32), Scratch(paths.capacity)
        self._width = scene.translucent[slot].roughness + _WIDER
        self._ior, self._g = np.float32(scene.media.ior[slot]), scene.media.g[slot]
        self._sigma_t = scene.media.sigma_t[:, slot, None]
        self._rough = np.array([*(thing.roughness > 0 for thing in scene.translucent), False])

    def light(self, index: NDArray[np.intp]) -> None:
        """Add light to the paths ``index``; their directions must still be those before the collisions."""
        if not len(index):
            return
        u, _ = self.transport.draw(index)
        limit = depth_roulette.reach(self._sigma_t.min(), depth_roulette.drawn_depth(u))
        if self._grid is not None:
            position = self.transport.paths.origin[:, index]
            near = np.flatnonzero(self._grid.distance(position, self._bound[: len(index)], self._scratch) < limit)
            index, limit = index[near], limit[near]
        for source in self.transport.scene.lights.points if len(index) else ():
            self._connect(index, source, limit)

    def _connect(self, index: NDArray[np.intp], source: PointSource | DirectionalSource, limit: Float32) -> None:
        """Connect the paths ``index`` to one light, as far as the boundary is within ``limit`` (n,)."""
        transport, scene = self.transport, self.transport.scene
        position, before = transport.paths.origin[:, index], transport.paths.direction[:, index]
        direction, phase, density = self._directions(index, position, before, source, limit)
        distance, triangle = scene.met(position, direction, limit)
        transport.tally.rays += len(index)
        met = np.flatnonzero(triangle >= 0)
        met = met[self._rough[scene.slot_of_triangle[triangle[met]]]]
        if not len(met):
            return
        ends, direction, distance, triangle = self._ends, direction[:, met], distance[met], triangle[met]
        ends.clear()
        ends.append(transport.paths, index[met])
        ends.origin[:] = scene.on_plane(position[:, met] + distance * direction, triangle)
        ends.direction[:] = direction
        depth = self._sigma_t * distance - depth_roulette.taken(self._sigma_t.min(), distance)
        ends.throughput *= np.exp(-depth) * (phase[met] / density[met])
        at = Crossings.of(scene, ends, np.arange(len(met)), triangle)
        bends = (at.eta != 1) & ~at.contradictory(scene)
        at_ends = replace(transport, paths=ends)
        for slot in np.unique(at.slot[bends]):
            here = at.take(np.flatnonzero(bends & (at.slot == slot)))
            frame = LocalFrame(here.facing)
            light_rough(at_ends, here, frame, frame.to_local(-here.direction), [source.illuminate(here.position)])

    def _directions(
        self, index: NDArray[np.intp], position: Float32, before: Float32, source: PointSource | DirectionalSource,
        limit: Float32,
    ) -> tuple[Float32, Float32, Float32]:  # fmt: skip
        """(3, n) directions from positions (3, n), the phase function there (n,), and their densities per steradian."""
        transport, scene = self.transport, self.transport.scene
        (choice, _), (u1, u2) = transport.draw(index), transport.draw(index)
        direction = around(before, spherical(sample_henyey_greenstein(self._g, u1), u2, np.empty_like(before)))
        to_light = np.ascontiguousarray(np.broadcast_to(source.illuminate(position).direction, position.shape))
        _, triangle = scene.closest(position, to_light, limit)
        transport.tally.rays += len(index)
        normal = np.take(scene.triangle_normal, np.maximum(triangle, 0), axis=1)
        known = np.flatnonzero((triangle >= 0) & (np.einsum("ij,ij->j", normal, to_light) > 0))
        frame = LocalFrame(normal[:, known])
        light = frame.to_local(to_light[:, known])
        guided = np.flatnonzero(choice[known] < _GUIDED)
        turned = known[guided]
        bent, inside = _bent(light[:, guided], self._width, self._ior, u1[turned], u2[turned])
        direction[:, turned] = -frame.take(guided).to_world(bent)
        phase = henyey_greenstein(np.einsum("ij,ij->j", before, direction), self._g)
        density = phase.copy()
        local = frame.to_local(-direction[:, known])
        behind, _ = turning(light, local, self._ior, self._width)
        density[known] += _GUIDED * (np.where(local[2] < 0, behind, 0) - density[known])
        density[turned[~inside]] = np.inf
        return direction, phase, density


def _bent(light: Float32, width: float, ior: np.float32, u1: Float32, u2: Float32) -> tuple[Float32, NDArray[np.bool_]]:
    """(3, n) directions in which facets send light on that comes from ``light`` (3, n), all in the local frame, and
    (n,) whether they lead inside.

        o = (c - sqrt(1 - 1/ior^2 + c^2)) m - l/ior,   c = l.m / ior

    Walter et al. 2007, eq. 40.
    """
    facet = sample_visible_facet(light, width, u1, u2)
    cosine = np.einsum("ij,ij->j", light, facet) / ior
    bent = (cosine - np.sqrt(1 - 1 / (ior * ior) + cosine * cosine)) * facet - light / ior
    bent /= np.sqrt(np.maximum(np.einsum("ij,ij->j", bent, bent), np.float32(1e-20)))
    return bent, bent[2] < 0
