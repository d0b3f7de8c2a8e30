"""One renderer on one scene for some seconds, in a process of its own: speed, and the noise of every pixel.

    python benchmarks/one_render.py ours SCENE.toml OUT.npz [--seconds S] [--seed K]
    python benchmarks/one_render.py VARIANT SCENE.xml OUT.npz [--seconds S] [--seed K] [--rr-depth D]

VARIANT is one of Mitsuba's, such as scalar_rgb. OUT holds ``mean`` and ``variance`` (h, w, 3), of one sample a pixel,
``samples`` a pixel, ``freedom`` of the variance, ``object_pixels`` (h, w; ours alone knows), ``setup`` and ``render``
seconds, ``setup_cpu`` and ``cpu`` seconds of both over all cores, ``memory`` at its peak in bytes.

Set-up is all from the start of the process to the first sample: imports, loading, building, compiling.
"""

from __future__ import annotations

import argparse
import time
from itertools import count
from pathlib import Path

import numpy as np

from cli.clock import process_start
from sss_tools.memory import peak_memory

LANES = (2**15, 2**20)
"""Samples of one call of Mitsuba: enough to keep wide kernels busy, not more than fit in memory."""
LEAST = 8
"""Passes of ours, whatever the time: of fewer the variance is too uncertain."""
CALLS = 16
"""Calls of Mitsuba that should fit in the time: the variance is estimated from their means."""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("renderer")
    parser.add_argument("scene", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rr-depth", type=int, default=1000)
    options = parser.parse_args()
    measured = ours(options) if options.renderer == "ours" else mitsuba(options)
    np.savez(options.output, memory=peak_memory(), **measured)


def ours(options: argparse.Namespace) -> dict:
    """The path shader, as many passes as the command makes in the time, at least ``LEAST`` of them."""
    started = process_start()
    from renderer.render import Renderer, Settings
    from renderer.scene.scene_file import load_scene

    renderer = Renderer(load_scene(options.scene), Settings(shader="path", seed=options.seed))
    begun, cpu = time.monotonic(), time.process_time()
    # as for --time
    renderer.run(count(), None, lambda: begun + options.seconds - time.monotonic())
    if renderer.film.passes < LEAST:
        more = count(max(stop for _, stop in renderer.film.ranges))
        renderer.run(more, lambda _: renderer.film.passes >= LEAST)
    ended = time.monotonic()
    film = renderer.film
    return {
        "mean": film.mean(),
        "variance": film.passes * film.stderr() ** 2,
        "samples": film.passes,
        "freedom": film.passes - 1,
        "object_pixels": film.object_pixels(),
        "setup": begun - started,
        "setup_cpu": cpu,
        "render": ended - begun,
        "cpu": time.process_time() - cpu,
    }


def mitsuba(options: argparse.Namespace) -> dict:
    """Independent pictures until the time is up, at least four."""
    started = process_start()
    import mitsuba as mi

    mi.set_variant(options.renderer)
    scene = mi.load_file(str(options.scene), rr_depth=options.rr_depth)
    seeds = (1_000_003 * options.seed + k for k in count(1))

    def timed(samples: int) -> tuple[np.ndarray, np.ndarray]:
        begun = np.array([time.monotonic(), time.process_time()])
        image = np.array(mi.render(scene, spp=samples, seed=next(seeds)), float)
        return image, np.array([time.monotonic(), time.process_time()]) - begun

    loaded = np.array([time.monotonic() - started, time.process_time()])
    _, cold = timed(1)
    image, once = timed(1)
    # the first call compiles, or reads what was compiled before
    setup, setup_cpu = loaded + np.maximum(cold - once, 0)
    pixels = image.shape[0] * image.shape[1]
    least, most = (max(lanes // pixels, 1) for lanes in LANES)
    _, several = timed(least)
    samples = int(np.clip(least * options.seconds / CALLS / several[0], least, most))
    begun, cpu, images = time.monotonic(), time.process_time(), []
    while time.monotonic() - begun < options.seconds or len(images) < 4:
        images.append(timed(samples)[0])
    return {
        "mean": np.mean(images, axis=0),
        "variance": samples * np.var(images, axis=0, ddof=1),
        "samples": samples * len(images),
        "freedom": len(images) - 1,
        "setup": setup,
        "setup_cpu": setup_cpu,
        "render": time.monotonic() - begun,
        "cpu": time.process_time() - cpu,
    }


if __name__ == "__main__":
    main()
