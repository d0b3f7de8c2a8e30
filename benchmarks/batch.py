"""How long a folder of small meshes takes, and how much memory the command itself needs for it.

    python benchmarks/batch.py --count 1000 --page docs/batch.md

Each run is the command in a fresh process. Its own peak memory is read in it, without that of its workers.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

ROOT = Path(__file__).parents[1]

COMMAND = """
import resource, sys
from pathlib import Path
from cli.sss_check import main
status = main(sys.argv[1:])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
if Path("/proc/self/status").exists():
    # on Linux ru_maxrss begins with what the process was before it became this program
    lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
print(status, peak)
"""


def write_meshes(folder: Path, count: int) -> None:
    """Balls of 1280 faces, no two alike: sound, with a hole, hollow, inverted; one in fifty is cut short."""
    folder.mkdir()
    generator = np.random.default_rng(7)
    kinds = (
        shapes.icosphere(),
        shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3),
        shapes.hollow_ball(),
        shapes.inverted(shapes.icosphere()),
    )
    for number in range(count):
        kind = kinds[number % len(kinds)]
        path = folder / f"{number:05}.ply"
        write_mesh(Mesh(kind.vertices * generator.uniform(0.9, 1.1, 3), kind.faces), path)
        if number % 50 == 49:
            path.write_bytes(path.read_bytes()[:-100])


def run(folder: Path, cache: Path, *options: str) -> dict:
    """Seconds, peak bytes, and what was found, of one run of the command."""
    environment = {**os.environ, "SSS_TOOLS_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    output = folder.parent / "report.json"
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, str(folder), "-q", "--format", "json", "-o", str(output), *options],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    seconds = time.perf_counter() - start
    meshes = json.loads(output.read_text())["meshes"]
    return {
        "seconds": seconds,
        "memory": int(done.stdout.split()[1]),
        "meshes": len(meshes),
        "unreadable": sum(mesh["status"] != "ok" for mesh in meshes),
        "cached": sum(mesh["cached"] for mesh in meshes),
        "size": output.stat().st_size,
    }


def main() -> None:
    """Run, print the page, write it where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        few, many = Path(scratch, "few"), Path(scratch, "many")
        write_meshes(few, options.count // 10)
        write_meshes(many, options.count)
        for name, folder, arguments in (
            ("a tenth, not cached", few, ("--no-cache",)),
            ("all, one job, not cached", many, ("--no-cache", "--jobs", "1")),
            ("all, not cached", many, ("--no-cache",)),
            ("all, filling the cache", many, ()),
            ("all, cached", many, ()),
            ("all, at most 1 GiB a mesh, not cached", many, ("--no-cache", "--max-memory", "1G")),
        ):
            rows.append((name, run(folder, Path(scratch, "cache"), *arguments)))
            print(rows[-1], file=sys.stderr)
    text = page(rows)
    print(text)
    if options.page is not None:
        options.page.write_text(text)


def page(rows: list[tuple[str, dict]]) -> str:
    """The table in Markdown."""
    lines = [
        "# A folder of meshes",
        "",
        "Balls of 1280 faces, a quarter each sound, holed, hollow and inverted; one file in fifty is cut short.",
        f"Each run once, {os.cpu_count()} processors ({platform.machine()}), Python {platform.python_version()}: "
        "`python benchmarks/batch.py`. *memory* is the peak of the command itself, without its workers.",
        f"Load average at the end: {os.getloadavg()[1]:.1f}; above the number of processors, jobs share them with "
        "others.",
        "",
        "| run | meshes | unreadable | from cache | seconds | ms a mesh | memory, MB | report, MB |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {name} | {row['meshes']} | {row['unreadable']} | {row['cached']} | {row['seconds']:.1f} | "
        f"{1000 * row['seconds'] / row['meshes']:.1f} | {row['memory'] / 1e6:.0f} | {row['size'] / 1e6:.1f} |"
        for name, row in rows
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
