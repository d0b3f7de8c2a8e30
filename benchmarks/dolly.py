"""A camera that recedes: which shaders, how much they jump where they change, and what that saves against path alone.

    PYTHONPATH=. python benchmarks/dolly.py [--frames N] [--size PIXELS] [--quality Q] [--scene one|row] [-o FOLDER]

One object, or a row of twelve in four media, seen from ``--frames`` distances in equal ratios. The jump between two
frames is what the change of the shares alone does to the mean radiance of an object, each shader's picture taken from
the same place. Seconds are CPU seconds of the passes that the tolerance asks for, from a few measured ones, set-up left
out, against path alone at the same tolerance. Writes dolly_SCENE.json and dolly_SCENE.md into FOLDER.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import Camera, DirectionalLight, EnvironmentLight, Scene, SceneObject, Translucent
from renderer.shaders.selection import picture_passes
from sss_tools import shapes
from sss_tools.medium import Medium

MEDIA = {
    "marble": ((0.999, 0.998, 0.996), 12.0),
    "jade": ((0.9, 0.98, 0.93), 8.0),
    "milk": ((0.9995, 0.999, 0.995), 30.0),
    "wax": ((0.97, 0.9, 0.7), 5.0),
}
LIGHTS = (DirectionalLight(np.array([-1.0, -0.8, -0.5]), np.full(3, 2.5)), EnvironmentLight(radiance=np.full(3, 0.2)))
PASSES = 4


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--quality", type=float, default=0.4)
    parser.add_argument("--scene", choices=("one", "row"), default="one")
    parser.add_argument("--farthest", type=float, default=30.0, help="largest distance over the smallest")
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    options = parser.parse_args()
    scene = admit(one() if options.scene == "one" else row())[0]
    frames = []
    step = options.farthest ** (1 / max(options.frames - 1, 1))
    for k in range(options.frames):
        frames.append(measure(scene, step**k, step, options.size, options.quality))
        print(frames[-1]["shares"], f"{frames[-1]['jump']:.2%}", flush=True)
    auto, path = (sum(frame[name] for frame in frames) for name in ("seconds", "path_seconds"))
    figures = {
        "quality": options.quality,
        "size": options.size,
        "largest_jump": max(frame["jump"] for frame in frames),
        "path_over_auto": path / auto,
        "frames": frames,
    }
    options.output.mkdir(parents=True, exist_ok=True)
    name = f"dolly_{options.scene}"
    (options.output / f"{name}.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(figures)
    (options.output / f"{name}.md").write_text(text)
    print(text)


def body(name: str, medium: str, mesh) -> SceneObject:
    """A mesh in one of the media."""
    albedo, sigma_t = MEDIA[medium]
    return SceneObject(name, mesh, Translucent(Medium.from_albedo(np.array(albedo), sigma_t)), normals="smooth")


def one() -> Scene:
    """An ellipsoid of marble."""
    return _around([body("one", "marble", shapes.ellipsoid((1.0, 0.8, 0.7), 4))])


def row() -> Scene:
    """Twelve solids, three of each medium, one behind the other to the side."""
    solids = [shapes.icosphere(0.8, 4), shapes.ellipsoid((0.8, 0.5, 0.6), 4), shapes.torus(0.6, 0.25)]
    things = []
    for k in range(12):
        medium = list(MEDIA)[k % 4]
        things.append(body(f"{medium} {k // 4}", medium, shapes.moved(solids[k // 4], (0.6 * k - 3, 0, -1.9 * k))))
    return _around(things)


def _around(things: list[SceneObject]) -> Scene:
    camera = Camera(np.array([0, 1.0, 5]), np.zeros(3), np.array([0, 1.0, 0]), 30.0, (96, 96))
    return Scene("mm", camera, LIGHTS, tuple(things))


def measure(scene: Scene, ratio: float, step: float, size: int, quality: float) -> dict:
    """A frame: shares, passes, seconds, and the jump that the shares of the next frame would make in this one."""
    camera = replace(scene.camera, position=np.asarray(scene.camera.position) * ratio, resolution=(size, size))
    here, next_camera = replace(scene, camera=camera), replace(camera, position=camera.position * step)
    settings = Settings(quality=quality, threads=1)
    auto = Renderer(here, settings)
    following = Renderer(replace(scene, camera=next_camera), settings).plans
    passes, path_passes = picture_passes(auto.plans), picture_passes(
        Renderer(here, replace(settings, shader="path")).plans)  # fmt: skip
    seconds, _ = _pass(auto)
    path_seconds, path_film = _pass(Renderer(here, replace(settings, shader="path")))
    jump = 0.0
    means: dict[str, np.ndarray] = {"path": path_film.mean()}
    for index, (plan, then) in enumerate(zip(auto.plans, following, strict=True)):
        changes = {name: then.shares.get(name, 0.0) - plan.shares.get(name, 0.0) for name in plan.shares | then.shares}
        if not any(changes.values()):
            continue
        where = auto.object_id == index
        change = level = 0.0
        for name, rise in changes.items():
            if name not in means:
                means[name] = _by(here, name, settings)
            change += rise * float(means[name][where].mean()) if where.any() else 0.0
            level = max(level, float(means[name][where].mean()) if where.any() else 0.0)
        jump = max(jump, abs(change) / level if level else 0.0)
    return {
        "ratio": ratio,
        "shares": [plan.shares for plan in auto.plans],
        "size_px": [plan.size_px for plan in auto.plans],
        "passes": passes,
        "seconds": seconds * passes,
        "path_seconds": path_seconds * path_passes,
        "jump": jump,
    }


def _pass(renderer: Renderer):
    """CPU seconds of a pass, and the film."""
    renderer.run([0])
    start = time.process_time()
    renderer.run(range(1, 1 + PASSES))
    return (time.process_time() - start) / PASSES, renderer.film


def _by(scene: Scene, shader: str, settings: Settings) -> np.ndarray:
    objects = tuple(replace(thing, shader=shader) for thing in scene.objects)
    renderer = Renderer(replace(scene, objects=objects), settings)
    renderer.run(range(1 + PASSES))
    return renderer.film.mean()


def markdown(figures: dict) -> str:
    """A table of the frames."""
    rows = []
    for frame in figures["frames"]:
        shares = "; ".join(
            " + ".join(f"{100 * share:.0f} % {name}" if share < 1 else name for name, share in one.items())
            for one in frame["shares"]
        )
        rows.append(
            f"| {frame['ratio']:.3g} | {max(frame['size_px']):.0f} | {shares} | {frame['passes']} "
            f"| {frame['seconds']:.2g} | {frame['path_seconds']:.2g} | {100 * frame['jump']:.2f} % |"
        )
    table = "\n".join(rows)
    return f"""Quality {figures["quality"]:g}, {figures["size"]} pixels square. The largest jump from frame to frame is
{100 * figures["largest_jump"]:.2f} % of the object's radiance. Path alone takes {figures["path_over_auto"]:.1f} times
as long.

| distance | pixels across | shaders | passes | CPU s | path alone | jump |
|---:|---:|---|---:|---:|---:|---:|
{table}
"""


if __name__ == "__main__":
    main()
