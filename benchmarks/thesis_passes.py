"""Passes of the path shader on a scene as the thesis has it: few scatterings a path.

    python benchmarks/thesis_passes.py [--mesh PATH] [--passes N] [-o FILE.md]

One mesh, 500 x 500 pixels, in the light of ``sss-render MESH``, albedo 0.6, mean free path 2 % of the longest side. One
pass is the median of some, each a run of its own after set-up; many are one run. The thesis' bunny took 0.12 s a pass
and 67.5 s for 1000 on eight cores at 3 GHz, in compiled code; its walks have a greatest depth, and no exact boundary.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

from first_figures import machine

from renderer.render import Renderer, Settings
from renderer.scene.staging import stage_mesh
from sss_tools.elephant import elephant
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium

ROOT = Path(__file__).resolve().parents[1]
SIZE, RUNS = (500, 500), 9
THESIS = {1: 0.12, 1000: 67.5}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--mesh", type=Path, help="default: the elephant")
    parser.add_argument("--passes", type=int, default=1000)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "thesis_passes.md")
    options = parser.parse_args()
    mesh = load_mesh(options.mesh) if options.mesh else elephant()
    medium = Medium.from_albedo(0.6, 1 / (0.02 * mesh.longest_side), ior=1.5)
    started = time.perf_counter()
    renderer = Renderer(stage_mesh(mesh, medium, SIZE), Settings(shader="path", threads=2))
    setup = time.perf_counter() - started
    singly = [_seconds(renderer, range(k, k + 1)) for k in range(RUNS + 1)][1:]
    many = _seconds(renderer, range(RUNS + 1, RUNS + 1 + options.passes))
    tally, covered = renderer.tally, float((renderer.film.hits > 0).mean())
    about = machine(2)
    rows = [
        "# Passes as in the thesis",
        "",
        "What is rendered is said in `benchmarks/thesis_passes.py`.",
        "",
        "| passes | seconds | the thesis, eight cores |",
        "|---:|---:|---:|",
        f"| 1 | {statistics.median(singly):.2f} | {THESIS[1]:g} |",
        f"| {options.passes} | {many:.0f} | {THESIS[1000] * options.passes / 1000:.3g} |",
        "",
        f"{options.mesh.stem if options.mesh else 'elephant'}, {len(mesh.faces):,} faces, on {100 * covered:.0f} % of "
        f"the pixels; set-up {setup:.1f} s; {tally.rays / tally.samples:.1f} rays and "
        f"{tally.collisions / tally.samples:.1f} collisions a camera sample. {about['processor']}, 2 threads; Python "
        f"{about['python']}, NumPy {about['numpy']}, embreex {about['embreex']}.",
        "",
    ]
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text("\n".join(rows))


def _seconds(renderer: Renderer, passes: range) -> float:
    started = time.perf_counter()
    renderer.run(passes)
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
