"""How an object stands in the picture: its size in pixels, its depth in mean free paths, its shape and its light.

All that the predictions of errors and seconds go by; found from bounding box, areas and lights, without a ray.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from sss_tools.curvature import Folds, folds
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh

from ..scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    SphereLight,
    Translucent,
)


@dataclass(frozen=True)
class Appearance:
    """How an object stands in the picture and what its medium makes of its shape.

    distance   scene units
    footprint  side of a pixel at the object, scene units
    size_px    longest side of the bounding box, what the eye takes for an object's size, in pixels
    depth      tau, inradius in transport mean free paths
    diffusion  diffusion length, scene units
    aspect     longest over shortest extent
    unlit      share of the visible surface that the lights leave unlit
    even       share of the light on it that comes from environments
    absorbed   1 - albedo', what a collision takes from the light; mean of the channels
    roundness  36 pi V^2 / A^3: 1 for a ball, 0.5 for a cube, little for what is thin or has limbs
    sharp      share of its curvature in sharp edges, see ``sss_tools.curvature.Folds``
    concave    share of its curvature that bends inwards
    open       area of its holes over that of its surface; 0 for objects not checked yet
    g          mean cosine of scattering, mean of the channels
    ior        index of refraction, mean of the channels
    extended   share of the light on it that comes from rectangles and balls
    light_near radius of its bounding ball over the distance of each light, by irradiance: 0 for a sun, above 1 where
               a light is inside
    view_near  the same radius over the distance of the camera
    pixels     how many show it, as far as the picture reaches
    lights     how many shine on it
    """

    distance: float
    footprint: float
    size_px: float
    depth: float
    diffusion: float
    aspect: float
    unlit: float
    even: float = 0.0
    absorbed: float = 0.1
    roundness: float = 1.0
    sharp: float = 0.0
    concave: float = 0.0
    open: float = 0.0
    g: float = 0.0
    ior: float = 1.5
    extended: float = 0.0
    light_near: float = 0.0
    view_near: float = 0.0
    pixels: float = 1e4
    lights: int = 1


def appearance(scene: Scene, thing: SceneObject) -> Appearance:
    """How ``thing`` stands in the picture."""
    camera, mesh = scene.camera, thing.mesh
    lower, upper = mesh.bounds
    position = np.asarray(camera.position, float)
    nearest = np.clip(position, lower, upper)
    distance = float(np.linalg.norm(position - nearest))
    centre = mesh.bounds.mean(axis=0)
    footprint = pixel_footprint(camera, max(distance, 1e-6 * mesh.diagonal))
    depth, diffusion, absorbed, g, ior = 0.0, 0.0, 1.0, 0.0, 1.0
    if isinstance(thing.material, Translucent):
        medium = thing.material.medium
        depth, diffusion = _optical_size(medium, mesh.mean_inradius)
        absorbed = float(np.mean(1 - np.asarray(medium.reduced_albedo, float)))
        g, ior = float(np.mean(medium.g)), float(np.mean(medium.ior))
    radius = mesh.diagonal / 2
    lighting = _lighting(scene.lights, centre, position, mesh)
    away = float(np.linalg.norm(position - centre))
    in_the_middle = pixel_footprint(camera, max(away, footprint))
    bends = _folds(mesh)
    return Appearance(
        distance=distance,
        footprint=footprint,
        size_px=mesh.longest_side / in_the_middle,
        depth=depth,
        diffusion=diffusion,
        aspect=_aspect(mesh),
        unlit=lighting.unlit,
        even=lighting.even,
        absorbed=absorbed,
        roundness=_roundness(mesh),
        sharp=bends.sharp,
        concave=bends.concave,
        open=thing.closedness.hole_area_fraction if thing.closedness is not None else 0.0,
        g=g,
        ior=ior,
        extended=lighting.extended,
        light_near=lighting.near,
        view_near=radius / max(away, 1e-30) if radius > 0 else 0.0,
        pixels=_pixels(camera, mesh, in_the_middle),
        lights=max(len(scene.lights), 1),
    )


def pixel_footprint(camera: Camera, distance: float) -> float:
    """Side of the square that a pixel covers at ``distance``, in its unit."""
    return 2 * distance * float(np.tan(np.radians(camera.fov) / 2)) / camera.resolution[1]


def _roundness(mesh: Mesh) -> float:
    return min(36 * np.pi * mesh.volume**2 / mesh.area**3, 1.0) if mesh.area > 0 else 0.0


_NEAREST = 0.1
"""Least distance of a light from the surface that counts, in radii."""
_FOLDS: WeakKeyDictionary[Mesh, Folds] = WeakKeyDictionary()
"""Of meshes looked at before: the same in every frame."""


def _folds(mesh: Mesh) -> Folds:
    found = _FOLDS.get(mesh)
    if found is None:
        found = _FOLDS[mesh] = folds(mesh)
    return found


def _pixels(camera: Camera, mesh: Mesh, footprint: float) -> float:
    """A convex body shows a quarter of its surface in the mean (Cauchy); none more than its box or the picture."""
    width, height = camera.resolution
    sides = np.sort(mesh.bounds[1] - mesh.bounds[0])
    shown = min(mesh.area / 4, float(sides[1] * sides[2]) * 1.5) / footprint**2
    return float(min(shown, width * height))


def _aspect(mesh: Mesh) -> float:
    """Longest over shortest extent along the principal axes of the surface."""
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    weights = mesh.face_areas
    if weights.sum() == 0:
        return 1.0
    offset = centres - np.average(centres, axis=0, weights=weights)
    variances = np.maximum(np.linalg.eigvalsh((offset.T * weights) @ offset), 0)
    if variances[-1] == 0:
        return 1.0  # a single face
    return float(np.sqrt(variances[-1] / max(variances[0], 1e-12 * variances[-1])))


def _optical_size(medium: Medium, inradius: float) -> tuple[float, float]:
    """Inradius in transport mean free paths, and the diffusion length in the medium's unit; means of the channels."""
    extinction = np.asarray(medium.reduced_extinction, float)
    diffusion = (2 * medium.sigma_a + medium.reduced_scattering) / (3 * np.maximum(extinction, 1e-30) ** 2)
    # without absorption the body itself bounds how far light spreads
    length = np.sqrt(diffusion / np.maximum(medium.sigma_a, diffusion / max(inradius, 1e-30) ** 2))
    return inradius * float(extinction.mean()), float(length.mean())


@dataclass(frozen=True)
class _Lighting:
    """Of ``Appearance``: unlit, even, extended and light_near."""

    unlit: float = 0.0
    even: float = 0.0
    extended: float = 0.0
    near: float = 0.0


def _lighting(lights: tuple[Light, ...], centre, viewer, mesh: Mesh) -> _Lighting:
    """How a ball about ``centre`` that is as large as ``mesh`` is lit.

    Unlit is the share of its visible disk that faces away from the lights, each weighted by its irradiance: seen from
    V a ball lit from L shows (1 - cos(V, L))/2 of its disk unlit; environments leave nothing unlit.
    """
    unlit, extended, near, total, even = 0.0, 0.0, 0.0, 0.0, 0.0
    view = (viewer - centre) / max(float(np.linalg.norm(viewer - centre)), 1e-30)
    for light in lights:
        if isinstance(light, EnvironmentLight):
            seen = light.radiance if light.image is None else light.image
            even += np.pi * float(np.mean(seen)) if seen is not None else 0.0
            continue
        offset, irradiance = _from_light(light, centre, mesh.longest_side / 2)
        total += irradiance
        unlit += irradiance * (1 - float(offset @ view)) / 2
        if isinstance(light, RectangleLight | SphereLight):
            extended += irradiance
        if not isinstance(light, DirectionalLight):
            place = light.center if isinstance(light, RectangleLight | SphereLight) else light.position
            near += irradiance * min(mesh.diagonal / 2 / max(float(np.linalg.norm(place - centre)), 1e-30), 4.0)
    total += even
    return _Lighting(*(one / total for one in (unlit, even, extended, near))) if total > 0 else _Lighting()


def _from_light(
    light: PointLight | DirectionalLight | RectangleLight | SphereLight, centre, radius: float
) -> tuple[np.ndarray, float]:
    """Unit direction to a light from ``centre``, and its irradiance where it is nearest to the ball around it."""
    if isinstance(light, PointLight):
        offset, strength = light.position - centre, float(np.mean(light.intensity))
    elif isinstance(light, RectangleLight):
        offset, strength = light.center - centre, 4 * light.half[0] * light.half[1] * float(np.mean(light.radiance))
    elif isinstance(light, SphereLight):
        offset, strength = light.center - centre, np.pi * light.radius**2 * float(np.mean(light.radiance))
    else:
        direction = -np.asarray(light.direction, float)
        return direction / np.linalg.norm(direction), float(np.mean(light.irradiance))
    distance = max(float(np.linalg.norm(offset)), 1e-30)
    return offset / distance, strength / max(abs(distance - radius), _NEAREST * radius, 1e-30) ** 2
