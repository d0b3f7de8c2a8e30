"""What a rung did to the mesh: faults counted, cavities counted, the way from the old surface to the new one."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh
from ..rays import RAY_OFFSET, RayCaster, UnitFrame
from ..topology import Topology
from .draft import Draft

FARTHEST = 0.01
"""How far the visible surface may be from the result, as a share of the diagonal."""

SAMPLES = 3000
LOOKS = 24
SEEN = 2
"""From so many of ``LOOKS`` directions a point must be seen: one alone is a glance through a hole at what is inside."""

FAULTS = ("open_edges", "non_manifold_edges", "pinches", "disagreeing_edges", "inverted", "duplicates", "crossings")
"""The fields of ``Condition`` that count faults which no rung may add to, unless a later one sees to them."""


@dataclass(frozen=True)
class Condition:
    """Faults and measures of a mesh.

    open_edges, non_manifold_edges, pinches, disagreeing_edges  as the topology counts them
    inverted    solids whose normals point inwards
    duplicates  faces over the same three points as another
    crossings   faces that pass through or overlap each other; None where that could not be found out
    solids, cavities, internal, sheets  components of each role
    volume      by the divergence theorem, None where that is undefined: where faces do not run through each edge as
                often one way as the other, as at open edges and round a face that is there twice
    """

    faces: int
    area: float
    volume: float | None
    open_edges: int
    non_manifold_edges: int
    pinches: int
    disagreeing_edges: int
    inverted: int
    duplicates: int
    degenerates: int
    crossings: int | None
    solids: int
    cavities: int
    internal: int
    sheets: int

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    @property
    def is_solid(self) -> bool:
        """Whether nothing is left that the ladder mends."""
        return not any(getattr(self, name) for name in (*FAULTS, "internal", "sheets")) and self.solids > 0

    def faults(self) -> dict[str, int]:
        """How many of each kind there are, where there are any."""
        found = {name: getattr(self, name) or 0 for name in (*FAULTS, "internal", "sheets")}
        return {name: count for name, count in found.items() if count}


class Examined:
    """A draft with what is known about it, each found out once."""

    def __init__(self, draft: Draft):
        self.draft = draft

    @property
    def mesh(self) -> Mesh:
        """The geometry."""
        return self.draft.mesh

    @cached_property
    def crossings(self) -> int | None:
        """How many faces pass through others."""
        return count_crossing_faces(self.mesh)

    @cached_property
    def condition(self) -> Condition:
        """Everything counted."""
        topology, roles = self.mesh.topology, [part.role for part in self.draft.assessment.components]
        corners = np.sort(topology.faces[topology.live], axis=1)
        return Condition(
            faces=len(self.mesh.faces),
            area=self.mesh.area,
            volume=self.mesh.volume if _is_cycle(topology) else None,
            open_edges=len(topology.boundary_edges),
            non_manifold_edges=len(topology.nonmanifold_edges),
            pinches=len(topology.pinched_points),
            disagreeing_edges=len(topology.misoriented_edges),
            inverted=int(self.draft.assessment.inverted.sum()),
            duplicates=len(corners) - len(_distinct(corners)),
            degenerates=int((~topology.live).sum()),
            crossings=self.crossings,
            solids=roles.count("solid"),
            cavities=roles.count("cavity"),
            internal=roles.count("internal") + len(self.draft.assessment.interior.patches),
            sheets=roles.count("sheet"),
        )


def _is_cycle(topology: Topology) -> bool:
    """Whether faces run through every edge as often one way as the other."""
    edges, forward = topology.face_edges[topology.live].ravel(), topology.side_direction[topology.live].ravel()
    return not np.bincount(edges, np.where(forward, 1, -1), len(topology.edges)).any()


def count_crossing_faces(mesh: Mesh) -> int | None:
    """Faces that meet others elsewhere than in common corners and edges, exactly; None without libigl.

    Coordinates are taken as they are: the test is exact, and moving them to the centre would round them.
    """
    try:
        from igl.copyleft.cgal import remesh_self_intersections
    except ImportError:
        return None
    topology = mesh.topology
    faces = topology.faces[topology.live]
    if len(faces) < 2:
        return 0
    pairs = remesh_self_intersections(np.array(topology.points), np.array(faces), detect_only=True)[2]
    return len(np.unique(pairs))


class VisibleSurface:
    """Points on the part of a surface that can be seen from outside, and how far a result is from them."""

    def __init__(self, mesh: Mesh):
        self.diagonal = mesh.diagonal
        self.points = _visible_points(mesh)

    def distance_to(self, mesh: Mesh) -> float:
        """Greatest distance from the points to ``mesh``, as a share of the diagonal; infinite to no face."""
        if len(mesh.faces) == 0:
            return np.inf
        if len(self.points) == 0:
            return 0.0
        import igl

        square = igl.point_mesh_squared_distance(self.points, np.array(mesh.vertices), np.array(mesh.faces))[0]
        return float(np.sqrt(square.max())) / self.diagonal


def _visible_points(mesh: Mesh) -> NDArray[np.float64]:
    """Points spread evenly over the area from which rays in ``SEEN`` of ``LOOKS`` directions leave freely."""
    faces = mesh.faces[mesh.topology.live]
    areas = mesh.face_areas[mesh.topology.live]
    if len(faces) == 0 or areas.sum() <= 0:
        return np.empty((0, 3))
    cumulative = np.cumsum(areas)
    # evenly along the cumulative area; barycentric coordinates from a plastic sequence: the same every time
    place = (np.arange(SAMPLES) + 0.5) / SAMPLES * cumulative[-1]
    chosen = faces[np.searchsorted(cumulative, place)]
    u, v = (np.arange(SAMPLES)[:, None] * (0.7548776662466927, 0.5698402909980532) % 1).T
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    corner = mesh.vertices[chosen]
    points = corner[:, 0] + u[:, None] * (corner[:, 1] - corner[:, 0]) + v[:, None] * (corner[:, 2] - corner[:, 0])
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)

    frame = UnitFrame.around(*mesh.bounds)
    caster = RayCaster(frame.points_in(mesh.vertices), faces)
    inside, direction = frame.points_in(points), _directions(LOOKS)
    side = np.sign(normal @ direction.T)  # (s, looks): leave on the side the ray goes to
    origin = inside[:, None] + 4 * RAY_OFFSET * side[..., None] * normal[:, None]
    rays = np.broadcast_to(direction, origin.shape)
    blocked = caster.occluded(
        np.ascontiguousarray(origin.reshape(-1, 3).T, np.float32),
        np.ascontiguousarray(rays.reshape(-1, 3).T, np.float32),
    )
    return points[(~blocked.reshape(len(points), -1)).sum(axis=1) >= SEEN]


def _directions(count: int) -> NDArray[np.float64]:
    """(count, 3) directions spread evenly over the sphere (Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, k * np.pi * (1 + np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def _distinct(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    order = np.lexsort(rows.T)
    ordered = rows[order]
    fresh = np.ones(len(rows), bool)
    fresh[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return ordered[fresh]
