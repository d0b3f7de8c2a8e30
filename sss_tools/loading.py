"""Mesh files of strangers: read whole, or refused in one line.

Readers are lenient where a check must not be. A truncated STL comes back from them as an empty scene, a cut
OFF file as the part that is there, an OBJ face that names no vertex as something. So every file is held
against what it promises (``completeness``) before its geometry is believed.
"""

from __future__ import annotations

import io
import logging
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import completeness, gltf_structure, unfolding, xml_structure
from .errors import InputError
from .mesh import Body, Mesh
from .ply import read_ply
from .reading import read_file

if TYPE_CHECKING:
    import trimesh

    from .beside import FilesBeside

SUFFIXES = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf", ".3mf", ".dae")
"""The kinds of files ``load_mesh`` reads, in lower case."""

_NAMED_KINDS: dict[str, tuple[str, ...] | None] = {".obj": (".mtl",), ".gltf": None, ".glb": None}
"""Of the files that a mesh file names, those that are read for its geometry and the names of its materials."""

_SILENT = logging.NullHandler()
_REMEDY = "write it again from its source"


def load_mesh(path: str | Path) -> Mesh:
    """Read a mesh file.

    Nothing is merged or repaired. Vertices stay in file order, but for OBJ: there a vertex with several texture
    coordinates or normals becomes as many vertices, and one that no face uses is left out. Polygons become
    triangles. The bodies of a scene stand one after the other, placed by the scene's transforms; a mirroring
    transform turns its faces over so that they stay outward. Vertex attributes are "uv" (n, 2), "normal" (n, 3)
    and "color" (n, 4) uint8, each where all bodies have it.

    A file without faces is a mesh without faces. NaN and infinite coordinates are passed on as they are; a
    caller that computes with positions checks them first.

    Reads this file and, for OBJ and glTF, the files beside it that it names (material libraries and buffers, no
    images); nothing from elsewhere, nothing from the network. See ``unfolding`` for what small files may grow to.
    Raises InputError for a file that is missing, of no known kind, corrupt, holds less than it promises, unfolds to too
    much, or changes while it is read.
    """
    path = Path(path)
    data = _read(path)
    suffix = path.suffix.lower()
    try:
        # numbers that make no sense are refused or reported, not warned of on the terminal
        with np.errstate(all="ignore"):
            return _parse(path, suffix, data)
    except (MemoryError, InputError):
        raise  # says nothing about the file, or all there is to say
    # The parsers are not written against hostile files: a stray byte surfaces as any exception of numpy,
    # zipfile, json, lxml or collada, and each of them means the same to the user.
    except Exception as error:
        raise InputError(path, f"unreadable {suffix[1:]} file: {_reason(error)}", _REMEDY) from error


def _parse(path: Path, suffix: str, data: bytes) -> Mesh:
    """The mesh in a file's bytes. Raises whatever its parser does, ValueError where less is there than promised."""
    if suffix == ".ply":
        vertices, faces, attributes = read_ply(data)
        return Mesh(vertices, faces, (Body(path.stem, 0, len(faces)),), attributes, path)
    if suffix in (".gltf", ".glb"):
        data = gltf_structure.without_images(suffix, data)
    scene, promised = load_checked(path, data, _NAMED_KINDS.get(suffix, ()))
    _check_size(scene, len(data))
    mesh = _mesh_of_scene(scene, path)
    if promised is not None and len(mesh.faces) != promised:
        raise ValueError(f"corrupt: it has {promised} triangles, of which {len(mesh.faces)} make sense")
    return mesh


def load_checked(path: Path, data: bytes, named: tuple[str, ...] | None = None) -> tuple[trimesh.Scene, int | None]:
    """A mesh file of any kind but PLY as trimesh sees it, and how many triangles it promises where it says so.

    data   its bytes
    named  kinds of files beside it that it may name; None: all

    Raises whatever its parser does, ValueError for what is incomplete or unfolds to too much.
    """
    from .beside import FilesBeside

    suffix, beside = path.suffix.lower(), FilesBeside(path, named)
    data, promised = completeness.check(suffix, data)
    match suffix:
        case ".gltf" | ".glb":
            gltf_structure.check(suffix, data, beside.size)
        case ".3mf":
            xml_structure.check_archive(data)
        case ".dae":
            xml_structure.check_collada(data)
    return _load_scene(suffix, data, beside), promised


def _reason(error: Exception) -> str:
    """What a parser's exception means, in a few words."""
    message = str(error).strip().split("\n")[0][:200]
    if isinstance(error, FileNotFoundError):
        return f"it names '{message}', which is not in its folder"
    if isinstance(error, ValueError) and message:
        return message
    return f"it does not parse ({type(error).__name__}{': ' + message if message else ''})"


def _read(path: Path) -> bytes:
    """The file's bytes; InputError where there are none to have."""
    kinds = ", ".join(suffix[1:] for suffix in SUFFIXES)
    if path.is_dir():
        raise InputError(path, "is a folder, not a mesh file", "name a file in it")
    if path.suffix.lower() not in SUFFIXES:
        if not path.exists():
            raise InputError(path, "no such file", "check the path")
        raise InputError(path, f"'{path.suffix}' is no known kind of mesh file", f"use one of {kinds}")
    try:
        data = read_file(path)
    except FileNotFoundError:
        raise InputError(path, "no such file", "check the path") from None
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "check its permissions") from None
    if not data.strip():
        raise InputError(path, "the file is empty", _REMEDY)
    return data


def _load_scene(suffix: str, data: bytes, resolver: FilesBeside) -> trimesh.Scene:
    """The file as trimesh sees it."""
    import trimesh

    # what it has to say about a file, tracebacks included, goes to whoever listens and not to the terminal
    logging.getLogger("trimesh").addHandler(_SILENT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], resolver=resolver, process=False)


def _check_size(scene: trimesh.Scene, size: int) -> None:
    """Refuse bodies that are placed so often that they are far more than the file."""
    bytes_of = {
        name: 24 * (len(getattr(body, "vertices", ())) + len(getattr(body, "faces", ())))
        for name, body in scene.geometry.items()
    }
    if len(scene.graph.nodes_geometry) > unfolding.MOST_NODES:
        raise ValueError(f"its scene has more than {unfolding.MOST_NODES} bodies")
    unfolding.check_geometry(sum(bytes_of[scene.graph[node][1]] for node in scene.graph.nodes_geometry), size)


def _mesh_of_scene(scene: trimesh.Scene, path: Path) -> Mesh:
    """All bodies of a scene, placed, one after the other."""
    vertices: list[NDArray] = [np.zeros((0, 3))]
    faces: list[NDArray] = [np.zeros((0, 3), np.int64)]
    attributes: list[dict[str, NDArray]] = []
    bodies: list[Body] = []
    offset = first_face = 0
    nodes = list(scene.graph.nodes_geometry)
    for node in nodes:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        points = np.asarray(getattr(geometry, "vertices", np.zeros((0, 3))), np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or hasattr(geometry, "entities"):
            continue  # curves carry no surface
        corners = np.asarray(getattr(geometry, "faces", np.zeros((0, 3))), np.int64).reshape(-1, 3)
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
            raise ValueError(f"a face names vertex {_outside(corners, len(points))} of {len(points)}")
        carried = _attributes(geometry, len(points))
        if not np.array_equal(matrix, np.eye(4)):
            points, corners, carried = _place(matrix, points, corners, carried)
        vertices.append(points)
        faces.append(corners + offset)
        attributes.append(carried)
        title = path.stem if len(nodes) == 1 and name in (path.name, "geometry_0") else str(name)
        bodies.append(Body(title, first_face, len(corners), _material_name(geometry)))
        offset, first_face = offset + len(points), first_face + len(corners)
    shared = [name for name in ("uv", "normal", "color") if attributes and all(name in a for a in attributes)]
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(faces),
        tuple(bodies),
        {name: np.concatenate([carried[name] for carried in attributes]) for name in shared},
        path,
    )


def _outside(corners: NDArray[np.int64], count: int) -> int:
    """The first index that names no vertex."""
    return int(corners[(corners < 0) | (corners >= count)][0])


def _place(matrix: NDArray, points: NDArray, corners: NDArray, carried: dict[str, NDArray]):
    """A body moved by a scene's (4, 4) matrix; infinite coordinates may become NaN, reported alike."""
    linear = np.asarray(matrix, float)[:3, :3]
    with np.errstate(all="ignore"):
        points = points @ linear.T + matrix[:3, 3]
        if "normal" in carried:
            # normals go with the inverse transpose; the adjugate is that but for scale, and needs no inverse
            adjugate = np.stack([np.cross(linear[(i + 1) % 3], linear[(i + 2) % 3]) for i in range(3)])
            normals = carried["normal"] @ adjugate.T * np.sign(np.linalg.det(linear))
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
            carried = {**carried, "normal": normals}
        if np.linalg.det(linear) < 0:
            corners = corners[:, ::-1]
    return points, corners, carried


def _attributes(geometry: Any, count: int) -> dict[str, NDArray]:
    """What the body's vertices carry besides their position; nothing that trimesh would have to compute."""
    carried: dict[str, NDArray] = {}
    visual: Any = getattr(geometry, "visual", None)
    uv = getattr(visual, "uv", None)
    if uv is not None and np.shape(uv) == (count, 2):
        carried["uv"] = np.asarray(uv, np.float64)
    cache = getattr(geometry, "_cache", None)
    normals = cache.cache.get("vertex_normals") if cache is not None else None
    if normals is not None and np.shape(normals) == (count, 3):
        carried["normal"] = np.asarray(normals, np.float64)
    if getattr(visual, "kind", None) == "vertex" and np.shape(visual.vertex_colors) == (count, 4):
        carried["color"] = np.asarray(visual.vertex_colors, np.uint8)
    return carried


def _material_name(geometry) -> str | None:
    name = getattr(getattr(getattr(geometry, "visual", None), "material", None), "name", None)
    return str(name) if name else None
