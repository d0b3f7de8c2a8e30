"""Cases to measure the errors of shaders in: shapes, media, lights and distances, drawn at random and always the same.

Used by ``calibrate_prediction.py``, which fits, and ``prediction.py``, which judges on other cases.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from renderer.pilot import pilot
from renderer.render import Settings
from renderer.scene.admission import admit
from renderer.scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    RectangleLight,
    Scene,
    SceneObject,
    Translucent,
)
from renderer.shaders.appearance import Appearance, appearance
from renderer.shaders.prediction import Error
from renderer.shaders.selection import Measured
from sss_tools import shapes
from sss_tools.elephant import elephant
from sss_tools.errors import InputError
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh

MESHES = ("spot.obj", "rocker-arm.obj", "fandisk.obj", "homer.obj", "7_8ths_cube.stl")
PASSES = 16
LARGEST = 50  # pixels


@dataclass(frozen=True)
class Case:
    """A case as it was measured."""

    number: int
    name: str
    look: Appearance
    measured: Measured


def measured_cases(seed: int, count: int, meshes: Path | None, store: Path, threads: int) -> Iterator[Case]:
    """``count`` cases, from ``store`` (JSON lines) as far as they were measured before."""
    known = {}
    if store.exists():
        for line in store.read_text().splitlines():
            stored = json.loads(line)
            known[stored["number"]] = stored
    for number in range(count):
        if number not in known:
            known[number] = _measure(seed, number, meshes, threads)
            store.parent.mkdir(parents=True, exist_ok=True)
            with store.open("a") as file:
                file.write(json.dumps(known[number]) + "\n")
        if known[number].get("errors"):
            yield _case(known[number])


def _case(stored: dict) -> Case:
    errors = {name: Error(*pair) for name, pair in stored["errors"].items()}
    return Case(
        stored["number"], stored["name"], Appearance(**stored["look"]), Measured(errors, Error(*stored["noise"]))
    )


def _measure(seed: int, number: int, meshes: Path | None, threads: int) -> dict:
    rng = np.random.default_rng([seed, number])
    name, mesh = _solid(rng, meshes)
    scene = _scene(rng, mesh)
    checked, _ = admit(scene)
    thing = checked.objects[0]
    if thing.closedness is None or thing.closedness.hole_handling == "surface":
        return {"number": number, "name": name}
    found = pilot(checked, 0, Settings(seed=number, threads=threads), PASSES)
    if found is None:
        return {"number": number, "name": name}
    return {
        "number": number,
        "name": name,
        "look": asdict(appearance(checked, thing)),
        "errors": {shader: [error.error, error.bound] for shader, error in found.errors.items()},
        "noise": [found.noise.error, found.noise.bound],
    }


def _solid(rng, meshes: Path | None) -> tuple[str, Mesh]:
    kinds: dict[str, Callable[[], Mesh]] = {
        "ball": lambda: shapes.icosphere(1.0, 4),
        "ellipsoid": lambda: shapes.ellipsoid((1.0, *rng.uniform(0.2, 1.0, 2)), 4),
        "box": lambda: shapes.box((1.0, *rng.uniform(0.2, 1.0, 2))),
        "torus": lambda: shapes.torus(1.0, rng.uniform(0.15, 0.5)),
        "cylinder": lambda: shapes.cylinder(rng.uniform(0.15, 1.0), 1.0),
        "bumps": lambda: _bumps(rng.uniform(0.05, 0.25), rng.uniform(2, 6)),
        "elephant": elephant,
    }
    for file in MESHES:
        if meshes is not None and (meshes / file).exists():
            kinds[file] = lambda file=file: load_mesh(meshes / file)  # type: ignore[misc]
    name = list(kinds)[int(rng.integers(len(kinds)))]
    try:
        return name, kinds[name]()
    except InputError:
        return "ball", shapes.icosphere(1.0, 4)


def _bumps(depth: float, waves: float) -> Mesh:
    ball = shapes.icosphere(1.0, 4)
    x, y, z = ball.vertices.T
    height = 1 + depth * np.sin(waves * x + 1) * np.sin(waves * y + 2) * np.sin(waves * z + 3)
    return Mesh(ball.vertices * height[:, None], ball.faces)


def _scene(rng, mesh: Mesh) -> Scene:
    """The mesh in a medium under lights, seen from somewhere."""
    tau = np.exp(rng.uniform(np.log(0.5), np.log(40)))
    albedo = 1 - np.exp(rng.uniform(np.log(1e-3), np.log(0.6), 3))
    medium = Medium.from_albedo(albedo, tau / mesh.mean_inradius, 0.0, rng.choice([1.3, 1.5]))
    middle, size = mesh.bounds.mean(axis=0), mesh.diagonal
    view, shine = (_direction(rng) for _ in range(2))
    pixels = np.exp(rng.uniform(np.log(6), np.log(LARGEST)))
    # so far that the longest side is so many pixels of 128 in 30 degrees
    distance = mesh.longest_side * 128 / (pixels * 2 * np.tan(np.radians(15)))
    up = np.array([0.0, 1, 0]) if abs(view[1]) < 0.9 else np.array([1.0, 0, 0])
    camera = Camera(middle + distance * view, middle, up, 30.0, (128, 128))
    dim = EnvironmentLight(radiance=np.full(3, rng.choice([0.1, 0.3])))
    lamp = RectangleLight(middle + 1.5 * size * shine, middle, _direction(rng), (0.8 * size,) * 2, np.full(3, 2.0))
    lights = {
        "sky": (EnvironmentLight(radiance=np.ones(3)),),
        "sun": (DirectionalLight(-shine, np.full(3, 3.0)), dim),
        "sun alone": (DirectionalLight(-shine, np.full(3, 3.0)),),
        "lamp": (lamp, dim),
    }
    chosen = lights[str(rng.choice(list(lights)))]
    thing = SceneObject("thing", mesh, Translucent(medium), normals="smooth")
    thing = replace(thing, normals="flat") if len(mesh.faces) < 500 else thing
    return Scene("mm", camera, chosen, (thing,))


def _direction(rng) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
