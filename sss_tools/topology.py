"""Which faces meet where: points, edges, boundary loops, fans and components of a mesh."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

Indices = NDArray[np.int64]


class Topology:
    """The mesh with exactly equal positions taken as one point, so that UV and normal seams are no gaps.

    point_of_vertex   (n,) int64   the point of each vertex
    points            (k, 3) float64, in the order in which the file first names them
    faces             (m, 3) int64 over points
    live              (m,) bool    faces with three distinct points; the others take no part in edges
    edges             (e, 2) int64 undirected edges of live faces, lesser point first, in lexicographic order
    face_edges        (m, 3) int64 the edge of each side (side k joins corners k and k + 1); -1 if not live
    side_direction    (m, 3) bool  whether the side runs from edges[:, 0] to edges[:, 1]; False if not live
    faces_per_edge    (e,) int64   how many sides lie on each edge

    Positions are equal when all three coordinates have the same bits; -0.0 counts as 0.0.
    """

    def __init__(self, mesh: Mesh):
        self.point_of_vertex, first_vertex = weld_exactly(mesh.vertices)
        self.points = mesh.vertices[first_vertex]
        self.faces = self.point_of_vertex[mesh.faces]
        a, b, c = self.faces.T
        self.live = (a != b) & (b != c) & (c != a)

        start = self.faces[self.live]
        end = np.roll(start, -1, axis=1)
        # one integer an edge: sorting integers is some ten times faster than sorting rows
        keys = (np.minimum(start, end) * len(self.points) + np.maximum(start, end)).ravel()
        order = np.argsort(keys, kind="stable")
        edge_of_sorted, unique_keys = _number_runs(keys[order])
        edge_of_side = np.empty(len(keys), np.int64)
        edge_of_side[order] = edge_of_sorted

        self.edges = np.stack(np.divmod(unique_keys, max(len(self.points), 1)), axis=1)
        self.faces_per_edge = np.bincount(edge_of_side, minlength=len(self.edges))
        self.face_edges = np.full((len(self.faces), 3), -1, np.int64)
        self.face_edges[self.live] = edge_of_side.reshape(-1, 3)
        self.side_direction = np.zeros((len(self.faces), 3), bool)
        self.side_direction[self.live] = start < end

        # sides 3 * face + k of live faces, grouped by edge: neighbours in this list share an edge
        self._sides = (3 * np.flatnonzero(self.live)[:, None] + np.arange(3)).ravel()[order]
        self._same_edge = edge_of_sorted[1:] == edge_of_sorted[:-1]

    @cached_property
    def side_pairs(self) -> tuple[Indices, Indices]:
        """The two sides (3 * face + k) of every edge with exactly two faces, in the order of the edges."""
        first = np.cumsum(self.faces_per_edge) - self.faces_per_edge
        first = first[self.faces_per_edge == 2]
        return self._sides[first], self._sides[first + 1]

    @cached_property
    def boundary_edges(self) -> Indices:
        """(b,) edges with one face."""
        return np.flatnonzero(self.faces_per_edge == 1)

    @cached_property
    def nonmanifold_edges(self) -> Indices:
        """(q,) edges with more than two faces."""
        return np.flatnonzero(self.faces_per_edge > 2)

    @cached_property
    def misoriented_edges(self) -> Indices:
        """(q,) two-faced edges whose faces run through them in the same direction."""
        sides = self.face_edges[self.live].ravel()
        forward = np.bincount(sides[self.side_direction[self.live].ravel()], minlength=len(self.edges))
        return np.flatnonzero((self.faces_per_edge == 2) & (forward != 1))

    @cached_property
    def boundary_loops(self) -> list[Indices]:
        """Edge indices of each connected component of the graph of boundary edges, largest first.

        Where every point has two boundary edges a component is one loop. Loops that touch in a point are one
        component. Components of equal size come in the order of their first edges.
        """
        ends = self.edges[self.boundary_edges]
        if len(ends) == 0:
            return []
        used, compact = np.unique(ends, return_inverse=True)
        compact = compact.reshape(-1, 2)
        label = connected_components(len(used), compact[:, 0], compact[:, 1])[compact[:, 0]]
        order = np.argsort(label, kind="stable")
        cuts = np.flatnonzero(np.diff(label[order])) + 1
        return sorted(np.split(self.boundary_edges[order], cuts), key=lambda loop: (-len(loop), loop[0]))

    @cached_property
    def component_of_face(self) -> Indices:
        """(m,) component of each face, numbered by first face; -1 for faces that are not live.

        Faces belong together that share an edge, whatever its number of faces; a shared point is not enough.
        """
        face = self._sides // 3
        label = connected_components(len(self.faces), face[:-1][self._same_edge], face[1:][self._same_edge])
        component = np.full(len(self.faces), -1, np.int64)
        live_labels = label[self.live]
        _, first, inverse = np.unique(live_labels, return_index=True, return_inverse=True)
        component[self.live] = np.argsort(np.argsort(first))[inverse.ravel()]
        return component

    @cached_property
    def component_count(self) -> int:
        """How many components the live faces form."""
        return int(self.component_of_face.max(initial=-1)) + 1

    @cached_property
    def pinched_points(self) -> Indices:
        """(q,) points where the surface touches itself in a point alone, sorted.

        The faces round such a point form more than one fan, a fan being faces that one can walk through over
        the edges at that point. Edges with more than two faces join all their faces, so the end of a
        non-manifold edge is pinched only if there are other fans besides.
        """
        corner_point = self.faces.ravel()
        side, following = self._sides, self._sides // 3 * 3 + (self._sides + 1) % 3
        forward = self.side_direction.ravel()[side]
        # side k touches corners k and k + 1; sort the two by the edge's direction so that they match up
        tail, head = np.where(forward, side, following), np.where(forward, following, side)
        label = connected_components(
            len(corner_point),
            np.concatenate([tail[:-1][self._same_edge], head[:-1][self._same_edge]]),
            np.concatenate([tail[1:][self._same_edge], head[1:][self._same_edge]]),
        )
        corners = np.flatnonzero(np.repeat(self.live, 3))
        _, one_corner = np.unique(label[corners], return_index=True)
        fans = np.bincount(corner_point[corners[one_corner]], minlength=len(self.points))
        return np.flatnonzero(fans > 1)


def weld_exactly(vertices: NDArray[np.float64]) -> tuple[Indices, Indices]:
    """Number the distinct positions of ``vertices`` (n, 3) in order of first appearance.

    Returns point_of_vertex (n,) and first_vertex (k,), the first vertex of each point. Positions are equal
    when their bits are, with -0.0 equal to 0.0; a NaN equals a NaN of the same bits.
    """
    # adding 0.0 turns -0.0 into 0.0 and changes nothing else
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64)
    hashes = _hash_rows(bits)
    order = np.argsort(hashes, kind="stable")
    if _has_collision(bits, hashes, order):
        order = np.lexsort(bits.T[::-1])
    ordered = bits[order]
    starts = np.ones(len(bits), bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    # both sorts are stable: the first of each run is the least vertex
    run_first = order[starts]
    by_first = np.argsort(run_first)
    number = np.empty(len(run_first), np.int64)
    number[by_first] = np.arange(len(run_first))
    point_of_vertex = np.empty(len(bits), np.int64)
    point_of_vertex[order] = number[np.cumsum(starts) - 1]
    return point_of_vertex, run_first[by_first]


def _hash_rows(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """(n,) 64-bit hashes of (n, 3) rows, by the finaliser of SplitMix64 (Steele, Lea & Flood 2014)."""
    hashes = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        hashes += column
        hashes ^= hashes >> np.uint64(30)
        hashes *= np.uint64(0xBF58476D1CE4E5B9)
        hashes ^= hashes >> np.uint64(27)
        hashes *= np.uint64(0x94D049BB133111EB)
        hashes ^= hashes >> np.uint64(31)
    return hashes


def _has_collision(bits: NDArray[np.uint64], hashes: NDArray[np.uint64], order: Indices) -> bool:
    """Whether different rows share a hash, so that sorting by hash would not gather equal rows."""
    same_hash = hashes[order[1:]] == hashes[order[:-1]]
    return bool((bits[order[1:][same_hash]] != bits[order[:-1][same_hash]]).any())


def _number_runs(ordered: Indices) -> tuple[Indices, Indices]:
    """The run each element of a sorted array belongs to, and the value of each run."""
    starts = np.ones(len(ordered), bool)
    starts[1:] = ordered[1:] != ordered[:-1]
    return np.cumsum(starts) - 1, ordered[starts]


def connected_components(count: int, a: Indices, b: Indices) -> Indices:
    """(count,) component labels of the undirected graph with ``count`` nodes and links a[i] - b[i]."""
    from scipy.sparse import coo_array, csgraph

    links = coo_array((np.ones(len(a), bool), (a, b)), shape=(count, count))
    return csgraph.connected_components(links, directed=False)[1].astype(np.int64)
