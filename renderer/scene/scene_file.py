"""Scenes from TOML files: every key has one line here that says what it may hold."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sss_tools.errors import InputError
from sss_tools.keys import (
    Key,
    Kind,
    Place,
    did_you_mean,
    one_of,
    read_keys,
    read_variant,
    to_colour,
    to_number,
    to_text,
    to_vector,
    to_whole_numbers,
)
from sss_tools.loading import load_mesh
from sss_tools.medium import UNITS
from sss_tools.mesh import Mesh
from sss_tools.toml_file import read_toml

from .description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    HoleHandling,
    Light,
    Material,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    ShaderChoice,
    SphereLight,
)
from .environment_image import is_file, read_environment_image
from .fingerprint import with_hash
from .materials import read_material
from .transform import Matrix, read_transform, transformed

MOST_PIXELS = 2**26
"""The film keeps some 60 bytes a pixel: 4 GB at this size, 8192 x 8192."""

MOST_LIGHTS, MOST_OBJECTS = 10_000, 10_000
MOST_TRIANGLES = 2**28
"""Of all objects together; some 400 bytes each while light is traced."""

_ANYTHING = Kind("a table", lambda value: value)
_POSITION = Kind("three numbers", to_vector, lambda v: v.shape == (3,))
_DIRECTION = Kind("three numbers, not all zero", to_vector, lambda v: v.shape == (3,) and v.any())
_LIGHT = Kind("one number or three, each 0 or more", to_colour, lambda c: (c >= 0).all())
_HALF = Kind("[half width, half height], both above 0", to_vector, lambda h: h.shape == (2,) and h.min() > 0)
_UPWARD = np.array([0.0, 1.0, 0.0])

_FILE = {
    "scene": Key(_ANYTHING, {}),
    "camera": Key(_ANYTHING, None),
    "light": Key(_ANYTHING, []),
    "object": Key(_ANYTHING, []),
    "material": Key(_ANYTHING, {}),
}
_SCENE = {"unit": Key(one_of(UNITS), "mm")}
_CAMERA = {
    "position": Key(_POSITION),
    "target": Key(_POSITION),
    "up": Key(_DIRECTION, _UPWARD),
    "fov": Key(Kind("the vertical angle in degrees, above 0 and below 180", to_number, lambda a: 0 < a < 180)),
    "resolution": Key(
        Kind(f"[width, height], whole numbers from 1, at most {MOST_PIXELS} pixels", to_whole_numbers,
             lambda r: len(r) == 2 and min(r) >= 1 and r[0] * r[1] <= MOST_PIXELS), (500, 500)),
}  # fmt: skip
_LIGHTS = {
    "environment": {
        "radiance": Key(_LIGHT, None),
        "image": Key(Kind("the name of an image file", to_text), None),
        "rotation": Key(Kind("an angle in degrees", to_number), 0.0),
    },
    "point": {"position": Key(_POSITION), "intensity": Key(_LIGHT)},
    "directional": {"direction": Key(_DIRECTION), "irradiance": Key(_LIGHT)},
    "rectangle": {
        "center": Key(_POSITION),
        "target": Key(_POSITION),
        "up": Key(_DIRECTION, None),
        "half": Key(_HALF),
        "radiance": Key(_LIGHT),
    },
    "sphere": {
        "center": Key(_POSITION),
        "radius": Key(Kind("a radius above 0", to_number, lambda r: r > 0)),
        "radiance": Key(_LIGHT),
    },
}
_OBJECT = {
    "name": Key(Kind("a name", to_text), None),
    "mesh": Key(Kind("the name of a mesh file", to_text)),
    "material": Key(Kind("the name of a material", to_text)),
    "normals": Key(one_of(["flat", "smooth"]), "flat"),
    "transform": Key(_ANYTHING, {}),
    "shader": Key(one_of(["auto", "path", "plumb", "scalar"]), "auto"),
    "hole_handling": Key(one_of(["auto", "strict", "cap", "terminate", "surface"]), "auto"),
    "reflected_share": Key(Kind("a probability from 0.01 to 0.99", to_number, lambda p: 0.01 <= p <= 0.99), None),
}


@dataclass(frozen=True, eq=False)
class Placement:
    """An object of a scene file, before its mesh is read.

    material_name  what the file calls its material
    matrix         (4, 4) from mesh units to scene units, acting on columns
    place          where the file says so
    """

    name: str
    mesh_path: Path
    material: Material
    material_name: str
    matrix: Matrix
    normals: Literal["flat", "smooth"]
    shader: ShaderChoice
    hole_handling: HoleHandling
    reflected_share: float | None
    place: Place


@dataclass(frozen=True, eq=False)
class Outline:
    """What a scene file says, before any mesh is read."""

    unit: str
    camera: Camera
    lights: tuple[Light, ...]
    placements: tuple[Placement, ...]


def load_scene(path: str | Path) -> Scene:
    """The scene that a TOML file describes, meshes and images included, with its hash.

    Raises InputError, one line that names the file, the key and the table, for whatever cannot be rendered:
    syntax, unknown and missing keys, values out of range, degenerate cameras and transforms, missing or
    corrupt meshes and images, no object, no light.
    """
    path = Path(path)
    outline = read_outline(path)
    meshes: dict[Path, Mesh] = {}
    objects: list[SceneObject] = []
    triangles = 0
    for placement in outline.placements:
        objects.append(_object(placement, meshes))
        triangles += len(objects[-1].mesh.faces)
        if triangles > MOST_TRIANGLES:
            problem = f"its objects have more than {MOST_TRIANGLES} triangles up to {placement.place.name}"
            raise InputError(path, problem, "use fewer objects or simpler meshes")
    return with_hash(Scene(outline.unit, outline.camera, outline.lights, tuple(objects), path=path))


def read_outline(path: str | Path) -> Outline:
    """The scene that a TOML file describes, without its meshes. Raises InputError as ``load_scene`` does."""
    path = Path(path)
    document = Place(path, "the scene file")
    tables = read_keys(_parse(path), _FILE, document)
    if tables["camera"] is None:
        raise document.error("missing table [camera]", 'add it with "position", "target" and "fov"')
    unit = read_keys(tables["scene"], _SCENE, document.within("[scene]"))["unit"]
    camera = _camera(tables["camera"], document.within("[camera]"))
    lights = tuple(_light(table, place) for table, place in _entries(tables["light"], "light", path, MOST_LIGHTS))
    if not lights:
        raise document.error("there is no [[light]], so nothing would be lit", "add one")
    materials = _materials(tables["material"], unit, document)
    placements = _placements(tables["object"], materials, path)
    if not placements:
        raise document.error("there is no [[object]], so there is nothing to render", "add one")
    return Outline(unit, camera, lights, placements)


def _parse(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except FileNotFoundError:
        raise InputError(path, "there is no such scene file", "check the path") from None
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "give a readable TOML file") from None


def _entries(tables: Any, name: str, path: Path, most: int) -> list[tuple[Any, Place]]:
    """The tables of an array of tables, each with its place."""
    if not isinstance(tables, list):
        raise InputError(path, f"[{name}] is one table", f"write [[{name}]], for there may be several")
    if len(tables) > most:
        raise InputError(path, f"it has {len(tables)} [[{name}]], more than {most}", "use fewer")
    return [(table, Place(path, f"[[{name}]] {number}")) for number, table in enumerate(tables, 1)]


def _camera(table: Any, place: Place) -> Camera:
    camera = Camera(**read_keys(table, _CAMERA, place))
    view = camera.target - camera.position
    if not view.any():
        raise place.error(f'"position" equals "target" in {place.name}', "move one of them")
    if _parallel(view, camera.up):
        raise place.error(f'"up" in {place.name} is parallel to the line of sight', "turn it")
    return camera


def _parallel(a, b) -> bool:
    # below this angle, in radians, the roll would be left to rounding
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    return bool(np.linalg.norm(np.cross(a, b)) < 1e-6 * np.linalg.norm(a) * np.linalg.norm(b))


def _light(table: Any, place: Place) -> Light:
    kind, values = read_variant(table, _LIGHTS, place)
    if kind == "environment":
        return _environment(values, place)
    if kind == "rectangle":
        return _rectangle(values, place)
    if kind == "point":
        return PointLight(**values)
    return DirectionalLight(**values) if kind == "directional" else SphereLight(**values)


def _environment(values: dict[str, Any], place: Place) -> EnvironmentLight:
    if (values["radiance"] is None) == (values["image"] is None):
        found = "neither" if values["image"] is None else "both"
        raise place.error(f'{place.name} (environment) has {found} of "radiance" and "image"', "give one of them")
    if values["image"] is not None:
        values["image"] = read_environment_image(place.file.parent / values["image"])
    return EnvironmentLight(**values)


def _rectangle(values: dict[str, Any], place: Place) -> RectangleLight:
    view = values["target"] - values["center"]
    if not view.any():
        raise place.error(f'"center" equals "target" in {place.name} (rectangle)', "move one of them")
    if values["up"] is None:
        # a lamp overhead is no mistake where nothing was said about its roll
        values["up"] = np.array([0.0, 0.0, 1.0]) if _parallel(view, _UPWARD) else _UPWARD
    elif _parallel(view, values["up"]):
        problem = f'"up" in {place.name} (rectangle) is parallel to the direction of the light'
        raise place.error(problem, "turn it, or leave it out")
    return RectangleLight(**{**values, "half": tuple(values["half"].tolist())})


def _materials(tables: Any, unit: str, document: Place) -> dict[str, Material]:
    if not isinstance(tables, dict):
        raise InputError(document.file, "[material] is no table", "write [material.NAME]")
    places = {name: document.within(f"[material.{name}]") for name in tables}
    return {name: read_material(table, unit, places[name]) for name, table in tables.items()}


def _placements(tables: Any, materials: dict[str, Material], path: Path) -> tuple[Placement, ...]:
    placements: dict[str, Placement] = {}
    for table, place in _entries(tables, "object", path, MOST_OBJECTS):
        values = read_keys(table, _OBJECT, place)
        mesh_path = path.parent / values["mesh"]
        name = values["name"] or mesh_path.stem
        if name in placements:
            raise place.error(f'two objects have the name "{name}"', 'give each its own "name"')
        material = values["material"]
        if material not in materials:
            hint = did_you_mean(material, materials) if materials else f"add [material.{material}]"
            raise place.error(f'unknown material "{material}" in {place.name}', hint)
        placements[name] = Placement(
            name=name,
            mesh_path=mesh_path,
            material=materials[material],
            material_name=material,
            matrix=read_transform(values["transform"], place.within(f'"transform" of {place.name}')),
            normals=values["normals"],
            shader=values["shader"],
            hole_handling=values["hole_handling"],
            reflected_share=values["reflected_share"],
            place=place,
        )
    return tuple(placements.values())


def _object(placement: Placement, meshes: dict[Path, Mesh]) -> SceneObject:
    source = _mesh(placement.mesh_path, placement.place, meshes)
    return SceneObject(
        name=placement.name,
        mesh=_usable(transformed(source, placement.matrix), placement.mesh_path, placement.place),
        material=placement.material,
        mesh_path=placement.mesh_path,
        normals=placement.normals,
        shader=placement.shader,
        hole_handling=placement.hole_handling,
        reflected_share=placement.reflected_share,
        source=source,
    )


def _mesh(path: Path, place: Place, meshes: dict[Path, Mesh]) -> Mesh:
    """The mesh of a file, read once and kept in ``meshes``."""
    if not is_file(path):
        raise InputError(path, f"there is no such mesh, but {place.name} of {place.file} names it", "check the path")
    file = path.resolve()
    if file not in meshes:
        meshes[file] = load_mesh(path)
    return meshes[file]


def _usable(mesh: Mesh, path: Path, place: Place) -> Mesh:
    if len(mesh.faces) == 0:
        raise InputError(path, f"the mesh of {place.name} has no faces", "give a mesh with triangles")
    if not np.isfinite(mesh.vertices).all():
        raise InputError(path, f"the mesh of {place.name} has vertices that are not finite", "repair it")
    if not 0 < mesh.longest_side < float("inf"):
        raise InputError(path, f"the mesh of {place.name} has no extent", "check its vertices and the transform")
    return mesh
