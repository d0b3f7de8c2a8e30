"""A scene as Mitsuba 3 reads it: XML, with meshes and the environment's image beside it.

Conventions that differ, and are bridged here: its index of air is 1.000277 unless said otherwise; its environment
images start at -z and put the first and last rows on the poles; its diffuse and mirror surfaces have one side; its
cameras clip at 1e-2 and 1e4 units.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sss_tools.contact import common_faces, lies_within
from sss_tools.errors import InputError
from sss_tools.mesh import Mesh
from sss_tools.writing import ply_bytes

from ..scene.description import (
    Camera,
    Diffuse,
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
from ..tracing.normals import corner_normals

ROULETTE_DEPTH = 1000
"""Bounces before Mitsuba plays roulette. Its weights grow from then on, which makes dense media noisy."""
_RAY_OFFSET = 9e-5
"""Mitsuba moves rays off surfaces by this times one plus the greatest coordinate, in scene units whatever the scale
(``math::RayEpsilon``, 1500 ulp)."""


@dataclass(eq=False)
class Export:
    """What to write.

    document  the XML
    files     by name relative to the XML, with / between folder and file
    warnings  what Mitsuba will do otherwise than this renderer
    """

    document: ET.Element
    files: dict[str, bytes] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def to_mitsuba(scene: Scene, folder: str, passes: int, seed: int = 0) -> Export:
    """The scene for Mitsuba 3.

    folder  for the files beside the XML, relative to it
    passes  camera samples a pixel; the XML takes others as ``mitsuba -Dspp=...``, and ``-Drr_depth=...``

    Raises InputError for more than one environment image, which Mitsuba cannot take.
    """
    export = Export(ET.Element("scene", version="3.0.0"))
    root = export.document
    ET.SubElement(root, "default", name="spp", value=str(passes))
    ET.SubElement(root, "default", name="rr_depth", value=str(ROULETTE_DEPTH))
    chromatic = not all(material.medium.is_achromatic for _, material in _translucent(scene))
    integrator = _plugin(root, "integrator", "volpathmis" if chromatic else "volpath")
    _value(integrator, "integer", "max_depth", -1)
    _value(integrator, "integer", "rr_depth", "$rr_depth")
    _camera(root, scene, seed)
    _environment(export, scene, folder)
    for light in scene.lights:
        _light(root, light)
    for number, thing in enumerate(scene.objects):
        _object(export, thing, f"{number:02d}_{_slug(thing.name)}", folder)
    export.warnings += list(_differences(scene))
    ET.indent(root)
    return export


# ---- camera ----


def _camera(root: ET.Element, scene: Scene, seed: int) -> None:
    camera = scene.camera
    nearest, farthest = _reach(scene, camera)
    sensor = _plugin(root, "sensor", "perspective")
    _value(sensor, "string", "fov_axis", "y")
    _value(sensor, "float", "fov", camera.fov)
    _value(sensor, "float", "near_clip", nearest)
    _value(sensor, "float", "far_clip", farthest)
    ET.SubElement(
        ET.SubElement(sensor, "transform", name="to_world"),
        "lookat", origin=_numbers(camera.position), target=_numbers(camera.target), up=_numbers(camera.up),
    )  # fmt: skip
    sampler = _plugin(sensor, "sampler", "independent")
    _value(sampler, "integer", "sample_count", "$spp")
    _value(sampler, "integer", "seed", seed)
    film = _plugin(sensor, "film", "hdrfilm")
    _value(film, "integer", "width", camera.resolution[0])
    _value(film, "integer", "height", camera.resolution[1])
    _value(film, "string", "pixel_format", "rgb")
    _value(film, "string", "component_format", "float32")
    _plugin(film, "rfilter", "box")


def _reach(scene: Scene, camera: Camera) -> tuple[float, float]:
    """Distances that hold all there is to see: a hundredth of the least, twice the greatest."""
    boxes = [thing.mesh.bounds for thing in scene.objects]
    for light in scene.lights:
        if isinstance(light, RectangleLight | SphereLight):
            radius = light.radius if isinstance(light, SphereLight) else float(np.linalg.norm(light.half))
            boxes.append(np.stack([light.center - radius, light.center + radius]))
    position = np.asarray(camera.position, float)
    outside = [np.linalg.norm(np.maximum(np.maximum(low - position, position - high), 0)) for low, high in boxes]
    farthest = max(np.linalg.norm(np.maximum(np.abs(low - position), np.abs(high - position))) for low, high in boxes)
    # a camera inside a box may have a surface right before it
    nearest = min(outside) / 100 or 1e-6 * farthest
    return float(nearest), float(2 * farthest)


# ---- lights ----


def _environment(export: Export, scene: Scene, folder: str) -> None:
    """All environments as one, the only one that Mitsuba takes."""
    environments = [light for light in scene.lights if isinstance(light, EnvironmentLight)]
    images = [light for light in environments if light.image is not None]
    constant = sum((light.radiance for light in environments if light.radiance is not None), np.zeros(3))
    if len(images) > 1:
        raise InputError(
            scene.path or "scene", "has several environment images, and Mitsuba takes one", "add them up in one image"
        )
    if not images:
        if environments:
            _colour(_plugin(export.document, "emitter", "constant"), "radiance", constant)
        return
    assert images[0].image is not None
    name = f"{folder}/environment.exr"
    export.files[name] = _exr(_with_rows_on_poles(images[0].image) + constant)
    emitter = _plugin(export.document, "emitter", "envmap")
    _value(emitter, "string", "filename", name)
    transform = ET.SubElement(emitter, "transform", name="to_world")
    # Mitsuba's first column looks along -z, ours along +z
    ET.SubElement(transform, "rotate", x="0", y="1", z="0", angle=_number(images[0].rotation + 180))


def _with_rows_on_poles(image: NDArray[np.float32]) -> NDArray[np.float64]:
    """(2 h + 1, w, 3) the same light for linear interpolation with the first and last rows on the poles.

    Ours has its h rows at the middles of h equal bands and is constant beyond the outermost. Rows at multiples of half
    a band hold every knot of that, so nothing changes between them.
    """
    height = len(image)
    row = np.clip(np.arange(2 * height + 1) / 2 - 0.5, 0, height - 1)
    upper = np.floor(row).astype(int)
    share = (row - upper)[:, None, None]
    return image[upper] * (1 - share) + image[np.minimum(upper + 1, height - 1)] * share


def _exr(image: NDArray) -> bytes:
    from pathlib import Path
    from tempfile import TemporaryDirectory

    import OpenEXR

    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    channels = {name: np.ascontiguousarray(image[..., k], np.float32) for k, name in enumerate("RGB")}
    # the library writes to names only
    with TemporaryDirectory() as place:
        path = Path(place, "environment.exr")
        OpenEXR.File(header, channels).write(str(path))
        return path.read_bytes()


def _light(root: ET.Element, light: Light) -> None:
    """A light that is no environment."""
    if isinstance(light, PointLight):
        emitter = _plugin(root, "emitter", "point")
        _point(emitter, "position", light.position)
        _colour(emitter, "intensity", light.intensity)
    elif isinstance(light, DirectionalLight):
        emitter = _plugin(root, "emitter", "directional")
        _value(emitter, "vector", "direction", _numbers(light.direction))
        _colour(emitter, "irradiance", light.irradiance)
    elif isinstance(light, RectangleLight):
        shape = _plugin(root, "shape", "rectangle")
        transform = ET.SubElement(shape, "transform", name="to_world")
        ET.SubElement(transform, "matrix", value=_numbers(rectangle_to_world(light).ravel()))
        _shining(shape, light.radiance)
    elif isinstance(light, SphereLight):
        shape = _plugin(root, "shape", "sphere")
        _point(shape, "center", light.center)
        _value(shape, "float", "radius", light.radius)
        _shining(shape, light.radiance)


def rectangle_to_world(light: RectangleLight) -> NDArray[np.float64]:
    """(4, 4) from the square [-1, 1]^2 that looks along +z to the light."""
    normal = _unit(np.asarray(light.target, float) - light.center)
    across = _unit(np.cross(light.up, normal))
    matrix = np.eye(4)
    matrix[:3] = np.stack(
        [light.half[0] * across, light.half[1] * np.cross(normal, across), normal, light.center], axis=1
    )
    return matrix


def _shining(shape: ET.Element, radiance: ArrayLike) -> None:
    """Emit from the front, reflect nothing."""
    _colour(_plugin(shape, "emitter", "area"), "radiance", radiance)
    _colour(_plugin(shape, "bsdf", "diffuse"), "reflectance", np.zeros(3))


# ---- objects ----


def _object(export: Export, thing: SceneObject, name: str, folder: str) -> None:
    opaque = not isinstance(thing.material, Translucent)
    # refraction is by facets here; only opaque surfaces are shaded smoothly
    smooth = opaque and thing.normals == "smooth"
    file = f"{folder}/{name}.ply"
    export.files[file] = ply_bytes(_with_normals(thing.mesh) if smooth else Mesh(thing.mesh.vertices, thing.mesh.faces))
    shape = _plugin(export.document, "shape", "ply")
    shape.set("id", name)
    _value(shape, "string", "filename", file)
    _value(shape, "boolean", "face_normals", str(not smooth).lower())
    if isinstance(thing.material, Translucent):
        _boundary(shape, thing.material)
        _medium(shape, thing.material)
        return
    bsdf = _plugin(shape, "bsdf", "twosided")
    if isinstance(thing.material, Diffuse):
        _colour(_plugin(bsdf, "bsdf", "diffuse"), "reflectance", thing.material.reflectance)
    else:
        mirror = _plugin(bsdf, "bsdf", "conductor")
        _value(mirror, "string", "material", "none")
        _colour(mirror, "specular_reflectance", thing.material.reflectance)


def _with_normals(mesh: Mesh) -> Mesh:
    """Every face with corners of its own that carry the vertex normals."""
    normals = corner_normals(mesh).reshape(-1, 3)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3), vertex_attributes={"normal": normals})


def _boundary(shape: ET.Element, material: Translucent) -> None:
    ior = material.medium.ior
    if ior == 1:
        _plugin(shape, "bsdf", "null")
        return
    bsdf = _plugin(shape, "bsdf", "roughdielectric" if material.roughness > 0 else "dielectric")
    if material.roughness > 0:
        _value(bsdf, "string", "distribution", "ggx")
        _value(bsdf, "float", "alpha", material.roughness)
    _value(bsdf, "float", "int_ior", ior)
    _value(bsdf, "float", "ext_ior", 1.0)


def _medium(shape: ET.Element, material: Translucent) -> None:
    medium = material.medium
    interior = _plugin(shape, "medium", "homogeneous")
    interior.set("name", "interior")
    _colour(interior, "albedo", medium.single_scattering_albedo)
    # Mitsuba takes colours up to 1 and a factor for all channels
    factor = float(medium.sigma_t.max())
    _colour(interior, "sigma_t", medium.sigma_t / factor)
    _value(interior, "float", "scale", factor)
    _value(interior, "boolean", "has_spectral_extinction", str(not medium.is_achromatic).lower())
    phase = _plugin(interior, "phase", "hg" if medium.g else "isotropic")
    if medium.g:
        _value(phase, "float", "g", medium.g)


# ---- what comes out different ----


def _differences(scene: Scene) -> Iterator[str]:
    """What Mitsuba does otherwise, a sentence each."""
    solids = _translucent(scene)
    for (one, _), (other, _) in combinations(solids, 2):
        if _overlap(one.mesh, other.mesh):
            yield (
                f"{one.name} and {other.name} overlap: here {one.name}, listed first, owns the overlap; Mitsuba "
                "takes whichever surface a path crossed last, and vacuum outside both"
            )
    for thing, material in solids:
        handling = thing.closedness.hole_handling if thing.closedness is not None else "strict"
        if handling != "strict":
            yield (
                f"{thing.name} is not closed, or not soundly (hole handling {handling}): Mitsuba has none, and paths "
                "will leak"
            )
        offset = _RAY_OFFSET * (1 + float(np.abs(thing.mesh.bounds).max()))
        length = min(float(1 / material.medium.sigma_t.max()), thing.mesh.longest_side)
        if length < 20 * offset:
            yield (
                f"Mitsuba moves rays off surfaces by {offset:.1g} units, not little against {length:.1g}, the mean "
                f"free path or size of {thing.name}: scale the scene up, or move it to the origin"
            )
    smooth = [thing.name for thing, material in solids if material.medium.ior != 1 and not material.roughness]
    if smooth and any(isinstance(light, PointLight | DirectionalLight) for light in scene.lights):
        yield (
            f"Mitsuba finds no light of point and directional lights through smooth boundaries: {', '.join(smooth)} "
            "will lack it"
        )


def _overlap(one: Mesh, other: Mesh) -> bool:
    lower = np.maximum(one.bounds[0], other.bounds[0])
    if (lower > np.minimum(one.bounds[1], other.bounds[1])).any():
        return False
    return lies_within(one, other) or lies_within(other, one) or len(common_faces(one, other)) > 0


def _translucent(scene: Scene) -> list[tuple[SceneObject, Translucent]]:
    return [(thing, thing.material) for thing in scene.objects if isinstance(thing.material, Translucent)]


# ---- XML ----


def _plugin(parent: ET.Element, tag: str, kind: str) -> ET.Element:
    return ET.SubElement(parent, tag, type=kind)


def _value(parent: ET.Element, tag: str, name: str, value) -> None:
    ET.SubElement(parent, tag, name=name, value=value if isinstance(value, str) else _number(value))


def _colour(parent: ET.Element, name: str, value: ArrayLike) -> None:
    _value(parent, "rgb", name, _numbers(value))


def _point(parent: ET.Element, name: str, value: ArrayLike) -> None:
    x, y, z = (_number(number) for number in np.asarray(value))
    ET.SubElement(parent, "point", name=name, x=x, y=y, z=z)


def _numbers(values: ArrayLike) -> str:
    return ", ".join(_number(value) for value in np.asarray(values, float))


def _number(value) -> str:
    """The shortest text that reads back the same."""
    return repr(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def _slug(name: str) -> str:
    """Letters, digits and dashes: Mitsuba puts values in place of $names, and refuses dots in ids."""
    return re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-")[:60] or "object"


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector)
