"""A small scene as data, and as files that ``sss-render`` reads: what a point of a sweep is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

from .drawing import write

MEDIUM: dict[str, Any] = {"albedo": [0.95, 0.9, 0.8], "sigma_t": 20.0, "g": 0.0, "ior": 1.5}
"""Of all studies that sweep something else: mean free path 0.05 in objects of size 1."""
SUN: dict[str, Any] = {"type": "directional", "direction": [-0.6, -0.7, -0.5], "irradiance": 2.0}
SKY: dict[str, Any] = {"type": "environment", "radiance": 0.3}
CAMERA: dict[str, Any] = {"position": [0.0, 0.5, 3.0], "target": [0.0, 0.0, 0.0], "fov": 22.0, "resolution": [40, 40]}


@dataclass(frozen=True, eq=False)
class Case:
    """A scene of translucent objects of one medium.

    meshes  in scene units
    medium, lights, camera  tables of a scene file
    seed    of the pictures' random numbers, where that is what is swept
    """

    meshes: Sequence[Mesh]
    medium: Mapping[str, Any] = field(default_factory=lambda: MEDIUM)
    lights: Sequence[Mapping[str, Any]] = (SUN, SKY)
    camera: Mapping[str, Any] = field(default_factory=lambda: CAMERA)
    seed: int = 0

    def write(self, folder: Path, name: str) -> Path:
        """The scene file ``name``.toml with its meshes beside it; its path.

        Raises InputError where that cannot be written.
        """
        parts = [_table("[camera]", self.camera)]
        parts += [_table("[[light]]", light) for light in self.lights]
        for k, mesh in enumerate(self.meshes):
            mesh_name = f"{name}-{k}.ply"
            write_mesh(mesh, folder / mesh_name)
            parts.append(_table("[[object]]", {"name": f"object {k}", "mesh": mesh_name, "material": "medium"}))
        parts.append(_table("[material.medium]", {"type": "translucent", **self.medium}))
        path = folder / f"{name}.toml"
        write(path, "\n".join(parts).encode())
        return path


def _table(heading: str, values: Mapping[str, Any]) -> str:
    return "\n".join([heading, *(f"{key} = {_value(value)}" for key, value in values.items()), ""])


def _value(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(float(value))
    return f"[{', '.join(_value(one) for one in value)}]"
