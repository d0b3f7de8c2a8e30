"""Does the error fall and the time rise with every step of --quality?

    PYTHONPATH=. python benchmarks/quality.py [--size PIXELS] [--steps N] [--most Q] [--scenes N] [-o FOLDER]

Six scenes. The error is the root mean square over object pixels and channels against path at ``--reference`` passes,
the reference's own noise taken off, over the mean; where all objects are lit by path it is the picture's own standard
error, which is surer. Seconds are CPU seconds of the passes. Writes quality.json and quality.md into FOLDER.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from benchmarks.dolly import LIGHTS, body
from renderer.enough import rounds
from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import EnvironmentLight, Scene
from renderer.scene.staging import frame_camera
from renderer.shaders.selection import picture_passes
from sss_tools import shapes
from sss_tools.elephant import elephant

SKY = (EnvironmentLight(radiance=np.ones(3)),)
SCENES = {
    "ball of jade, sun": ("jade", lambda: shapes.icosphere(1.0, 4), LIGHTS),
    "ball of marble, sky": ("marble", lambda: shapes.icosphere(1.0, 4), SKY),
    "torus of wax, sun": ("wax", lambda: shapes.torus(1.0, 0.35), LIGHTS),
    "flat ellipsoid of milk, sun": ("milk", lambda: shapes.ellipsoid((1.0, 1.0, 0.3), 4), LIGHTS),
    "box of wax, sky": ("wax", lambda: shapes.box((1.0, 0.6, 0.8)), SKY),
    "elephant of jade, sun": ("jade", elephant, LIGHTS),
}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=32)
    parser.add_argument("--steps", type=int, default=11)
    parser.add_argument("--most", type=float, default=1.0, help="highest quality")
    parser.add_argument("--scenes", type=int, default=len(SCENES))
    parser.add_argument("--reference", type=int, default=4096)
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    options = parser.parse_args()
    figures = {}
    for name in list(SCENES)[: options.scenes]:
        figures[name] = sweep(name, options)
        print(name, "monotone" if monotone(figures[name]) else "NOT monotone", flush=True)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "quality.json").write_text(json.dumps(figures, indent=1) + "\n")
    text = markdown(figures)
    (options.output / "quality.md").write_text(text)
    print(text)


def sweep(name: str, options) -> list[dict]:
    """Error and time by quality."""
    medium, solid, lights = SCENES[name]
    mesh = solid()
    scene = Scene("mm", frame_camera(mesh, (options.size, options.size)), lights, (body(name, medium, mesh),))
    scene = admit(scene)[0]
    reference = Renderer(scene, Settings(shader="path", seed=99))
    reference.run(range(options.reference))
    points: list[dict] = []
    for quality in np.linspace(0, options.most, options.steps):
        renderer = Renderer(scene, Settings(quality=float(quality)))
        start = time.process_time()
        for passes, _ in rounds(renderer, picture_passes(renderer.plans)):
            renderer.run(range(renderer.film.passes, passes))
        seconds = time.process_time() - start
        points.append({
            "quality": float(quality),
            "shares": renderer.plans[0].shares,
            "passes": renderer.film.passes,
            "seconds": seconds,
            "error": error(renderer, reference),
            "tolerance": renderer.plans[0].tolerance,
        })  # fmt: skip
    return points


def error(renderer: Renderer, reference: Renderer) -> float:
    """Root mean square over the mean."""
    where = renderer.film.object_pixels() & reference.film.object_pixels()
    level = float(reference.film.mean()[where].mean())
    if "path" in renderer.plans[0].shares and len(renderer.plans[0].shares) == 1 and renderer.film.passes > 1:
        return float(np.sqrt((renderer.film.stderr()[where] ** 2).mean())) / level
    squared = (renderer.film.mean()[where] - reference.film.mean()[where]) ** 2 - reference.film.stderr()[where] ** 2
    return float(np.sqrt(max(squared.mean(), 0))) / level


def monotone(points: list[dict], slack: float = 0.05) -> bool:
    """Whether no quality is beaten by another in error and time, to ``slack``."""
    return not any(
        other["error"] < point["error"] * (1 - slack) and other["seconds"] < point["seconds"] * (1 - slack)
        for point in points
        for other in points
    )


def markdown(figures: dict) -> str:
    """A table for each scene."""
    parts = []
    for name, points in figures.items():
        rows = "\n".join(
            f"| {one['quality']:.1f} | {', '.join(f'{n} {100 * s:.0f} %' for n, s in one['shares'].items())} | "
            f"{one['passes']} | {one['seconds']:.2g} | {100 * one['error']:.2g} % | {100 * one['tolerance']:.2g} % |"
            for one in points
        )
        parts.append(f"## {name}: {'monotone' if monotone(points) else 'not monotone'}\n\n"
                     "| quality | shaders | passes | CPU s | error | tolerance |\n|---:|---|---:|---:|---:|---:|\n"
                     f"{rows}\n")  # fmt: skip
    return "\n".join(parts)


if __name__ == "__main__":
    main()
