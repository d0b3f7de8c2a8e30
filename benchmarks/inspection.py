"""How long does sss-inspect take for a still of each mesh, and how many pictures a second do its windows show?

    PYTHONPATH=. xvfb-run -a python benchmarks/inspection.py [--meshes FOLDER] [--out FOLDER] [--page PAGE]

Stills are whole commands, one a mesh of the folder, kept in --out to be looked at. The windows, which need a display
(xvfb-run makes one), are a ball of 1.3 million faces that turns, and the live picture of elephants of marble and milk.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from first_figures import machine

from renderer.inspection.exhibit import put_together
from renderer.inspection.live import Live
from renderer.inspection.live_window import LiveWindow
from renderer.inspection.specimen import Inspection, Specimen
from renderer.inspection.window import Window
from renderer.scene.staging import stage_mesh
from sss_tools import shapes
from sss_tools.elephant import elephant
from sss_tools.medium import Medium
from sss_tools.validation.outcome import MeshReport

MESHES = {".obj", ".ply", ".stl", ".glb", ".gltf", ".off", ".3mf", ".dae"}
PICTURES = 15
LIVE_SIZE = (800, 600)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--meshes", type=Path, default=Path("../shared/meshes"))
    parser.add_argument("--out", type=Path, default=Path("out/inspection"))
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    about = machine(None)
    lines = [
        "# How quick the inspection is",
        "",
        f"By `benchmarks/inspection.py`: {about['processor']}, {about['cores']} cores, software GL, "
        f"Python {about['python']}.",
        "",
        *windows_table(),
        "",
        *stills_table(sorted(path for path in options.meshes.iterdir() if path.suffix.lower() in MESHES), options.out),
    ]
    print("\n".join(lines))
    if options.page:
        options.page.write_text("\n".join(lines) + "\n")


def stills_table(meshes: list[Path], out: Path) -> list[str]:
    """Seconds of ``sss-inspect MESH --screenshot``, the slowest first."""
    rows = []
    for mesh in meshes:
        picture = out / f"{mesh.name}.png"
        picture.unlink(missing_ok=True)
        command = [sys.executable, "-m", "cli.sss_inspect", str(mesh), "--screenshot", str(picture), "-q"]
        begun = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - begun
        words = done.stderr.strip().splitlines()
        refused = done.returncode == 2 and len(words) == 1
        good = refused or (done.returncode in (0, 1) and picture.is_file())
        said = "refused" if refused else "" if good else f"**failed**: status {done.returncode}, {words[-1:]}"
        rows.append((seconds, mesh.name, mesh.stat().st_size / 2**20, said))
        print(f"{seconds:6.1f} s  {mesh.name}  {words[0] if refused else said}", file=sys.stderr)
    shown = [row for row in rows if not row[3]]
    seconds = [row[0] for row in rows]
    refused = sum(row[3] == "refused" for row in rows)
    return [
        f"A still (`sss-inspect MESH --screenshot`) of each of {len(rows)} meshes, whole and broken, the check and the "
        f"start of Python counted in: {len(shown)} shown, {refused} refused with a line, "
        f"{len(rows) - len(shown) - refused} failed; median {statistics.median(seconds):.1f} s, at most "
        f"{max(seconds):.1f} s. The slowest:",
        "",
        "| mesh | file, MB | seconds | |",
        "|---|---:|---:|---|",
        *(f"| {name} | {size:.1f} | {spent:.1f} | {said} |" for spent, name, size, said in sorted(rows)[:-11:-1]),
    ]


def windows_table() -> list[str]:
    """Pictures a second of a large mesh and of live pictures."""
    lines = ["| window | pictures a second, median | slowest |", "|---|---:|---:|"]
    ball = shapes.icosphere(1.0, 8)
    window = Window(put_together(Inspection("ball", (Specimen("ball", ball, MeshReport("ball")),))))
    window.plotter.show(auto_close=False, interactive=False)
    for words, fine in (("turning", False), ("at rest, in full", True)):
        window.show_fine(fine)

        def turned(camera=window.plotter.camera, render=window.plotter.render) -> None:
            camera.azimuth += 5
            render()

        lines.append(_row(f"{len(ball.faces):,} faces, {words}", turned))
    window.close()
    for name in ("marble", "wholemilk"):
        for preview in ("scalar", "plumb"):
            live = Live(stage_mesh(elephant(), Medium.preset(name, "cm")), LIVE_SIZE, preview)
            shown = LiveWindow(live, "elephant")

            def moved(live=live, shown=shown) -> None:
                # as while somebody drags who rests now and then: the reference begins, and is dropped
                live.resting()
                live.turn(0.05, 0.0)
                shown.show(live.moving())

            words = f"`--live`, elephant of {name}, {preview}, {LIVE_SIZE[0]} x {LIVE_SIZE[1]}"
            lines.append(_row(words, moved))
            live.close()
    return lines


def _row(name: str, picture: Callable[[], None]) -> str:
    for _ in range(5):  # the size of live pictures settles
        picture()
    seconds = []
    for _ in range(PICTURES):
        begun = time.perf_counter()
        picture()
        seconds.append(time.perf_counter() - begun)
    return f"| {name} | {1 / statistics.median(seconds):.1f} | {1 / max(seconds):.1f} |"


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    main()
