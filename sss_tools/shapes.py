"""Solids made from nothing: for tests, examples and charts.

All are closed, two faces at every edge, oriented outwards, centred at the origin, and the same every time.
``punctured`` and ``with_internal`` damage them in known ways.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .mesh import Body, Mesh


def box(size: float | ArrayLike = 1.0) -> Mesh:
    """A box with edges ``size``, one number or (3,), of 12 triangles."""
    corner = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return Mesh(corner * np.broadcast_to(np.asarray(size, float), (3,)), _halved(quads))


def slab(width: float = 1.0, thickness: float = 0.1) -> Mesh:
    """A square plate, ``width`` in x and y and ``thickness`` in z."""
    return box((width, width, thickness))


def icosphere(radius: float = 1.0, subdivisions: int = 3) -> Mesh:
    """A ball of 20 * 4**subdivisions even triangles, with its vertices on the sphere: a little too small."""
    golden = (1 + np.sqrt(5)) / 2
    signs = [(one, two) for one in (-1, 1) for two in (-golden, golden)]
    points = np.array([np.roll((0, one, two), shift) for shift in range(3) for one, two in signs])
    # the icosahedron's faces are its triples of vertices that are each 2 apart, taken counter-clockwise
    triples = np.array(list(combinations(range(12), 3)))
    sides = np.linalg.norm(points[triples] - points[np.roll(triples, 1, axis=1)], axis=2)
    faces = triples[np.isclose(sides, 2).all(axis=1)]
    backwards = np.linalg.det(points[faces]) < 0
    faces[backwards] = faces[backwards][:, ::-1]
    points = points / np.linalg.norm(points[0])
    for _ in range(subdivisions):
        points, faces = _subdivided(points, faces)
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return Mesh(radius * points, faces)


def ellipsoid(radii: ArrayLike = (1.0, 0.7, 0.5), subdivisions: int = 3) -> Mesh:
    """An ``icosphere`` stretched to the half axes ``radii`` (3,)."""
    ball = icosphere(1.0, subdivisions)
    return Mesh(ball.vertices * np.asarray(radii, float), ball.faces)


def torus(major: float = 1.0, minor: float = 0.3, around: int = 64, across: int = 24) -> Mesh:
    """A ring about the z axis: ``major`` from its centre to that of the tube, ``minor`` the tube's radius.

    around, across  quadrilaterals along the ring and around the tube
    """
    i, j = (index.ravel() for index in np.indices((around, across)))
    u, v = _turn(around)[i], _turn(across)[j]
    reach = major + minor * np.cos(v)
    points = np.stack([reach * np.cos(u), reach * np.sin(u), minor * np.sin(v)], axis=1)
    next_i, next_j = (i + 1) % around, (j + 1) % across
    quads = np.stack([i * across + j, next_i * across + j, next_i * across + next_j, i * across + next_j], 1)
    return Mesh(points, _halved(quads))


def cylinder(radius: float = 0.5, height: float = 1.0, segments: int = 64) -> Mesh:
    """A cylinder about the z axis with flat ends of ``segments`` triangles each."""
    angle, k = _turn(segments), np.arange(segments)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(segments, height / 2)], axis=1)
    centre = np.array([[0, 0, height / 2]])
    points = np.concatenate([ring, ring * (1, 1, -1), centre, -centre])
    after, bottom = (k + 1) % segments, segments
    sides = _halved(np.stack([k + bottom, after + bottom, after, k], axis=1))
    top_fan = np.stack([k, after, np.full(segments, 2 * segments)], axis=1)
    bottom_fan = np.stack([after + bottom, k + bottom, np.full(segments, 2 * segments + 1)], axis=1)
    return Mesh(points, np.concatenate([sides, top_fan, bottom_fan]))


def hollow_ball(outer: float = 1.0, inner: float = 0.5, subdivisions: int = 3) -> Mesh:
    """A ball with a legitimate cavity: the inner shell faces inwards, away from the material."""
    return joined(icosphere(outer, subdivisions), inverted(icosphere(inner, subdivisions)))


def moved(mesh: Mesh, offset: ArrayLike) -> Mesh:
    """The mesh shifted by ``offset`` (3,)."""
    return Mesh(mesh.vertices + np.asarray(offset, float), mesh.faces, mesh.bodies, mesh.vertex_attributes)


def inverted(mesh: Mesh) -> Mesh:
    """The mesh with every face turned over."""
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], mesh.bodies, mesh.vertex_attributes)


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as the bodies of one; vertex attributes are left behind."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    firsts = np.cumsum([0, *(len(mesh.faces) for mesh in meshes)])
    bodies = tuple(
        Body(body.name, int(first) + body.first_face, body.face_count, body.material)
        for mesh, first in zip(meshes, firsts, strict=False)
        for body in mesh.bodies
    )
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
        bodies,
    )


def punctured(mesh: Mesh, centres: ArrayLike, radius: float) -> Mesh:
    """The mesh without the faces whose centroid lies within ``radius`` of one of ``centres`` (k, 3): real holes.

    Vertices that no face uses any more go too; of the bodies one remains.
    """
    centroids = mesh.vertices[mesh.faces].mean(axis=1)
    gaps = np.linalg.norm(centroids[:, None] - np.atleast_2d(np.asarray(centres, float)), axis=2)
    faces = mesh.faces[gaps.min(axis=1) > radius]
    used, renumbered = np.unique(faces, return_inverse=True)
    attributes = {name: values[used] for name, values in mesh.vertex_attributes.items()}
    return Mesh(mesh.vertices[used], renumbered.reshape(-1, 3), vertex_attributes=attributes)


def with_internal(mesh: Mesh, centre: ArrayLike, radius: float, subdivisions: int = 3) -> Mesh:
    """The mesh with a ball inside that faces outwards as if it stood alone: internal geometry, not a cavity."""
    return joined(mesh, moved(icosphere(radius, subdivisions), centre))


def _turn(count: int) -> NDArray[np.float64]:
    return 2 * np.pi * np.arange(count) / count


def _halved(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """(2 q, 3) two triangles for each quadrilateral."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _subdivided(points: NDArray[np.float64], faces: NDArray[np.int64]):
    """Every triangle cut into four at the middles of its edges."""
    topology = Mesh(points, faces).topology
    middles = points[topology.edges].mean(axis=1)
    a, b, c = faces.T
    ab, bc, ca = (topology.face_edges + len(points)).T
    cut = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([points, middles]), np.stack([np.stack(t, 1) for t in cut], axis=1).reshape(-1, 3)
