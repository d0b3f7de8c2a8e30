"""The scene as rays see it: one Embree scene in a frame of unit size, and what each triangle belongs to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sss_tools.medium import Medium, diffuse_reflectance
from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET, RayCaster, UnitFrame

from ..scene.description import Scene, SceneObject, Translucent
from ..scene.lights import LightSet, PointSource
from .beam_generation import Facets
from .media import MediaTable
from .normals import SmoothNormals
from .refracted_beams import RefractedBeams
from .touching import grown_where_touching
from .unscattered import mirror_as_needed

Float32 = NDArray[np.float32]
MISS = np.float32(1e37)
"""Distance of rays that meet nothing, as Embree has it."""


@dataclass(frozen=True)
class TracedObject:
    """What the tracer knows of an object.

    index          its place in the scene
    first_triangle where its triangles begin among the scene's
    medium         coefficients per unit of the frame; None for opaque objects
    roughness      GGX alpha of the boundary
    reflected_share  probability of following the reflection at the boundary, NaN: the reflectance
    colour         (3, 1) reflectance of opaque objects, diffuse reflectance of the media of translucent ones
    shader         "path", "plumb", "scalar" or "diffuse" for translucent objects, "opaque" or "mirror"
    hole_handling  "strict", "cap", "terminate" or "surface"
    shells_add_up  closed (by caps, it may be) but flagged: surfaces inside the solid are counted, not taken for holes
    taken_for_closed  what contradicts its surface is a leak, not a hole
    lower, upper   (3, 1) bounding box in the frame
    """

    index: int
    first_triangle: int
    medium: Medium | None
    roughness: float
    reflected_share: float
    colour: Float32
    shader: str
    hole_handling: str
    shells_add_up: bool
    taken_for_closed: bool
    lower: Float32
    upper: Float32

    @property
    def transports(self) -> bool:
        """Whether light is followed through its inside."""
        return self.shader == "path"


@dataclass(frozen=True)
class LitCollisions:
    """How light is connected to the collisions in a medium, and not only met by its paths.

    areas   sky and lights with an extent, where the boundary does not bend rays
    inside  these, and lights without extent that stand in the medium or shine into it unbent
    facets  lights without extent, bent by smooth facets
    rough   lights without extent, through a rough boundary
    """

    areas: bool
    inside: bool
    facets: bool
    rough: bool


class TracedScene:
    """Geometry, lights and materials in the unit-size frame.

    Triangles of the objects come first, in scene order; those of rectangle lights come last.

    vertices         (n, 3) float32
    triangles        (t, 3) indices
    caster           the Embree scene
    triangle_object  (t,) int16 object index, -1 for lights
    triangle_normal  (3, t) float32 unit geometric normals, outward
    translucent      the objects whose inside light is followed through; their places here are the slots
    media            their media, by slot
    slot_of_triangle (t,) slot, -1 for lights, opaque objects and those with a faster shader
    reflectance      (3, objects) colour of each object
    frame            between the frame and scene units
    beams            light without extent behind smooth boundaries, one for each object and light
    holds_light      (points, slots + 1) bool, whether the object's box holds the place of a light without extent
    holds_sphere     (slots,) bool, whether a sphere light reaches into the object's box
    lit_collisions   by slot
    """

    def __init__(self, scene: Scene, shaders: list[str], hole_handling: list[str]):
        lower = np.min([thing.mesh.bounds[0] for thing in scene.objects], axis=0)
        upper = np.max([thing.mesh.bounds[1] for thing in scene.objects], axis=0)
        self.scene = scene
        self.frame = UnitFrame.around(lower, upper)
        self.lights = LightSet(scene.lights, self.frame)
        triangles = [thing.mesh.faces for thing in scene.objects]
        vertices = [self.frame.points_in(thing.mesh.vertices) for thing in scene.objects]
        vertices = grown_where_touching(vertices, triangles)
        self.objects = [
            self._traced(index, thing, shader, handling, points)
            for index, (thing, shader, handling, points) in enumerate(
                zip(scene.objects, shaders, hole_handling, vertices, strict=True)
            )
        ]
        owners = [np.full(len(thing.mesh.faces), index) for index, thing in enumerate(scene.objects)]
        self.first_light_triangle = sum(map(len, triangles))
        for rectangle in self.lights.rectangles:
            vertices.append(rectangle.vertices)
            triangles.append(rectangle.triangles)
            owners.append(np.full(len(rectangle.triangles), -1))
        offsets = np.cumsum([0] + [len(block) for block in vertices[:-1]])
        all_vertices = np.concatenate(vertices).astype(np.float32)
        all_triangles = np.concatenate([block + offset for block, offset in zip(triangles, offsets, strict=True)])
        self.vertices, self.triangles = all_vertices, all_triangles
        self.triangle_object = np.concatenate(owners).astype(np.int16)
        # from the rounded vertices, which are what Embree sees
        corners = all_vertices.astype(np.float64)[all_triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        self.triangle_normal = np.ascontiguousarray(normals.T, np.float32)
        self.triangle_plane = np.einsum("ij,ij->i", normals, corners.mean(axis=1)).astype(np.float32)
        self.reflectance = np.concatenate([thing.colour for thing in self.objects], axis=1)
        self.caster = RayCaster(all_vertices, all_triangles)
        self._edges = np.ascontiguousarray((corners[:, 1:] - corners[:, :1]).transpose(1, 2, 0), np.float32)
        self._corner = np.ascontiguousarray(corners[:, 0].T, np.float32)
        smooth = any(thing.normals == "smooth" for thing in scene.objects)
        self._smooth = SmoothNormals(scene.objects, len(all_triangles)) if smooth else None
        self.translucent = [thing for thing in self.objects if thing.transports]
        self.media = MediaTable([thing.medium for thing in self.translucent if thing.medium is not None])
        # the last entries serve lights (object -1) and opaque objects (slot -1)
        slot_of_object = np.full(len(self.objects) + 1, -1)
        slot_of_object[[thing.index for thing in self.translucent]] = np.arange(len(self.translucent))
        self.slot_of_triangle = slot_of_object[self.triangle_object]
        self.beams = [
            self._beams(thing, corners, normals, source)
            for thing in self.translucent
            for source in self.lights.points
            if thing.medium is not None and thing.medium.ior != 1 and thing.roughness == 0
        ]

        self.holds_light = np.zeros((len(self.lights.points), self.media.count + 1), bool)
        for row, source in zip(self.holds_light, self.lights.points, strict=True):
            if isinstance(source, PointSource):
                for slot, thing in enumerate(self.translucent):
                    within = (source.position > thing.lower) & (source.position < thing.upper)
                    row[slot] = within.all()

        self.holds_sphere = np.array([self._reached_by_spheres(thing) for thing in self.translucent], bool)
        self.lit_collisions = [self._lit_collisions(slot) for slot in range(self.media.count)]

    def _reached_by_spheres(self, thing: TracedObject) -> bool:
        centres = [sphere.center.ravel() for sphere in self.lights.spheres]
        nearest = [np.clip(centre, thing.lower, thing.upper) for centre in centres]
        gaps = [np.linalg.norm(centre - point) for centre, point in zip(centres, nearest, strict=True)]
        return any(gap <= sphere.radius for gap, sphere in zip(gaps, self.lights.spheres, strict=True))

    def _lit_collisions(self, slot: int) -> LitCollisions:
        ior = self.media.ior[slot]
        unbent = bool(ior == 1)
        areas = unbent and self.lights.sampled
        inside = areas or bool(unbent and self.lights.points) or bool(self.holds_light[:, slot].any())
        rough = bool(self.lights.points) and not unbent and self.translucent[slot].roughness > 0
        return LitCollisions(areas, inside, any(np.float32(beams.ior) == ior for beams in self.beams), rough)

    def _beams(self, thing: TracedObject, corners, normals, source) -> RefractedBeams:
        first = thing.first_triangle
        mine = slice(first, first + len(self.scene.objects[thing.index].mesh.faces))
        assert thing.medium is not None
        # faces without area have no normal, and light nothing
        facets = Facets(first, corners[mine], normals[mine])
        sigma_t = np.asarray(thing.medium.sigma_t, float)
        beams = RefractedBeams(facets, thing.medium.ior, source, float(sigma_t.min()), thing.lower, thing.upper)
        mirror_as_needed(self.caster, facets, beams, sigma_t)
        return beams

    def _traced(self, index: int, thing: SceneObject, shader: str, handling: str, points) -> TracedObject:
        material = thing.material
        if isinstance(material, Translucent):
            medium, roughness = material.medium.scaled(self.frame.scale), material.roughness
            colour = diffuse_reflectance(replace(medium, ior=1.0))
        else:
            medium, roughness, colour = None, 0.0, material.reflectance
        bounds = Mesh(points, thing.mesh.faces).bounds.astype(np.float32)
        closedness = thing.closedness
        closed = closedness is not None and closedness.state == "closed"
        shells_add_up = closedness is not None and closed and handling != "strict" and closedness.flagged
        first = sum(len(other.mesh.faces) for other in self.scene.objects[:index])
        return TracedObject(
            index=index,
            first_triangle=first,
            medium=medium,
            roughness=roughness,
            reflected_share=np.nan if thing.reflected_share is None else thing.reflected_share,
            colour=np.asarray(colour, np.float32).reshape(3, 1),
            shader=shader,
            hole_handling=handling,
            shells_add_up=shells_add_up,
            taken_for_closed=handling == "strict" or (handling == "cap" and closed),
            lower=bounds[0][:, None],
            upper=bounds[1][:, None],
        )

    def closest(self, origin: Float32, direction: Float32, limit: Float32 | None = None):
        """As ``RayCaster.closest``."""
        return self.caster.closest(origin, direction, limit)

    def met(
        self, origin: Float32, direction: Float32, limit: Float32 | None = None
    ) -> tuple[Float32, NDArray[np.int32]]:
        """As ``closest``, sphere lights included: triangle -2 - k is the k-th of them."""
        distance, triangle = self.closest(origin, direction, limit)
        self._meet_spheres(origin, direction, distance, triangle)
        return distance, triangle

    def met_with_place(self, origin: Float32, direction: Float32):
        """As ``RayCaster.closest_with_place``, sphere lights included."""
        distance, triangle, u, v = self.caster.closest_with_place(origin, direction)
        self._meet_spheres(origin, direction, distance, triangle)
        return distance, triangle, u, v

    def _meet_spheres(
        self, origin: Float32, direction: Float32, distance: Float32, triangle: NDArray[np.int32]
    ) -> None:
        """Put sphere lights where they are nearer than what was met, in place."""
        for k, sphere in enumerate(self.lights.spheres):
            reach = sphere.distance(origin, direction)
            nearer = reach < distance
            np.copyto(distance, reach, where=nearer)
            np.copyto(triangle, np.int32(-2 - k), where=nearer)

    def on_plane(self, position: Float32, triangle: NDArray[np.int32]) -> Float32:
        """(3, n) hit points moved back onto their triangle's plane.

        ``origin + t * direction`` is wrong by t's rounding, which for a camera a hundred object sizes away is
        more than the ray offset; what counts is the part along the normal.
        """
        normal = np.take(self.triangle_normal, triangle, axis=1)
        height = np.einsum("ij,ij->j", normal, position) - np.take(self.triangle_plane, triangle)
        return position - height * normal

    def shading_normal(self, position: Float32, triangle: NDArray[np.int32]) -> Float32:
        """(3, n) outward unit normals for shading: interpolated on objects that ask for it, else geometric."""
        normal = np.take(self.triangle_normal, triangle, axis=1)
        if self._smooth is None:
            return normal
        return self._smooth.interpolate(self.barycentric(position, triangle), triangle, normal)

    @property
    def faceted(self) -> bool:
        """Whether shading normals are those of the triangles, everywhere."""
        return self._smooth is None

    def corner_normals(self) -> Float32:
        """(t, 3, 3) what ``shading_normal`` interpolates: unit normals at the corners of each triangle."""
        flat = np.broadcast_to(self.triangle_normal.T[:, None], (len(self.triangles), 3, 3))
        return flat if self._smooth is None else self._smooth.corners(flat)

    def barycentric(self, position: Float32, triangle: NDArray[np.int32]) -> Float32:
        """(3, n) weights of the triangles' corners at points on them, each in [0, 1]."""
        first, second = (np.take(edge, triangle, axis=1) for edge in self._edges)
        offset = position - np.take(self._corner, triangle, axis=1)
        aa, ab, bb = (np.einsum("ij,ij->j", *pair) for pair in ((first, first), (first, second), (second, second)))
        ap, bp = (np.einsum("ij,ij->j", edge, offset) for edge in (first, second))
        whole = np.maximum(aa * bb - ab * ab, np.float32(1e-30))
        v, w = (bb * ap - ab * bp) / whole, (aa * bp - ab * ap) / whole
        weights = np.clip(np.stack([1 - v - w, v, w]), 0, 1)
        return weights / weights.sum(axis=0)

    def occluded(self, origin: Float32, direction: Float32, limit: Float32 | None = None) -> NDArray[np.bool_]:
        """As ``RayCaster.occluded``."""
        return self.caster.occluded(origin, direction, limit)


def offset_from(position: Float32, normal: Float32, side: Float32) -> Float32:
    """(3, n) ray origins just off a surface, on the side of ``normal`` that ``side`` (n,), +1 or -1, tells."""
    step = np.where(side > 0, RAY_OFFSET, -RAY_OFFSET).astype(np.float32, copy=False)
    return position + step * normal
