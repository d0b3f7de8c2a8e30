"""Rung ``caps``: surface where it is missing, on simple loops of components that otherwise enclose a volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..enclosure import ENCLOSES
from ..topology import Topology
from .draft import Declined, Draft
from .fairing import fair, refine
from .judge import count_crossing_faces
from .triangulation import triangulate_loop
from .unite import directed_balance

SMOOTH_FROM = 12
"""Loops of at least so many edges that do not lie in a plane get a refined, faired cap."""

ENCLOSES_BESIDE = 0.6
"""Least winding number, somewhere, of an open sheet that is capped beside solids: half is what a flat one reaches."""

GRID = 20
"""Places along each side of the box where a sheet is asked whether it encloses anything."""


def cap_holes(draft: Draft) -> Draft | None:
    """Close the holes of every component that encloses a volume, its caps with it.

    What is missing is what every edge is run through too seldom in one of its directions: at holes, and at
    non-manifold edges where a wall ends. That is a cycle; it falls into simple loops, and each is capped.
    Raises Declined where no loop can be.
    """
    loops = missing_loops(draft)
    if not loops:
        return None
    flat = _with_caps(draft, loops, smooth=False)
    caps = np.arange(len(draft.faces), len(flat.faces))
    if len(caps) == 0:
        raise Declined(f"none of {len(loops)} loops can be triangulated")
    if all(len(loop) < SMOOTH_FROM for loop in loops):
        return flat
    smooth = _with_caps(draft, loops, smooth=True)
    return smooth if (count_crossing_faces(smooth.mesh) or 0) <= (count_crossing_faces(flat.mesh) or 0) else flat


def missing_loops(draft: Draft) -> list[NDArray[np.int64]]:
    """Simple closed curves over points, each in the direction in which the faces of its cap must run."""
    topology = draft.topology
    balance = directed_balance(topology)
    fit = enclosing_components(draft)
    component_of_edge = np.zeros(len(topology.edges), np.int64)
    component_of_edge[topology.face_edges[topology.live]] = topology.component_of_face[topology.live][:, None]
    edges = np.flatnonzero((balance != 0) & fit[component_of_edge])
    # an edge run through forwards too often lacks the way back
    ends = np.where(balance[edges, None] > 0, topology.edges[edges][:, ::-1], topology.edges[edges])
    return _simple_loops(np.repeat(ends, np.abs(balance[edges]), axis=0))


def enclosing_components(draft: Draft) -> NDArray[np.bool_]:
    """(c,) which components enclose a volume, caps supplied: roles other than sheet, or sheets that all but do.

    A sheet beside solids (a spout, a handle) needs to enclose less than one that is all there is.
    """
    assessment = draft.assessment
    fit = np.array([part.role != "sheet" for part in assessment.components], bool)
    least = ENCLOSES_BESIDE if fit.any() else ENCLOSES
    for number in np.flatnonzero(~fit):
        faces = draft.topology.faces[assessment.component_of_face == number]
        fit[number] = len(faces) > 3 and _winds_round_something(draft.topology.points, faces, least)
    return fit


def _winds_round_something(points, faces, least: float) -> bool:
    """Whether the winding number of the faces reaches ``least`` somewhere on a grid in their box."""
    from igl import fast_winding_number

    used, compact = np.unique(faces, return_inverse=True)
    corners = points[used]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    if (upper - lower).min() <= 1e-6 * (upper - lower).max():
        return False
    steps = (np.arange(GRID) + 0.5) / GRID
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    centre = (lower + upper) / 2
    places = lower + grid * (upper - lower) - centre
    winding = fast_winding_number(corners - centre, compact.reshape(-1, 3), places)
    return bool(np.nanmax(np.abs(winding)) >= least)


def _simple_loops(directed: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Directed edges (e, 2), as many into each point as out of it, taken apart into loops that visit a point once."""
    following: dict[int, list[int]] = {}
    for start, end in directed[::-1].tolist():
        following.setdefault(start, []).append(end)
    loops = []
    for start in list(following):
        while following[start]:
            path, place = [start], {start: 0}
            while True:
                ahead = following[path[-1]].pop()
                if ahead in place:
                    # the walk has come back to itself: what lies between is a loop
                    at = place[ahead]
                    loop, path = path[at:], path[: at + 1]
                    for point in loop[1:]:
                        del place[point]
                    if len(loop) >= 3:
                        loops.append(np.array(loop))
                    if at == 0 and not following[start]:
                        break
                    if at == 0:
                        continue
                else:
                    place[ahead] = len(path)
                    path.append(ahead)
    return loops


def _with_caps(draft: Draft, loops: list[NDArray[np.int64]], smooth: bool) -> Draft:
    """The draft with a cap on every loop that can be triangulated."""
    topology = draft.topology
    points, faces, birth = [draft.mesh.vertices], [topology.faces], [draft.birth]
    count, added, refused = len(draft.mesh.vertices), 0, 0
    on_rim = np.zeros(len(topology.points), bool)
    on_rim[np.concatenate(loops)] = True
    chords = topology.edges[on_rim[topology.edges].all(axis=1)]
    rim_face = _face_of_edge(topology)
    for loop in loops:
        cap = cap_loop(topology, loop, chords, smooth)
        if cap is None:
            refused += 1
            continue
        corners, triangles = cap
        number = np.concatenate([loop, count + np.arange(len(corners) - len(loop))])
        points.append(corners[len(loop) :])
        faces.append(number[triangles])
        chords = np.concatenate([chords, _edges(number[triangles])])
        birth.append(_nearest_rim_face(draft, topology, loop, corners[triangles].mean(axis=1), rim_face))
        count += len(corners) - len(loop)
        added += len(triangles)
    what = f"{len(loops) - refused} of {len(loops)} holes capped with {added} faces"
    return Draft(draft.source, np.concatenate(points), np.concatenate(faces), np.concatenate(birth), what)


def cap_loop(
    topology: Topology, loop: NDArray[np.int64], chords: NDArray[np.int64], smooth: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """A cap: corners (k, 3), those of the loop first, and triangles over them; None where there is none.

    loop    points in the direction in which the cap's faces run round it
    chords  (c, 2) pairs of points that are joined already
    smooth  refine and fair the caps of curved loops of ``SMOOTH_FROM`` edges and more
    """
    cap = triangulate_loop(topology.points[loop], _existing_chords(loop, chords))
    if cap is None:
        return None
    triangles, is_flat = cap
    corners = topology.points[loop]
    if smooth and not is_flat and len(loop) >= SMOOTH_FROM:
        corners, triangles = refine(corners, triangles)
        corners = fair(corners, triangles, len(loop), topology, loop)
    return corners, triangles


def _edges(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _existing_chords(loop: NDArray[np.int64], edges: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n, n) pairs of the loop's points that are joined by an edge already: a chord there would be a third face."""
    place = np.full(int(max(edges.max(), loop.max())) + 1, -1)
    place[loop] = np.arange(len(loop))
    a, b = place[edges].T
    both = (a >= 0) & (b >= 0)
    taken = np.zeros((len(loop), len(loop)), bool)
    taken[a[both], b[both]] = taken[b[both], a[both]] = True
    return taken


def _face_of_edge(topology) -> NDArray[np.int64]:
    """(e,) one face at each edge."""
    face = np.zeros(len(topology.edges), np.int64)
    face[topology.face_edges[topology.live]] = np.flatnonzero(topology.live)[:, None]
    return face


def _nearest_rim_face(draft, topology, loop, centroids, rim_face) -> NDArray[np.int64]:
    """The source face whose attributes each face of a cap continues: the one at the nearest rim edge."""
    from scipy.spatial import cKDTree

    pairs = np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1)
    keys = topology.edges[:, 0] * len(topology.points) + topology.edges[:, 1]
    edges = np.searchsorted(keys, pairs[:, 0] * len(topology.points) + pairs[:, 1])
    nearest = cKDTree(topology.points[pairs].mean(axis=1)).query(centroids)[1]
    return draft.birth[rim_face[edges[nearest]]]
