"""How far a path may fly before it can meet a surface, looked up instead of traced.

A box is cut into cubic voxels of edge h, and each holds a number D such that no surface lies within D of any of
its points. The proof: let S be samples of the surface such that every point q of it lies within delta of one
(``surface_samples.cover``). Mark the voxels that hold samples; let E_i be the distance from the centre c_i to the
nearest marked centre. Take p in voxel i, q on the surface, s its sample, in the marked voxel j:

    |p - q| >= |c_i - c_j| - |p - c_i| - |c_j - s| - |s - q| >= h E_i - sqrt(3)/2 h - sqrt(3)/2 h - delta.

Nearer than some three voxels, where that slack is most of E, the distance d_i from c_i to the nearest sample is
searched for instead, and one half-diagonal less is lost: |p - q| >= d_i - sqrt(3)/2 h - delta.

The outermost layer of voxels is marked as well and lies around the box. A surface beyond it, whose samples may be
left out, is reached only through that layer: at a point at least h E_i - sqrt(3) h from p, so the first bound holds,
and for the second d_i is cut to the distance to the box's outside. EPSILON covers rounding.

Distances are unsigned and to any surface: open meshes, nested shells and several objects need no care. They are
never interpolated: the bound holds for the voxel a point is in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sss_tools.topology import weld_exactly
from sss_tools.winding import winding_numbers

from .distance_transform import squared_distances
from .surface_samples import COVERING, cover

Float32 = NDArray[np.float32]

EPSILON = 1e-6
"""What rounding may take from the bound, unit-size frame. Samples are wrong by a few 6e-8 in each coordinate, and so is
the place of the voxel's walls: a position times 1/h, shifted, is rounded by half an ulp of each, times h again."""
BAND = 12
"""Squared distance in voxels up to which the nearest sample is searched: sqrt(12) is the diagonal of two voxels."""
RESOLUTIONS = (48, 64, 96, 128, 192, 256)
_HALF_DIAGONAL = np.sqrt(3) / 2
_LARGEST_REGIONS = 16
# seconds, measured on two cores: a bounded ray, a flight with its collision, a look-up; building
_RAY, _COLLISION, _LOOKUP = 80e-9, 60e-9, 15e-9
_START, _PER_VOXEL, _PER_SURFACE_VOXEL = 0.05, 1e-7, 1.5e-5


class Scratch:
    """Buffers for looking up ``capacity`` points."""

    def __init__(self, capacity: int):
        self._scaled = np.empty((3, capacity), np.float32)
        self._cell = np.empty((3, capacity), np.int32)
        self._index = np.empty(capacity, np.intp)

    def for_points(self, n: int):
        """The first ``n`` entries of each buffer."""
        return self._scaled[:, :n], self._cell[:, :n], self._index[:n]


class DistanceGrid:
    """Distance bounds over the box of some solids.

    bounds   (voxels,) float32, flat: the proven distance; 0 where nothing is known, and outside
    outside  (voxels,) bool, where the whole voxel surely lies outside all solids: no path flies there
    shape    voxels along each side, one more at either end than the box has
    origin   (3,) float64 outer corner
    voxel    edge length h
    """

    def __init__(self, points, faces, resolution: int, solids: Sequence[slice] | None = None):
        """Build the grid.

        points      (n, 3) vertices in the unit-size frame
        faces       (m, 3) indices, all that rays can hit
        resolution  voxels along the longest side of the box
        solids      the faces of each closed solid; the box is drawn around them. None for all faces as one.

        Raises ValueError where no solid has a face or the box has no size.
        """
        points, faces = np.asarray(points, np.float32), np.asarray(faces)
        solids = [slice(0, len(faces))] if solids is None else list(solids)
        corners = points[np.concatenate([faces[solid] for solid in solids])].reshape(-1, 3).astype(float)
        if len(corners) == 0:
            raise ValueError("a distance grid needs at least one face to be drawn around")
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        if not (upper - lower).max() > 0:
            raise ValueError("a distance grid needs a box with some size")
        self.voxel = h = float((upper - lower).max()) / resolution
        inner = np.maximum(np.ceil((upper - lower) / h - 1e-6), 1).astype(int)
        self.shape = tuple(int(side) + 2 for side in inner)
        self.origin = (lower + upper) / 2 - np.array(self.shape) * h / 2
        self._per_unit = np.float32(1 / h)
        self._shift = (-self.origin / h).astype(np.float32)[:, None]
        # half a voxel into the outermost layer, where the bound is 0
        self._last = (np.array(self.shape) - 0.5).astype(np.float32)[:, None]

        spacing = h / 2
        samples = cover(points, faces, spacing, self.origin, self.origin + np.array(self.shape) * h)
        squared = squared_distances(self._marked(samples))
        self.outside = self._outside(squared, points, [faces[solid] for solid in solids])
        self.slack = COVERING * spacing + EPSILON
        bounds = np.sqrt(squared, dtype=np.float32)
        bounds -= np.float32(2 * _HALF_DIAGONAL + self.slack / h)
        bounds *= np.float32(h)
        np.maximum(bounds, 0, out=bounds)
        self.bounds = bounds.reshape(-1)
        self._tighten(samples, squared)
        # a path that has leaked out is found by its rays
        self.bounds[self.outside] = 0

    def distance(self, position: Float32, out: Float32, scratch: Scratch) -> Float32:
        """(n,) the bounds of the voxels in which the points (3, n) lie; 0 beyond the grid."""
        index = self._index_of(position, scratch)
        return np.take(self.bounds, index, out=out, mode="clip")

    def centres(self, index: NDArray[np.intp]) -> NDArray[np.float64]:
        """(n, 3) middles of the voxels at flat indices (n,)."""
        return (np.stack(np.unravel_index(index, self.shape), axis=1) + 0.5) * self.voxel + self.origin

    def _index_of(self, position: Float32, scratch: Scratch) -> NDArray[np.intp]:
        scaled, cell, index = scratch.for_points(position.shape[1])
        np.multiply(position, self._per_unit, out=scaled)
        scaled += self._shift
        np.maximum(scaled, 0, out=scaled)
        np.minimum(scaled, self._last, out=scaled)
        np.copyto(cell, scaled, casting="unsafe")
        _, rows, columns = self.shape
        np.multiply(cell[0], rows, out=cell[0])
        cell[0] += cell[1]
        cell[0] *= columns
        return np.add(cell[0], cell[2], out=index)

    def _marked(self, samples: Float32) -> NDArray[np.bool_]:
        marked = np.zeros(self.shape, bool)
        flat = marked.reshape(-1)
        scratch = Scratch(1 << 15)
        for block in np.split(samples, range(1 << 15, len(samples), 1 << 15)):
            flat[self._index_of(np.ascontiguousarray(block.T), scratch)] = True
        for axis in range(3):
            layers = np.moveaxis(marked, axis, 0)
            layers[0] = layers[-1] = True
        return marked

    def _tighten(self, samples: Float32, squared: NDArray[np.uint16]) -> None:
        """Replace the bounds of voxels near the surface by those from the nearest sample."""
        from scipy.spatial import cKDTree

        if len(samples) == 0:
            return
        # marked voxels hold a sample within half a diagonal: their bound is zero. No path flies outside
        wanted = (squared > 0) & (squared <= BAND)
        if self.outside.any():
            wanted &= ~self._near_outside()
        index = np.flatnonzero(wanted)
        tree = cKDTree(samples, balanced_tree=False, compact_nodes=False, leafsize=32)
        reach = (np.sqrt(BAND) + _HALF_DIAGONAL) * self.voxel
        nearest, _ = tree.query(self.centres(index), distance_upper_bound=reach, workers=2)
        nearest = np.minimum(nearest, reach)
        cells = np.unravel_index(index, self.shape)
        beyond = np.min([np.minimum(c, n - 1 - c) for c, n in zip(cells, self.shape, strict=True)], axis=0) + 0.5
        nearest = np.minimum(nearest, beyond * self.voxel)
        tight = nearest - _HALF_DIAGONAL * self.voxel - self.slack
        self.bounds[index] = np.maximum(self.bounds[index], np.float32(tight))

    def _near_outside(self) -> NDArray[np.bool_]:
        """Voxels within two steps of surely outside ones, which no surface separates from them."""
        from scipy.ndimage import binary_dilation

        return binary_dilation(self.outside.reshape(self.shape), iterations=2)

    def _outside(self, squared, points, solids) -> NDArray[np.bool_]:
        """(voxels,) as ``outside``: regions of voxels that no surface meets lie inside or outside as a whole.

        A voxel holds no surface where its bound is positive, and two that share a side make one convex room. Of
        such a room any point's winding number tells, provided that each solid's sides run as often one way as the
        other, so that the number changes nowhere but at the surface; otherwise nothing is sure.
        """
        from scipy.ndimage import label

        free = squared > int(np.floor((2 * _HALF_DIAGONAL + COVERING / 2 + 2 * EPSILON / self.voxel) ** 2))
        place, _ = weld_exactly(points.astype(float))
        if not all(closes(place[faces]) for faces in solids):
            return np.zeros(free.size, bool)
        regions, count = label(free)
        regions = regions.reshape(-1)
        sizes = np.bincount(regions, minlength=count + 1)
        sizes[0] = 0
        largest = np.argsort(-sizes)[: min(_LARGEST_REGIONS, count)]
        voxel_of = np.zeros(count + 1, np.int32)
        voxel_of[regions] = np.arange(regions.size, dtype=np.int32)
        winding = [winding_numbers(self.centres(voxel_of[largest]), points.astype(float), faces) for faces in solids]
        outside = np.zeros(count + 1, bool)
        outside[largest] = ~(np.abs(winding) > 0.5).any(axis=0)
        return outside[regions]


def closes(corners: NDArray[np.int64]) -> bool:
    """Whether the sides of faces, (m, 3) places of their corners, run between any two as often one way as the other.

    Then the surface has no boundary, and its winding number is whole and changes nowhere but across it.
    """
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    base = int(corners.max(initial=0)) + 1
    return np.array_equal(np.sort(start * base + end), np.sort(end * base + start))


@dataclass(frozen=True)
class Walks:
    """The walks expected in one solid, lengths in the unit-size frame.

    count           walks that enter
    area, volume    of the solid
    mean_free_path  1/sigma_t
    albedo          single-scattering albedo, of the channel that scatters most
    ior             index inside over index outside
    """

    count: float
    area: float
    volume: float
    mean_free_path: float
    albedo: float
    ior: float = 1.0

    @property
    def collisions(self) -> float:
        """Of all walks together: 4V/A ior^2 of path each (Blanco & Fournier 2003), unless absorption ends them."""
        chord = 4 * abs(self.volume) / self.area * self.ior**2 / self.mean_free_path
        return self.count * min(chord, 1 / max(1 - self.albedo, 1e-9))

    def share_near_surface(self, slack: float) -> float:
        """Share of the flights that reach further than the bound, which is ``slack`` below the true distance.

        Where light fills the solid evenly, as without absorption, flights start at depth z in A dz/V of the cases
        and pass the bound in exp(-(z - slack)/l) of those: together (l + slack) A/V. Absorption keeps them within
        a diffusion length l/sqrt(3(1 - albedo)) of the surface.
        """
        depth = abs(self.volume) / self.area
        if self.albedo < 1:
            depth = min(depth, self.mean_free_path / np.sqrt(3 * (1 - self.albedo)))
        return min(1.0, (self.mean_free_path + slack) / max(depth, 1e-30))


def choose_resolution(walks: Sequence[Walks], extent, jumps: bool = False) -> int | None:
    """Voxels along the longest side for which building and tracing together cost least; None where no grid pays.

    walks   one for each solid
    extent  (3,) sides of the box around them, unit-size frame
    jumps   whether the grid serves ball jumps, which save collisions as well

    A grid saves a ray, and with jumps the flight too, at all flights but those near the surface, and costs a look-up
    at each. It pays for thousands of walks through a body many mean free paths thick, never for a few bounces.
    """
    extent = np.asarray(extent, float)
    gained = _RAY + (_COLLISION if jumps else 0)

    def gain(resolution: int) -> float:
        voxel = extent.max() / resolution
        slack = (_HALF_DIAGONAL + COVERING / 2) * voxel
        saved = sum(w.collisions * ((1 - w.share_near_surface(slack)) * gained - _LOOKUP) for w in walks)
        voxels, surface = np.prod(extent / voxel + 2), sum(w.area for w in walks) / voxel**2
        return saved - _START - _PER_VOXEL * voxels - _PER_SURFACE_VOXEL * surface

    best = max(RESOLUTIONS, key=gain)
    return best if gain(best) > 0 else None
