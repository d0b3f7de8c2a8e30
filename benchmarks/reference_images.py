"""The path shader against every public reference picture, at full precision, tile by tile.

    python benchmarks/reference_images.py [--seconds S] [--quick] [--resume] [--only SCENE]... [-o FILE.md]

Renders each scene for --seconds and judges it against Mitsuba's picture of it: Welch tests of tiles of 4 x 4 pixels
that count the noise of both, at a family-wise false-alarm rate of 1e-3 over all scenes, tiles, channels and histograms
of p-values; the mean over the object, which must be within 0.5 %; what differs beyond the noise of both; and what the
eye would see of it (HDR-FLIP; needs the extra ``peers``). Light that leaked is counted. Where the mean's noise is
above a third of the 0.5 %, it is not held against it: render longer.

--resume adds to the films that an earlier call has left in --work: of the same renderer, or the old one's mistakes
would be judged with the new one's. Exit status 1 where a picture
disagrees.

Blind to: errors below what the table says is detected in a single tile, unless many tiles share them; rare bright
samples that neither renderer has met (p3 and p4 have heavy tails; there the larger of both renderers' variances is
believed).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from first_figures import machine

from renderer.checkpoint import checkpoint_path
from renderer.job import Budget, execute
from renderer.output.film import Film
from renderer.render import Renderer, Settings
from renderer.scene.scene_file import load_scene
from renderer.study.judges import Estimate, compare_tiles, flip, relative_mse, sidak, with_rare_samples
from sss_tools.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
SCENES = ("p1_sphere", "p2_bunny_marble", "p3_bunny_backlit", "p4_slab", "p5_spot_matched", "p6_furnace")
FURNACE = "p6_furnace"
FAMILY = 1e-3
WITHIN = 0.005
"""Relative difference of the object's mean that is allowed."""
TILE = 4
HEAVY_TAILS = ("p3_bunny_backlit", "p4_slab")
"""Scenes in which few samples carry much of the light: our standard error is taken to be no smaller than Mitsuba's
would be with as many samples."""
ROUNDING = 1e-5
"""Pixels of the furnace may be off by so much: float32 over a path."""


def main() -> int:
    """The command; 1 where a picture disagrees."""
    options = _options()
    options.work.mkdir(parents=True, exist_ok=True)
    chosen = [name for name in SCENES if not options.only or name in options.only]
    rows, agree = [], True
    for name in chosen:
        print(name, file=sys.stderr)
        renderer, seconds = _render(name, options)
        with np.load(options.shared / "reference" / "public" / f"{name}.npz") as reference:
            cells, good = judge(name, renderer.film, dict(reference), sidak(FAMILY, len(SCENES) - 1))
        leaks = renderer.tally.leaked / max(renderer.tally.samples, 1)
        rows.append(
            [name, f"{renderer.film.passes:,}", f"{seconds:.0f}", *cells, f"{leaks:.1g}", "yes" if good else "NO"]
        )
        agree &= good
    text = markdown(rows)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(text)
    print(text)
    return 0 if agree else 1


def _render(name: str, options: argparse.Namespace) -> tuple[Renderer, float]:
    started = time.monotonic()
    scene = load_scene(options.shared / "reference" / "scenes" / f"{name}.toml")
    renderer = Renderer(scene, Settings(shader="path", seed=options.seed))
    output = options.work / f"{name}.npz"
    resume = options.resume and (output.is_file() or checkpoint_path(output).is_file())
    picture = execute(renderer, output, Budget(0, None, seconds=options.seconds, started=started), resume)
    return renderer, picture.seconds


def judge(name: str, film: Film, reference: dict, false_alarm: float) -> tuple[list[str], bool]:
    """Cells of the table, and whether the picture is right."""
    where = reference["coverage"] >= 1
    ours = Estimate(film.mean(), film.stderr(), film.passes)
    if name == FURNACE:
        worst = float(np.abs(ours.mean - 1).max())
        return ["", f"{worst:.1g} in the worst pixel", "", "", "", "", ""], worst < ROUNDING
    about = json.loads(str(reference["meta"]))
    theirs = Estimate(reference["image"].astype(float), reference["stderr"].astype(float), about["chunks"])
    if name in HEAVY_TAILS:
        ours = with_rare_samples(ours, film.passes, theirs, about["spp"])
    test = compare_tiles(ours, theirs, where, TILE, false_alarm)
    noise = np.hypot(ours.stderr, theirs.stderr)
    brightness = theirs.mean[where].mean(axis=0)
    difference = (ours.mean - theirs.mean)[where].mean(axis=0) / brightness
    error = np.sqrt((noise[where] ** 2).sum(axis=0)) / where.sum() / brightness
    k = int(np.argmax(np.abs(difference)))
    beyond = relative_mse(ours.mean, theirs.mean, noise, where)
    cells = [
        f"{100 * film.mean_relative_stderr():.2f} %",
        f"{100 * difference[k]:+.3f} +- {100 * error[k]:.3f} %",
        f"{np.abs(test.z).max():.2f} of {test.z.size}",
        f"{np.nanmin(test.uniformity):.2g}" if np.isfinite(test.uniformity).any() else "",
        f"{100 * test.detects:.1f} %",
        f"{100 * np.sqrt(max(beyond, 0)):.2f} %",
        _flip(ours, theirs, where),
    ]
    known = error <= WITHIN / 3
    if not known.all():
        cells[1] += ", too noisy to say"
    return cells, bool(test.agrees and (np.abs(difference) <= WITHIN)[known].all())


def _flip(ours: Estimate, theirs: Estimate, where) -> str:
    try:
        return f"{flip(ours.mean, theirs.mean, where):.4f}"
    except InputError:
        return "not installed"


def markdown(rows: list[list[str]]) -> str:
    """The page."""
    about = machine(None)
    lines = [
        "# Against the reference pictures",
        "",
        "The path shader against Mitsuba's pictures of the public scenes. How they are judged, and what that is blind "
        f"to, is said in `benchmarks/reference_images.py`. Family-wise false-alarm rate {FAMILY:g}. "
        f"{about['processor']}, {about['threads']} threads; Python {about['python']}, NumPy {about['numpy']}, embreex "
        f"{about['embreex']}.",
        "",
        "| scene | passes | seconds | noise a pixel | object mean, worst channel | worst z | p of histogram | seen in "
        "any tile | differs beyond noise | FLIP | leaks | agrees |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
    ]
    return "\n".join(lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, help="a scene (default: 600)")
    parser.add_argument("--quick", action="store_true", help="30 seconds a scene")
    parser.add_argument("--resume", action="store_true", help="add to what an earlier call rendered")
    parser.add_argument("--only", action="append", default=[], metavar="SCENE", help="not all scenes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with reference/")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "reference_images", help="where films are kept")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "reference_images.md")
    options = parser.parse_args()
    options.seconds = options.seconds or (30.0 if options.quick else 600.0)
    return options


if __name__ == "__main__":
    raise SystemExit(main())
