"""How fast a mesh is checked: crossings next to pymeshlab's, cost over the number of faces, a million faces.

    python benchmarks/check_speed.py --meshes ../shared/meshes --page docs/check_speed.md

Writes the page, and beside it the same numbers as JSON and images/check_speed.png. Peak memory is that of a fresh
process for each size. Processor seconds count both threads; next to other work they say more than the clock does.
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
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from sss_tools import shapes
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.memory import peak_memory
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

ROOT = Path(__file__).parents[1]

SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 4_000_000)

REAL = ("bunny_stanford.obj", "dragon_photon.obj", "lucy_vtk.ply", "armadillo_odedstein.obj", "buddha_happy_photon.obj")

REPEATS = 5

FAMILIES = {
    "1": "holes (SSS1xx)",
    "2": "manifold, orientation (SSS2xx)",
    "3": "inside, duplicates (SSS3xx)",
    "4": "shape of faces (SSS4xx)",
    "5": "walls, size, neighbours (SSS5xx)",
    "6": "numbers (SSS6xx)",
    "7": "file (SSS7xx)",
}


def bumpy_torus(faces: int) -> Mesh:
    """A closed solid 120 units long of so many faces, rounded to a grid twice as long as wide."""
    short = max(round((faces / 4) ** 0.5), 3)
    long = max(round(faces / 2 / short), 3)
    u, v = np.meshgrid(np.arange(long) * 2 * np.pi / long, np.arange(short) * 2 * np.pi / short, indexing="ij")
    tube = 20 + 2 * np.sin(7 * u) * np.cos(5 * v) + 0.5 * np.sin(31 * u + 3 * v)
    ring = 40 + tube * np.cos(v)
    index = np.arange(long * short).reshape(long, short)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    triangles = np.concatenate([np.stack([index, right, both], -1), np.stack([index, both, up], -1)], axis=-1)
    places = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], axis=-1)
    return Mesh(places.reshape(-1, 3), triangles.reshape(-1, 3))


def bumpy_ball(subdivisions: int) -> Mesh:
    """A ball with hills."""
    ball = shapes.icosphere(1.0, subdivisions)
    x, y, z = ball.vertices.T
    return Mesh(ball.vertices * (1 + 0.1 * np.sin(7 * x) * np.cos(5 * y + 2 * z))[:, None], ball.faces)


def subdivided(mesh: Mesh) -> Mesh:
    """Each face cut into four."""
    topology = mesh.topology
    middles = topology.points[topology.edges].mean(axis=1)
    (a, b, c), (x, y, z) = topology.faces.T, topology.face_edges.T + len(topology.points)
    quarters = [np.stack(corners, axis=1) for corners in ((a, x, z), (x, b, y), (z, y, c), (x, y, z))]
    return Mesh(np.concatenate([topology.points, middles]), np.concatenate(quarters))


@contextmanager
def timed(into: dict[str, list[float]], name: str):
    """Add clock and processor seconds to those under a name."""
    clock, processor = time.perf_counter(), time.process_time()
    yield
    spent = into.setdefault(name, [0.0, 0.0])
    spent[0] += time.perf_counter() - clock
    spent[1] += time.process_time() - processor


def measure(path: Path) -> dict:
    """Seconds of each step over one mesh file and the peak memory of this process, which must be fresh."""
    from sss_tools import closedness
    from sss_tools.validation import run
    from sss_tools.validation.rule import Context

    context = Context(Medium.preset("marble", "mm"), "mm", ())
    run.check_mesh(bumpy_torus(1000), context)  # what imports cost is another matter
    seconds: dict[str, list[float]] = {}
    with timed(seconds, "decoding the file"):
        mesh = load_mesh(path)
    with timed(seconds, "topology"):
        _ = mesh.topology
    crossings, check = closedness.self_intersections, run._run

    def crossings_timed(topology):
        with timed(seconds, "self-intersection (SSS302)"):
            return crossings(topology)

    def check_timed(rule, *rest):
        # what the first rule that asks for the verdict pays for belongs to all
        with timed(seconds, FAMILIES[rule.code[3]]):
            return check(rule, *rest)

    def assess_timed(mesh):
        with timed(seconds, "verdict on closedness, with SSS302"):
            return assess(mesh)

    from sss_tools.validation import rule as rules

    assess = rules.assess
    closedness.self_intersections, run._run, rules.assess = crossings_timed, check_timed, assess_timed
    with timed(seconds, "all rules"):
        report = run.check_mesh(mesh, context)
    for number in (0, 1):
        seconds["all rules"][number] += seconds["topology"][number]
        seconds[FAMILIES["1"]][number] -= seconds["verdict on closedness, with SSS302"][number]
    return {
        "faces": len(mesh.faces),
        "seconds": seconds,
        "peak_mb": (peak_memory() or 0) / 2**20,
        "not_run": [rule.code for rule in report.rules if rule.outcome.value == "not-run"],
    }


def over_sizes(folder: Path, sizes, repeats: int) -> list[dict]:
    """Of each size the run with the least processor time for all rules."""
    results = []
    for size in sizes:
        path = folder / f"{size}.ply"
        write_mesh(bumpy_torus(size), path)
        runs = []
        for _ in range(repeats):
            command = [sys.executable, __file__, "--measure", str(path)]
            done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment())
            runs.append(json.loads(done.stdout))
        path.unlink()
        results.append(min(runs, key=lambda run: run["seconds"]["all rules"][1]))
        print(size, {name: round(spent[1], 2) for name, spent in results[-1]["seconds"].items()}, flush=True)
    return results


def environment() -> dict[str, str]:
    """The surroundings of a fresh process that finds this package."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def paired(meshes: dict[str, Mesh], repeats: int) -> list[dict]:
    """Self-intersection here and in pymeshlab, turn by turn in one process."""
    import pymeshlab

    from sss_tools.intersection import self_intersections

    results = []
    for name, mesh in meshes.items():
        topology = mesh.topology
        peer = pymeshlab.MeshSet()
        peer.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
        pairs = self_intersections(topology)
        turns: dict[str, list[list[float]]] = {"ours": [], "pymeshlab": []}
        for _ in range(repeats):
            for side, run in (
                ("ours", lambda topology=topology: self_intersections(topology)),
                ("pymeshlab", peer.compute_selection_by_self_intersections_per_face),
            ):
                spent: dict[str, list[float]] = {}
                with timed(spent, side):
                    run()
                turns[side].append(spent[side])
        medians = {side: np.median(np.array(spent), axis=0).tolist() for side, spent in turns.items()}
        result = {"mesh": name, "faces": len(mesh.faces), "pairs": len(pairs), **medians}
        result["ratio"] = [medians["pymeshlab"][k] / medians["ours"][k] for k in (0, 1)]
        results.append(result)
        print(result, flush=True)
    return results


def exponent(sizes, seconds) -> float:
    """Slope of the straight line through logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def draw(results: list[dict], place: Path) -> None:
    """Processor seconds over faces, both logarithmic, with n log n for comparison."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 5.5), layout="constrained")
    sizes = np.array([result["faces"] for result in results])
    names = [name for name in results[-1]["seconds"] if name != "decoding the file"]
    names.sort(key=lambda name: -results[-1]["seconds"][name][1])
    for name in names:
        seconds = np.array([result["seconds"].get(name, [0, 0])[1] for result in results])
        if seconds[-1] < 0.05 or (seconds <= 0).any():
            continue
        bold = name in ("all rules", "topology", "self-intersection (SSS302)")
        label = f"{name}: exponent {exponent(sizes, seconds):.2f}"
        axes.loglog(sizes, seconds, "o-", lw=2.2 if bold else 1, ms=4 if bold else 3, label=label)
    first = results[0]["seconds"]["all rules"][1]
    slope = sizes * np.log(sizes)
    axes.set_ylim(bottom=1e-5)
    label = f"n log n: exponent {exponent(sizes, slope):.2f}"
    axes.loglog(sizes, 1.6 * first * slope / slope[0], "k--", lw=1, label=label)
    axes.set(
        xlabel="faces", ylabel="processor seconds", title="Cost of checking a closed mesh, all rules, with a material"
    )
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")
    place.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(place, dpi=110)


def page(data: dict, picture: str) -> str:
    """The numbers as tables."""
    lines = [
        "# How fast meshes are checked",
        "",
        f"Written by `benchmarks/check_speed.py`. {data['machine']} Clock seconds depend on what else the machine "
        "does; processor seconds (both threads together) less so.",
        "",
        "## Self-intersection next to pymeshlab",
        "",
        f"Turn by turn in one process, medians of {data['repeats']}; the mesh is in memory on both sides, topology "
        "built. A ratio above 1 means that SSS302 is faster. SSS302 is exact, pymeshlab's answer is not.",
        "",
        "| mesh | faces | SSS302, s | pymeshlab, s | **ratio** | SSS302, CPU s | pymeshlab, CPU s | ratio |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in data["paired"]:
        ours, peer, ratio = row["ours"], row["pymeshlab"], row["ratio"]
        lines.append(
            f"| {row['mesh']} | {row['faces']:,} | {ours[0]:.3f} | {peer[0]:.3f} | **{ratio[0]:.2f}** "
            f"| {ours[1]:.3f} | {peer[1]:.3f} | {ratio[1]:.2f} |"
        )
    sizes = [result["faces"] for result in data["sizes"]]
    lines += [
        "",
        "## Cost over the number of faces",
        "",
        f"![Processor seconds over faces]({picture})",
        "",
        "A bumpy torus, with a material (marble) and an empty scene, so that every rule runs"
        + (f" (but {', '.join(data['sizes'][-1]['not_run'])})" if data["sizes"][-1]["not_run"] else "")
        + '. Processor seconds; "all rules" has the topology in it, the verdict has SSS302 in it. Least of the runs '
        "in fresh processes.",
        "",
        "| | " + " | ".join(f"{size:,}" for size in sizes) + " | exponent |",
        "|---|" + "---:|" * (len(sizes) + 1),
    ]
    for name in data["sizes"][-1]["seconds"]:
        seconds = [result["seconds"].get(name, [0, 0])[1] for result in data["sizes"]]
        fit = f"{exponent(sizes, seconds):.2f}" if min(seconds) > 0.002 else ""
        lines.append(f"| {name} | " + " | ".join(f"{value:.3f}" for value in seconds) + f" | {fit} |")
    lines.append("| peak memory, MB | " + " | ".join(f"{result['peak_mb']:.0f}" for result in data["sizes"]) + " | |")
    slope = exponent(sizes, np.array(sizes) * np.log(sizes))
    lines += ["", f"n log n would be {slope:.2f} over these sizes."]
    million = min(data["sizes"], key=lambda result: abs(result["faces"] - 1e6))
    spent = million["seconds"]
    lines += [
        "",
        "## A million faces",
        "",
        "| | clock, s | processor, s | target |",
        "|---|---:|---:|---|",
        f"| all rules, {million['faces']:,} faces, with a material | {spent['all rules'][0]:.2f} "
        f"| {spent['all rules'][1]:.2f} | 8 s |",
        f"| topology alone | {spent['topology'][0]:.2f} | {spent['topology'][1]:.2f} | 2 s |",
        f"| decoding the file (binary PLY), apart | {spent['decoding the file'][0]:.2f} "
        f"| {spent['decoding the file'][1]:.2f} | |",
        f"| peak memory | {million['peak_mb'] / 1024:.2f} GB | | 2 GB |",
        "",
    ]
    return "\n".join(lines)


def machine() -> str:
    """What the numbers were measured on."""
    load = f", load average {os.getloadavg()[0]:.1f} at the start" if hasattr(os, "getloadavg") else ""
    return (
        f"{os.cpu_count()} processors ({platform.machine()}){load}; Python {platform.python_version()}, "
        f"NumPy {np.__version__}."
    )


def main() -> None:
    """Run, write the page and the chart."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--meshes", type=Path, help="folder with real meshes")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "check_speed.md")
    parser.add_argument("--largest", type=int, default=SIZES[-1], help="faces of the largest mesh")
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--runs", type=int, default=2, help="fresh processes a size")
    parser.add_argument("--draw", action="store_true", help="write page and chart anew from the numbers beside them")
    parser.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(measure(arguments.measure)))
        return
    numbers = arguments.page.with_suffix(".json")
    if not arguments.draw:
        meshes = {}
        if arguments.meshes:
            meshes = {name: load_mesh(arguments.meshes / name) for name in REAL if (arguments.meshes / name).exists()}
            if REAL[0] in meshes:
                meshes[f"{REAL[0]}, each face in 16"] = subdivided(subdivided(meshes[REAL[0]]))
        meshes["bumpy ball"] = bumpy_ball(8)
        meshes["bumpy torus"] = bumpy_torus(1_000_000)
        data = {"machine": machine(), "repeats": arguments.repeats, "paired": paired(meshes, arguments.repeats)}
        with tempfile.TemporaryDirectory() as folder:
            sizes = [size for size in SIZES if size <= arguments.largest]
            data["sizes"] = over_sizes(Path(folder), sizes, arguments.runs)
        numbers.write_text(json.dumps(data, indent=1) + "\n")
    data = json.loads(numbers.read_text())
    picture = Path("images") / "check_speed.png"
    draw(data["sizes"], arguments.page.parent / picture)
    arguments.page.write_text(page(data, picture.as_posix()))


if __name__ == "__main__":
    main()
