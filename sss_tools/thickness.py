"""How thick is a solid behind each of its faces?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh
from .rays import RAY_OFFSET, RayCaster, UnitFrame

START = 4 * float(RAY_OFFSET)
"""How far behind its face a ray starts, unit-size frame: centroids of large triangles are rounded off their plane."""

OPPOSITE = 0.5
"""Least cosine between a ray and the normal where it leaves: two faces that are no wall are the tip of a wedge."""

SLACK = 1e-3
"""How much nearer than the point found another one may be, as a share: the balls' diameters are as inexact."""

STEPS = 30
"""Most times a ball shrinks; each step at least halves what is left, or it ends."""


def wall_thickness(mesh: Mesh) -> NDArray[np.float64]:
    """(m,) distance from each face's centroid straight inwards to where the solid ends, mesh units.

    inf where nothing is hit, where what is hit does not face the other way within 60 degrees (the tip of a wedge is
    no wall), and for faces without area. Walls down to nothing are seen: a ray that starts beyond a wall sees it when
    it looks back. Finite coordinates and at least one face are taken for granted.
    """
    frame = UnitFrame.around(*mesh.bounds)
    inside = frame.points_in(mesh.vertices)
    caster = RayCaster(inside, mesh.faces)
    normals = mesh.face_normals
    start = inside[mesh.faces].mean(axis=1) - START * normals
    inwards = np.ascontiguousarray(-normals.T, np.float32)
    origin = np.ascontiguousarray(start.T, np.float32)
    distance, hit = caster.closest(origin, inwards)
    distance = distance.astype(np.float64)
    leaves = -np.einsum("ij,ij->i", normals, normals[hit]) >= OPPOSITE
    thickness = np.where((hit >= 0) & leaves, distance + START, np.inf)

    # looking back, the own face comes first, unless another lies between
    limit = np.full(len(start), 2 * START, np.float32)
    distance, hit = caster.closest(origin, -inwards, limit)
    opposite = -np.einsum("ij,ij->i", normals, normals[hit]) >= OPPOSITE
    between = (hit >= 0) & (hit != np.arange(len(start))) & opposite & (distance <= START)
    thickness[between] = np.maximum(START - distance[between], 0)
    thickness[(normals == 0).all(axis=1)] = np.inf
    return thickness * frame.scale


def inscribed_balls(mesh: Mesh, faces: NDArray[np.int64], largest: NDArray[np.float64]):
    """The largest balls inside that touch ``faces`` (f,) in their centroids.

    largest  (f,) diameters of interest, mesh units: no ball is wider
    Returns diameters (f,), mesh units, and whether a ball is held by a wall (f,): by a face that faces the other way.
    A ball shrinks until no corner or centroid of a face lies in it; it may be too large by what fits between these.

    Ma, Bae & Choi 2012, Vis. Comput. 28:7, algorithm 1 (the shrinking ball).
    """
    from scipy.spatial import cKDTree

    centroids = mesh.vertices[mesh.faces].mean(axis=1)
    normals = mesh.face_normals
    tree = cKDTree(np.concatenate([centroids, mesh.vertices[mesh.faces].reshape(-1, 3)]))
    owner = np.concatenate([np.arange(len(mesh.faces)), np.repeat(np.arange(len(mesh.faces)), 3)])
    point, normal = centroids[faces], normals[faces]
    radius = np.minimum(largest, mesh.diagonal) / 2
    holder = np.full(len(faces), -1)
    todo = np.arange(len(faces))
    for _ in range(STEPS):
        # nearly nearest will do: in the middle of a ball, all of its surface is
        _, nearest = tree.query(point[todo] - radius[todo, None] * normal[todo], eps=SLACK)
        place = tree.data[nearest]
        towards = point[todo] - place
        depth = np.einsum("ij,ij->i", towards, normal[todo])
        square = np.einsum("ij,ij->i", towards, towards)
        smaller = np.divide(square, 2 * depth, out=np.full(len(todo), np.inf), where=depth > 0)
        shrinks = smaller < radius[todo] * (1 - 1e-6)
        todo, nearest, smaller = todo[shrinks], nearest[shrinks], smaller[shrinks]
        if len(todo) == 0:
            break
        radius[todo] = smaller
        holder[todo] = owner[nearest]
    wall = np.zeros(len(faces), bool)
    held = holder >= 0
    wall[held] = -np.einsum("ij,ij->i", normal[held], normals[holder[held]]) >= OPPOSITE
    return 2 * radius, wall
