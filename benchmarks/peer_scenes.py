"""The scenes on which speed is measured against other renderers: five public references, and three dense ones.

The dense ones are of our own making: mean free paths of 0.5 % of the size and less, albedo from 0.999 up, with a smooth
and a rough boundary, straight and forward scattering, small and large lights.
"""

from __future__ import annotations

from pathlib import Path

from sss_tools.elephant import elephant
from sss_tools.shapes import ellipsoid, torus
from sss_tools.writing import write_mesh

PUBLIC = ("p1_sphere", "p2_bunny_marble", "p3_bunny_backlit", "p4_slab", "p5_spot_matched")
DENSE = ("d1_elephant_marble", "d2_torus_white", "d3_ellipsoid_rough")

_SCENE = """# {name}: {note}
[camera]
position = [{camera}]
target = [{target}]
fov = 28.0
resolution = [128, 128]
{lights}
[[object]]
name = "{name}"
mesh = "{name}.ply"
material = "medium"

[material.medium]
type = "translucent"
{medium}
"""

_SKY = '\n[[light]]\ntype = "environment"\nradiance = {}\n'
_RECTANGLE = (
    '\n[[light]]\ntype = "rectangle"\ncenter = [1.2, 1.9, 1.4]\ntarget = [0.0, 0.5, 0.0]\nhalf = [0.7, 0.7]\n'
    "radiance = [3.0, 2.7, 2.4]\n"
)
_LAMP = '\n[[light]]\ntype = "sphere"\ncenter = [1.0, 1.4, 0.8]\nradius = 0.35\nradiance = [9.0, 8.0, 7.0]\n'


def public_scenes(shared: Path) -> dict[str, Path]:
    """The public reference scenes below ``shared``, by name; those that are there."""
    paths = {name: shared / "reference" / "scenes" / f"{name}.toml" for name in PUBLIC}
    return {name: path for name, path in paths.items() if path.is_file()}


def dense_scenes(folder: Path) -> dict[str, Path]:
    """Write the dense scenes with their meshes into ``folder``; their paths by name."""
    described = {
        "d1_elephant_marble": (
            elephant, "marble's albedo, mean free path 0.5 %, large light",
            {"camera": "0.5, 1.0, 2.6", "target": "0.0, 0.5, 0.1", "lights": _SKY.format(0.5) + _RECTANGLE,
             "medium": "albedo = [0.99904, 0.99844, 0.99764]\nsigma_t = 200.0\nior = 1.5"},
        ),
        "d2_torus_white": (
            lambda: torus(0.35, 0.15, 192, 96), "albedo 0.9995, mean free path 0.3 %, white sky",
            {"camera": "0.0, -1.6, 1.9", "target": "0.0, 0.0, 0.0", "lights": _SKY.format(1.0),
             "medium": "albedo = [0.9995, 0.9992, 0.999]\nsigma_t = 330.0\nior = 1.4"},
        ),
        "d3_ellipsoid_rough": (
            lambda: ellipsoid((0.5, 0.35, 0.25), 5), "GGX boundary, g 0.7, mean free path 0.4 %, a lamp and a dim sky",
            {"camera": "0.2, 0.8, 2.3", "target": "0.0, 0.0, 0.0", "lights": _SKY.format(0.1) + _LAMP,
             "medium": "albedo = [0.9996, 0.9994, 0.999]\nsigma_t = 250.0\ng = 0.7\nior = 1.45\nroughness = 0.3"},
        ),
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for name, (mesh, note, values) in described.items():
        paths[name] = folder / f"{name}.toml"
        if not (folder / f"{name}.ply").is_file():
            write_mesh(mesh(), folder / f"{name}.ply")
        paths[name].write_text(_SCENE.format(name=name, note=note, **values))
    return paths
