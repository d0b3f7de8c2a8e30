"""On which side does a point lie? Orientation of points in space and in the plane, exact in sign.

Double precision decides wherever its error bound lets it; the rest is decided by sums of products without any
rounding. Coordinates are taken as the binary fractions they are.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Signs = NDArray[np.int8]

ERROR_BOUND_3D = 2.0**-50
"""Error of a 3 x 3 determinant of differences over its permanent: (7 + 56 e) e < 8 e with e = 2**-53.

Shewchuk 1997, Discrete Comput. Geom. 18:305, section 4.3 (``o3derrboundA``)."""

ERROR_BOUND_2D = 2.0**-51
"""The same for 2 x 2: (3 + 16 e) e < 4 e (``ccwerrboundA``)."""

UNDERFLOW = 1e-280
"""What products of tiny factors may lose besides, with room to spare."""

LEAST_FACTOR = 2.0**-200
"""A product of three factors from here on keeps all of its 159 bits above the least double."""

_SPLITTER = 2.0**27 + 1


def orient_3d(a: Float, b: Float, c: Float, d: Float) -> Signs:
    """(n,) sign of det(b - a, c - a, d - a): 1 where d is on the side a, b, c turn counter-clockwise from.

    a, b, c, d  (3, n) float64, no larger than about 1 (scale by a power of two, which is exact)
    """
    ux, uy, uz = b - a
    vx, vy, vz = c - a
    wx, wy, wz = d - a
    determinant = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    ux, uy, uz, vx, vy, vz, wx, wy, wz = map(np.abs, (ux, uy, uz, vx, vy, vz, wx, wy, wz))
    permanent = ux * (vy * wz + vz * wy) + uy * (vz * wx + vx * wz) + uz * (vx * wy + vy * wx)
    signs = np.sign(determinant).astype(np.int8)
    unsure = np.flatnonzero(np.abs(determinant) <= ERROR_BOUND_3D * permanent + UNDERFLOW)
    if len(unsure):
        signs[unsure] = _exactly_3d(*(x[:, unsure] for x in (a, b, c, d)))
    return signs


def orient_2d(a: Float, b: Float, c: Float) -> Signs:
    """(n,) sign of det(b - a, c - a): 1 where a, b, c turn counter-clockwise.

    a, b, c  (2, n) float64, no larger than about 1
    """
    (ux, uy), (vx, vy) = b - a, c - a
    left, right = ux * vy, uy * vx
    signs = np.sign(left - right).astype(np.int8)
    permanent = np.abs(left) + np.abs(right)
    unsure = np.flatnonzero(np.abs(left - right) <= ERROR_BOUND_2D * permanent + UNDERFLOW)
    if len(unsure):
        signs[unsure] = _exactly_2d(*(x[:, unsure] for x in (a, b, c)))
    return signs


def _exactly_3d(a, b, c, d) -> Signs:
    """Orientation in space, exact. Points that coincide, and differences that are exact, are the cheap cases."""
    signs = np.zeros(a.shape[1], np.int8)
    same = np.zeros(len(signs), bool)
    for p, q in ((a, b), (a, c), (a, d), (b, c), (b, d), (c, d)):
        same |= (p == q).all(axis=0)
    # four points in a common axis-parallel plane are coplanar
    flat = ((a == b) & (a == c) & (a == d)).any(axis=0)
    open_ = np.flatnonzero(~same & ~flat)
    a, b, c, d = (x[:, open_] for x in (a, b, c, d))
    exact = _is_exact_difference(b, a) & _is_exact_difference(c, a) & _is_exact_difference(d, a)
    u, v, w = ((x - a)[:, exact] for x in (b, c, d))
    signs[open_[exact]] = _sign_of_sum(_determinant_terms(u, v, w))
    a, b, c, d = (x[:, ~exact] for x in (a, b, c, d))
    # det(b - a, c - a, d - a) = [bcd] - [acd] + [abd] - [abc]
    whole = _determinant_terms(b, c, d) + _determinant_terms(-a, c, d)
    whole += _determinant_terms(a, b, d) + _determinant_terms(-a, b, c)
    signs[open_[~exact]] = _sign_of_sum(whole)
    return signs


def _exactly_2d(a, b, c) -> Signs:
    """Orientation in the plane, exact: det(b - a, c - a) = a x b + b x c + c x a."""
    one = np.ones(a.shape[1])
    terms = []
    for p, q in ((a, b), (b, c), (c, a)):
        terms += [(p[0], q[1], one), (-p[1], q[0], one)]
    return _sign_of_sum(terms)


def _determinant_terms(u, v, w) -> list[tuple[Float, Float, Float]]:
    """The six products whose sum is det(u, v, w)."""
    terms = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        terms += [(u[i], v[j], w[k]), (-u[i], v[k], w[j])]
    return terms


def _is_exact_difference(x: Float, y: Float) -> NDArray[np.bool_]:
    """(n,) whether x - y (3, n) is free of rounding, by the tail of Knuth's two-sum."""
    difference = x - y
    back = x - difference
    tail = (x - (difference + back)) + (back - y)
    return (tail == 0).all(axis=0)


def _sign_of_sum(terms: list[tuple[Float, Float, Float]]) -> Signs:
    """(n,) signs of sums of products of three factors, (n,) each, without rounding."""
    count = len(terms[0][0])
    if count == 0:
        return np.zeros(0, np.int8)
    parts: list[Float] = []
    least = np.full(count, np.inf)
    for x, y, z in terms:
        for factor in (x, y, z):
            np.minimum(least, np.where(factor == 0, np.inf, np.abs(factor)), out=least)
        for part in _two_product(x, y):
            parts += _two_product(part, z)
    # fsum rounds the exact sum once, so its sign is right
    sums = [math.fsum(row) for row in np.stack(parts, axis=1).tolist()]
    signs = np.sign(sums).astype(np.int8)
    for index in np.flatnonzero(least < LEAST_FACTOR):
        total = sum(math.prod(Fraction(float(factor[index])) for factor in term) for term in terms)
        signs[index] = (total > 0) - (total < 0)
    return signs


def _two_product(x: Float, y: Float) -> tuple[Float, Float]:
    """x * y as a rounded product and its exact error: Dekker 1971, Numer. Math. 18:224, section 5."""
    product = x * y
    xc, yc = _SPLITTER * x, _SPLITTER * y
    x_high, y_high = xc - (xc - x), yc - (yc - y)
    x_low, y_low = x - x_high, y - y_high
    error = x_low * y_low - (((product - x_high * y_high) - x_low * y_high) - x_high * y_low)
    return product, error
