"""How often a repair leaves a solid: ours and the peers' over a folder of real meshes, judged alike.

    python benchmarks/repair_corpus.py [--meshes DIR] [--tools "ours;trimesh"] [-o TABLE.md]

DIR holds meshes and a MANIFEST.csv with the columns file, class and refuse_ok. Every tool works in a process of
its own with a time limit; what it returns is judged here. *Strict*: after an exact weld every edge has two faces
that run through it in opposite directions and no point is pinched, no two faces cross (exactly, by CGAL), the
volume is positive, every cavity is still void, and the visible surface is nowhere farther than 1 % of the
diagonal from the result. Declining counts as right where the manifest says so.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import statistics
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from sss_tools.closedness import assess
from sss_tools.loading import load_mesh
from sss_tools.mesh import Mesh
from sss_tools.repair.judge import FARTHEST, VisibleSurface, count_crossing_faces
from sss_tools.winding import deepest_points, winding_numbers

LIMIT = 90.0
"""Seconds a tool may take for a mesh."""


def ours(mesh: Mesh):
    """The ladder with all rungs."""
    from sss_tools.repair import repair_mesh

    result, report = repair_mesh(mesh, unsafe=True)
    if report.status == "refused":
        return "refused"
    return None if result is None else (result.vertices, result.faces)


def ours_safe(mesh: Mesh):
    """The ladder's safe rungs."""
    from sss_tools.repair import repair_mesh

    result, report = repair_mesh(mesh)
    if report.status == "refused":
        return "refused"
    return None if result is None else (result.vertices, result.faces)


def with_trimesh(mesh: Mesh):
    """Weld, drop degenerate and double faces, wind alike, close small holes."""
    import trimesh

    body = trimesh.Trimesh(*_welded(mesh), process=True)
    body.update_faces(body.nondegenerate_faces() & body.unique_faces())
    body.remove_unreferenced_vertices()
    trimesh.repair.fix_normals(body, multibody=True)
    trimesh.repair.fill_holes(body)
    return np.asarray(body.vertices), np.asarray(body.faces)


def with_pymeshlab(mesh: Mesh):
    """The usual chain of filters."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(*_welded(mesh)))
    for name, options in (
        ("meshing_remove_duplicate_vertices", {}),
        ("meshing_remove_duplicate_faces", {}),
        ("meshing_remove_null_faces", {}),
        ("meshing_repair_non_manifold_edges", {}),
        ("meshing_repair_non_manifold_vertices", {}),
        ("meshing_close_holes", {"maxholesize": 1000}),
        ("meshing_re_orient_faces_coherently", {}),
        ("meshing_re_orient_faces_by_geometry", {}),
    ):
        try:
            getattr(meshes, name)(**options)
        except pymeshlab.PyMeshLabException:
            continue
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def with_pymeshfix(mesh: Mesh, joined: bool = False):
    """MeshFix as it comes."""
    import pymeshfix

    return pymeshfix.clean_from_arrays(*_welded(mesh), joincomp=joined, remove_smallest_components=not joined)


def with_pymeshfix_joined(mesh: Mesh):
    """MeshFix, all components kept and joined."""
    return with_pymeshfix(mesh, joined=True)


def with_manifold3d(mesh: Mesh):
    """manifold3d: merge open edges, take what is a manifold then."""
    import manifold3d

    points, faces = _welded(mesh)
    data = manifold3d.Mesh64(np.array(points), np.array(faces, np.uint64))
    data.merge()
    solid = manifold3d.Manifold(data)
    if solid.status() != manifold3d.Error.NoError or solid.num_tri() == 0:
        return None
    out = solid.to_mesh64()
    return np.array(out.vert_properties[:, :3]), np.array(out.tri_verts).astype(np.int64)


TOOLS = {
    "ours": ours,
    "ours, safe rungs": ours_safe,
    "trimesh": with_trimesh,
    "pymeshlab chain": with_pymeshlab,
    "pymeshfix": with_pymeshfix,
    "pymeshfix, joined": with_pymeshfix_joined,
    "manifold3d merge": with_manifold3d,
}


def _welded(mesh: Mesh):
    topology = mesh.topology
    return np.array(topology.points), np.array(topology.faces[topology.live])


@dataclass
class Result:
    """What a tool did to a mesh: outcome is strict, closed, open, refused, unchanged or failed."""

    outcome: str
    detail: str = ""
    seconds: float = 0.0


def judge(mesh: Mesh, answer) -> Result:
    """Measure an answer against the mesh it was made from."""
    if isinstance(answer, str):
        return Result(answer)
    if answer is None:
        return Result("unchanged")
    result = Mesh(*answer)
    if len(result.faces) == 0 or not np.isfinite(result.vertices).all():
        return Result("open", "nothing left")
    topology = result.topology
    if not (
        (topology.faces_per_edge == 2).all()
        and len(topology.misoriented_edges) == 0
        and len(topology.pinched_points) == 0
    ):
        return Result("open", "not a closed oriented 2-manifold after an exact weld")
    faults = []
    if crossing := count_crossing_faces(result):
        faults.append(f"{crossing} faces cross")
    if result.volume <= 0:
        faults.append("volume not positive")
    distance = VisibleSurface(mesh).distance_to(result)
    if distance > FARTHEST:
        faults.append(f"visible surface moved {distance:.1%}")
    if lost := _cavities_lost(mesh, result):
        faults.append(f"{lost} cavities filled")
    return Result("closed" if faults else "strict", ", ".join(faults))


def _cavities_lost(mesh: Mesh, result: Mesh) -> int:
    """How many voids of the mesh are matter in the result."""
    assessment, topology, lost = assess(mesh), mesh.topology, 0
    for number, part in enumerate(assessment.components):
        if part.role == "cavity" and part.closed:
            faces = topology.faces[assessment.component_of_face == number]
            inside = deepest_points(topology.points, faces)
            own = np.abs(winding_numbers(inside, topology.points, faces)) > 0.9
            void = np.abs(winding_numbers(inside, topology.points, topology.faces)) < 0.1
            places = inside[own & void]
            if len(places):
                lost += bool((np.abs(winding_numbers(places, result.vertices, result.faces)) > 0.5).all())
    return lost


def serve(pipe: Connection, tool: str) -> None:
    """The tool's process: meshes in, answers out."""
    TOOLS[tool](load_mesh_of(np.eye(4, 3), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])))  # imports
    pipe.send("ready")
    while True:
        vertices, faces = pipe.recv()
        mesh = load_mesh_of(vertices, faces)
        start = time.perf_counter()
        try:
            answer = TOOLS[tool](mesh)
        except Exception as error:
            answer = f"failed: {type(error).__name__}: {error}"
        pipe.send((time.perf_counter() - start, answer))


def load_mesh_of(vertices, faces) -> Mesh:
    """A mesh as the worker sees it."""
    return Mesh(vertices, faces)


def run_tool(tool: str, meshes: dict[str, Mesh]) -> dict[str, Result]:
    """All meshes through one tool; a crash or a hang is a failure of that mesh alone."""
    context, results = multiprocessing.get_context("spawn"), {}
    process = pipe = None
    for name, mesh in meshes.items():
        if process is None:
            pipe, far = context.Pipe()
            process = context.Process(target=serve, args=(far, tool), daemon=True)
            process.start()
            far.close()
            try:
                pipe.recv()
            except EOFError:
                return {name: Result("failed", "not installed") for name in meshes}
        try:
            pipe.send((mesh.vertices, mesh.faces))
            if not pipe.poll(LIMIT):
                raise TimeoutError
            seconds, answer = pipe.recv()
            if isinstance(answer, str) and answer.startswith("failed"):
                results[name] = Result("failed", answer, seconds)
            else:
                results[name] = judge(mesh, answer)
                results[name].seconds = seconds
        except (EOFError, OSError, TimeoutError) as error:
            process.kill()
            process.join()
            process = None
            results[name] = Result("failed", type(error).__name__, LIMIT)
        print(f"  {tool}: {name}: {results[name].outcome} {results[name].detail}", file=sys.stderr, flush=True)
    if process is not None:
        process.kill()
    return results


def is_right(result: Result, row: dict[str, str]) -> bool:
    """Strict, or declined where declining is right."""
    return result.outcome == "strict" or (result.outcome == "refused" and row["refuse_ok"] == "yes")


def table(rows: list[dict[str, str]], results: dict[str, dict[str, Result]], meshes: dict[str, Mesh]) -> str:
    """The Markdown page."""
    broken = [row for row in rows if row["class"] not in ("clean", "si_only")]
    crossing = [row for row in rows if row["class"] == "si_only"]
    clean = [row for row in rows if row["class"] == "clean"]
    lines = [
        "# Repair of real meshes",
        "",
        f"{len(broken)} broken, readable meshes; {len(crossing)} more that are closed but cross themselves; "
        f"{len(clean)} clean ones. Written by `benchmarks/repair_corpus.py`, which says what *strict* means. Seconds "
        "are of the repair alone, on a shared machine: read ratios.",
        "",
        "| tool | strict | closed | strict, self-crossing | clean left alone | median s | p90 s |",
        "|---|---|---|---|---|---|---|",
    ]
    for tool, found in results.items():
        times = sorted(found[row["file"]].seconds for row in broken)
        right = sum(is_right(found[row["file"]], row) for row in broken)
        closed = sum(found[row["file"]].outcome in ("closed", "strict") for row in broken)
        cured = sum(found[row["file"]].outcome == "strict" for row in crossing)
        alone = sum(_left_alone(found[row["file"]]) for row in clean)
        lines.append(
            f"| {tool} | {right}/{len(broken)} ({right / len(broken):.0%}) | {closed}/{len(broken)} "
            f"| {cured}/{len(crossing)} | {alone}/{len(clean)} | {statistics.median(times):.2f} "
            f"| {times[int(0.9 * len(times))]:.1f} |"
        )
    lines += ["", "## By class", "", "| class | meshes | " + " | ".join(results) + " |"]
    lines.append("|---|---|" + "---|" * len(results))
    for name in dict.fromkeys(row["class"] for row in sorted(broken + crossing, key=lambda row: row["class"])):
        group = [row for row in rows if row["class"] == name]
        counts = [str(sum(is_right(found[row["file"]], row) for row in group)) for found in results.values()]
        lines.append(f"| {name} | {len(group)} | " + " | ".join(counts) + " |")
    lines += ["", "## By mesh", "", "| mesh | class | faces | " + " | ".join(results) + " |"]
    lines.append("|---|---|---|" + "---|" * len(results))
    for row in [*broken, *crossing]:
        cells = []
        for found in results.values():
            result = found[row["file"]]
            detail = f" ({result.detail})" if result.detail and result.outcome == "closed" else ""
            cells.append(f"{result.outcome}{detail}, {result.seconds:.2f} s")
        lines.append(
            f"| {row['file']} | {row['class']} | {len(meshes[row['file']].faces)} | " + " | ".join(cells) + " |"
        )
    return "\n".join(lines) + "\n"


def _left_alone(result: Result) -> bool:
    """Whether a clean mesh came back unchanged, or at least as sound."""
    return result.outcome in ("unchanged", "strict")


def main() -> None:
    """Run the tools and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", type=Path, default=Path(__file__).parents[2] / "shared" / "meshes")
    parser.add_argument("--tools", default=";".join(TOOLS), help="separated by semicolons")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    with (options.meshes / "MANIFEST.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["class"] not in ("corrupt", "either")]
    meshes = {row["file"]: load_mesh(options.meshes / row["file"]) for row in rows}
    wanted = [tool for tool in TOOLS if tool in options.tools.split(";")]
    results = {tool: run_tool(tool, meshes) for tool in wanted}
    text = table(rows, results, meshes)
    if options.output is None:
        print(text)
    else:
        options.output.write_text(text)


if __name__ == "__main__":
    main()
