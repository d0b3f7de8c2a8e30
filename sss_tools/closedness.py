"""How closed a mesh is: its components and what each is for, its holes, and what to do at them.

Closed is a property of the solid, not of the file: a UV seam is no hole, a cavity is legitimate, a sheet
beside a solid takes nothing from it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from .interior import Interior, find_interior
from .intersection import self_intersections
from .mesh import Mesh
from .parts import Parts
from .patches import patch_of_face
from .roles import Role, find_roles
from .topology import Topology

State = Literal["closed", "holes", "open"]
Handling = Literal["strict", "cap", "terminate", "surface"]

FOLD = 0.02
"""Share of a component's area that may lie in folds where it passes through itself and still is no internal
geometry: such a fold is a self-intersection and nothing more."""


@dataclass(frozen=True)
class Hole:
    """One boundary loop of a component that encloses volume.

    edges      how many boundary edges it has
    perimeter  their length, mesh units
    area       of the loop: the size of its vector area, square mesh units; exact for a flat loop
    diameter   greatest distance between two of its points, mesh units
    centroid   mean of its edges weighted by length, mesh units
    """

    edges: int
    perimeter: float
    area: float
    diameter: float
    centroid: tuple[float, float, float]


@dataclass(frozen=True)
class Component:
    """Faces connected through edges.

    faces   how many
    role    solid; cavity (a void in a solid); internal (inside a solid, no cavity); sheet (encloses nothing)
    closed  no boundary edge after an exact weld
    volume  signed, cubic mesh units, negative where the normals point inwards (as a cavity's must): the
            volumes of all components add up to the mesh's. None where it is not closed
    """

    faces: int
    role: Role
    closed: bool
    volume: float | None


@dataclass(frozen=True)
class Closedness:
    """The verdict on a mesh; the fields are those of the JSON object ``closedness``.

    state               the worst among components that enclose volume; ``open`` where none does
    watertight          every edge has exactly two faces
    manifold            no edge has more than two faces, and no point joins several fans
    oriented            neighbours agree, and the normals of solids point outwards
    internal_geometry   surface found inside a solid that bounds no cavity
    self_intersecting   faces pass through each other or touch; None where nobody looked
    boundary_loops      connected components of the graph of boundary edges, in the whole file
    holes               the loops of components that enclose volume
    hole_area_fraction  area of the holes over the mesh's area
    hole_handling       what a renderer should do at them
    """

    state: State
    watertight: bool
    manifold: bool
    oriented: bool
    internal_geometry: bool
    self_intersecting: bool | None
    boundary_loops: int
    holes: tuple[Hole, ...]
    hole_area_fraction: float
    hole_handling: Handling

    @property
    def flagged(self) -> bool:
        """Whether counting surfaces may find more than one solid in a place."""
        return not (self.manifold and self.oriented) or self.internal_geometry or bool(self.self_intersecting)

    def to_json(self) -> dict[str, Any]:
        """As CONTRACTS section 2 has it: plain numbers, lists and strings."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Closedness:
        """The inverse of ``to_json``. Raises KeyError, TypeError or ValueError for anything else."""
        values = {field.name: data[field.name] for field in fields(cls)}
        values["holes"] = tuple(Hole(**{**hole, "centroid": tuple(hole["centroid"])}) for hole in values["holes"])
        if values["state"] not in get_args(State) or values["hole_handling"] not in get_args(Handling):
            raise ValueError(f"no such state or handling: {values['state']}, {values['hole_handling']}")
        return cls(**values)


@dataclass(frozen=True)
class Assessment:
    """A verdict and what it rests on.

    components          one for each of the topology's components, in its order
    inverted            (c,) whether a component is a solid whose normals point inwards
    sign                (c,) 1 where a component's normals point away from what it encloses, -1 where into it
    loop_is_hole        (l,) whether each of the topology's boundary loops bounds a hole
    interior            what lies inside solids
    component_of_face   (m,) as in the topology
    self_intersections  (p, 2) pairs of faces that meet elsewhere than in a common side or corner
    """

    closedness: Closedness
    components: tuple[Component, ...]
    inverted: NDArray[np.bool_]
    sign: NDArray[np.float64]
    loop_is_hole: NDArray[np.bool_]
    interior: Interior
    component_of_face: NDArray[np.int64]
    self_intersections: NDArray[np.int64]

    @property
    def volume(self) -> float | None:
        """Signed volume of a closed mesh, cubic mesh units; None where the mesh is not closed."""
        if self.closedness.state != "closed":
            return None
        return float(sum(component.volume or 0.0 for component in self.components))

    @property
    def matter(self) -> float | None:
        """Volume of the matter in a closed mesh, cubic mesh units, whichever way its shells are oriented; None where
        the mesh is not closed. What overlaps counts twice."""
        if self.closedness.state != "closed":
            return None
        signs = {"solid": 1, "cavity": -1, "internal": 0, "sheet": 0}
        return float(sum(signs[part.role] * abs(part.volume or 0.0) for part in self.components))

    def faces_of(self, components) -> NDArray[np.int64]:
        """Faces of the components with these numbers, in file order."""
        return np.flatnonzero(np.isin(self.component_of_face, components))


_ASSESSED: WeakKeyDictionary[Mesh, Assessment] = WeakKeyDictionary()
"""Of meshes that are still there: a check, the closing of holes and a repair ask for the same one."""


def assess(mesh: Mesh) -> Assessment:
    """Find the components, their roles and holes, and decide how closed the mesh is; once for each mesh.

    All it asks for are the welded points of ``mesh.topology`` and the faces over them.
    Raises ValueError for a mesh without faces or with coordinates that are not finite.
    """
    found = _ASSESSED.get(mesh)
    if found is None:
        found = _ASSESSED[mesh] = _assess(mesh)
    return found


def _assess(mesh: Mesh) -> Assessment:
    if len(mesh.faces) == 0:
        raise ValueError("a mesh without faces is neither open nor closed")
    if not np.isfinite(mesh.vertices[mesh.faces]).all():
        raise ValueError("closedness needs finite coordinates")
    topology = mesh.topology
    intersecting = self_intersections(topology)
    parts = Parts(topology)
    roles, inverted = find_roles(parts, intersecting)
    components = tuple(
        Component(len(faces), role, bool(closed), float(volume) if closed else None)
        for faces, role, closed, volume in zip(parts.groups, roles, parts.closed, parts.volumes, strict=True)
    )
    interior = _interior(parts, intersecting)
    loop_is_hole = np.array(
        [parts.encloses[parts.component_of_edge[loop[0]]] for loop in topology.boundary_loops], bool
    )
    loops = [loop for loop, hole in zip(topology.boundary_loops, loop_is_hole, strict=True) if hole]
    directed = _directed_edges(topology)
    holes = tuple(_measure(topology.points[directed[loop]]) for loop in loops)
    manifold = len(topology.nonmanifold_edges) == 0 and len(topology.pinched_points) == 0
    oriented = len(topology.misoriented_edges) == 0 and not inverted.any()
    internal = bool(interior) or "internal" in roles
    state: State = "open" if not parts.encloses.any() else "holes" if holes else "closed"
    closedness = Closedness(
        state=state,
        watertight=bool(len(topology.edges)) and bool((topology.faces_per_edge == 2).all()),
        manifold=manifold,
        oriented=oriented,
        internal_geometry=internal,
        self_intersecting=len(intersecting) > 0,
        boundary_loops=len(topology.boundary_loops),
        holes=holes,
        hole_area_fraction=sum(hole.area for hole in holes) / mesh.area if holes else 0.0,
        hole_handling=_handling(
            state, manifold and oriented and not internal, all(_is_simple(topology, loop) for loop in loops)
        ),
    )
    return Assessment(
        closedness, components, inverted, parts.sign, loop_is_hole, interior, topology.component_of_face, intersecting
    )


def _handling(state: State, flawless: bool, simple_loops: bool) -> Handling:
    """What to do at holes, from the state and the flags."""
    if state == "open":
        return "surface"
    if state == "holes":
        return "cap" if simple_loops else "terminate"
    return "strict" if flawless else "terminate"


def _interior(parts: Parts, intersecting: NDArray[np.int64]) -> Interior:
    """What lies inside solids; nothing can where a single manifold component that meets itself nowhere is all.

    intersecting  (p, 2) pairs of faces that meet others
    """
    cut = np.unique(intersecting)
    if parts.count < 2 and len(parts.topology.nonmanifold_edges) == 0 and len(cut) == 0:
        return Interior()
    component = parts.topology.component_of_face
    found = find_interior(parts.points, parts.faces, patch_of_face(parts.topology, cut), parts.shells, component, cut)
    # components that meet themselves and nothing else
    both = component[intersecting]
    folded = np.setdiff1d(both, both[both[:, 0] != both[:, 1]])
    small = [number for number in folded if _share(parts, found, number) < FOLD]
    return Interior(
        tuple(patch for patch in found.patches if component[patch[0]] not in small),
        found.faces[~np.isin(component[found.faces], small)],
        found.skipped,
    )


def _share(parts: Parts, found: Interior, number: int) -> float:
    """How much of a component's area, at most, lies inside."""
    faces = np.concatenate([*found.patches, found.faces])
    faces = faces[parts.topology.component_of_face[faces] == number]
    corners = parts.points[parts.faces[faces]]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(vectors, axis=1).sum() / 2 / parts.areas[number])


def _is_simple(topology: Topology, loop: NDArray[np.int64]) -> bool:
    """Whether boundary edges form one closed curve that runs through each of its points once."""
    _, uses = np.unique(topology.edges[loop], return_counts=True)
    return len(loop) >= 3 and bool((uses == 2).all())


def _measure(ends: NDArray[np.float64]) -> Hole:
    """Size and place of the hole bounded by edges with the end points (k, 2, 3)."""
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    perimeter = float(lengths.sum())
    centroid = (lengths / perimeter) @ ends.mean(axis=1)
    spokes = ends - centroid
    vector_area = np.cross(spokes[:, 0], spokes[:, 1]).sum(axis=0) / 2
    return Hole(
        edges=len(ends),
        perimeter=perimeter,
        area=float(np.linalg.norm(vector_area)),
        diameter=_diameter(spokes[:, 0]),
        centroid=(float(centroid[0]), float(centroid[1]), float(centroid[2])),
    )


def _directed_edges(topology: Topology) -> NDArray[np.int64]:
    """(e, 2) point pairs of all edges; a boundary edge runs the way its face does."""
    edges = topology.edges[:, ::-1].copy()
    forward = topology.face_edges[topology.side_direction]
    edges[forward] = topology.edges[forward]
    return edges


def _diameter(points: NDArray[np.float64]) -> float:
    """Greatest distance between two of (k, 3) points; of every so many where they are thousands."""
    points = points[:: len(points) // 2048 + 1]
    square = 0.0
    for start in range(0, len(points), 256):
        difference = points[start : start + 256, None] - points[None]
        square = max(square, float(np.einsum("psi,psi->ps", difference, difference).max()))
    return float(np.sqrt(square))
