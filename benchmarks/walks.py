"""What each acceleration of walks in media brings, and what threads and the number of paths in flight do to speed.

    PYTHONPATH=. python benchmarks/walks.py [--passes N] [-o FOLDER]

An elephant, 100 x 100 pixels, lit by a dim sky and one large rectangle, in media from dark to white and from thin to
dense. Speed is CPU time of one thread; noise is the standard deviation of one sample over the mean, root mean square
over the pixels of the object; the gain is that of speed over noise squared against plain walks, set-up left out and
reported apart. Then the same under a sun, with a rough boundary: lit from collisions as well, or at the boundary alone.
Writes walks.json and walks.md into FOLDER, docs/ by default.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.first_figures import machine
from renderer.optics.ball_jump import ball_jumps
from renderer.optics.guided_flight import Guide
from renderer.scene.camera import CameraRays
from renderer.scene.description import DirectionalLight, Translucent
from renderer.scene.staging import stage_mesh
from renderer.strips import WholePass, traced_passes
from renderer.tracing.acceleration import Acceleration
from renderer.tracing.distance_grid import DistanceGrid
from renderer.tracing.memory import keep_freed_memory
from renderer.tracing.tally import Tally
from renderer.tracing.traced_scene import TracedScene
from renderer.wavefront import Wavefront
from sss_tools.elephant import elephant
from sss_tools.medium import Medium

SIZE = (100, 100)
RUNS = 3
MEDIA = {
    # albedo, mean free path as a share of the longest side
    "dark, thin": (0.6, 0.1),
    "dark": (0.6, 0.02),
    "grey": (0.9, 0.02),
    "light": (0.98, 0.02),
    "white": (0.998, 0.02),
    "white, dense": (0.999, 0.005),
}
ROUGHNESSES = (0.1, 0.3, 1.0)
SUNS = {"in front": (-1.0, -1.5, -1.0), "behind": (-0.6, -0.7, 1.0)}
"""The way their light goes; the camera looks along -z."""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passes", type=int, default=24)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    keep_freed_memory()
    mesh = elephant()
    measured = {name: measure(mesh, *medium, options.passes) for name, medium in MEDIA.items()}
    threads = {f"{name}, {block} paths": scaling(mesh, *MEDIA[name], block, options.passes)
               for name in ("grey", "white, dense") for block in (16384, 131072)}  # fmt: skip
    rough = [
        {"medium": name, "roughness": roughness, "sun": sun, **connected(mesh, *medium, roughness, sun, options.passes)}
        for name, medium in MEDIA.items()
        for roughness in ROUGHNESSES
        for sun in SUNS
    ]
    figures = {"machine": machine(2), "media": measured, "threads": threads, "rough": rough}
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "walks.json").write_text(json.dumps(figures, indent=1) + "\n")
    table = markdown(figures)
    (options.output / "walks.md").write_text(table)
    print(table)


def ready(mesh, albedo: float, mean_free_path: float, roughness: float = 0.0, lights=None):
    """The scene as the tracer sees it, and its camera; ``lights`` in place of the sky and the rectangle."""
    medium = Medium.from_albedo(albedo, 1 / (mean_free_path * mesh.longest_side), ior=1.5)
    staged = stage_mesh(mesh, medium, SIZE)
    body = replace(staged.objects[0], material=Translucent(medium, roughness))
    scene = replace(staged, objects=(body,), lights=lights or staged.lights)
    traced = TracedScene(scene, ["path"], ["strict"])
    return traced, CameraRays(scene.camera, traced.frame)


def measure(mesh, albedo: float, mean_free_path: float, passes: int) -> dict:
    """Speed, noise and cost of walks with each acceleration, and with what the renderer chooses."""
    traced, camera = ready(mesh, albedo, mean_free_path)
    medium = traced.translucent[0].medium
    sigma_t = float(medium.sigma_t[0])
    start = time.process_time()
    grid = DistanceGrid(traced.vertices, traced.triangles, 128)
    grid_seconds, start = time.process_time() - start, time.process_time()
    jumps = ball_jumps(medium.sigma_t, medium.single_scattering_albedo)
    tables_seconds = time.process_time() - start
    chosen = Acceleration.chosen(traced, 250_000)
    ways = {
        "plain": Acceleration.none(1),
        "grid": Acceleration(grid, (None,), (None,)),
        "jumps": Acceleration(grid, (jumps,), (None,)),
        "guide 0.5": Acceleration(None, (None,), (Guide.of(albedo, sigma_t, 0.5),)),
        "guide 0.75": Acceleration(None, (None,), (Guide.of(albedo, sigma_t, 0.75),)),
        "chosen": chosen,
    }
    rows = {name: way_measured(traced, camera, way, passes) for name, way in ways.items()}
    for row in rows.values():
        row["gain"] = gain(row, rows["plain"])
    return {"albedo": albedo, "mean_free_path": mean_free_path, "grid_seconds": grid_seconds,
            "tables_seconds": tables_seconds, "chosen": describe(chosen), "ways": rows}  # fmt: skip


def connected(mesh, albedo: float, mean_free_path: float, roughness: float, sun: str, passes: int) -> dict:
    """Speed and noise with collisions connected to a sun through the boundary, and gain over the boundary alone."""
    lights = (DirectionalLight(np.array(SUNS[sun]), np.full(3, 3.0)),)
    rows = []
    for through in (True, False):
        traced, camera = ready(mesh, albedo, mean_free_path, roughness, lights)
        if not through:
            traced.lit_collisions = [replace(lit, rough=False) for lit in traced.lit_collisions]
        rows.append(way_measured(traced, camera, Acceleration.chosen(traced, 250_000), passes))
    row, alone = rows
    return {**row, "alone": alone, "gain": gain(row, alone)}


def gain(row: dict, over: dict) -> float:
    """How much less CPU time the same noise of a picture takes."""
    return row["speed"] / row["noise"] ** 2 * over["noise"] ** 2 / over["speed"]


def passes_of(tracer: Wavefront, passes: range) -> tuple[list[WholePass], Tally]:
    """Of the whole picture."""
    return traced_passes(tracer, passes, np.arange(SIZE[0] * SIZE[1]), 2**13)


def way_measured(traced: TracedScene, camera: CameraRays, way: Acceleration, passes: int) -> dict:
    """Median CPU speed of a few runs, and the noise of all of them."""
    pixels = SIZE[0] * SIZE[1]
    tracer = Wavefront(traced, camera, {}, 1, acceleration=way)
    passes_of(tracer, range(10**6, 10**6 + 2))
    seconds, samples, tally = [], [], Tally()
    for run in range(RUNS):
        start = time.thread_time()
        made, tally = passes_of(tracer, range(run * passes, (run + 1) * passes))
        seconds.append(time.thread_time() - start)
        samples += [radiance for _, radiance, _ in made]
        shown = np.stack([first_object for _, _, first_object in made])
    inside = np.stack(samples).astype(float)[:, (shown == 0).all(axis=0)]
    mean, deviation = inside.mean(axis=0), inside.std(axis=0, ddof=1)
    walks = passes * inside.shape[1]
    return {
        "speed": passes * pixels / statistics.median(seconds),
        "noise": float(np.sqrt(np.mean(deviation**2) / np.mean(mean) ** 2)),
        "collisions": tally.collisions / walks,
        "rays": tally.rays / walks,
    }


def scaling(mesh, albedo: float, mean_free_path: float, block: int, passes: int) -> dict:
    """Samples a second of wall time on one thread and on two, each with work of its own; medians of a few runs."""
    traced, camera = ready(mesh, albedo, mean_free_path)
    way, pixels = Acceleration.chosen(traced, 250_000), SIZE[0] * SIZE[1]
    tracers = [Wavefront(traced, camera, {}, 1, block, way) for _ in range(2)]
    for tracer in tracers:
        passes_of(tracer, range(10**6, 10**6 + 2))
    speeds: dict[int, list[float]] = {1: [], 2: []}
    with ThreadPoolExecutor(2) as pool:
        for _ in range(RUNS):
            for threads in speeds:
                start = time.perf_counter()
                units = [
                    pool.submit(passes_of, tracers[k], range(k * passes, (k + 1) * passes)) for k in range(threads)
                ]
                for unit in units:
                    unit.result()
                speeds[threads].append(threads * passes * pixels / (time.perf_counter() - start))
    one, two = (statistics.median(speeds[threads]) for threads in (1, 2))
    return {"one": one, "two": two, "ratio": two / one}


def describe(way: Acceleration) -> str:
    """In words."""
    parts = ["jumps" if way.jumps[0] else "", f"guide {way.guides[0].share:g}" if way.guides[0] else ""]
    return " and ".join(part for part in parts if part) or "plain"


def markdown(figures: dict) -> str:
    """The tables."""
    lines = ["# Walks in media", "", "| medium | way | thousand samples / CPU s | noise | collisions | rays | gain |",
             "|---|---|---:|---:|---:|---:|---:|"]  # fmt: skip
    for name, medium in figures["media"].items():
        title = f"{name}: albedo {medium['albedo']:g}, mean free path {100 * medium['mean_free_path']:g} %"
        for way, row in medium["ways"].items():
            label = f"chosen: {medium['chosen']}" if way == "chosen" else way
            lines.append(
                f"| {title} | {label} | {row['speed'] / 1e3:.0f} | {row['noise']:.2f} | {row['collisions']:.1f} | "
                f"{row['rays']:.1f} | {row['gain']:.1f} |"
            )
    media = figures["media"].values()
    grids, tables = (", ".join(f"{medium[key]:.2f}" for medium in media) for key in ("grid_seconds", "tables_seconds"))
    lines += [
        "",
        f"CPU seconds of set-up, medium by medium: grid of 128 voxels {grids}; tables of the jumps {tables} "
        "(next to nothing where they are on disk already).",
        "",
        "| medium, paths in flight | thousand samples / s, one thread | two threads | ratio |",
        "|---|---:|---:|---:|",
    ]
    for name, row in figures["threads"].items():
        lines.append(f"| {name} | {row['one'] / 1e3:.0f} | {row['two'] / 1e3:.0f} | {row['ratio']:.2f} |")
    lines += [
        "",
        "Under a sun, with a rough boundary: collisions connected to it through the boundary (in brackets: the "
        "boundary alone).",
        "",
        "| medium | roughness | sun | thousand samples / CPU s | noise | gain |",
        "|---|---:|---|---:|---:|---:|",
    ]
    for row in figures["rough"]:
        alone = row["alone"]
        lines.append(
            f"| {row['medium']} | {row['roughness']:g} | {row['sun']} | {row['speed'] / 1e3:.0f} "
            f"({alone['speed'] / 1e3:.0f}) | {row['noise']:.2f} ({alone['noise']:.2f}) | {row['gain']:.1f} |"
        )
    about = figures["machine"]
    lines += [
        "",
        f"{about['processor']}; Python {about['python']}, NumPy {about['numpy']}. Made by `benchmarks/walks.py`.",
    ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
