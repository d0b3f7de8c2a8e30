"""A camera that recedes: which shaders, how much they jump where they change, and what that saves against path alone.

    PYTHONPATH=. python benchmarks/dolly.py [--scene one|row] [--frames N] [--size PIXELS] [--quality Q] [--every N]
                                            [--work FOLDER] [-o FOLDER]

One object, or a row of twelve in four media, seen from ``--frames`` distances in equal ratios, or from one in
``--every`` of them. The jump between two frames is what the change of the shares alone does to the mean radiance of an
object, each shader's picture taken from the same place; its doubt is the standard error of that. Seconds are CPU
seconds of the passes, set-up left out, that ``sss-render --quality`` would make, against those of ``--shader path`` at
the same tolerance: both go by the noise of their first passes, and beyond ``MOST`` passes the rest is taken to be as
fast as those.

What was measured is kept in --work, and an interrupted run goes on there; remove it when a shader or the choice of
shaders has changed. Writes dolly_SCENE.json into --work, and from all of those there dolly.md into FOLDER, docs/ by
default.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from renderer.enough import passes_needed, rounds
from renderer.output.film import Film
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import Camera, DirectionalLight, EnvironmentLight, Scene, SceneObject, Translucent
from renderer.shaders.selection import CHEAPEST_FIRST, picture_passes, select
from sss_tools import shapes
from sss_tools.medium import Medium

MEDIA = {
    "marble": ((0.999, 0.998, 0.996), 12.0),
    "jade": ((0.9, 0.98, 0.93), 8.0),
    "milk": ((0.9995, 0.999, 0.995), 30.0),
    "wax": ((0.97, 0.9, 0.7), 5.0),
}
LIGHTS = (DirectionalLight(np.array([-1.0, -0.8, -0.5]), np.full(3, 2.5)), EnvironmentLight(radiance=np.full(3, 0.2)))
MOST = 32
"""Passes that are measured."""
TITLES = {"one": "One object", "row": "A row of twelve objects in four media"}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=("one", "row"), default="one")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--every", type=int, default=1, help="of the frames: the others are left out")
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--quality", type=float, default=0.4)
    parser.add_argument("--farthest", type=float, default=30.0, help="largest distance over the smallest")
    parser.add_argument("--work", type=Path, default=Path("out/dolly"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    scene = admit(one() if options.scene == "one" else row())[0]
    store = options.work / f"{options.scene}_{options.size}_{options.quality:g}_{options.frames}.jsonl"
    known = {one["frame"]: one for one in map(json.loads, store.read_text().splitlines())} if store.exists() else {}
    step = options.farthest ** (1 / max(options.frames - 1, 1))
    wanted = range(0, options.frames, options.every)
    for k in wanted:
        if k not in known:
            known[k] = {"frame": k, **measure(scene, step**k, step, options.size, options.quality)}
            with store.open("a") as file:
                file.write(json.dumps(known[k]) + "\n")
        told = {name: known[k][name] for name in ("passes", "seconds", "path_passes", "path_seconds", "jump", "doubt")}
        print(k, told, flush=True)
    frames = [known[k] for k in wanted]
    figures = {"quality": options.quality, "size": options.size, "every": options.every, "frames": frames}
    (options.work / f"dolly_{options.scene}.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(
        {
            name: json.loads(file.read_text())
            for name in TITLES
            if (file := options.work / f"dolly_{name}.json").exists()
        }
    )
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "dolly.md").write_text(text)
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
    auto, path = (Renderer(here, replace(settings, shader=shader)) for shader in ("auto", "path"))
    seconds, passes = rendered(auto)
    path_seconds, path_passes = rendered(path)
    following = select(replace(scene, camera=next_camera), quality)
    pictures = {"path": path.film}
    jump, doubt = 0.0, 0.0
    for index, (plan, then) in enumerate(zip(auto.plans, following, strict=True)):
        changes = {name: then.shares.get(name, 0.0) - plan.shares.get(name, 0.0) for name in plan.shares | then.shares}
        where = auto.object_id == index
        if not any(changes.values()) or not where.any():
            continue
        for name in changes:
            if name not in pictures:
                pictures[name] = _by(here, name, settings)
        means = {name: float(pictures[name].mean()[where].mean()) for name in changes}
        level = max(means.values())
        jumped = abs(sum(rise * means[name] for name, rise in changes.items())) / max(level, 1e-30)
        if jumped > jump:
            jump = jumped
            doubt = abs(changes.get("path", 0.0)) * _doubt(path.film, where) / level
    return {
        "ratio": ratio,
        "shares": [plan.shares for plan in auto.plans],
        "size_px": [plan.size_px for plan in auto.plans],
        "passes": passes,
        "seconds": seconds,
        "path_passes": path_passes,
        "path_seconds": path_seconds,
        "jump": jump,
        "doubt": doubt,
    }


def rendered(renderer: Renderer) -> tuple[float, int]:
    """CPU seconds and passes of a render by quality; of no more than ``MOST`` passes, the rest in proportion."""
    renderer.run([0])  # what is built at first use is set-up
    renderer.film = film = Film.blank(renderer.film.resolution, renderer.film.scene_hash, renderer.film.seed)
    seconds = 0.0
    for last, _ in rounds(renderer, picture_passes(renderer.plans)):
        start = time.process_time()
        renderer.run(range(film.passes, min(last, MOST)))
        seconds += time.process_time() - start
        if last > MOST:
            needed = max(passes_needed(film, renderer.object_id, renderer.plans), MOST)
            return seconds * needed / MOST, needed
    return seconds, film.passes


def _by(scene: Scene, shader: str, settings: Settings) -> Film:
    objects = tuple(replace(thing, shader=shader) for thing in scene.objects)
    renderer = Renderer(replace(scene, objects=objects), settings)
    renderer.run(range(MOST))
    return renderer.film


def _doubt(film: Film, where: np.ndarray) -> float:
    """Standard error of the mean over pixels; channels share their paths."""
    if film.passes < 2:
        return float("nan")
    return float(np.sqrt((film.stderr()[where].mean(axis=1) ** 2).sum())) / int(where.sum())


def markdown(found: dict[str, dict]) -> str:
    """The page."""
    return "# A camera that recedes\n\nMade by `benchmarks/dolly.py`.\n\n" + "\n".join(
        f"## {TITLES[name]}\n\n{_section(figures)}" for name, figures in found.items()
    )


def _section(figures: dict) -> str:
    """What came out, and a table of the frames."""
    frames = figures["frames"]
    rows = []
    for frame in frames:
        rows.append(
            f"| {frame['ratio']:.3g} | {max(frame['size_px']):.0f} | {_shaders(frame['shares'])} | {frame['passes']} "
            f"| {frame['seconds']:.2g} | {frame['path_passes']} | {frame['path_seconds']:.2g} "
            f"| {100 * frame['jump']:.2f} % |"
        )
    table = "\n".join(rows)
    worst = max(frames, key=lambda frame: frame["jump"])
    seconds, path_seconds = (sum(frame[name] for frame in frames) for name in ("seconds", "path_seconds"))
    number = "" if len(frames[0]["shares"]) == 1 else " (shaders: how many objects, in sum of their shares)"
    return f"""Quality {figures["quality"]:g}, {figures["size"]} pixels square, {_counted(figures)}{number}.
The largest jump from frame to frame that comes from a change of shaders is {100 * worst["jump"]:.2f} %
± {100 * worst["doubt"]:.2f} % of an object's radiance. Together the frames take {seconds:.3g} CPU seconds, by path
alone at the same tolerance {path_seconds:.3g}, {path_seconds / seconds:.3g} times as long.

| distance | pixels across | shaders | passes | CPU s | path: passes | CPU s | jump |
|---:|---:|---|---:|---:|---:|---:|---:|
{table}
"""


def _counted(figures: dict) -> str:
    """How many frames."""
    count, every = len(figures["frames"]), figures["every"]
    return f"{count} frames" if every == 1 else f"{count} frames, one in {every} of a sequence"


def _shaders(shares: list[dict[str, float]]) -> str:
    """Of one object its shares; of several how many each shader lights."""
    if len(shares) == 1:
        return " + ".join(f"{100 * share:.0f} % {name}" if share < 1 else name for name, share in shares[0].items())
    sums = {name: sum(one.get(name, 0.0) for one in shares) for name in CHEAPEST_FIRST}
    return ", ".join(f"{name} {count:.2g}" for name, count in sums.items() if count)


if __name__ == "__main__":
    main()
