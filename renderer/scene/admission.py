"""May light go into these objects? Their closedness, from a record that can be trusted or from a check."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sss_tools.closedness import Closedness, assess
from sss_tools.errors import InputError
from sss_tools.record import read_record
from sss_tools.winding import winding_numbers

from .description import Scene, SceneObject, Translucent


def admit(scene: Scene) -> tuple[Scene, dict[str, str]]:
    """The scene with the closedness of its translucent objects, and by name where each verdict comes from.

    Raises InputError where the camera is inside an object: nothing would be right in that picture.
    """
    verdicts: dict[int, tuple[Closedness, str]] = {}
    objects, sources = [], {}
    for thing in scene.objects:
        if isinstance(thing.material, Translucent):
            _refuse_camera_inside(scene, thing)
            if thing.closedness is not None:
                sources[thing.name] = "checked before"
                objects.append(thing)
                continue
            key = id(thing.source if thing.source is not None else thing.mesh)
            if key not in verdicts:
                verdicts[key] = _verdict(thing)
            closedness, sources[thing.name] = verdicts[key]
            thing = replace(thing, closedness=closedness)
        objects.append(thing)
    return replace(scene, objects=tuple(objects)), sources


def _verdict(thing: SceneObject) -> tuple[Closedness, str]:
    # a record is of the mesh as the file has it; a transform changes neither topology nor nesting
    source = thing.source if thing.source is not None else thing.mesh
    record = read_record(thing.mesh_path, source) if thing.mesh_path is not None else None
    if record is not None:
        return record.closedness, "record"
    return assess(source).closedness, "checked now"


def _refuse_camera_inside(scene: Scene, thing: SceneObject) -> None:
    position = np.asarray(scene.camera.position, float)
    lower, upper = thing.mesh.bounds
    if np.all((position > lower) & (position < upper)):
        winding = float(winding_numbers(position, thing.mesh.vertices, thing.mesh.faces)[0])
        if abs(winding) > 0.5:
            raise InputError(
                scene.path or thing.mesh_path or "scene",
                f"the camera is inside the object {thing.name!r}",
                "move [camera] position out of it",
            )
