"""Error of the fast shaders and of their rivals against the converged path shader.

    PYTHONPATH=. python benchmarks/fast_shaders.py [--meshes FOLDER] [--cache FOLDER] [--only BODY]... [-o FOLDER]

Bodies: a ball, ellipsoids of 2:1 and 4:1, flat and long, a slab, and six real closed meshes (of --meshes, left out
where absent). Three media, given by their optical radius tau = 3 V/A over the transport mean free path (the ball's
radius; V volume, A area), each with reduced albedos of .9, .99 and .999 in its three channels. Three directions of
parallel light: 40, 90 and 140 degrees from the way to the camera. 96 x 96 pixels; those that the body covers count.

Boundaries are matched or smooth, so that a parallel light makes no highlight: pictures show scattered light, and the
reflection of the body in itself. Path's own noise is taken out of squared errors by splitting its passes in two
halves, and stays in FLIP, whose floor the row "path" shows: one half of the passes held against the other.

References are kept in --cache, as long as scenes stay what they are, and so are the rows of all cases; empty it when
path changes. Writes fast_shaders.md and images/fast_shaders.png into FOLDER, docs/ by default.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.fast_shader_rivals import Dipole, Lambert, LambertBehind, Thesis, Wrap, outgoing_share
from renderer.optics.dielectric import transmittance
from renderer.output.film import Film
from renderer.render import Renderer, Settings
from renderer.scene.camera import view_basis
from renderer.scene.description import DirectionalLight, Scene, SceneObject, Translucent
from renderer.scene.fingerprint import with_hash
from renderer.scene.staging import frame_camera
from renderer.shaders import plumb, scalar
from renderer.study.judges import FLOOR, flip
from sss_tools.loading import load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.shapes import ellipsoid, icosphere, slab

SIZE = (96, 96)
ALBEDOS = (0.9, 0.99, 0.999)

MEDIA = {
    # optical radius, index of refraction, passes of the reference
    "thin": (2.0, 1.3, 24),
    "middle": (6.0, 1.0, 48),
    "dense": (20.0, 1.5, 12),
}
LIGHTS = {"front": 40.0, "side": 90.0, "back": 140.0}
MESHES = ("spot.obj", "homer.obj", "rocker-arm.obj", "armadillo_odedstein.obj", "fandisk.obj", "lucy_vtk.ply")
GROUPS = {
    "ball": ("ball",),
    "2:1": ("flat 2:1", "long 2:1"),
    "4:1": ("flat 4:1", "long 4:1"),
    "slab": ("slab",),
    "meshes": tuple(name.partition(".")[0].partition("_")[0] for name in MESHES),
}
FRAMES = 1
"""Passes of the fast shaders, which have next to no noise."""
LEAST_PIXELS = 30
"""A part of a picture with fewer is not judged."""


@dataclass(frozen=True)
class Case:
    """One picture: a body, a medium, a direction of the light."""

    body: str
    medium: str
    light: str
    scene: Scene

    @property
    def group(self) -> str:
        """Of bodies, as the table has it."""
        return next(group for group, bodies in GROUPS.items() if self.body in bodies)


def main() -> None:
    """The command."""
    options = _options()
    rows: list[dict] = []
    earlier = options.cache / "rows.json"
    if options.only and earlier.is_file():
        rows = [row for row in json.loads(earlier.read_text()) if row["body"] not in options.only]
    options.output.mkdir(parents=True, exist_ok=True)
    for body, mesh in bodies(options.meshes):
        if options.only and body not in options.only:
            continue
        for case in cases(body, mesh):
            rows += measure(case, mesh, options.cache)
        # a page after each body: what is done stays where the rest is interrupted
        options.cache.mkdir(parents=True, exist_ok=True)
        earlier.write_text(json.dumps(rows, separators=(",", ":")) + "\n")
        (options.output / "fast_shaders.md").write_text(markdown(rows))
        draw(rows, options.output / "images" / "fast_shaders.png")
        print(body, flush=True)


def bodies(folder: Path | None) -> Iterator[tuple[str, Mesh]]:
    """Names and meshes; those of our own turned askew to camera and lights."""
    shapes = {
        "ball": icosphere(1.0, 4),
        "flat 2:1": ellipsoid((2, 2, 1), 4),
        "long 2:1": ellipsoid((1, 1, 2), 4),
        "flat 4:1": ellipsoid((4, 4, 1), 4),
        "long 4:1": ellipsoid((1, 1, 4), 4),
        "slab": slab(8.0, 1.0),
    }
    turn, _ = np.linalg.qr(np.array([[0.8, -0.3, 0.5], [0.4, 0.9, -0.2], [-0.4, 0.5, 0.8]]))
    turn *= np.sign(np.linalg.det(turn))
    for name, mesh in shapes.items():
        yield name, Mesh(mesh.vertices @ turn.T, mesh.faces)
    if folder is None or not folder.is_dir():
        return
    for file in MESHES:
        yield file.partition(".")[0].partition("_")[0], load_mesh(folder / file)


def cases(body: str, mesh: Mesh) -> Iterator[Case]:
    """All media and lights of a body."""
    camera = frame_camera(mesh, SIZE)
    right, up, back = _axes(camera)
    radius = 3 * mesh.volume / mesh.area
    for medium, (tau, ior, _) in MEDIA.items():
        material = Translucent(Medium.from_albedo(ALBEDOS, tau / radius, ior=ior))
        thing = SceneObject(body, mesh, material)
        for light, degrees in LIGHTS.items():
            angle = np.radians(degrees)
            # to the left and a little from above
            towards = np.cos(angle) * back + np.sin(angle) * (0.9 * right + np.sqrt(1 - 0.81) * up)
            lamp = DirectionalLight(-towards, np.full(3, np.pi))
            yield Case(body, medium, light, with_hash(Scene("mm", camera, (lamp,), (thing,))))


def _axes(camera) -> tuple[NDArray, NDArray, NDArray]:
    forward, left, up = view_basis(camera)
    return -left, up, -forward


# ---- pictures ----


def halves(case: Case, folder: Path) -> tuple[Film, Film]:
    """The even and the odd passes of path, from the cache where they are there."""
    passes = MEDIA[case.medium][2] // (2 if case.group == "meshes" else 1)
    file = folder / f"{case.scene.hash}.npz"
    if file.is_file():
        arrays = dict(np.load(file, allow_pickle=False))
        return tuple(  # type: ignore[return-value]
            Film.from_arrays({key.partition(":")[2]: value for key, value in arrays.items() if key.startswith(half)})
            for half in ("even", "odd")
        )
    renderer = Renderer(case.scene, Settings(shader="path", hole_handling="terminate"))
    blank = renderer.film
    films = [Film.blank(blank.resolution, blank.scene_hash, blank.seed) for _ in range(2)]
    for first, film in enumerate(films):
        renderer.film = film
        renderer.run(range(first * passes // 2, (first + 1) * passes // 2))
    folder.mkdir(parents=True, exist_ok=True)
    named = zip(("even", "odd"), films, strict=True)
    stored: dict[str, Any] = {f"{half}:{key}": value for half, film in named for key, value in film.arrays().items()}
    np.savez_compressed(file, **stored)
    return films[0], films[1]


@dataclass(frozen=True)
class Judged:
    """What pictures are held against.

    even, odd  (h, w, 3) halves of path's passes, and ``mean`` of both
    inside     (h, w) pixels the body covers
    cosine     (h, w) N.L where the ray through the middle of a pixel meets the body, else NaN
    """

    even: NDArray
    odd: NDArray
    inside: NDArray[np.bool_]
    cosine: NDArray

    @property
    def mean(self) -> NDArray:
        """All passes."""
        return (self.even + self.odd) / 2

    def parts(self) -> dict[str, NDArray[np.bool_]]:
        """All of the body, the lit and the unlit side."""
        return {"all": self.inside, "lit": self.inside & (self.cosine > 0), "unlit": self.inside & (self.cosine < 0)}


def measure(case: Case, mesh: Mesh, folder: Path, shaders: tuple = ()) -> list[dict]:
    """Rows of errors: one a shader, part and channel. ``shaders`` replaces all rivals."""
    films = halves(case, folder)
    renderer = Renderer(case.scene, Settings(shader="plumb", hole_handling="terminate"))
    _, view, cosine = _middles(renderer, case)
    inside = np.logical_and(*(film.object_pixels() for film in films)) & np.isfinite(cosine)
    judged = Judged(films[0].mean(), films[1].mean(), inside, cosine)
    rivals: tuple = shaders
    if not shaders:
        wrap = Wrap()
        ior = MEDIA[case.medium][1]
        share = outgoing_share(ior) / transmittance(np.clip(view[inside], 1e-3, 1), ior)
        # the lamp's irradiance is pi
        wrap.fit(cosine[inside], judged.mean[inside] * share[:, None] / np.pi)
        rivals = (plumb, scalar, wrap, Lambert(), LambertBehind(), Thesis(), Dipole(mesh, renderer.traced))
    rows = []
    for rival in rivals:
        renderer._fast_bodies[0].shader = rival
        renderer.film = Film.blank(SIZE)
        renderer.run(range(FRAMES))
        rows += judge(case, rival.NAME, renderer.film.mean(), judged)
    if not shaders:
        rows += judge(case, "path", judged.even, replace(judged, even=judged.odd))
    return rows


def _middles(renderer: Renderer, case: Case) -> tuple[NDArray, NDArray, NDArray]:
    """Of the rays through the middles of pixels: normals (3, h, w), cosines to the camera and to the light (h, w)."""
    directions = renderer.camera.centre_directions()
    origins = np.repeat(renderer.camera.origin[:, None], directions.shape[1], axis=1)
    _, triangle = renderer.traced.closest(origins, directions)
    normal = renderer.traced.triangle_normal[:, triangle]
    lamp = case.scene.lights[0]
    assert isinstance(lamp, DirectionalLight)
    to_light = -lamp.direction / np.linalg.norm(lamp.direction)
    view = np.where(triangle >= 0, -np.einsum("ij,ij->j", normal, directions), np.nan)
    cosine = np.where(triangle >= 0, to_light @ normal, np.nan)
    return normal.reshape(3, *SIZE[::-1]), view.reshape(SIZE[::-1]), cosine.reshape(SIZE[::-1])


def judge(case: Case, name: str, image: NDArray, judged: Judged) -> list[dict]:
    """Errors of a picture in the parts of the body."""
    rows = []
    eye = flip(np.where(judged.inside[..., None], image, 0), np.where(judged.inside[..., None], judged.mean, 0),
               judged.inside)  # fmt: skip
    for part, where in judged.parts().items():
        if where.sum() < LEAST_PIXELS:
            continue
        a, one, two = image[where], judged.even[where], judged.odd[where]
        r = (one + two) / 2
        product = (a - one) * (a - two)
        for channel, albedo in enumerate(ALBEDOS):
            mean = r[:, channel].mean()
            rows.append({
                "body": case.body, "group": case.group, "medium": case.medium, "light": case.light, "part": part,
                "albedo": albedo, "shader": name,
                "signed": round(float(a[:, channel].mean() / mean - 1), 4),
                "rms": round(float(np.sqrt(max(product[:, channel].mean(), 0)) / mean), 4),
                "relmse": round(float(max((product / (r * r + FLOOR))[:, channel].mean(), 0)), 5),
                "flip": round(eye, 4),
            })  # fmt: skip
    return rows


# ---- page and chart ----

SHADERS = ("plumb", "scalar", Wrap.NAME, Lambert.NAME, LambertBehind.NAME, Thesis.NAME, Dipole.NAME)


def pick(rows: list[dict], **wanted: str) -> list[dict]:
    """The rows that have all these values."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def summary(rows: list[dict]) -> str:
    """A line's cells: median and ninth decile of |signed error|, median of the root mean square, percent."""
    if not rows:
        return "||"
    signed = np.array([abs(row["signed"]) for row in rows])
    rms = statistics.median(row["rms"] for row in rows)
    return f"{100 * np.median(signed):.0f} | {100 * np.quantile(signed, 0.9):.0f} | {100 * rms:.0f}"


def markdown(rows: list[dict]) -> str:
    """docs/fast_shaders.md."""
    lines = [
        "# How right the fast shaders are", "",
        "Made by `benchmarks/fast_shaders.py`. Errors against the path shader, in "
        "percent of the part's mean light: median and ninth decile of the absolute signed error of whole parts of "
        "pictures, and the median of the root mean square over pixels, path's noise taken out.", "",
        "Bodies: " + "; ".join(f"*{group}*: {', '.join(dict.fromkeys(r['body'] for r in pick(rows, group=group)))}"
                               for group in GROUPS if pick(rows, group=group)) + ".", "",
        "Media by optical radius 3 V/A over the transport mean free path, and index: "
        + ", ".join(f"*{name}* {tau:g}, {ior:g}" for name, (tau, ior, _) in MEDIA.items())
        + "; reduced albedos .9, .99 and .999 each. Parallel light from 40 (*front*), 90 (*side*) and 140 degrees "
        "(*back*) off the way to the camera.", "",
        "![Errors by shader](images/fast_shaders.png)", "",
    ]  # fmt: skip
    for part, title in (("all", "Whole bodies"), ("lit", "Lit sides"), ("unlit", "Unlit sides")):
        groups = [group for group in GROUPS if pick(rows, group=group)]
        titles = " | ".join(f"{group}: median | 9 in 10 | rms" for group in groups)
        lines += [f"## {title}", "", f"| shader | {titles} |",
                  "|---|" + "---:|" * 3 * len(groups)]  # fmt: skip
        for name in SHADERS:
            cells = [summary(pick(rows, shader=name, part=part, group=group)) for group in groups]
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
        lines.append("")
    lines += ["## The eye and the square", "", "Medians over the cases; the row path is one half of its passes held "
              "against the other: what noise alone makes of FLIP.", "",
              "| shader | " + " | ".join(f"{group}: relMSE | FLIP" for group in groups) + " |",
              "|---|" + "---:|" * 2 * len(groups)]  # fmt: skip
    for name in (*SHADERS, "path"):
        cells = []
        for group in groups:
            some = pick(rows, shader=name, part="all", group=group)
            relmse = statistics.median(row["relmse"] for row in some)
            eye = statistics.median(row["flip"] for row in some)
            cells.append(f"{'' if name == 'path' else f'{relmse:.3f}'} | {eye:.2f}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    lines += ["", "## Plumb and scalar, body by body", "", "Signed errors of whole bodies, percent, for albedos of .9, "
              ".99 and .999.", "", "| body | medium | light | plumb | scalar |", "|---|---|---|---|---|"]  # fmt: skip
    for body in dict.fromkeys(row["body"] for row in rows):
        for medium in MEDIA:
            for light in LIGHTS:
                both = (pick(rows, body=body, medium=medium, light=light, part="all", shader=shader)
                        for shader in ("plumb", "scalar"))  # fmt: skip
                cells = [", ".join(f"{100 * row['signed']:+.0f}" for row in some) for some in both]
                if any(cells):
                    lines.append(f"| {body} | {medium} | {light} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def draw(rows: list[dict], path: Path) -> None:
    """Median |signed error| of whole bodies, a row a shader and a mark a group of bodies."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 3.2), constrained_layout=True)
    for group, mark in zip(GROUPS, "osD^*", strict=True):
        found = [(100 * np.median([abs(row["signed"]) for row in some]), k) for k, name in enumerate(SHADERS)
                 if (some := pick(rows, shader=name, part="all", group=group))]  # fmt: skip
        if found:
            axes.plot(*zip(*found, strict=True), mark, label=group, alpha=0.8)
    axes.axvline(10, color="grey", linewidth=0.8)
    axes.set(xscale="log", xlabel="median |signed error| of whole bodies against path, %", xlim=(0.5, 200))
    axes.set_yticks(range(len(SHADERS)), SHADERS)
    axes.invert_yaxis()
    axes.grid(axis="x", which="both", alpha=0.3)
    axes.legend(fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", type=Path, help="folder of the real meshes, such as ../shared/meshes")
    parser.add_argument("--cache", type=Path, default=Path(tempfile.gettempdir()) / "fast_shaders")
    parser.add_argument("--only", nargs="*", metavar="BODY", help="measure these anew, keep the others' rows")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    return parser.parse_args()


if __name__ == "__main__":
    main()
