"""The path shader at the ends of its range: finite and unbiased, or refused with a reason, within time and memory.

    python benchmarks/stress.py [--only PART]... [--resume] [-o FILE.md]

Each case runs in a process of its own. It is judged by what it must show, or by a twin that must show the same:

- ``white``: without absorption in a sky of radiance 1 every pixel is 1 (1e-5); with chromatic extinction, whose weights
  fluctuate, each channel's mean is;
- ``law``: with an albedo of 1 - e a body is darker by e times its mean number of collisions, ior^2 sigma_t 4V/S
  (Blanco & Fournier 2003), e^2 neglected;
- ``twin``: the scene moved, scaled, or without acceleration has the same mean in each channel;
- ``finite``: nothing but numbers, no light where there can be none.

Means are judged at a false-alarm rate of 1e-3 over all cases (Sidak). "seen" is the relative error that is found with
probability 0.95; where that is above half of the light the noise hides too much, and the case is "unseen", neither good
nor bad. Leaks must stay below 1e-5 of the paths, set-up below ``SETUP`` seconds, memory below ``MEMORY``.
--resume keeps what an earlier call has measured. Exit status 1 where a verdict is bad.

Blind to: errors below what is seen; light moved within an object; twins share what both do wrong.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from first_figures import machine
from scipy import stats

from renderer.render import Renderer, Settings
from renderer.scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    Translucent,
)
from renderer.study.judges import sidak
from renderer.tracing.acceleration import Acceleration
from sss_tools.errors import InputError
from sss_tools.medium import Medium
from sss_tools.memory import peak_memory
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, cylinder, ellipsoid, icosphere, moved, torus

ROOT = Path(__file__).resolve().parents[1]
SETUP, MEMORY, LIMIT = 60.0, 1.5e9, 400.0
THREADS = 2
FAMILY = 1e-3
LEAKS = 1e-5
UNSEEN = 0.5
"""Share of the light that noise may hide at most, for a comparison to say anything."""
ROUNDING = 1e-5
"""Pixels of white bodies may be off by so much."""
ABSORBED = 0.03
"""Of the light that a body must lose by the law, this share may be missing or too much: float32 multiplies by an albedo
of 1 - 1e-6 with errors of 2 % of what is absorbed."""

SKY = EnvironmentLight(radiance=np.ones(3))
CHROMATIC = np.array([1.0, 2.0, 4.0])


@dataclass
class Case:
    """What is rendered and how it is judged.

    judge    "white", "law", "twin" or "finite"
    twin     the scene that must look the same; None: the same scene without acceleration
    expected share of the light that is lost, for "law"
    seconds  of rendering, half of it for the twin: of each processor, whatever else it does
    passes   of each, at least
    """

    scene: Scene
    judge: str
    twin: Scene | None = None
    expected: float = 0.0
    seconds: float = 3.0
    passes: int = 8
    settings: dict = field(default_factory=dict)


def vector(*numbers: float) -> np.ndarray:
    """Three numbers."""
    return np.array(numbers, float)


def body(mesh: Mesh, sigma_t=10.0, albedo=1.0, g: float = 0.0, ior: float = 1.5, roughness: float = 0.0) -> SceneObject:
    """A translucent object."""
    return SceneObject(f"body {id(mesh)}", mesh, Translucent(Medium.from_albedo(albedo, sigma_t, g, ior), roughness))


def view(position=(0.3, 0.5, 2.5), target=(0, 0, 0), fov: float = 26.0, size: int = 32, up=(0, 1, 0)) -> Camera:
    """A camera; bodies are one unit large."""
    return Camera(vector(*position), vector(*target), vector(*up), fov, (size, size))


def scene(objects, lights=(SKY,), camera: Camera | None = None) -> Scene:
    """The objects under the sky."""
    named = tuple(replace(thing, name=f"body {k}") for k, thing in enumerate(objects))
    return Scene("mm", camera or view(), tuple(lights), named)


def bumpy(subdivisions: int = 4) -> Mesh:
    """An organic solid, not convex, one unit large."""
    ball = icosphere(1.0, subdivisions)
    x, y, z = ball.vertices.T
    height = 1 + 0.15 * np.sin(4 * x + 1) * np.sin(4 * y + 2) * np.sin(4 * z + 3)
    mesh = Mesh(ball.vertices * height[:, None], ball.faces)
    return Mesh(mesh.vertices / np.ptp(mesh.vertices, axis=0).max(), mesh.faces)


def placed_elsewhere(of: Scene, scale: float, offset) -> Scene:
    """The scene scaled and moved, media and lights with it: its picture is the same."""
    offset = vector(*offset)

    def place(point):
        return np.asarray(point, float) * scale + offset

    def light(one: Light) -> Light:
        if isinstance(one, PointLight):
            return replace(one, position=place(one.position), intensity=one.intensity * scale**2)
        if isinstance(one, RectangleLight):
            half = (one.half[0] * scale, one.half[1] * scale)
            return replace(one, center=place(one.center), target=place(one.target), half=half)
        return one

    objects = []
    for thing in of.objects:
        mesh = Mesh(place(thing.mesh.vertices), thing.mesh.faces)
        medium = thing.material.medium.scaled(1 / scale)
        objects.append(replace(thing, mesh=mesh, material=replace(thing.material, medium=medium)))
    camera = replace(of.camera, position=place(of.camera.position), target=place(of.camera.target))
    return replace(of, camera=camera, lights=tuple(map(light, of.lights)), objects=tuple(objects))


SUN = DirectionalLight(vector(1.0, -1.0, 0.6), np.full(3, 3.0))
LAMP = PointLight(vector(-1.2, 1.5, -0.8), np.full(3, 4.0))
SMALL_LAMP = RectangleLight(vector(-1.5, 2.0, 1.0), vector(0, 0, 0), vector(0, 0, 1), (0.2, 0.2), np.full(3, 30.0))


def _whites() -> dict[str, Callable[[], Case]]:
    cases: dict[str, Callable[[], Case]] = {}
    for path in (1e-4, 1e-2, 1.0, 10.0):
        for g in (-0.95, 0.0, 0.95):
            for ior in (1.0, 1.5, 2.5):
                if path == 1e-4 and (g != 0 or ior == 2.5) and (g, ior) != (0.95, 1.5):
                    continue
                size = {1e-4: 12, 1e-2: 24}.get(path, 32)
                for name, sigma_t in (("", 1 / path), (", chromatic", CHROMATIC / (2 * path))):
                    cases[f"white: mean free path {path:g}, g {g:g}, ior {ior:g}{name}"] = (
                        lambda sigma_t=sigma_t, g=g, ior=ior, size=size: Case(
                            scene([body(bumpy(), sigma_t, 1.0, g, ior)], camera=view(size=size)), "white"
                        )
                    )
    return cases


def _laws() -> dict[str, Callable[[], Case]]:
    """A ball from afar: its picture is the mean over all chords."""

    def case(sigma_t: float, ior: float, e: float) -> Case:
        ball, far = icosphere(0.5, 4), 100.0
        camera = view((0, 0, far), fov=float(np.degrees(2 * np.arctan(0.51 / far))), size=24)
        albedo = [1.0, 1 - e, 1 - e]
        lost = e * sigma_t * ior**2 * ball.volume / 1.02**2
        return Case(scene([body(ball, sigma_t, albedo, 0.0, ior)], camera=camera), "law", expected=lost, seconds=6)

    return {
        f"law: albedo 1 - {e:g}, mean free path {path:g}, ior {ior:g}": (
            lambda path=path, ior=ior, e=e: case(1 / path, ior, e)
        )
        for path, e in ((1e-4, 1e-6), (1e-3, 1e-6), (1e-2, 1e-5), (1.0, 1e-4), (10.0, 1e-3))
        for ior in (1.0, 1.5)
    }


def _places() -> dict[str, Callable[[], Case]]:
    lights = {"sky": (SKY,), "lamp with extent": (SMALL_LAMP,), "sun": (SUN,), "point": (LAMP,)}

    def case(which: str, far, scale: float, sigma_t) -> Case:
        here = scene([body(bumpy(3), sigma_t, 0.9, 0.3, 1.4)], lights[which], view(size=24))
        return Case(placed_elsewhere(here, scale, far), "twin", here, seconds=8, passes=64)

    places = {
        "100 000 sizes away": ((1e5, -1e5, 3e4), 1.0),
        "a thousandth as large": ((0, 0, 0), 1e-3),
        "a million times as large": ((5e7, 0, 1e6), 1e6),
    }
    return {
        f"place: {where}, {which}{name}": (
            lambda which=which, far=far, scale=scale, sigma_t=sigma_t: case(which, far, scale, sigma_t)
        )
        for where, (far, scale) in places.items()
        for which in lights
        for name, sigma_t in (("", 8.0), (", chromatic", 4 * CHROMATIC))
        if not name or where.startswith("100")
    }


def _grazing() -> dict[str, Callable[[], Case]]:
    def case(degrees: float, sigma_t, ior: float, judge: str, lights) -> Case:
        slope = np.radians(degrees)
        plate = moved(box((1, 0.1, 1)), (0, -0.05, 0))
        # from the height at which the middle of the plate is seen so flatly
        camera = view((2 * np.cos(slope), 2 * np.sin(slope), 0), fov=0.5, size=24)
        albedo = 1.0 if judge == "white" else 0.9
        return Case(scene([body(plate, sigma_t, albedo, 0.0, ior)], lights, camera), judge)

    cases: dict[str, Callable[[], Case]] = {}
    for degrees in (1.0, 0.01, 0.0001):
        for name, sigma_t in (("", 20.0), (", chromatic", 10 * CHROMATIC)):
            for ior in (1.0, 1.5):
                cases[f"grazing: {degrees:g} degrees, ior {ior:g}{name}"] = (
                    lambda degrees=degrees, sigma_t=sigma_t, ior=ior: case(degrees, sigma_t, ior, "white", (SKY,))
                )
            cases[f"grazing: {degrees:g} degrees, sun and point{name}"] = lambda degrees=degrees, sigma_t=sigma_t: case(
                degrees, sigma_t, 1.5, "finite", (SUN, LAMP)
            )
    grazed = replace(SUN, direction=vector(1, -1e-6, 0))
    cases["grazing: the sun is"] = lambda: case(20, 20.0, 1.5, "finite", (grazed,))
    return cases


def needles() -> dict[str, Mesh]:
    """Solids with triangles a thousand times and more as long as wide."""
    fan = cylinder(0.5, 1e-3, 4000)
    return {
        "spindle 1000:1": ellipsoid((0.5, 5e-4, 5e-4), 3),
        "rod 300:1 in 2000 strips": cylinder(1 / 600, 1.0, 2000),
        "disc of 4000 slivers": Mesh(fan.vertices[:, [0, 2, 1]], fan.faces[:, ::-1]),
        "sheet 10000:1": box((1, 1e-4, 1)),
    }


def _needles() -> dict[str, Callable[[], Case]]:
    def case(mesh: Mesh, sigma_t, judge: str, lights) -> Case:
        albedo = 1.0 if judge == "white" else 0.9
        return Case(scene([body(mesh, sigma_t, albedo, 0.0, 1.5)], lights), judge)

    cases: dict[str, Callable[[], Case]] = {}
    for shape, mesh in needles().items():
        for name, sigma_t in (("", 1000.0), (", chromatic", 500 * CHROMATIC)):
            cases[f"needles: {shape}{name}"] = lambda mesh=mesh, sigma_t=sigma_t: case(mesh, sigma_t, "white", (SKY,))
            cases[f"needles: {shape}, sun and point{name}"] = lambda mesh=mesh, sigma_t=sigma_t: case(
                mesh, sigma_t, "finite", (SUN, LAMP)
            )
    return cases


def _touching() -> dict[str, Callable[[], Case]]:
    half = box((0.5, 0.6, 0.6))
    ball = icosphere(0.25, 4)
    pairs = {
        "boxes that share a side": (moved(half, (-0.25, 0, 0)), moved(half, (0.25, 0, 0))),
        "boxes a millionth apart": (moved(half, (-0.25, 0, 0)), moved(half, (0.250001, 0, 0))),
        "boxes a hundred thousandth into each other": (moved(half, (-0.25, 0, 0)), moved(half, (0.24999, 0, 0))),
        "balls that touch": (moved(ball, (-0.25, 0, 0)), moved(ball, (0.25, 0, 0))),
        "a ball and the same ball again": (icosphere(0.5, 4), icosphere(0.5, 4)),
    }
    media = {"ior 1.5 and 1.3": (1.5, 1.3), "ior 1.5 twice": (1.5, 1.5), "ior 1 and 1.5": (1.0, 1.5)}

    def case(pair, iors, tint, judge: str, lights) -> Case:
        albedo = 1.0 if judge == "white" else 0.9
        things = [body(mesh, sigma * tint, albedo, 0.0, n) for mesh, sigma, n in zip(pair, (8, 5), iors, strict=True)]
        return Case(scene(things, lights, view((0.7, 0.6, 2.3))), judge)

    cases: dict[str, Callable[[], Case]] = {}
    for which, pair in pairs.items():
        for optics, iors in media.items():
            for name, tint in (("", 1.0), (", chromatic", CHROMATIC / 2)):
                cases[f"touching: {which}, {optics}{name}"] = lambda pair=pair, iors=iors, tint=tint: case(
                    pair, iors, tint, "white", (SKY,)
                )
        cases[f"touching: {which}, sun and point"] = lambda pair=pair: case(
            pair, (1.5, 1.5), CHROMATIC / 2, "finite", (SUN, LAMP)
        )
    return cases


def _beams() -> dict[str, Callable[[], Case]]:
    """Light without extent behind smooth boundaries, over the range of media."""

    def case(light: Light, sigma_t, g: float, ior: float, albedo=0.9, size: int = 16) -> Case:
        here = scene([body(bumpy(3), sigma_t, albedo, g, ior)], (light,), view(size=size))
        # connections are noisy where nearly all light goes straight on, or back
        seconds = 60 if abs(g) > 0.9 else 8
        return Case(placed_elsewhere(here, 1e3, (0, 0, 0)), "twin", here, seconds=seconds, passes=64)

    cases: dict[str, Callable[[], Case]] = {}
    for which, light in (("sun", SUN), ("point", LAMP)):
        for path in (1e-4, 1e-2, 1.0, 10.0):
            for name, sigma_t in (("", 1 / path), (", chromatic", CHROMATIC / (2 * path))):
                cases[f"beams: {which}, mean free path {path:g}{name}"] = lambda light=light, sigma_t=sigma_t: case(
                    light, sigma_t, 0.0, 1.5
                )
        for g, ior in ((0.95, 1.5), (-0.95, 1.5), (0.0, 1.001), (0.0, 2.5)):
            cases[f"beams: {which}, g {g:g}, ior {ior:g}"] = lambda light=light, g=g, ior=ior: case(
                light, 5 * CHROMATIC, g, ior
            )
        cases[f"beams: {which}, albedo 1 - 1e-6"] = lambda light=light: case(light, 20.0, 0.0, 1.5, 1 - 1e-6)
    return cases


def _options() -> dict[str, Callable[[], Case]]:
    """What acceleration chooses, against none of it."""

    def case(mesh: Mesh, sigma_t: float, albedo, ior: float) -> Case:
        return Case(scene([body(mesh, sigma_t, albedo, 0.0, ior)], (SKY, SMALL_LAMP), view(size=24)), "twin",
                    seconds=16, settings={"choose for": 250_000})  # fmt: skip

    return {
        f"options: albedo {albedo:g}, mean free path {path:g}, {shape}": (
            lambda mesh=mesh, path=path, albedo=albedo: case(mesh(), 1 / path, albedo, 1.4)
        )
        for shape, mesh in (("organic", bumpy), ("spindle", lambda: ellipsoid((0.5, 0.1, 0.1), 4)))
        for albedo, path in ((0.6, 0.02), (0.99, 0.01), (0.999, 0.003), (0.99, 0.1))
    }


def _large() -> dict[str, Callable[[], Case]]:
    """A million faces; lights without extent, which are connected to every collision, in a smaller picture."""

    def case(lights, sigma_t) -> Case:
        camera = replace(view(fov=32), resolution=(1920, 1080) if SMALL_LAMP in lights else (480, 270))
        ring = torus(0.35, 0.15, 1000, 500)
        whole = scene([body(ring, sigma_t, [0.99, 0.98, 0.97], 0.0, 1.4)], lights, camera)
        return Case(whole, "finite", seconds=0.0)

    lights = {
        "sky and rectangle": (SKY, SMALL_LAMP),
        "sun": (SKY, SUN),
        "point": (SKY, LAMP),
    }
    return {
        f"large: {which}{name}": (lambda which=which, sigma_t=sigma_t: case(lights[which], sigma_t))
        for which in lights
        for name, sigma_t in (("", 50.0), (", chromatic", 25 * CHROMATIC))
    }


CASES: dict[str, Callable[[], Case]] = {
    **_whites(), **_laws(), **_places(), **_grazing(), **_needles(), **_touching(), **_beams(), **_options(), **_large()
}  # fmt: skip


# ---- running one ----


def measure(name: str) -> dict:
    """Render a case in this process; its row."""
    case = CASES[name]()
    started = time.monotonic()
    try:
        film, row = _render(case.scene, case, 0, started)
        if case.judge == "twin":
            twin, other = _render(case.twin or case.scene, case, 1, time.monotonic(), plain=case.twin is None)
            for count in ("leaked", "paths", "non_finite"):
                row[count] += other[count]
            row["setup"] = max(row["setup"], other["setup"])
    except InputError as error:
        return {"refused": str(error), "seconds": time.monotonic() - started, "memory": peak_memory()}
    row["memory"] = peak_memory()
    mean, noise = _mean(film)
    row["lit"] = float(film.mean().max())
    if case.judge == "white":
        row["worst"] = float(np.abs(film.mean() - 1).max())
        # the same in all channels and samples but for rounding, or means
        row["difference"], row["noise"] = (mean - 1).tolist(), noise.tolist()
    elif case.judge == "law":
        lost = (1 - mean[1:]) / case.expected
        row["difference"], row["noise"] = (lost - 1).tolist(), (noise[1:] / case.expected).tolist()
    elif case.judge == "twin":
        mean_2, noise_2 = _mean(twin)
        row["difference"] = ((mean - mean_2) / mean_2).tolist()
        row["noise"] = (np.hypot(noise, noise_2) / mean_2).tolist()
    return row | {"judge": case.judge}


def _render(of: Scene, case: Case, seed: int, started: float, plain: bool = False):
    renderer = Renderer(of, Settings(shader="path", seed=seed, threads=THREADS))
    pixels = case.settings.get("choose for")
    if plain:
        renderer.acceleration = Acceleration.none(renderer.traced.media.count)
    elif pixels:
        renderer.acceleration = Acceleration.chosen(renderer.traced, pixels)
    begun, used = time.monotonic(), time.process_time()
    seconds = case.seconds / (2 if case.judge == "twin" else 1)
    first = []

    def done(_: int) -> bool:
        first.append(time.monotonic() - begun)
        spent = (time.process_time() - used) / THREADS
        return spent > seconds and (renderer.film.passes >= case.passes or seconds == 0)

    renderer.run(range(100_000), done)
    tally = renderer.tally
    return renderer.film, {
        "setup": begun - started,
        "first": first[0],
        "seconds": time.monotonic() - started,
        "passes": renderer.film.passes,
        "leaked": tally.leaked,
        "paths": tally.samples,
        "non_finite": tally.non_finite,
        "finite": bool(np.isfinite(renderer.film.mean()).all()),
    }


def _mean(film) -> tuple[np.ndarray, np.ndarray]:
    """(3,) mean of the picture, and its standard error: pixels are independent."""
    error = film.stderr() if film.passes > 1 else np.zeros((1, 1, 3))
    return film.mean().mean(axis=(0, 1)), np.sqrt((error**2).sum(axis=(0, 1))) / error[..., 0].size


# ---- judging all ----


def verdict(row: dict, level: float) -> tuple[str, str]:
    """What was found, and whether that is good: "yes", "refused", "unseen" or what is wrong."""
    if "refused" in row:
        return row["refused"], "refused"
    if "failed" in row:
        return row["failed"], "FAILED"
    wrong = []
    if not row["finite"] or row["non_finite"]:
        wrong.append("not finite")
    # Poisson: as many or more leaks happen with this probability at the rate allowed
    if stats.poisson.sf(row["leaked"] - 1, LEAKS * row["paths"]) < level:
        wrong.append("leaks")
    if row["setup"] > SETUP:
        wrong.append("slow")
    if row["memory"] > MEMORY:
        wrong.append("memory")
    found, seen = "", 0.0
    if row["judge"] != "finite":
        critical = stats.norm.isf(level / 6)
        difference, noise = np.array(row["difference"]), np.array(row["noise"])
        k = int(np.argmax(np.abs(difference)))
        seen = (critical + stats.norm.isf(0.05)) * noise[k]
        found = f"{100 * difference[k]:+.2g} %, seen {100 * seen:.2g} %"
        if row["judge"] == "white" and row["worst"] < ROUNDING:
            found, seen = f"{row['worst']:.1g} in the worst pixel", 0.0
        else:
            allowed = ABSORBED if row["judge"] == "law" else ROUNDING
            if (np.abs(difference) > critical * noise + allowed).any():
                wrong.append("biased")
    return found, ", ".join(wrong) or ("unseen" if seen > UNSEEN else "yes")


def main() -> int:
    """The command; 1 where a verdict is bad."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", action="append", default=[], metavar="PART", help="cases with this in their name")
    parser.add_argument("--resume", action="store_true", help="keep what an earlier call has measured")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds that a case may take (default: 400)")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "stress.json", help="where rows are kept")
    parser.add_argument("--note", default="", help="what the page says of the machine")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "stress.md")
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.one)))
        return 0
    options.work.parent.mkdir(parents=True, exist_ok=True)
    rows = json.loads(options.work.read_text()) if options.work.is_file() else {}
    for name in CASES:
        wanted = not options.only or any(part in name for part in options.only)
        if wanted and not (options.resume and name in rows):
            rows[name] = _in_a_process(name, options.limit)
            options.work.write_text(json.dumps(rows))
            print(name, *verdict(rows[name], sidak(FAMILY, len(CASES))), file=sys.stderr, sep=" | ")
    rows = {name: rows[name] for name in CASES if name in rows}
    text, good = markdown(rows, options.note)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(text)
    return 0 if good else 1


def _in_a_process(name: str, limit: float) -> dict:
    command = [sys.executable, __file__, "--one", name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=True)
    except subprocess.TimeoutExpired:
        return {"failed": f"took longer than {limit:g} s"}
    except subprocess.CalledProcessError as error:
        return {"failed": (error.stderr.strip().splitlines() or ["no message"])[-1]}
    return json.loads(done.stdout.splitlines()[-1])


def markdown(rows: dict[str, dict], note: str) -> tuple[str, bool]:
    """The page, and whether all is well."""
    about, level = machine(None), sidak(FAMILY, len(CASES))
    missing = "; ".join(name for name in CASES if name not in rows)
    lines = [
        "# The path shader at the ends of its range",
        "",
        f"How each case is judged, and what that is blind to, is said in `benchmarks/stress.py`. Bodies are one unit "
        f"large, renders last some seconds. {len(rows)} of {len(CASES)} cases were measured. "
        f"Family-wise false-alarm rate {FAMILY:g}. {about['processor']}, "
        f"{about['threads']} threads; Python {about['python']}, NumPy {about['numpy']}, embreex {about['embreex']}.",
        *(["", note] if note else []),
        "",
        *([f"Not measured: {missing}.", ""] if missing else []),
        "| case | set-up s | first pass s | passes | MB | leaks | found | good |",
        "|---|---:|---:|---:|---:|---:|---|---|",
    ]
    good = True
    for name, row in rows.items():
        found, word = verdict(row, level)
        good &= word in ("yes", "refused", "unseen")
        cells = [
            f"{row['setup']:.1f}" if "setup" in row else "",
            f"{row['first']:.2g}" if "first" in row else "",
            f"{row['passes']:,}" if "passes" in row else "",
            f"{row['memory'] / 1e6:.0f}" if "memory" in row else "",
            f"{row['leaked'] / row['paths']:.1g}" if "leaked" in row else "",
        ]
        lines.append(f"| {name} | {' | '.join(cells)} | {found} | {word} |")
    return "\n".join([*lines, ""]), good


if __name__ == "__main__":
    raise SystemExit(main())
