"""Beams of light without extent behind smooth boundaries: which facets light a point inside, and from where.

A boundary bends light at flat facets. Parallel light behind one facet is a prism with one direction; light from a
point is a bundle in which one ray leads to each point. Both are found exactly. Facets that meet a beam from inside
mirror part of it: a further generation of beams, found alike through the mirrored point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optics.dielectric import fresnel_reflectance
from ..optics.flat_refraction import bent, crossing, inner_cosine, spreading
from ..scene.lights import DirectionalSource, PointSource
from .beam_generation import Facets, Generation, least_way, met, side_planes

Float64 = NDArray[np.float64]
Index = NDArray[np.intp]

FAR_CHANCE = 2.0**-17
"""Probability with which a point is tried for beams from farther than ``-ln FAR_CHANCE`` = 11.8 mean free paths.

Such light is weaker than that, so what it adds, over the chance, stays below what near light adds.
"""

_NARROW, _SPLITS = 0.1, 5
_FAR_PAIRS = 1_000_000


@dataclass(frozen=True)
class Arrivals:
    """c pairs of a point and a beam that reaches it, seen from the point.

    point      (c,) which point
    hit        one (3, c) float64 for each surface on the way to the light: mirrors, nearest first, then the entry
    direction  one (3, c) float64 for each stretch before those: the way light travels
    triangle   one (c,) for each, the scene's number
    length     (c,) way inside
    share      (c,) of the light that passes the entry and the mirrors
    focus      (c,) irradiance across the beam for light of strength 1, all else left aside
    """

    point: Index
    hit: list[Float64]
    direction: list[Float64]
    triangle: list[Index]
    length: Float64
    share: Float64
    focus: Float64

    @classmethod
    def joined(cls, parts: list[Arrivals]) -> Arrivals:
        """All pairs of parts of one generation, of which there is at least one."""
        if len(parts) == 1:
            return parts[0]

        def ways(name: str) -> list[NDArray]:
            legs = zip(*(getattr(part, name) for part in parts), strict=True)
            return [np.concatenate(leg, axis=-1) for leg in legs]

        def rows(name: str) -> NDArray:
            return np.concatenate([getattr(part, name) for part in parts])

        return cls(rows("point"), ways("hit"), ways("direction"), ways("triangle"),
                   rows("length"), rows("share"), rows("focus"))  # fmt: skip

    def take(self, columns: Index) -> Arrivals:
        """The given columns."""
        return Arrivals(
            self.point[columns],
            [one[:, columns] for one in self.hit],
            [one[:, columns] for one in self.direction],
            [one[columns] for one in self.triangle],
            self.length[columns],
            self.share[columns],
            self.focus[columns],
        )


class RefractedBeams:
    """Light of one source behind the smooth boundary of one object.

    ior     of the object, over 1 outside
    source  the light
    near    ways inside up to this length are found for every point, longer ones by ``far_arrivals``
    generations  beams that enter, and then those mirrored once, twice ... inside, see ``mirror``
    missing  (3,) share of the light entering that first collides after being mirrored more often than that
    """

    def __init__(
        self, facets: Facets, ior: float, source: PointSource | DirectionalSource, sigma_t: float, lower, upper
    ):
        self.ior, self.source, self._facets = float(ior), source, facets
        self._lower, self._upper = np.asarray(lower, float).ravel(), np.asarray(upper, float).ravel()
        diagonal = float(np.linalg.norm(self._upper - self._lower))
        self.near = -np.log(FAR_CHANCE) / max(sigma_t, 1e-9)
        self.all_near = self.near > diagonal
        self._diagonal = diagonal
        # where the light is, or, from afar, the direction towards it
        self._place = None if isinstance(source, DirectionalSource) else source.position.astype(float)[:, 0]
        self._towards = source.towards.astype(float)[:, 0] if isinstance(source, DirectionalSource) else np.zeros(3)
        if self._place is not None:
            self._sides, self._side_forward = side_planes(facets.corners, -facets.normal)
        self._level = np.einsum("ij,ij->i", facets.normal, facets.corners[:, 0])
        self.generations = [self._entered()]
        self.missing = np.zeros(3)

    @property
    def first_triangle(self) -> int:
        """The object's first among the scene's."""
        return self._facets.first

    @property
    def memory(self) -> int:
        """Bytes of the grids and beams."""
        return sum(one.grid.memory + one.planes.nbytes for one in self.generations if len(one.base))

    # ---- building ----

    def _entered(self) -> Generation:
        facets, eta = self._facets, self.ior
        normal, corners = facets.normal, facets.corners
        if self._place is None:
            towards = np.broadcast_to(self._towards, normal.shape)
            towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
            x = (normal * towards).sum(axis=1)
            base = np.flatnonzero((x > 0) & (inner_cosine(x, eta) > 0))
        else:
            base = np.flatnonzero(normal @ self._place > self._level + 1e-9)
        axis, spread = self._cone(corners[base], normal[base])
        ones = np.ones(len(base))
        share, focus = ones, ones
        if self._place is None:
            reflectance, inner = fresnel_reflectance(x[base], eta)
            share, focus = 1 - reflectance, x[base] / inner
        return self._generation(base, None, axis, spread, self.near * ones, share, focus)

    def _generation(self, base, parent, axis, spread, reach, share, focus) -> Generation:
        result = Generation(self._facets, base, parent, axis, spread, reach, share, focus, self._lower, self._upper)
        result.enter(self._split if parent is None and self._place is not None else _whole)
        return result

    def _cone(self, corners: Float64, normal: Float64) -> tuple[Float64, Float64]:
        """Directions behind facets: their middle (b, 3), and a bound of the distance from it (b,).

        Seen from the light a facet lies within the cap about its middle that holds its corners, of chord delta. Snell's
        law divides tangential components by eta, so those behind lie within delta/eta of the middle's, and their
        normal components sqrt(1 - |tangential|^2) follow.
        """
        if self._place is None:
            return bent(self._towards, normal, self.ior), np.zeros(len(corners))
        eta = self.ior
        towards = self._place - corners
        towards /= np.linalg.norm(towards, axis=2, keepdims=True)
        middle = towards.sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        delta = np.linalg.norm(towards - middle[:, None], axis=2).max(axis=1) / eta
        x = (middle * normal).sum(axis=1)
        tangential = np.sqrt(np.maximum(1 - x * x, 0)) / eta
        usable = tangential < 1
        axis = np.where(usable[:, None], bent(middle, normal, eta), -normal)
        steepest, flattest = (np.sqrt(1 - np.clip(t, 0, 1) ** 2) for t in (tangential - delta, tangential + delta))
        own = np.sqrt(np.maximum(1 - tangential**2, 0))
        spread = np.hypot(delta, np.maximum(steepest - own, own - flattest)) + 1e-9
        return axis, np.where(usable & (delta * eta < 1), spread, 2.0)

    def _split(self, corners, axis, spread, base):
        """Quarter the triangles of wide beams until they are narrow; (corners, axis, spread, beam)."""
        name = np.arange(len(corners))
        for _ in range(_SPLITS):
            wide = spread > _NARROW
            if not wide.any():
                break
            halved = corners[wide]
            a, b, c = halved.transpose(1, 0, 2)
            ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
            parts = np.concatenate(
                [np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
            )
            names = np.tile(name[wide], 4)
            new_axis, new_spread = self._cone(parts, self._facets.normal[base[names]])
            corners = np.concatenate([corners[~wide], parts])
            axis, spread = np.concatenate([axis[~wide], new_axis]), np.concatenate([spread[~wide], new_spread])
            name = np.concatenate([name[~wide], names])
        return corners, axis, spread, name

    def mirror(self) -> bool:
        """Find the beams that facets make of the last generation by reflecting it inside; whether that was feasible."""
        facets, before = self._facets, self.generations[-1]
        pairs = met(facets, before) if len(before.base) else None
        if pairs is None or not len(pairs[0]):
            return False
        triangle, beam = pairs
        normal, axis = facets.normal[triangle], before.axis[beam]
        cosine = (normal * axis).sum(axis=1)
        reach = before.reach[beam] - least_way(facets, before, triangle, beam)
        share = before.share[beam]
        if self._place is None:
            share = share * fresnel_reflectance(cosine, 1 / self.ior)[0]
        turned = axis - 2 * cosine[:, None] * normal
        keep = np.flatnonzero((reach > 0) & (share > 0))
        if not len(keep):
            return False
        of = beam[keep]
        self.generations.append(
            self._generation(
                triangle[keep], of, turned[keep], before.spread[of], reach[keep], share[keep], before.focus[of]
            )
        )
        return True

    # ---- asking ----

    def near_arrivals(self, position: NDArray, generation: int = 0) -> Arrivals:
        """All beams of a generation that reach points (3, n) within ``near``, whatever may stand in their way."""
        position = position.astype(float)
        found = []
        for point, beam in self.generations[generation].grid.candidates(position):
            part = self._arrivals(position, point, beam, generation, min(self.near, self._diagonal))
            found.append(part if self.all_near else part.take(np.flatnonzero(part.length <= self.near)))
        return Arrivals.joined(found)

    def far_arrivals(self, position: NDArray) -> Arrivals:
        """All unmirrored beams that reach points from farther than ``near``; every beam is tried."""
        position = position.astype(float)
        beams, found = len(self.generations[0].base), []
        step = max(_FAR_PAIRS // max(beams, 1), 1)
        for first in range(0, position.shape[1], step):
            some = np.arange(first, min(first + step, position.shape[1]))
            every = np.tile(np.arange(beams), len(some))
            part = self._arrivals(position, np.repeat(some, beams), every, 0, self._diagonal)
            found.append(part.take(np.flatnonzero(part.length > self.near)))
        return Arrivals.joined(found)

    def _arrivals(self, position: Float64, point: Index, beam: Index, generation: int, farthest: float) -> Arrivals:
        if self._place is None:
            return self._trace_parallel(position[:, point], point, beam, generation)
        keep, _ = self.generations[generation].holding(position[:, point], beam, farthest)
        return self._trace_from_point(position[:, point[keep]], point[keep], beam[keep], generation)

    def _trace_parallel(self, position: Float64, point: Index, beam: Index, generation: int) -> Arrivals:
        last, found = self.generations[generation], None
        for one in reversed(self.generations[: generation + 1]):
            keep, way = one.holding(position, beam, self._diagonal)
            if found is None:
                share, focus = last.share[beam[keep]], last.focus[beam[keep]]
                found = Arrivals(point[keep], [], [], [], np.zeros(len(keep)), share, focus)
            else:
                found = found.take(keep)
            beam = beam[keep]
            direction = one.axis[beam].T
            position = position[:, keep] - way * direction
            found.hit.append(position)
            found.direction.append(direction)
            found.triangle.append(one.base[beam] + self._facets.first)
            found.length[:] += way
            if one.parent is not None:
                beam = one.parent[beam]
        assert found is not None
        return found

    def _trace_from_point(self, position: Float64, point: Index, beam: Index, generation: int) -> Arrivals:
        """Mirror the points from facet to facet, find where light enters on its way to the image, and follow it."""
        facets, place, eta = self._facets, self._place, self.ior
        assert place is not None
        images, bases = [position], []
        for one in reversed(self.generations[: generation + 1]):
            bases.append(one.base[beam])
            if one.parent is not None:
                normal = facets.normal[bases[-1]].T
                height = (normal * images[-1]).sum(axis=0) - self._level[bases[-1]]
                images.append(images[-1] - 2 * height * normal)
                beam = one.parent[beam]
        root, image = bases[-1], images[-1]
        normal = facets.normal[root].T
        below = self._level[root] - (normal * image).sum(axis=0)
        above = normal.T @ place - self._level[root]
        across = image + below * normal - (place[:, None] - above * normal)
        apart = np.sqrt((across * across).sum(axis=0))
        keep = np.flatnonzero(below > 0)
        root, normal, below, above, across, apart = (
            entry[..., keep] for entry in (root, normal, below, above, across, apart)
        )
        r = crossing(above, below, apart, eta)
        entry = place[:, None] - above * normal + across * (r / np.maximum(apart, 1e-300))
        within = self._on_facet(root, entry)
        some = np.flatnonzero(within)
        keep, root, normal, entry = keep[some], root[some], normal[:, some], entry[:, some]
        above, below, rest, r = above[some], below[some], (apart - r)[some], r[some]
        outside, inside = np.sqrt(above**2 + r**2), np.sqrt(below**2 + rest**2)
        x, inner = above / outside, below / inside
        share = 1 - fresnel_reflectance(x, eta)[0]
        focus = spreading(outside, inside, x, inner, eta)
        images = [one[:, keep] for one in images]
        bases = [one[keep] for one in bases]
        # from the entry back to the point: light heads for one image after the other
        start, good = entry, np.ones(len(keep), bool)
        hits, directions = [entry], []
        for image, mirror in zip(images[:0:-1], bases[-2::-1] if len(bases) > 1 else [], strict=True):
            direction = _unit(image - start)
            directions.append(direction)
            normal = facets.normal[mirror].T
            cosine = (normal * direction).sum(axis=0)
            way = (self._level[mirror] - (normal * start).sum(axis=0)) / np.where(cosine > 0, cosine, 1)
            good &= (cosine > 0) & (way > 0)
            start = start + way * direction
            good &= self._on_facet(mirror, start)
            # on the point's own side of the mirror
            good &= (normal * images[0]).sum(axis=0) < self._level[mirror]
            share = share * fresnel_reflectance(np.clip(cosine, 0, 1), 1 / eta)[0]
            hits.append(start)
        directions.append(_unit(images[0] - start))
        result = Arrivals(point[keep], hits[::-1], directions[::-1], [one + facets.first for one in bases],
                          inside, share, focus)  # fmt: skip
        return result if generation == 0 else result.take(np.flatnonzero(good))

    def _on_facet(self, facet: Index, position: Float64) -> NDArray[np.bool_]:
        planes = self._sides[:3, facet]
        value = (np.einsum("scj,jc->sc", planes[..., :3], position) - planes[..., 3]).T
        return ((value > 0) | ((value == 0) & self._side_forward[facet])).all(axis=1)


def _unit(vector: Float64) -> Float64:
    return vector / np.maximum(np.sqrt((vector * vector).sum(axis=0)), 1e-300)


def _whole(corners, axis, spread, base):
    return corners, axis, spread, np.arange(len(corners))
