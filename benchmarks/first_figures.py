"""Seconds a frame and error of the three shaders, one mesh in the light of ``sss-render MESH``.

    python benchmarks/first_figures.py [--mesh PATH]... [--runs N] [--threads N] [-o FOLDER]

500 x 500 pixels, one sample each: for path one pass, for the others the frame. Medium: albedo 0.9, mean free path
2 % of the longest side, index of refraction 1.5. Set-up (loading, check, tables) is not in the frame's time; the
first frame, which fills caches, is not counted. Writes figures.json and figures.md into FOLDER, docs/ by default.

Errors are root mean square, as a share of the mean, over the pixels of the object. Path's is the noise of one pass.
The others' is the difference from path, from two halves of path's samples, so that its noise cancels.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from renderer.output.film import Film
from renderer.render import Renderer, Settings
from renderer.scene.description import Scene, Translucent
from renderer.scene.staging import stage_mesh
from sss_tools.elephant import elephant
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.memory import peak_memory
from sss_tools.mesh import Mesh

SIZE = (500, 500)


def main() -> None:
    """The command."""
    options = _options()
    meshes = {"elephant": elephant(), **{path.stem: load_mesh(path) for path in options.mesh}}
    figures = {
        "machine": machine(options.threads),
        "size": SIZE,
        "runs": options.runs,
        "meshes": {name: measure(mesh, options.runs, options.threads) for name, mesh in meshes.items()},
        "peak_memory_mb": round((peak_memory() or 0) / 2**20),
    }
    table = markdown(figures)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "figures.json").write_text(json.dumps(figures, indent=1) + "\n")
    (options.output / "figures.md").write_text(table)
    print(table)


def measure(mesh: Mesh, runs: int, threads: int | None) -> dict:
    """Times and errors of the three shaders on one mesh."""
    staged = stage_mesh(mesh, size=SIZE)
    medium = Medium.from_albedo(0.9, 1 / (0.02 * mesh.longest_side), ior=1.5)
    scene = replace(staged, objects=(replace(staged.objects[0], material=Translucent(medium)),), hash="")
    measured = {shader: Frames.of(scene, shader, runs, threads) for shader in ("path", "plumb", "scalar")}
    path = measured["path"]
    pixels = path.film.object_pixels()
    mean = path.film.mean()[pixels].mean()
    noise = np.sqrt(np.mean(path.film.stderr()[pixels] ** 2) * path.film.passes)
    figures = {}
    for shader, frames in measured.items():
        if shader == "path":
            error = noise / mean
        else:
            one, two = ((half.mean() - frames.film.mean())[pixels] for half in path.halves)
            error = np.sqrt(max(np.mean(one * two), 0)) / mean
        figures[shader] = {
            "seconds": statistics.median(frames.seconds),
            "spread": [min(frames.seconds), max(frames.seconds)],
            "setup": frames.setup,
            "error": float(error),
        }
    return {"faces": len(mesh.faces), "shaders": figures}


@dataclass
class Frames:
    """What was rendered with one shader.

    seconds  of each frame; setup seconds before the first
    halves   the even and the odd passes on films of their own; ``film`` has all
    """

    seconds: list[float]
    setup: float
    film: Film
    halves: tuple[Film, Film]

    @classmethod
    def of(cls, scene: Scene, shader: str, runs: int, threads: int | None) -> Frames:
        """One frame to warm up, then ``runs`` that count."""
        start = time.perf_counter()
        renderer = Renderer(scene, Settings(shader=shader, threads=threads))
        setup = time.perf_counter() - start
        renderer.run([0])
        blank = renderer.film
        films = [Film.blank(blank.resolution, blank.scene_hash, blank.seed) for _ in range(3)]
        seconds = []
        for index in range(1, runs + 1):
            renderer.film = films[index % 2]
            start = time.perf_counter()
            renderer.run([index])
            seconds.append(time.perf_counter() - start)
        for half in films[:2]:
            films[2].merge(half)
        return cls(seconds, setup, films[2], (films[0], films[1]))


def machine(threads: int | None) -> dict:
    """What the times depend on."""
    cpuinfo = Path("/proc/cpuinfo")
    names = [line for line in cpuinfo.read_text().splitlines() if "model name" in line] if cpuinfo.exists() else []
    return {
        "processor": names[0].split(":")[1].strip() if names else platform.processor(),
        "cores": os.cpu_count(),
        "threads": threads or os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        **{package: version(package) for package in ("numpy", "embreex")},
    }


def markdown(figures: dict) -> str:
    """The figures as a table."""
    about = figures["machine"]
    lines = ["| mesh | shader | seconds a frame | least - most | error |", "|---|---|---:|---:|---:|"]
    for name, mesh in figures["meshes"].items():
        for shader, figure in mesh["shaders"].items():
            least, most = figure["spread"]
            kind = "noise" if shader == "path" else "from path"
            lines.append(
                f"| {name} ({mesh['faces']:,} faces) | {shader} | {figure['seconds']:.2f} | {least:.2f} - {most:.2f} "
                f"| {100 * figure['error']:.0f} % {kind} |"
            )
    width, height = figures["size"]
    return "\n".join(lines) + (
        f"\n\n{width} x {height} pixels, one sample a pixel, median of {figures['runs']} runs after set-up; albedo "
        f"0.9, mean free path 2 % of the longest side, index 1.5. {about['processor']}, {about['threads']} threads; "
        f"Python {about['python']}, NumPy {about['numpy']}, embreex {about['embreex']}. Peak memory "
        f"{figures['peak_memory_mb']} MB.\n"
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--mesh", type=Path, action="append", default=[], help="a mesh to measure besides")
    parser.add_argument("--runs", type=int, default=7, help="frames that count, at least two (default: 7)")
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).resolve().parents[1] / "docs")
    return parser.parse_args()


if __name__ == "__main__":
    main()
