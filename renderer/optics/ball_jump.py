"""Many collisions in one step: from a collision straight to the surface of a ball around it.

Light scattered isotropically at the centre of a ball of medium first leaves the ball at a place uniform on its surface,
at an angle to the radius and with a mean weight that ``ball_exit`` knows exactly. As flights have no memory the walk
goes on from there with a fresh one. Wherever no surface is nearer than the ball's radius, the jump changes nothing in
the mean (shell transport: Moon, Walter & Marschner 2007, Rendering Techniques, p. 231; in astrophysics the modified
random walk: Min et al. 2009, A&A 497:155).

Radii are rounded down to those of a table, so nothing is interpolated between balls. Angles are drawn from the mean of
three channels' densities, and each channel takes its share of it as weight: at most three times the mean weight.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .ball_exit import ball_exit
from .phase import around, spherical
from .table_cache import cached

Float32 = NDArray[np.float32]
Index = NDArray[np.int32]

BINS = 512
"""Bins of equal probability of the exit cosine; inside one it is uniform, which moves its mean by less than 1e-5."""
SMALLEST, LARGEST = 1.0, 128.0
"""Radii of the tables in mean free paths of the densest channel. A ball of 1 stands for 1.4 collisions, of 2 for 3.7,
of 128 for eight thousand, and hardly any path needs a larger one."""
_FORMULA = "ball jump 4"
_STEPS_PER_OCTAVE = 4
_COUNT = int(np.log2(LARGEST / SMALLEST)) * _STEPS_PER_OCTAVE + 1
_SHIFT = 23 - 2  # all but the exponent and two bits of the mantissa of a float32
_FIRST = int(np.float32(SMALLEST).view(np.int32)) >> _SHIFT


def table_radii() -> NDArray[np.float64]:
    """(29,) 1, 1.25, 1.5, 1.75, 2, 2.5, 3, ... 128: the numbers with two bits of mantissa, in mean free paths."""
    bits = (np.arange(_COUNT, dtype=np.int32) + _FIRST) << _SHIFT
    return bits.view(np.float32).astype(float)


@dataclass(frozen=True)
class BallJumps:
    """Jumps in one medium with g = 0.

    radius      (k,) float32 radii of the tables, in the length unit of ``sigma_t``
    collisions  (k,) float32 collisions that a jump stands for, as weighted by albedo, in the channel with the most
    weight      (k, 3) float32 mean weight W per channel
    """

    radius: Float32
    collisions: Float32
    weight: Float32
    _per_step: np.float32
    _straight: Float32
    _lower: Float32
    _width: Float32
    _weights: Float32

    def index_of(self, radius: Float32) -> Index:
        """(n,) index of the largest table radius that does not exceed ``radius`` (n,); negative where none does."""
        scaled = radius * self._per_step
        # of positive floats the order of the bits is that of the numbers; negative ones come out negative
        index = scaled.view(np.int32)
        index >>= _SHIFT
        index -= _FIRST
        return np.minimum(index, len(self.radius) - 1, out=index)

    def sample_exit(self, index: Index, u: Float32) -> tuple[Float32, Float32]:
        """Cosines to the radius (n,) and weights per channel (3, n), for table indices and uniforms (n,).

        With the probability of the unscattered share the cosine is 1.
        """
        straight = np.take(self._straight, index)
        place = (u - straight) * (np.float32(BINS) / np.maximum(1 - straight, np.float32(1e-7)))
        np.maximum(place, -1, out=place)
        np.minimum(place, np.float32(BINS - 1e-3), out=place)
        place += 1
        column = place.astype(np.int32)
        place -= column
        entry = column.astype(np.intp)
        entry += index * np.intp(BINS + 1)
        mu = np.take(self._width, entry)
        mu *= place
        mu += np.take(self._lower, entry)
        weights = np.empty((3, len(u)), np.float32)
        for channel in range(3):
            np.take(self._weights[channel], entry, out=weights[channel], mode="clip")
        return mu, weights

    def jump(self, index: Index, uniforms, position: Float32, direction: Float32) -> Float32:
        """Move to the surfaces of the balls around ``position``; returns the weights (3, n) to multiply throughputs by.

        index      (n,) from ``index_of``, none negative
        uniforms   four arrays (n,) in [0, 1): place on the ball (two), cosine, azimuth
        position   (3, n) where isotropic collisions took place, their albedo in the weight already; moved in place
        direction  (3, n) filled with the directions of travel, (3, n)

        At the new place nothing happens: the next flight begins.
        """
        height, turn, u, azimuth = uniforms
        radial = spherical(2 * height - 1, turn, np.empty_like(position))
        mu, weights = self.sample_exit(index, u)
        local = spherical(mu, azimuth, np.empty_like(position))
        np.copyto(direction, around(radial, local))
        radial *= np.take(self.radius, index)
        position += radial
        return weights

    def pays_from(self, cost: float = 2.0) -> float:
        """The least table radius whose jump stands for more than ``cost`` collisions; infinite where none does."""
        worth = np.flatnonzero(self.collisions > cost)
        return float(self.radius[worth[0]]) if len(worth) else float("inf")


def ball_jumps(sigma_t: ArrayLike, albedo: ArrayLike) -> BallJumps:
    """The tables of a medium: from memory, from disk, or built (some 0.5 s on two cores).

    sigma_t  (3,) extinction, 1/length; not all zero
    albedo   (3,) single-scattering albedo, in [0, 1]
    """
    extinction, albedo = np.asarray(sigma_t, float), np.asarray(albedo, float)
    densest = float(extinction.max())
    if not densest > 0:
        raise ValueError(f"jumps need a medium that extinguishes, not sigma_t = {extinction}")
    table = _tables(tuple(map(float, extinction / densest)), tuple(map(float, albedo)))
    columns = BINS + 1
    rows, rest = np.split(table, [5 * columns], axis=1)
    lower, width, *weights = rows.reshape(-1, 5, columns).transpose(1, 0, 2)
    radius = (table_radii() / densest).astype(np.float32)
    return BallJumps(
        radius=radius,
        collisions=rest[:, 1],
        weight=rest[:, 2:],
        # a few ulps less, so that rounding never takes a radius for the next larger one
        _per_step=np.float32(densest * (1 - 3e-7)),
        _straight=np.ascontiguousarray(rest[:, 0]),
        _lower=np.ascontiguousarray(lower).ravel(),
        _width=np.ascontiguousarray(width).ravel(),
        _weights=np.stack(weights).reshape(3, -1),
    )


@lru_cache(maxsize=16)
def _tables(ratios: tuple[float, ...], albedos: tuple[float, ...]) -> Float32:
    key = f"{_FORMULA} bins {BINS} radii {SMALLEST} {LARGEST} {_STEPS_PER_OCTAVE} "
    key += " ".join(value.hex() for value in ratios + albedos)
    shape = (_COUNT, 5 * (BINS + 1) + 5)

    def compute() -> NDArray[np.float64]:
        with ThreadPoolExecutor(2) as pool:
            return np.stack(list(pool.map(lambda radius: _row(radius, ratios, albedos), table_radii())))

    return cached("ball-jump", key, shape, compute)


def _row(radius: float, ratios: tuple[float, ...], albedos: tuple[float, ...]) -> NDArray[np.float64]:
    """Lower cosines, widths, three weights of all columns, then straight share, collisions and W: one radius.

    Column 0 is unscattered light; the others are bins of equal probability under the channels' mean density.
    """
    angle, shares, straight, collisions = _channels(radius, ratios, albedos)
    # nothing is lost without absorption: known better than solved
    total = np.where(np.array(albedos) == 1, 1, shares[:, -1] + straight)
    chance = straight.mean() / total.mean()
    mixture = shares.mean(axis=0)
    edges = np.interp(np.linspace(0, mixture[-1], BINS + 1), mixture, angle)
    edges[0], edges[-1] = 0, np.pi / 2
    masses = np.diff([np.interp(edges, angle, share) for share in shares], axis=1)
    cosine = np.cos(edges)
    lower, width = np.concatenate([[1], cosine[1:]]), np.concatenate([[0], cosine[:-1] - cosine[1:]])
    weights = masses * BINS / max(1 - chance, 1e-30)
    columns = np.concatenate([straight[:, None] / chance, weights], axis=1)
    if (shares == shares[0]).all():
        # what tells channels apart is nothing but the rounding of the bins
        columns[:] = total[:, None]
    columns *= (total / (chance * columns[:, 0] + (1 - chance) * columns[:, 1:].mean(axis=1)))[:, None]
    return np.concatenate([lower, width, columns.ravel(), [chance, collisions.max()], total])


def _channels(radius: float, ratios, albedos):
    """Angles (j,), scattered shares (3, j), unscattered shares (3,) and collisions (3,) of the channels."""
    ratio_of = np.array(ratios)
    shares, straight, collisions = [None] * 3, np.exp(-radius * ratio_of), np.zeros(3)
    angle = np.zeros(0)
    for ratio in np.unique(ratio_of):
        mine = np.flatnonzero(ratio_of == ratio)
        # a vacuum lets all light straight through; next to nothing does as well
        solved = ball_exit(max(radius * ratio, 1e-6), [albedos[c] for c in mine])
        angle = solved.angle
        for row, channel in enumerate(mine):
            shares[channel] = solved.share[row]
            collisions[channel] = solved.collisions[row]
    return angle, np.array(shares), straight, collisions
