"""How wrong is the picture of a solid with holes? Solids whose shape is known, cut open, against themselves whole.

    PYTHONPATH=. python benchmarks/holes.py [--passes N] [--only NAME] [--angles] [--meshes FOLDER] [-o FOLDER]

Each solid loses 1 to 20 % of its area in one or three places, to round holes and to slits, at the front, the side, the
back and below. It is rendered by the path shader whole, with ``auto`` hole handling, and by the thesis' rule
(``terminate``), from the front and the back, under light of radiance 1 from
everywhere (red channel), and from one half (green: from the right; blue: from the camera's half). The error is the mean
over the pixels and two lights of |difference| over the mean radiance of the whole solid. Noise is what the same mean
would be if there were nothing but noise: sqrt(2 / pi) times the standard error of the difference of batches of passes
with common random numbers. The measured error contains it.

The open scan of the bunny is held, with ``auto``, against the path shader on its repaired solid, in the standard stage
and from below, where its holes are.

Writes holes.json and holes.md into FOLDER, docs/ by default.
"""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.first_figures import machine
from renderer.render import Renderer, Settings
from renderer.scene.description import Camera, EnvironmentLight, Scene, SceneObject, Translucent
from renderer.scene.staging import stage_mesh
from sss_tools import shapes
from sss_tools.elephant import elephant
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import RayCaster, UnitFrame
from sss_tools.repair.ladder import repair_mesh
from sss_tools.sealing import seal
from sss_tools.winding import winding_numbers

PIXELS = 12
BATCHES = 8
ALBEDO, DEPTH = 0.98, 5.0
"""Of the medium; radius of the ball with the solid's ratio of volume to area, in mean free paths."""
SMALL = 30.0
"""Degrees: half angle of the holes that the target is set for."""
TARGET, BUNNY_TARGET = 0.015, 0.02
CORPUS = ("spot.obj", "fandisk.obj", "homer.obj")
PLACES = {"front": (0.2, 0.3, 1.0), "side": (1.0, 0.2, 0.1), "back": (-0.3, 0.1, -1.0), "below": (0.1, -1.0, 0.2)}
CUTS = [
    # share of the area, shape, places
    (0.01, "round", ("front",)),
    (0.02, "round", ("side",)),
    (0.02, "slit", ("front",)),
    (0.05, "round", ("front",)),
    (0.05, "round", ("back",)),
    (0.05, "slit", ("side",)),
    (0.05, "round", ("front", "side", "below")),
    (0.10, "round", ("below",)),
    (0.10, "round", ("front", "side", "back")),
    (0.20, "round", ("side",)),
    (0.20, "round", ("front", "back", "below")),
]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passes", type=int, default=40, help="of each batch and view")
    parser.add_argument("--bunny-passes", type=int, default=40, help="of each batch and view")
    parser.add_argument("--only", help='one solid, or "bunny": the rest of holes.json stays as it is')
    parser.add_argument("--meshes", type=Path, default=Path("../shared/meshes"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    parser.add_argument(
        "--angles", action="store_true", help="only measure the angles of the cases in holes.json again"
    )
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    kept = options.output / "holes.json"
    figures: dict[str, Any] = {"machine": machine(2), "cases": [], "bunny": []}
    if options.only and kept.exists():
        figures |= json.loads(kept.read_text())
    if options.angles:
        figures |= json.loads(kept.read_text())
        for name, mesh in solids(options.meshes).items():
            mine = [row for row in figures["cases"] if row["solid"] == name]
            for row, (share, shape, places) in zip(mine, CUTS, strict=True):
                row["whole_angle"] = whole_angle(mesh, cut_open(mesh, share, shape, places))
                print(
                    f"{name} {share} {shape} {'+'.join(places)}: {row['half_angle']} {row['whole_angle']}", flush=True
                )
        kept.write_text(json.dumps(figures, indent=1) + "\n")
        (options.output / "holes.md").write_text(markdown(figures))
        return
    bunny = options.meshes / "bunny_stanford.obj"
    if options.only in (None, "bunny") and bunny.exists():
        figures["bunny"] = bunny_measured(bunny, options.bunny_passes)
    for name, mesh in solids(options.meshes).items():
        if options.only in (None, name):
            others = [row for row in figures["cases"] if row["solid"] != name]
            figures["cases"] = others + solid_measured(name, mesh, options.passes)
            kept.write_text(json.dumps(figures, indent=1) + "\n")
    kept.write_text(json.dumps(figures, indent=1) + "\n")
    (options.output / "holes.md").write_text(markdown(figures))


def solids(folder: Path) -> dict[str, Mesh]:
    """Closed solids by name."""
    made = {
        "ball": shapes.icosphere(1.0, 5),
        "ellipsoid": shapes.ellipsoid((1.0, 0.7, 0.5), 5),
        "torus": shapes.torus(1.0, 0.4, 128, 64),
        "elephant": elephant(0.02),
    }
    for name in CORPUS:
        if (folder / name).exists():
            made[Path(name).stem] = load_mesh(folder / name)
    return made


# ---- cutting ----


def cut_open(mesh: Mesh, share: float, shape: str, places) -> Mesh:
    """The mesh without ``share`` of its area: faces near the point farthest out in each of the directions ``places``.

    A slit is four times as long as wide. What comes off altogether is left out, and so is what hangs by a corner: loops
    that touch themselves are no simple curves, and ``auto`` leaves them to the thesis' rule.
    """
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    distance = np.full(len(middles), np.inf)
    for place in places:
        outward = np.array(PLACES[place]) / np.linalg.norm(PLACES[place])
        centre = np.argmax((middles - mesh.bounds.mean(axis=0)) @ outward)
        offset = middles - middles[centre]
        if shape == "slit":
            along = np.cross(mesh.face_normals[centre], (0.3, 0.9, 0.3))
            along /= np.linalg.norm(along)
            offset = offset - 0.75 * (offset @ along)[:, None] * along
        # round about corners nothing is near that is far along the surface
        around = mesh.face_normals @ mesh.face_normals[centre] < -0.5
        distance = np.minimum(distance, np.linalg.norm(offset, axis=1) + 1e3 * around)
    order = np.argsort(distance, kind="stable")
    gone = np.searchsorted(np.cumsum(mesh.face_areas[order]), share * mesh.area)
    faces = mesh.topology.faces[np.sort(order[gone:])]
    while True:
        topology = Mesh(mesh.topology.points, faces).topology
        largest = np.bincount(topology.component_of_face).argmax()
        pinched = topology.points[topology.pinched_points]
        hangs = (mesh.topology.points[faces][:, :, None] == pinched).all(axis=3).any(axis=(1, 2))
        kept = (topology.component_of_face == largest) & ~hangs
        if kept.all():
            return Mesh(topology.points, topology.faces)
        faces = faces[kept]


def whole_angle(whole: Mesh, opened: Mesh) -> float | None:
    """Degrees that the widest loop of ``opened`` subtends from inside ``whole``; None where none has a cap.

    Of the cone with the solid angle that its cap takes of the sphere around the middle of the stretch inside ``whole``
    along the cap's normal. ``HoleReport.half_angle`` cannot know ``whole``: where a limb is cut off, it is the angle
    from inside the stump.
    """
    sealed = seal(opened)
    caps = sealed.mesh.faces[sealed.faces :]
    if len(caps) == 0:
        return None
    component = Mesh(sealed.mesh.vertices, caps).topology.component_of_face
    frame = UnitFrame.around(*whole.bounds)
    caster = RayCaster(frame.points_in(whole.vertices), whole.faces)
    widest = 0.0
    for k in range(component.max() + 1):
        faces = caps[component == k]
        cap = Mesh(sealed.mesh.vertices, faces)
        outward = cap.face_vectors.sum(axis=0)
        outward /= max(float(np.linalg.norm(outward)), 1e-300)
        middle = cap.face_areas @ cap.vertices[faces].mean(axis=1) / cap.area
        # a cap may lie outside: it starts from just below
        start = frame.points_in(middle - 1e-3 * whole.longest_side * outward)
        ends = []
        for way in (outward, -outward):
            distance, _ = caster.closest(start.astype(np.float32).reshape(3, 1), way.astype(np.float32).reshape(3, 1))
            ends.append(start + float(distance[0]) * way)
        place = frame.points_out((ends[0] + ends[1]) / 2)
        share = abs(float(winding_numbers(place, cap.vertices, faces)[0]))
        widest = max(widest, float(np.degrees(np.arccos(np.clip(1 - 2 * share, -1, 1)))))
    return widest


# ---- rendering ----


def half_skies() -> EnvironmentLight:
    """Radiance 1: in red from everywhere, in green from +x, in blue from +z."""
    rows, columns = 64, 128
    longitude = (np.arange(columns) + 0.5) / columns * 2 * np.pi - np.pi
    image = np.zeros((rows, columns, 3), np.float32)
    image[..., 0] = 1
    # the centre column looks along -z, columns grow towards +x
    image[..., 1] = np.sin(longitude) > 0
    image[..., 2] = -np.cos(longitude) > 0
    return EnvironmentLight(image=image)


def views(mesh: Mesh) -> list[Camera]:
    """From the front and from the back, the whole solid in the picture."""
    middle, up = mesh.bounds.mean(axis=0), np.array([0.0, 1.0, 0.0])
    distance = 2.1 * mesh.diagonal
    return [
        Camera(middle + side * distance * np.array([0.35, 0.3, 0.89]), middle, up, 28.0, (PIXELS, PIXELS))
        for side in (1, -1)
    ]


def medium_for(mesh: Mesh) -> Translucent:
    """``DEPTH`` mean free paths to the middle."""
    return Translucent(Medium.from_albedo(ALBEDO, DEPTH / mesh.mean_inradius, ior=1.5))


def pictures(mesh: Mesh, material, cameras, lights, handling: str, passes: int):
    """(batches, views, h, w, 3) means of batches of passes, what was met first, and the last renderer."""
    shown, first = [], []
    for camera in cameras:
        scene = Scene("mm", camera, lights, (SceneObject("solid", mesh, material),))
        renderer = Renderer(scene, Settings(shader="path", hole_handling=handling, seed=7), passes)
        batches = []
        for batch in range(BATCHES):
            before = renderer.film.sum.copy()
            renderer.run(range(batch * passes, (batch + 1) * passes))
            batches.append((renderer.film.sum - before) / passes)
        shown.append(batches)
        first.append(renderer.object_id >= 0)
    return np.array(shown).swapaxes(0, 1), np.array(first), renderer


def compared(shown, reference, where) -> dict[str, list[float]]:
    """Mean |difference| over the pixels of ``where`` and its noise, relative, for each channel."""
    difference = (shown - reference)[:, where]
    mean = reference[:, where].mean(axis=(0, 1))
    error = np.abs(difference.mean(axis=0)).mean(axis=0) / mean
    stderr = difference.std(axis=0, ddof=1) / np.sqrt(len(difference))
    noise = np.sqrt(2 / np.pi) * stderr.mean(axis=0) / mean
    return {"error": error.tolist(), "noise": noise.tolist(), "signed": (difference.mean(axis=(0, 1)) / mean).tolist()}


def solid_measured(name: str, mesh: Mesh, passes: int) -> list[dict]:
    """All cuts of one solid."""
    material, cameras, lights = medium_for(mesh), views(mesh), (half_skies(),)
    whole, where, _ = pictures(mesh, material, cameras, lights, "strict", passes)
    rows = []
    for share, shape, places in CUTS:
        opened = cut_open(mesh, share, shape, places)
        row: dict[str, Any] = {
            "solid": name,
            "share": 1 - opened.area / mesh.area,
            "shape": shape,
            "places": list(places),
            "whole_angle": whole_angle(mesh, opened),
        }
        for handling in ("auto", "terminate"):
            shown, _, renderer = pictures(opened, material, cameras, lights, handling, passes)
            (hole,) = renderer.holes
            if handling == "auto":
                row |= {"handling": hole.handling, "half_angle": hole.half_angle, "loops": hole.loops,
                        "capped": hole.capped, "expected": hole.expected_error}  # fmt: skip
                row["leaked"] = renderer.tally.leaked / renderer.tally.samples
            row[handling] = compared(shown, whole, where)
        rows.append(row)
        print(
            f"{name} {100 * row['share']:.1f} % {shape} {'+'.join(places)}: {row['handling']}, {row['capped']} of "
            f"{row['loops']} loops, half angle {row['half_angle'] or 0:.0f}; auto {percent(row['auto'])}, "
            f"terminate {percent(row['terminate'])}",
            flush=True,
        )
    return rows


def bunny_measured(path: Path, passes: int) -> list[dict]:
    """The open scan against its repaired solid, in the standard stage and from below."""
    scan = load_mesh(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solid, _ = repair_mesh(scan, unsafe=True)
    assert solid is not None
    staged = stage_mesh(solid, size=(2 * PIXELS, 2 * PIXELS))
    camera = staged.camera
    below = replace(camera, position=2 * camera.target - camera.position, up=np.array([0.0, 0.0, 1.0]))
    rows = []
    for view, eye, lights in (("stage", camera, staged.lights), ("from below, uniform sky", below, (half_skies(),))):
        material = staged.objects[0].material
        reference, where, _ = pictures(solid, material, [eye], lights, "strict", passes)
        shown, _, renderer = pictures(scan, material, [eye], lights, "auto", passes)
        rule, _, _ = pictures(scan, material, [eye], lights, "terminate", passes)
        (hole,) = renderer.holes
        rows.append({"view": view, "handling": hole.handling, "loops": hole.loops, "half_angle": hole.half_angle,
                     "expected": hole.expected_error, "auto": compared(shown, reference, where),
                     "terminate": compared(rule, reference, where)})  # fmt: skip
        print(f"bunny, {view}: auto {percent(rows[-1]['auto'])}, terminate {percent(rows[-1]['terminate'])}")
    return rows


# ---- telling ----


def percent(measured: dict) -> str:
    """Errors of the channels, and the largest noise."""
    return "/".join(f"{100 * e:.2f}" for e in measured["error"]) + f" % (noise {100 * max(measured['noise']):.2f} %)"


def worst_light(row: dict, handling: str) -> float:
    """The error under the light that is worst for it."""
    return max(row[handling]["error"])


def markdown(figures: dict) -> str:
    """The page."""
    rows = figures["cases"]
    small = [row for row in rows if widest(row) <= SMALL]
    wide = [row for row in rows if widest(row) > SMALL]
    lines = [
        "# Holes",
        "",
        "How wrong is the picture of a solid with holes, against the picture of the same solid whole? `auto` closes",
        "them for light by virtual caps; `terminate` is the thesis' rule: what leaves through a hole takes the colour",
        "of the material. Errors are means of |difference| over the mean radiance of the whole solid, seen from the",
        "front and from the back, path shader; sky: radiance 1 from everywhere; half: from one half only, the worse",
        f"of two. Medium: albedo {ALBEDO}, index 1.5, {DEPTH:g} mean free paths from the middle to the surface.",
        "The noise is what the error would be of nothing but noise; errors contain it. `expected` is what",
        "`--report` predicts from the angles that the loops subtend from inside. Half angles are those from inside",
        "what is left, which is all that a renderer can know, and from inside the whole solid: where a limb is cut",
        "off with its surface, as of the fandisk, the first is that from inside the stump. The larger one counts.",
        "",
    ]
    if rows:
        lines += ["| cases | count | auto, mean | auto, worst | terminate, mean | terminate, worst |",
                  "|---|---:|---:|---:|---:|---:|"]  # fmt: skip
        for title, some in ((f"half angle up to {SMALL:g}°", small), (f"above {SMALL:g}°", wide)):
            if some:
                values = {how: [worst_light(row, how) for row in some] for how in ("auto", "terminate")}
                lines.append(
                    f"| {title} | {len(some)} | "
                    + " | ".join(f"{100 * f(values[how]):.2f} %" for how in values for f in (np.mean, max))
                    + " |"
                )
        worse = [row for row in rows if behind(row) > 0]
        own = [row for row in rows if (row["half_angle"] or 0) <= SMALL]
        over = [row for row in small if worst_light(row, "auto") > TARGET]
        lines += [
            "",
            f"By the renderer's own angles {len(own)} cases are up to {SMALL:g}°, with a mean of "
            f"{100 * np.mean([worst_light(row, 'auto') for row in own] or [0]):.2f} %.",
            "",
            f"Target: at most {100 * TARGET:g} % up to {SMALL:g}°. {len(small) - len(over)} of {len(small)} cases meet "
            f"it each for itself. `auto` is worse than the thesis' rule, by more than the noise of both, in "
            f"{len(worse)} of {len(rows)} cases.",
            "",
            "Solids with cases that miss it: " + (", ".join(sorted({row["solid"] for row in over})) or "none") + ".",
            "",
            "| solid | cut | handling | caps | half angle, whole | expected | auto: sky | half | terminate: sky | half "
            "| noise |",
            "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        ]
        for row in rows:
            lines.append(
                f"| {row['solid']} | {100 * row['share']:.1f} % {row['shape']}, {', '.join(row['places'])} | "
                f"{row['handling']} | {row['capped']} of {row['loops']} | {row['half_angle'] or 0:.0f}°, "
                f"{row.get('whole_angle') or 0:.0f}° | "
                + (f"{100 * row['expected']:.1f} %" if row["expected"] is not None else "–")
                + " | "
                + " | ".join(errors(row[how]) for how in ("auto", "terminate"))
                + f" | {100 * max(row['auto']['noise']):.2f} % |"
            )
    if figures["bunny"]:
        lines += [
            "",
            "## The bunny",
            "",
            "The open scan against the path shader on its repaired solid (`sss-check --unsafe-fixes`). Target: at most "
            f"{100 * BUNNY_TARGET:g} %.",
            "",
            "| view | handling | loops | expected | auto | terminate | noise |",
            "|---|---|---:|---:|---:|---:|---:|",
        ]
        for row in figures["bunny"]:
            auto, rule = (max(row[how]["error"]) for how in ("auto", "terminate"))
            lines.append(
                f"| {row['view']} | {row['handling']} | {row['loops']} | {100 * row['expected']:.1f} % | "
                f"{100 * auto:.2f} % | {100 * rule:.2f} % | {100 * max(row['auto']['noise']):.2f} % |"
            )
    about = figures["machine"]
    lines += [
        "",
        f"{about['processor']}; Python {about['python']}, NumPy {about['numpy']}. Made by `benchmarks/holes.py`.",
    ]
    return "\n".join([*lines, ""])


def widest(row: dict) -> float:
    """The larger of the angles from inside what is left and from inside the whole."""
    return max(row["half_angle"] or 0, row.get("whole_angle") or 0)


def behind(row: dict) -> float:
    """By how much the error of ``auto`` exceeds that of the thesis' rule beyond the noise of both, in the
    light for which it does so most."""
    auto, rule = (np.array(row[how]["error"]) for how in ("auto", "terminate"))
    noise = np.hypot(*(np.array(row[how]["noise"]) for how in ("auto", "terminate")))
    return float((auto - rule - noise).max())


def errors(measured: dict) -> str:
    """Under the sky, and under the worse half."""
    sky, *halves = measured["error"]
    return f"{100 * sky:.2f} % | {100 * max(halves):.2f} %"


if __name__ == "__main__":
    main()
