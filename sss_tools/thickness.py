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

CLOUD = 250_000
"""Most points that the surface is taken for when balls are inscribed."""

RESOLUTION = 24
"""Points along the diameter of the widest ball that is looked at."""

FINER = 4
"""How much narrower than the widest a ball is that is looked at again with more points."""

SLACK = 1e-3
"""How much nearer than the point found another one may be, as a share; balls that shrink by less are done."""

STEPS = 30
"""Most times a ball shrinks; nearly all are done after six."""


def wall_thickness(mesh: Mesh, largest: float = np.inf) -> NDArray[np.float64]:
    """(m,) distance from each face's centroid straight inwards to where the solid ends, mesh units.

    largest  thickness of interest: short rays are cheaper

    inf where nothing is hit so near, where what is hit does not face the other way within 60 degrees (the tip of a
    wedge is no wall), and for faces without area. Walls down to nothing are seen: a ray that starts beyond a wall sees
    it when it looks back. Finite coordinates and at least one face are taken for granted.
    """
    frame = UnitFrame.around(*mesh.bounds)
    inside = frame.points_in(mesh.vertices)
    caster = RayCaster(inside, mesh.faces)
    normals = mesh.face_normals
    start = inside[mesh.faces].mean(axis=1) - START * normals
    inwards = np.ascontiguousarray(-normals.T, np.float32)
    origin = np.ascontiguousarray(start.T, np.float32)
    reach = None
    if largest < 2 * mesh.diagonal:
        reach = np.full(len(start), largest / frame.scale, np.float32)
    distance, hit = caster.closest(origin, inwards, reach)
    distance = distance.astype(np.float64)
    towards = -np.einsum("ij,ij->i", normals, normals[hit])
    thickness = np.where((hit >= 0) & (towards >= OPPOSITE), distance + START, np.inf)

    # a ray that leaves the solid began in it; others may have begun beyond a thin wall. Looking back, the own face
    # comes first, unless another lies between
    beyond = np.flatnonzero((hit < 0) | (towards <= 0))
    if len(beyond):
        back = np.ascontiguousarray(-inwards[:, beyond])
        distance, hit = caster.closest(
            np.ascontiguousarray(origin[:, beyond]), back, np.full(len(beyond), 2 * START, np.float32)
        )
        opposite = -np.einsum("ij,ij->i", normals[beyond], normals[hit]) >= OPPOSITE
        between = (hit >= 0) & (hit != beyond) & opposite & (distance <= START)
        thickness[beyond[between]] = np.maximum(START - distance[between], 0)
    thickness[(normals == 0).all(axis=1)] = np.inf
    return thickness * frame.scale


def inscribed_balls(
    mesh: Mesh, faces: NDArray[np.int64], largest: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The largest balls inside that touch ``faces`` (f,) in their centroids.

    largest  (f,) diameters of interest, mesh units: no ball is wider
    Returns diameters (f,), mesh units, and whether a ball is held by a wall (f,): by a face that faces the other way.

    A ball shrinks until no point of a cloud over the surface lies in it. A ball of diameter d is too wide by up to
    s^2 / 4d for points s apart: s is at most d FINER / RESOLUTION, which makes 1 %, or where that takes more than CLOUD
    points, the root of the area over CLOUD. Fewer points for wider balls keep the search short: all of a sphere is as
    far from its middle.

    Ma, Bae & Choi 2012, 3D medial axis point approximation using nearest neighbors and the normal field, Vis. Comput.
    28:7, algorithm 1 (the shrinking ball).
    """
    radius = np.minimum(largest, mesh.diagonal) / 2
    holder = np.full(len(faces), -1)
    todo = np.flatnonzero(radius > 0)
    while len(todo):
        widest = float(radius[todo].max())
        spacing = 2 * widest / RESOLUTION
        radius[todo], held_by = _shrunk(mesh, faces[todo], radius[todo], spacing)
        holder[todo] = np.where(held_by >= 0, held_by, holder[todo])
        if mesh.area > CLOUD * spacing**2:
            break
        todo = todo[radius[todo] * FINER < widest]
    wall = np.zeros(len(faces), bool)
    held = holder >= 0
    normals = mesh.face_normals
    wall[held] = -np.einsum("ij,ij->i", normals[faces[held]], normals[holder[held]]) >= OPPOSITE
    return 2 * radius, wall


def _shrunk(mesh, faces, radius, spacing):
    """The radii (f,) of balls that hold no point of a cloud, and the face that holds each (f,): -1 where none does."""
    from scipy.spatial import cKDTree

    place, owner = _cloud(mesh, spacing)
    tree = cKDTree(place)
    point, normal = mesh.vertices[mesh.faces[faces]].mean(axis=1), mesh.face_normals[faces]
    radius, holder = radius.copy(), np.full(len(faces), -1)
    todo = np.arange(len(faces))
    for _ in range(STEPS):
        # nearly nearest will do: in the middle of a ball, all of its surface is
        _, nearest = tree.query(point[todo] - radius[todo, None] * normal[todo], eps=SLACK)
        towards = point[todo] - place[nearest]
        depth = np.einsum("ij,ij->i", towards, normal[todo])
        square = np.einsum("ij,ij->i", towards, towards)
        # the ball that touches the face in its centroid and passes through the point found
        smaller = np.divide(square, 2 * depth, out=np.full(len(todo), np.inf), where=depth > 0)
        shrinks = smaller < radius[todo] * (1 - SLACK)
        todo, nearest, smaller = todo[shrinks], nearest[shrinks], smaller[shrinks]
        if len(todo) == 0:
            break
        radius[todo], holder[todo] = smaller, owner[nearest]
    return radius, holder


def _cloud(mesh: Mesh, spacing: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, 3) spread evenly over the area, about ``spacing`` apart, and the face of each (n,).

    At most CLOUD of them, further apart where that is not enough; the same ones every time.
    """
    cumulative = np.cumsum(mesh.face_areas)
    count = int(np.clip(np.ceil(cumulative[-1] / spacing**2), 1, CLOUD))
    number = np.arange(count)
    face = np.searchsorted(cumulative, (number + 0.5) / count * cumulative[-1])
    # the R2 sequence (Roberts 2018) fills a parallelogram evenly; the half beyond the triangle is folded back
    u, v = (0.7548776662466927 * number) % 1, (0.5698402909980532 * number) % 1
    beyond = u + v > 1
    u, v = np.where(beyond, 1 - u, u)[:, None], np.where(beyond, 1 - v, v)[:, None]
    a, b, c = mesh.vertices[mesh.faces[face]].swapaxes(0, 1)
    return a + u * (b - a) + v * (c - a), face
