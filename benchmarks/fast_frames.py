"""Frames of scalar and plumb against bare visibility, set-up by stage, and how steady the pictures are.

    python benchmarks/fast_frames.py [--mesh PATH] [--size N] [--runs N] [-o FOLDER]

One mesh in the light of ``sss-render MESH`` (albedo 0.9, mean free path 2 % of the longest side, index 1.5), after
set-up. Bare visibility is Embree alone on the same camera rays, one call a thread. All are timed in turn, run by run,
so that what else the machine does falls on all alike; given are medians. Processor seconds are of one thread.
Set-up is measured in a process of its own with cached tables. Writes fast_frames.json and fast_frames.md into FOLDER,
docs/ by default.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from first_figures import machine

from renderer.render import Renderer, Settings
from renderer.scene.description import Scene
from renderer.scene.staging import stage_mesh
from renderer.study.steadiness import change, displaced, finer, turned
from sss_tools.elephant import elephant
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh

SHADERS = ("scalar", "plumb")
GOALS = {"scalar": 2.0, "plumb": 4.0}


def main() -> None:
    """The command."""
    options = _options()
    if options.setup_of:
        print(json.dumps(_setup(options.setup_of, options.size)))
        return
    mesh = load_mesh(options.mesh) if options.mesh else elephant()
    scene = staged(mesh, options.size)
    figures = {
        "machine": machine(2),
        "mesh": options.mesh.stem if options.mesh else "elephant",
        "faces": len(mesh.faces),
        "size": options.size,
        "runs": options.runs,
        "seconds": {},
        "processor_seconds": _frames(scene, 1, options.runs, time.process_time),
        "setup": _setup_elsewhere(options.mesh, options.size),
        "steadiness": {shader: steadiness(scene, shader) for shader in SHADERS},
    }
    for threads in (1, 2):
        figures["seconds"][str(threads)] = _frames(scene, threads, options.runs, time.perf_counter)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "fast_frames.json").write_text(json.dumps(figures, indent=1) + "\n")
    table = markdown(figures)
    (options.output / "fast_frames.md").write_text(table)
    print(table)


def staged(mesh: Mesh, size: int) -> Scene:
    """The scene that is measured."""
    return stage_mesh(mesh, Medium.from_albedo(0.9, 1 / (0.02 * mesh.longest_side), ior=1.5), (size, size))


def _frames(scene: Scene, threads: int, runs: int, clock: Callable[[], float]) -> dict[str, float]:
    """Median seconds, by ``clock``, of bare visibility and of a frame of each shader."""
    renderers = {shader: Renderer(scene, Settings(shader=shader, threads=threads)) for shader in SHADERS}
    one = renderers["scalar"]
    direction = one.camera.centre_directions()
    origin = np.repeat(one.camera.origin[:, None], direction.shape[1], axis=1)
    parts = np.array_split(np.arange(direction.shape[1]), threads)
    rays = [(np.ascontiguousarray(origin[:, part]), np.ascontiguousarray(direction[:, part])) for part in parts]
    with ThreadPoolExecutor(threads) as pool:
        found: dict[str, list[float]] = {"bare": [], **{shader: [] for shader in SHADERS}}
        for index in range(runs + 1):
            todo: dict[str, Callable[[], object]] = {
                "bare": lambda: list((pool.map if threads > 1 else map)(lambda ray: one.traced.closest(*ray), rays))
            }
            for shader, renderer in renderers.items():
                todo[shader] = partial(renderer.run, [index])
            for name, do in todo.items():
                start = clock()
                do()
                found[name].append(clock() - start)
    # the first frame fills caches
    return {name: statistics.median(seconds[1:]) for name, seconds in found.items()}


def _setup(path: Path | str, size: int) -> dict[str, float]:
    """Seconds by stage, in this process, from loading to the first frame."""
    start = time.perf_counter()
    mesh = elephant() if path == "elephant" else load_mesh(Path(path))
    seconds = {"load": time.perf_counter() - start}
    scene = staged(mesh, size)
    for shader in SHADERS:
        renderer = Renderer(scene, Settings(shader=shader, threads=2))
        seconds |= {f"{shader} {stage}": value for stage, value in renderer.stages.seconds.items()}
    return seconds


def _setup_elsewhere(path: Path | None, size: int) -> dict[str, float]:
    command = [sys.executable, __file__, "--setup-of", str(path or "elephant"), "--size", str(size)]
    # the first fills the cache of tables
    outputs = [subprocess.run(command, check=True, capture_output=True).stdout for _ in range(2)]
    return json.loads(outputs[1])


def steadiness(scene: Scene, shader: str) -> dict[str, tuple[float, float]]:
    """Relative change of the object's mean and of its pixels by what should change nothing."""
    changes = {"turned by 1 degree": turned, "moved by 1000 extents": displaced, "subdivided": finer}
    return {name: change(scene, changed(scene), shader) for name, changed in changes.items()}


def markdown(figures: dict) -> str:
    """The figures as tables."""
    lines = ["| | bare visibility | scalar | ratio | plumb | ratio |", "|---|---:|---:|---:|---:|---:|"]
    rows = {"processor seconds of one thread": figures["processor_seconds"]}
    for count, seconds in figures["seconds"].items():
        rows[f"seconds with {count} thread{'s' * (count != '1')}"] = seconds
    for name, row in rows.items():
        bare, scalar, plumb = (row[each] for each in ("bare", *SHADERS))
        lines.append(f"| {name} | {bare:.4f} | {scalar:.4f} | {scalar / bare:.1f} | {plumb:.4f} | {plumb / bare:.1f} |")
    one, two = (figures["seconds"][count]["bare"] for count in "12")
    lines.append("")
    for shader in SHADERS:
        ours = figures["seconds"]["2"][shader]
        lines.append(
            f"{shader} with two threads: {ours / two:.1f} times bare visibility with two threads, {ours / one:.1f} "
            f"times one call of Embree (goal: {GOALS[shader]:.0f}).  "
        )
    lines += ["", "| set-up | seconds |", "|---|---:|"]
    lines += [f"| {stage} | {seconds:.2f} |" for stage, seconds in figures["setup"].items()]
    lines += ["", "| change of the picture | shader | mean | pixels |", "|---|---|---:|---:|"]
    for shader, changes in figures["steadiness"].items():
        for name, (mean, pixels) in changes.items():
            lines.append(f"| {name} | {shader} | {100 * mean:+.2f} % | {100 * pixels:.2f} % |")
    about = figures["machine"]
    lines.append(
        f"\n{figures['mesh']}, {figures['faces']:,} faces, {figures['size']} x {figures['size']} pixels, one sample a "
        f"pixel, medians of {figures['runs']} runs; {about['processor']}, Python {about['python']}, NumPy "
        f"{about['numpy']}, embreex {about['embreex']}. Pixels: what 99.5 % of those of the object "
        "change by at most, as a share of the mean.\n"
    )
    return "\n".join(lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--mesh", type=Path, help="default: the elephant")
    parser.add_argument("--size", type=int, default=500, help="pixels along each side (default: 500)")
    parser.add_argument("--runs", type=int, default=15, help="frames that count (default: 15)")
    parser.add_argument("--setup-of", help=argparse.SUPPRESS)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).resolve().parents[1] / "docs")
    return parser.parse_args()


if __name__ == "__main__":
    main()
