"""Rung ``rebuild``: a new surface where the winding number is one half. The last resort."""

from __future__ import annotations

import numpy as np

from .draft import Declined, Draft, Points
from .holes import enclosing_components
from .judge import count_crossing_faces
from .nonmanifold import split_non_manifold
from .unite import unite

FINEST = 0.007
"""Edge of the grid as a share of the diagonal: corners lose about half of it, less than the ladder allows."""

POINTS = 600_000
"""Places at which manifold3d asks for the field, at most: each is a call of Python, some 4 us."""


def rebuild(draft: Draft) -> Draft | None:
    """The level set of the distance to the surface, signed by the generalised winding number, by manifold3d.

    Closes everything, keeps neither edges nor thin parts. The field is computed on a grid by libigl (fast winding
    numbers) and interpolated between. Faces get the attributes of the nearest face of the draft.
    Raises Declined where nothing encloses a volume, or a package is missing.
    """
    if not enclosing_components(draft).any():
        raise Declined("nothing encloses a volume")
    from igl import SignedDistanceType, point_mesh_squared_distance, signed_distance
    from manifold3d import Error, Manifold

    topology = draft.topology
    faces = topology.faces[topology.live]
    used, faces = np.unique(faces, return_inverse=True)
    centre = draft.mesh.bounds.mean(axis=0)
    points, faces = topology.points[used] - centre, faces.reshape(-1, 3)
    size = points.max(axis=0) - points.min(axis=0)
    # the grid of manifold3d has two points a cell
    edge = max(FINEST * draft.diagonal, float((2 * np.prod(size + 2 * FINEST * draft.diagonal) / POINTS) ** (1 / 3)))
    lower = points.min(axis=0) - 3 * edge
    shape = np.ceil((points.max(axis=0) + 3 * edge - lower) / edge).astype(int) + 1
    axes = [lower[k] + edge * np.arange(shape[k]) for k in range(3)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    field = signed_distance(places, points, faces, SignedDistanceType.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER)[0]
    if not np.isfinite(field).all():
        raise Declined("the winding number is not finite")
    bounds = [*(lower + edge), *(lower + edge * (shape - 2))]
    solid = Manifold.level_set(_interpolated(-field.reshape(shape), lower, edge), bounds, edge)
    if solid.status() != Error.NoError or solid.num_tri() == 0:
        raise Declined("manifold3d finds no surface")
    mesh = solid.to_mesh64()
    new_points = np.array(mesh.vert_properties[:, :3])
    new_faces = np.array(mesh.tri_verts).astype(np.int64)
    nearest = point_mesh_squared_distance(new_points[new_faces].mean(axis=1), points, faces)[1]
    birth = draft.birth[np.flatnonzero(topology.live)[nearest]]
    note = f"{len(new_faces)} faces at a resolution of {edge:.3g} units"
    rebuilt = Draft(draft.source, new_points + centre, new_faces, birth, note)
    # manifold3d lets sheets touch where they are closer than its grid: an exact weld brings that to light
    for clean in (unite, split_non_manifold) * 2:
        if _is_sound(rebuilt):
            break
        rebuilt = clean(rebuilt) or rebuilt
    return rebuilt.noted(note)


def _is_sound(draft: Draft) -> bool:
    topology = draft.topology
    manifold = len(topology.nonmanifold_edges) == 0 and len(topology.pinched_points) == 0
    return manifold and not count_crossing_faces(draft.mesh)


def _interpolated(field: Points, lower: Points, edge: float):
    """Trilinear interpolation as a function of three floats; plain numbers, since it is called one place at a time."""
    _, ny, nz = field.shape
    values = field.ravel().tolist()
    x0, y0, z0 = lower.tolist()
    step_y, step_x = nz, ny * nz
    last = [n - 2 for n in field.shape]

    def at(x: float, y: float, z: float) -> float:
        u, v, w = (x - x0) / edge, (y - y0) / edge, (z - z0) / edge
        i, j, k = min(int(u), last[0]), min(int(v), last[1]), min(int(w), last[2])
        u, v, w = u - i, v - j, w - k
        n = i * step_x + j * step_y + k
        a = values[n] + (values[n + 1] - values[n]) * w
        b = values[n + step_y] + (values[n + step_y + 1] - values[n + step_y]) * w
        n += step_x
        c = values[n] + (values[n + 1] - values[n]) * w
        d = values[n + step_y] + (values[n + step_y + 1] - values[n + step_y]) * w
        a += (b - a) * v
        c += (d - c) * v
        return a + (c - a) * u

    return at
