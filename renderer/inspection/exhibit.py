"""What is drawn, whoever draws it: coloured surfaces, strokes, spots to point at, and a legend.

All places are in the inspection's frame, so that single precision is enough wherever a mesh is and however large.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sss_tools.mesh import Mesh
from sss_tools.rays import UnitFrame

from . import palette, scenery
from .colouring import Legend, colour_faces
from .specimen import Inspection, Specimen
from .spots import SLIVER, Spot, find_spots
from .viewpoint import SAMPLES, Visibility, directions, framing, look_round

XRAY_SHARE = 0.1
"""Largest share of a mesh's faces that a hidden finding may have to shine through what is before it; one that lies
inside always does."""

BEHIND = 0.4
"""Share of the colour of backs in faces that are coloured for a reason."""
OUTLINED = 40
"""Most faces of a spot whose sides are drawn."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of one colour each.

    points   (n, 3) float32
    faces    (m, 3) int64
    colours  (m, 3) uint8 of the front
    number   of the specimen; -1 for what belongs to none
    source   (m,) number of each face in its mesh
    shining  (m,) bool: shows through what is before it
    """

    points: NDArray[np.float32]
    faces: NDArray[np.int64]
    colours: NDArray[np.uint8]
    number: int
    source: NDArray[np.int64]
    shining: NDArray[np.bool_]

    @property
    def backs(self) -> NDArray[np.uint8]:
        """(m, 3) colours seen from behind: all alike, but for faces that are coloured for a reason."""
        plain = (self.colours == palette.WALL).all(axis=1, keepdims=True)
        inside = np.array(palette.INSIDE, float)
        return np.where(plain, inside, self.colours + BEHIND * (inside - self.colours)).astype(np.uint8)

    def part(self, faces: NDArray) -> Surface:
        """Some of the faces, by index or as a mask."""
        return replace(
            self, faces=self.faces[faces], colours=self.colours[faces], source=self.source[faces],
            shining=self.shining[faces],
        )  # fmt: skip


def joined(surfaces: Sequence[Surface]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Points (n, 3) and faces (m, 3) of all surfaces, of which there must be one, in their order."""
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    faces = [surface.faces + offset for surface, offset in zip(surfaces, first[:-1], strict=True)]
    return np.concatenate([surface.points for surface in surfaces]), np.concatenate(faces)


@dataclass(frozen=True, eq=False)
class Strokes:
    """Lines of one colour, ``width`` pixels wide at any distance.

    ends     (k, 2, 3) float32
    shining  show through what is before them
    """

    ends: NDArray[np.float32]
    colour: palette.Colour
    width: float
    shining: bool = False


@dataclass(frozen=True, eq=False)
class Exhibit:
    """Everything to draw.

    reach       (n, 3) points that a view of the whole should hold
    visibility  which spots can be seen from where
    labels      places (3,) with a word for each: camera, lights, thresholds
    """

    inspection: Inspection
    frame: UnitFrame
    surfaces: tuple[Surface, ...]
    strokes: tuple[Strokes, ...]
    spots: tuple[Spot, ...]
    legend: Legend
    reach: NDArray[np.float64]
    visibility: Visibility
    labels: tuple[tuple[NDArray[np.float64], str, palette.Colour], ...] = field(default=())

    @property
    def inside(self) -> NDArray[np.bool_]:
        """(s,) spots that cannot be seen from anywhere outside."""
        return self.visibility.inside

    def overview(self, aspect: float):
        """The view that shows the whole, and of the findings as many as can be."""
        weights = np.array([_weight(spot) for spot in self.spots])
        return framing(directions()[self.visibility.best(weights)], self.reach, aspect)


def _weight(spot: Spot) -> float:
    return 0.0 if spot.waived else {"error": 1.0, "warning": 0.3, "info": 0.03}[spot.severity]


def put_together(inspection: Inspection, colour: str = "finding") -> Exhibit:
    """Make an exhibit. ``colour``: "finding", "thickness", "shader" or "component"."""
    frame = inspection.frame
    spots = tuple(find_spots(inspection))
    legend = Legend()
    surfaces = []
    shining = _shining_faces(inspection, spots)
    for number, specimen in enumerate(inspection.specimens):
        surfaces.append(_surface(number, specimen, frame, colour_faces(inspection, number, colour, legend)))
    visibility = look_round(list(spots), *joined(surfaces), [_samples(surfaces[spot.specimen], spot) for spot in spots])
    for spot, inside in zip(spots, visibility.inside, strict=True):
        if inside:
            shining[spot.specimen][spot.faces] = True
    surfaces = [replace(surface, shining=shining[surface.number][surface.source]) for surface in surfaces]
    reach = _reach(inspection, surfaces)
    for specimen in inspection.specimens:
        if specimen.cap is not None:
            surfaces.append(_cap(specimen.cap, frame))
            legend.add("holes", "cap", palette.CAP)
    strokes = [_edges(spot, inspection, frame) for spot in spots if len(spot.edges)]
    strokes += [_outline(s, inspection, frame) for s in spots if 0 < len(s.faces) <= OUTLINED and not len(s.edges)]
    labels: list = []
    if inspection.scene is not None and inspection.scene.path is not None:
        drawn = scenery.draw(inspection.scene, frame, inspection.specimens, np.concatenate(reach))
        strokes += [Strokes(ends, colour, width) for ends, colour, width in drawn.strokes]
        labels += drawn.labels
        reach.append(drawn.reach)
    points = np.concatenate(reach) if reach else np.zeros((1, 3))
    return Exhibit(inspection, frame, tuple(surfaces), tuple(strokes), spots, legend, points, visibility, tuple(labels))


def _surface(number: int, specimen: Specimen, frame: UnitFrame, colours: NDArray[np.uint8]) -> Surface:
    kept = np.flatnonzero(specimen.finite_faces())
    points = np.nan_to_num(frame.points_in(specimen.mesh.vertices), nan=0.0, posinf=0.0, neginf=0.0)
    return Surface(
        points.astype(np.float32), specimen.mesh.faces[kept], colours[kept], number, kept, np.zeros(len(kept), bool)
    )


def _cap(cap: Mesh, frame: UnitFrame) -> Surface:
    faces = cap.faces
    colours = np.broadcast_to(np.array(palette.CAP, np.uint8), faces.shape)
    points = frame.points_in(cap.vertices).astype(np.float32)
    return Surface(points, faces, colours, -1, np.arange(len(faces)), np.zeros(len(faces), bool))


def _edges(spot: Spot, inspection: Inspection, frame: UnitFrame) -> Strokes:
    points = frame.points_in(inspection.specimens[spot.specimen].mesh.vertices)[spot.edges]
    return Strokes(points.astype(np.float32), spot.colour, 5.0, shining=True)


def _outline(spot: Spot, inspection: Inspection, frame: UnitFrame) -> Strokes:
    """The sides of the faces of a small spot: faces without area or width show no colour."""
    mesh = inspection.specimens[spot.specimen].mesh
    faces = mesh.faces[spot.faces]
    sides = frame.points_in(mesh.vertices)[np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)]
    sides = sides[np.logical_and.reduce(np.isfinite(sides), axis=(1, 2))]
    return Strokes(sides.astype(np.float32), palette.mixed(spot.colour, palette.INK, 0.25), 2.0)


def _reach(inspection: Inspection, surfaces: list[Surface]) -> list[NDArray[np.float64]]:
    """Points of all that is looked at: where light enters some objects, floors and walls are only around them."""
    opaque = [s.plan is not None and s.plan.state is None for s in inspection.specimens]
    some = not all(opaque)
    return [
        surface.points[np.unique(surface.faces)].astype(float)
        for surface in surfaces
        if len(surface.faces) and not (some and opaque[surface.number])
    ]


def _shining_faces(inspection: Inspection, spots: tuple[Spot, ...]) -> list[NDArray[np.bool_]]:
    """For each mesh its faces of errors and warnings, unless they are a good part of it."""
    shining = [np.zeros(len(specimen.mesh.faces), bool) for specimen in inspection.specimens]
    for spot in spots:
        mask = shining[spot.specimen]
        if spot.severity != "info" and not spot.waived and len(spot.faces) < XRAY_SHARE * len(mask):
            mask[spot.faces] = True
    return shining


def _samples(surface: Surface, spot: Spot) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points on a spot, at most ``SAMPLES``, and the normals of the surface there."""
    chosen = spot.faces[np.linspace(0, len(spot.faces) - 1, min(SAMPLES, len(spot.faces))).astype(int)]
    place = np.searchsorted(surface.source, chosen)
    place = place[place < len(surface.source)]
    if not len(place):
        return spot.centre[None], spot.normal[None]
    corners = surface.points[surface.faces[place]].astype(float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return corners.mean(axis=1), np.divide(normal, length, out=np.zeros_like(normal), where=length > SLIVER)
