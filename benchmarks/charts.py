"""The charts of docs/performance.md, docs/accuracy.md and docs/limits.md, from a full run on a quiet machine.

    python benchmarks/charts.py [--quick] [--only speed|stability] [--shared FOLDER] [--work FOLDER]

Six scenes of ``sss-chart speed`` in at most an hour on two cores, then ``sss-chart stability`` in about another.
Everything measured is kept below --work: an interrupted run goes on where it was; an empty --work measures anew.
DRJIT_LIBLLVM_PATH should name a recent LLVM library for Mitsuba. To be started from the checkout's root: the commands
in the CSVs are relative to it (speed) and to --work/stability (stability).
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from peer_scenes import dense_scenes, public_scenes

DOCS = Path("docs")
PICTURES = DOCS / "images" / "charts"
SPEED_SCENES = ("p1_sphere", "p2_bunny_marble", "p3_bunny_backlit", "p4_slab", "d1_elephant_marble")
"""Beside the bunny at 500 x 500 pixels, the thesis' case: a large light and points, thick and thin, easy and hard."""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", choices=("speed", "stability"))
    parser.add_argument("--shared", type=Path, default=Path("../shared"), help="folder with reference/")
    parser.add_argument("--work", type=Path, default=Path("out/charts"))
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    quick = ["--quick"] if options.quick else []
    if options.only != "stability":
        known = {**public_scenes(options.shared), **dense_scenes(options.work / "scenes")}
        scenes = [known[name] for name in SPEED_SCENES] + [options.shared / "reference" / "meshes" / "bunny.ply"]
        _chart("speed", *map(str, scenes), "-o", str(options.work / "speed"), *quick)
        _publish(options.work / "speed", {"speed.md": "performance.md"}, "speed.csv", "speed-")
    if options.only != "speed":
        _chart("stability", "-o", str(options.work / "stability"), *quick)
        pages = {"stability.md": "accuracy.md", "limits.md": "limits.md"}
        _publish(options.work / "stability", pages, "stability.csv", "stability-")


def _chart(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "cli.sss_chart", *arguments], check=True)


def _publish(source: Path, pages: dict[str, str], table: str, prefix: str) -> None:
    """Copy pages, charts and table into the documentation, links and all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    charts = sorted(source.glob("*.png"))
    for chart in charts:
        shutil.copy(chart, PICTURES / f"{prefix}{chart.name}")
    shutil.copy(source / table, DOCS / table)
    for name, page in pages.items():
        text = (source / name).read_text()
        for chart in charts:
            text = text.replace(f"]({chart.name})", f"](images/charts/{prefix}{chart.name})")
        (DOCS / page).write_text(text)


if __name__ == "__main__":
    main()
