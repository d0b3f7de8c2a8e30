"""Cracks: boundary edges that all but coincide, so that a weld with a small tolerance closes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .topology import Topology

SEAM_TOLERANCE = 1e-5
"""How far apart the two sides of a seam may be, as a share of the diagonal: a hundred times single-precision
rounding, and far below anything one would model."""

_GENERIC = np.array([0.6018150231520483, 0.5270462766947299, 0.6])
"""A direction along no axis or diagonal: points of axis-aligned parts do not line up across it."""


def edges_closed_by_welding(topology: Topology, tolerance: float) -> NDArray[np.int64]:
    """Boundary edges that run along another one with both ends within ``tolerance`` (mesh units), sorted.

    Edges that a weld would make vanish, both ends being within the tolerance, are closed by it, too.
    """
    boundary = topology.boundary_edges
    if len(boundary) == 0 or tolerance <= 0:
        return np.zeros(0, np.int64)
    used, ends = np.unique(topology.edges[boundary], return_inverse=True)
    ends = ends.reshape(-1, 2)
    cluster = cluster_points(topology.points[used], tolerance)
    if (cluster == np.arange(len(used))).all():
        return np.zeros(0, np.int64)
    pairs = np.sort(cluster[ends], axis=1)
    _, twin, uses = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    return boundary[(uses[twin.ravel()] > 1) | (pairs[:, 0] == pairs[:, 1])]


def cluster_points(points: NDArray[np.float64], tolerance: float) -> NDArray[np.int64]:
    """(k,) for each point the least index it is joined to by steps of at most ``tolerance``."""
    along = points @ _GENERIC
    order = np.argsort(along, kind="stable")
    first, second = [], []
    for shift in range(1, len(points)):
        # points this many places apart in the sorted list, as long as any are near enough along the direction
        near = np.flatnonzero(along[order[shift:]] - along[order[:-shift]] <= tolerance)
        if len(near) == 0:
            break
        a, b = order[near], order[near + shift]
        close = np.linalg.norm(points[a] - points[b], axis=1) <= tolerance
        first.append(a[close])
        second.append(b[close])
    cluster = np.arange(len(points))
    if not first:
        return cluster
    a, b = np.concatenate(first), np.concatenate(second)
    while True:
        least = np.minimum(cluster[a], cluster[b])
        before = cluster.copy()
        np.minimum.at(cluster, a, least)
        np.minimum.at(cluster, b, least)
        if (cluster == before).all():
            return cluster
