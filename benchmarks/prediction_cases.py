"""Cases to measure the errors of shaders in: shapes, media, lights and distances, drawn at random and always the same.

Used by ``calibrate_prediction.py``, which fits, and ``prediction.py``, which judges on other cases.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from renderer.enough import noise_seen
from renderer.pilot import SIDE, pilot
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    Translucent,
)
from renderer.shaders.appearance import Appearance, appearance
from renderer.shaders.prediction import Error
from renderer.shaders.selection import Measured
from renderer.study.studies import wedge
from sss_tools import shapes
from sss_tools.elephant import elephant
from sss_tools.errors import InputError
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh

MESHES = ("spot.obj", "rocker-arm.obj", "fandisk.obj", "homer.obj", "7_8ths_cube.stl", "suzanne.obj")
STORE = Path("out/prediction")
LARGEST = 40  # pixels
ROUNDS = (2, 4, 8, 16, 32, 64, 128, 256)
"""Passes after which the noise is measured, as a render does."""
ENOUGH = 3
"""Rounds that tell how long more passes take; the first has to build much."""


@dataclass(frozen=True)
class Case:
    """A case as it was measured.

    seen  passes, and the noise of a sample that so many showed, apart from what ``measured`` goes by
    """

    number: int
    name: str
    look: Appearance
    measured: Measured
    seen: tuple[tuple[int, Error], ...]


def measured_cases(seed: int, count: int, meshes: Path | None, threads: int, seconds: float) -> Iterator[Case]:
    """``count`` cases of a seed, from ``STORE`` (JSON lines) as far as they were measured before.

    seconds  of CPU that each half of the path shader's picture takes, about, and the passes that tell the noise
    """
    known, store = {}, STORE / f"cases_{seed}.jsonl"
    if store.exists():
        for line in store.read_text().splitlines():
            stored = json.loads(line)
            known[stored["number"]] = stored
    for number in range(count):
        if number not in known:
            known[number] = _measure(seed, number, meshes, threads, seconds)
            store.parent.mkdir(parents=True, exist_ok=True)
            with store.open("a") as file:
                file.write(json.dumps(known[number]) + "\n")
        if known[number].get("errors"):
            yield _case(known[number], seed, meshes)


def checked_scene(seed: int, number: int, meshes: Path | None) -> tuple[str, Scene]:
    """Name of the solid, and the scene around it."""
    rng = np.random.default_rng([seed, number])
    name, mesh = _solid(rng, meshes)
    return name, admit(_scene(rng, mesh))[0]


def _case(stored: dict, seed: int, meshes: Path | None) -> Case:
    """What was measured, with what is known of the scene now."""
    _, scene = checked_scene(seed, stored["number"], meshes)
    errors = {name: Error(*pair) for name, pair in stored["errors"].items()}
    seen = tuple((passes, Error(*pair)) for passes, *pair in stored["seen"])
    look = appearance(scene, scene.objects[0])
    return Case(stored["number"], stored["name"], look, Measured(errors, Error(*stored["noise"])), seen)


def _measure(seed: int, number: int, meshes: Path | None, threads: int, seconds: float) -> dict:
    name, scene = checked_scene(seed, number, meshes)
    thing = scene.objects[0]
    nothing = {"number": number, "name": name}
    if thing.closedness is None or thing.closedness.hole_handling == "surface":
        return nothing
    settings = Settings(seed=number, threads=threads)
    seen, samples = _seen(scene, replace(settings, seed=number + 1), seconds)
    passes = float(np.clip(samples / SIDE**2, 0.25, 64))
    found = pilot(scene, 0, settings, passes)
    if found is None or not seen:
        return nothing
    return {
        **nothing,
        "passes": passes,
        "errors": {shader: [error.error, error.bound, error.doubt] for shader, error in found.errors.items()},
        "noise": [found.noise.error, found.noise.bound],
        "seen": [[passes, error.error, error.bound] for passes, error in seen],
    }


def _seen(scene: Scene, settings: Settings, seconds: float) -> tuple[list[tuple[int, Error]], float]:
    """The noise of a sample as the first passes show it, and how many camera samples on the object take so many CPU
    seconds at once: the last paths of a run walk alone, however many there were."""
    things = (replace(scene.objects[0], shader="path"),)
    renderer = Renderer(replace(scene, objects=things, hash=""), settings, ROUNDS[-1])
    where = renderer.object_id == 0
    found: list[tuple[int, Error]] = []
    counts, taken = [0], [0.0]
    for first, last in zip((0, *ROUNDS), ROUNDS, strict=False):
        begun = time.process_time()
        renderer.run(range(first, last))
        counts.append((last - first) * max(int(where.sum()), 1))
        taken.append(time.process_time() - begun)
        noise = noise_seen(renderer.film, where)
        if noise is not None:
            found.append((last, noise))
        if sum(taken) > (seconds if len(taken) > ENOUGH else 4 * seconds):
            break
    each = max((taken[-1] - taken[-2]) / max(counts[-1] - counts[-2], 1), 0.1 * taken[-1] / counts[-1])
    return found, max(seconds - taken[-1], 0.0) / each + counts[-1] * min(4 * seconds / taken[-1], 1.0)


def _solid(rng, meshes: Path | None) -> tuple[str, Mesh]:
    kinds: dict[str, Callable[[], Mesh]] = {
        "ball": lambda: shapes.icosphere(1.0, int(rng.integers(2, 5))),
        "ellipsoid": lambda: shapes.ellipsoid((1.0, *rng.uniform(0.1, 1.0, 2)), 4),
        "box": lambda: shapes.box((1.0, *rng.uniform(0.2, 1.0, 2))),
        "slab": lambda: shapes.slab(1.0, np.exp(rng.uniform(np.log(0.02), np.log(0.5)))),
        "wedge": lambda: wedge(rng.uniform(10, 150)),
        "torus": lambda: shapes.torus(1.0, rng.uniform(0.15, 0.5)),
        "cylinder": lambda: shapes.cylinder(rng.uniform(0.15, 1.0), 1.0),
        "shell": lambda: shapes.hollow_ball(1.0, rng.uniform(0.3, 0.9), 4),
        "bumps": lambda: _bumps(rng.uniform(0.05, 0.25), rng.uniform(2, 6)),
        "elephant": lambda: elephant(0.04),
    }
    for file in MESHES:
        if meshes is not None and (meshes / file).exists():
            kinds[file] = lambda file=file: load_mesh(meshes / file)  # type: ignore[misc]
    name = list(kinds)[int(rng.integers(len(kinds)))]
    try:
        mesh = kinds[name]()
    except InputError:
        name, mesh = "ball", shapes.icosphere(1.0, 4)
    harm = rng.uniform()
    if harm < 0.12 and len(mesh.faces) >= 500:
        return f"{name}, rough", _roughened(rng, mesh)
    if harm < 0.24 and len(mesh.faces) >= 500 and name != "shell":
        centre = mesh.vertices[mesh.faces[int(rng.integers(len(mesh.faces)))][0]]
        return f"{name}, cut open", shapes.punctured(mesh, centre, rng.uniform(0.05, 0.3) * mesh.longest_side / 2)
    return name, mesh


def _roughened(rng, mesh: Mesh) -> Mesh:
    """Noise of the vertices, a share of the edges' length."""
    points = mesh.topology.points
    corners = points[mesh.topology.faces]
    edge = float(np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean())
    amplitude = np.exp(rng.uniform(np.log(0.03), np.log(0.8)))
    return Mesh(points + amplitude * edge * rng.normal(size=points.shape), mesh.topology.faces)


def _bumps(depth: float, waves: float) -> Mesh:
    ball = shapes.icosphere(1.0, 4)
    x, y, z = ball.vertices.T
    height = 1 + depth * np.sin(waves * x + 1) * np.sin(waves * y + 2) * np.sin(waves * z + 3)
    return Mesh(ball.vertices * height[:, None], ball.faces)


def _scene(rng, mesh: Mesh) -> Scene:
    """The mesh in a medium under lights, seen from somewhere."""
    tau = np.exp(rng.uniform(np.log(0.1), np.log(100)))
    albedo = 1 - np.exp(rng.uniform(np.log(1e-3), np.log(0.6), 3))
    g = rng.uniform(-0.9, 0.95) if rng.uniform() < 0.5 else 0.0
    ior = rng.choice([1.0, 1.3, 1.5, 1.8], p=[0.1, 0.3, 0.45, 0.15])
    medium = Medium.from_albedo(albedo, tau / mesh.mean_inradius, g, ior)
    middle, size = mesh.bounds.mean(axis=0), mesh.diagonal
    view, shine = (_direction(rng) for _ in range(2))
    pixels = np.exp(rng.uniform(np.log(6), np.log(LARGEST)))
    # one in seven from near, else so far that the longest side is so many pixels of 128 in 30 degrees
    distance = mesh.longest_side * 128 / (pixels * 2 * np.tan(np.radians(15)))
    fov, side = 30.0, 128
    if rng.uniform() < 1 / 7:
        distance, fov = size * rng.uniform(0.55, 1.2), 90.0
        side = max(round(pixels * 2 * distance / mesh.longest_side), 16)
    up = np.array([0.0, 1, 0]) if abs(view[1]) < 0.9 else np.array([1.0, 0, 0])
    camera = Camera(middle + distance * view, middle, up, fov, (side, side))
    dim = EnvironmentLight(radiance=np.full(3, rng.choice([0.1, 0.3])))
    lamp = RectangleLight(middle + 1.5 * size * shine, middle, _direction(rng), (0.8 * size,) * 2, np.full(3, 2.0))
    away = size / 2 * np.exp(rng.uniform(np.log(1.1), np.log(6)))
    lights = {
        "sky": (EnvironmentLight(radiance=np.ones(3)),),
        "sun": (DirectionalLight(-shine, np.full(3, 3.0)), dim),
        "sun alone": (DirectionalLight(-shine, np.full(3, 3.0)),),
        "lamp": (lamp, dim),
        "point": (PointLight(middle + away * shine, np.full(3, 3 * away**2)), dim),
        "point inside": (PointLight(middle + rng.uniform(0, 0.4) * size * shine, np.full(3, size**2 / 4)), dim),
    }
    chosen = lights[str(rng.choice(list(lights), p=[0.2, 0.25, 0.2, 0.15, 0.15, 0.05]))]
    thing = SceneObject("thing", mesh, Translucent(medium), normals="smooth")
    thing = replace(thing, normals="flat") if len(mesh.faces) < 500 else thing
    return Scene("mm", camera, chosen, (thing,))


def _direction(rng) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
