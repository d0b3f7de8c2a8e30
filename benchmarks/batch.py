"""How long a folder of small meshes takes, and how much memory the command itself needs for it.

    PYTHONPATH=. python benchmarks/batch.py --json docs/batch.json --page docs/batch.md

Each run is the command in a fresh process. Its own peak memory is read in it, without that of its workers. Then ten
thousand small meshes, their reports as lines: memory while they come in, a run that is killed halfway, and the one that
goes on. What is not measured anew (``--count 0``, ``--many 0``) is taken from the JSON.
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
import psutil
from scipy.stats import theilslopes

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import ply_bytes, write_mesh

ROOT = Path(__file__).parents[1]

TASK_BYTES = 300
"""Of a path of a hundred characters and its task, and a place in two lists, as tracemalloc counts them."""
COMMAND = """
import sys
from cli.sss_check import main
from sss_tools.memory import peak_memory
print(main(sys.argv[1:]), peak_memory())
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


def write_small_meshes(folder: Path, count: int) -> None:
    """Balls of 80 faces, no two alike: sound, with a hole, inverted; one in fifty is cut short."""
    folder.mkdir()
    generator = np.random.default_rng(8)
    ball = shapes.icosphere(1.0, 1)
    kinds = ball, Mesh(ball.vertices, ball.faces[1:]), shapes.inverted(ball)
    for number in range(count):
        kind = kinds[number % len(kinds)]
        content = ply_bytes(Mesh(kind.vertices * generator.uniform(0.9, 1.1, 3), kind.faces))
        place = folder / f"{number // 1000:03}"
        place.mkdir(exist_ok=True)
        (place / f"{number:06}.ply").write_bytes(content[:-100] if number % 50 == 49 else content)


class Lines:
    """A run of the command that writes lines, watched.

    memory  (lines, resident bytes of the command) each time they are another twentieth of ``count`` more
    """

    def __init__(self, folder: Path, cache: Path, output: Path, count: int):
        environment = {**os.environ, "SSS_TOOLS_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
        self._output, self._count = output, count
        output.unlink(missing_ok=True)
        self._begun = time.perf_counter()
        arguments = [str(folder), "-q", "--format", "jsonl", "-o", str(output)]
        self.process = subprocess.Popen([sys.executable, "-m", "cli.sss_check", *arguments], env=environment,
                                        stderr=subprocess.DEVNULL)  # fmt: skip
        self.memory: list[tuple[int, int]] = []

    def watch(self, until: float = 1.0) -> None:
        """Until the process ends, or there are so many of the lines; then kill it."""
        while self.process.poll() is None:
            lines = self.lines()
            if lines >= len(self.memory) * self._count / 20 and lines:
                self.memory.append((lines, psutil.Process(self.process.pid).memory_info().rss))
            if lines >= until * self._count:
                break
            time.sleep(0.2)
        if until < 1:
            self.process.kill()
        self.process.wait()
        self.seconds = time.perf_counter() - self._begun

    def lines(self) -> int:
        """Written so far, whole ones."""
        return self._output.read_bytes().count(b"\n") if self._output.exists() else 0


def run_many(scratch: Path, count: int) -> dict:
    """Ten thousand and more, see the head of this file."""
    folder, cache, output = scratch / "small", scratch / "small cache", scratch / "report.jsonl"
    write_small_meshes(folder, count)
    killed = Lines(folder, cache, output, count)
    killed.watch(0.5)
    *whole, last = output.read_bytes().split(b"\n")
    done = {json.loads(line)["path"] for line in whole if json.loads(line)["status"] == "ok"}
    resumed = Lines(folder, cache, output, count)
    resumed.watch()
    again = [json.loads(line) for line in output.read_bytes().splitlines()]
    return {
        "count": count,
        "killed": {"lines": len(whole), "cut": bool(last), "seconds": killed.seconds, "memory": killed.memory},
        "resumed": {
            "lines": len(again),
            "paths": len({one["path"] for one in again}),
            "cached": sum(one["cached"] for one in again),
            "lost": sum(one["path"] in done and not one["cached"] for one in again),
            "seconds": resumed.seconds,
            "memory": resumed.memory,
            "bytes": output.stat().st_size,
        },
        "cache": sum(path.stat().st_size for path in cache.rglob("*") if path.is_file()),
    }


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
    parser.add_argument("--many", type=int, default=10000)
    parser.add_argument("--json", type=Path, help="what was measured; read first, where it is there")
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    data = json.loads(options.json.read_text()) if options.json is not None and options.json.exists() else {}
    with tempfile.TemporaryDirectory() as scratch:
        if options.count:
            data["rows"], data["rows on"] = run_count(Path(scratch), options.count), machine()
        if options.many:
            data["many"], data["many on"] = run_many(Path(scratch), options.many), machine()
    if options.json is not None:
        options.json.write_text(json.dumps(data, indent=1) + "\n")
    text = page(data["rows"], data["rows on"]) if "rows" in data else ""
    text += many_page(data["many"], data["many on"]) if "many" in data else ""
    print(text)
    if options.page is not None:
        options.page.write_text(text)


def run_count(scratch: Path, count: int) -> list[tuple[str, dict]]:
    """The runs of the first table."""
    rows = []
    few, many = scratch / "few", scratch / "many"
    write_meshes(few, count // 10)
    write_meshes(many, count)
    for name, folder, arguments in (
        ("a tenth, not cached", few, ("--no-cache",)),
        ("all, one job, not cached", many, ("--no-cache", "--jobs", "1")),
        ("all, not cached", many, ("--no-cache",)),
        ("all, filling the cache", many, ()),
        ("all, cached", many, ()),
        ("all, at most 1 GiB a mesh, not cached", many, ("--no-cache", "--max-memory", "1G")),
    ):
        rows.append((name, run(folder, scratch / "cache", *arguments)))
        print(rows[-1], file=sys.stderr)
    return rows


def machine() -> dict:
    """What the pages say of where it ran."""
    return {"processors": os.cpu_count(), "machine": platform.machine(), "python": platform.python_version(),
            "load": os.getloadavg()[1]}  # fmt: skip


def page(rows: list[tuple[str, dict]], on: dict) -> str:
    """The table in Markdown."""
    lines = [
        "# A folder of meshes",
        "",
        "Balls of 1280 faces, a quarter each sound, holed, hollow and inverted; one file in fifty is cut short.",
        f"Each run once, {on['processors']} processors ({on['machine']}), Python {on['python']}: "
        "`python benchmarks/batch.py`. *memory* is the peak of the command itself, without its workers.",
        f"Load average at the end: {on['load']:.1f}; above the number of processors, jobs share them with others.",
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


def many_page(many: dict, on: dict) -> str:
    """The section on many small meshes in Markdown."""
    killed, resumed, count = many["killed"], many["resumed"], many["count"]
    memory = np.array(resumed["memory"], float)
    slope = theilslopes(memory[:, 1], memory[:, 0], 0.95)
    fresh = 1000 * killed["seconds"] / max(killed["lines"], 1)
    known = count - killed["lines"]
    cached = 1000 * max(resumed["seconds"] - fresh * known / 1000, 0) / max(resumed["cached"], 1)
    by = 100_000
    most = memory[0, 1] + by * max(slope[3], 0) + (by - count) * TASK_BYTES
    paper = [
        f"at most {most / 1e6:.0f} MB in the command ({TASK_BYTES} bytes a path, and the slope's upper end)",
        f"{by * fresh / 3.6e6:.1f} h at {fresh:.0f} ms a mesh of this kind",
        f"{by * resumed['bytes'] / count / 1e6:.0f} MB of lines",
        f"{by * many['cache'] / max(count - count // 50, 1) / 1e6:.0f} MB of cache, which keeps the latest 268 MB",
        *([f"{by * cached / 3.6e6:.1f} h where all are known ({cached:.0f} ms each)"] if cached > 0.5 else []),
    ]
    lines = [
        "",
        "## Ten thousand, as lines",
        "",
        f"{count} balls of 80 faces, a third each sound, with a hole, inverted; one file in fifty is cut short. "
        f"`sss-check FOLDER --format jsonl -o report.jsonl`; {on['processors']} processors ({on['machine']}), Python "
        f"{on['python']}, load average at the end {on['load']:.1f}.",
        "",
        f"Killed (`kill -9`) after {killed['seconds']:.0f} s: {killed['lines']} whole lines"
        + (", and a cut one at the end" if killed["cut"] else "")
        + f". The same command again took {resumed['seconds']:.0f} s: {resumed['lines']} lines of {resumed['paths']} "
        f"meshes, {resumed['cached']} from the cache; meshes that had a line and were checked again: {resumed['lost']} "
        "(files that cannot be read have no entry in the cache, and are read again).",
        "",
        "Memory of the command itself, without its workers, while lines come in:",
        "",
        "| lines | MB |",
        "|---:|---:|",
        *(f"| {lines:.0f} | {resident / 1e6:.1f} |" for lines, resident in memory[:: max(len(memory) // 8, 1)]),
        "",
        f"Slope: {slope[0]:.0f} bytes a mesh (95 % interval {slope[2]:.0f} to {slope[3]:.0f}; Theil and Sen): where "
        "each report lies on disk. Paths and settings of all meshes are there from the start.",
        "",
        f"A hundred thousand, on paper: {'; '.join(paper)}.",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
