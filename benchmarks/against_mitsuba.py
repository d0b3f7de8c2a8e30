"""Seconds to an error, ours against Mitsuba 3, on eight scenes.

    python benchmarks/against_mitsuba.py [--quick] [--only SCENE]... [--again ours|mitsuba] [-o docs/against_mitsuba.md]

Needs the extra ``peers``; DRJIT_LIBLLVM_PATH must name a recent LLVM library for Mitsuba's LLVM variant. Every run is
kept below --work, by what was asked of it: an interrupted benchmark goes on where it was. After a change of ours,
``--again ours`` measures ours anew; pictures and times of both should stem from one state of the machine, so figures
to be published want an empty --work.

Method. Runs are much shorter than the target would take: the error of a mean of N independent samples is
sigma / sqrt(N), with sigma measured in every pixel over independent passes (ours) or pictures of other seeds (theirs),
and speed in samples a second. Then

    seconds = set-up + (sigma / target)^2 / (samples of a pixel a second).

sigma is relative to the pixel's mean, over pixels whose every sample meets the object first: its mean over pixels and
channels ("mean"), or its root mean square ("rms"; 2 % is relMSE 4e-4). Means are the public reference's where there
is one, else of all runs together. All renderers and scenes take turns, in reversed order every other time.

A peer does not count where its rare samples have plainly not been met yet, so that sigma means nothing: its object is
off by more than 2.5 standard errors, or a hundredth of the pixels has most of the variance, which is not so at the
greatest roulette depth. Mitsuba's roulette lets weights grow where the albedo is above 0.95; at small depths dense
media then look noiseless and too dark until one sample in very many makes up for it.

Blind to: samples so rare and bright that no run has met them. Both renderers have them (p3, p4); until they come,
sigma is too small, for us and for them. "rms" needs no correction for few samples; "mean" has the one for normal noise.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from statistics import median

import numpy as np
from first_figures import machine
from peer_scenes import DENSE, dense_scenes, public_scenes
from scipy.special import gammaln

ROOT = Path(__file__).resolve().parents[1]
TARGET = 0.02
OURS = "ours"
PEERS = tuple(f"{variant} {depth}" for variant in ("scalar_rgb", "llvm_ad_rgb") for depth in (5, 64, 10000))
"""Mitsuba's variants and roulette depths."""
DEEPEST = tuple(kind for kind in PEERS if kind.endswith(" 10000"))
KEPT = 2
"""How many of them go on after the first round: the best of it."""


def main() -> None:
    """The command."""
    options = _options()
    options.work.mkdir(parents=True, exist_ok=True)
    scenes = {**public_scenes(options.shared), **dense_scenes(options.work / "scenes")}
    scenes = {name: path for name, path in scenes.items() if not options.only or name in options.only}
    documents = {name: _exported(path, options.work) for name, path in scenes.items()}
    for old in options.work.glob("*.npz"):
        if options.again and (f"-{OURS}-" in old.name) == (options.again == OURS):
            old.unlink()
    runs: dict[str, dict[str, list[dict]]] = {name: {} for name in scenes}
    for turn in range(options.runs):
        for name in list(scenes)[:: -1 if turn % 2 else 1]:
            kinds = [OURS, *(PEERS if turn == 0 else _best(name, runs[name], options))]
            for kind in kinds[:: -1 if turn % 2 else 1]:
                source = scenes[name] if kind == OURS else documents[name]
                runs[name].setdefault(kind, []).append(_run(kind, name, source, turn, options))
    rows = [Row(name, Comparison(measured, _reference(name, options.shared))) for name, measured in runs.items()]
    text = markdown(rows, options)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(text)
    print(text)


# ---- measuring ----


def _exported(scene: Path, work: Path) -> Path:
    path = work / "mitsuba" / f"{scene.stem}.xml"
    path.parent.mkdir(exist_ok=True)
    _python("-m", "cli.sss_render", str(scene), "--export", "mitsuba", "-o", str(path), "-q")
    return path


def _run(kind: str, scene: str, source: Path, turn: int, options: argparse.Namespace) -> dict:
    """The figures of a run, measured unless they are there."""
    kept = options.work / f"{scene}-{kind.replace(' ', '-')}-{turn}-{options.seconds:g}s.npz"
    if not kept.is_file():
        print(f"{scene}: {kind}, run {turn}", file=sys.stderr)
        renderer, _, depth = kind.partition(" ")
        unfinished = kept.with_suffix(".unfinished.npz")
        more = ["--rr-depth", depth] if depth else []
        _python(str(ROOT / "benchmarks" / "one_render.py"), renderer, str(source), str(unfinished),
                "--seconds", str(options.seconds), "--seed", str(turn + 1), *more)  # fmt: skip
        unfinished.replace(kept)
    with np.load(kept) as arrays:
        return {name: array[()] for name, array in arrays.items()}


def _python(*arguments: str) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, *arguments], check=True, env=environment, cwd=ROOT)


def _best(name: str, measured: dict[str, list[dict]], options: argparse.Namespace) -> list[str]:
    """The peers that go on."""
    first = {kind: runs[:1] for kind, runs in measured.items()}
    comparison = Comparison(first, _reference(name, options.shared))
    trusted = [kind for kind in PEERS if comparison.trusted(kind)]
    return sorted(trusted, key=lambda kind: comparison.figures(kind).seconds("rms"))[:KEPT]


def _reference(name: str, shared: Path) -> np.ndarray | None:
    path = shared / "reference" / "public" / f"{name}.npz"
    if not path.is_file():
        return None
    with np.load(path) as arrays:
        return arrays["image"].astype(float)


# ---- reckoning ----


@dataclass(frozen=True)
class Figures:
    """One renderer on one scene. Times are medians of runs.

    sigma   by measure, relative standard deviation of a sample
    peaked  share of the variance that the hundredth of all pixels and channels with the most of it has
    rate    samples of a pixel a second; rate_cpu a CPU second
    """

    sigma: dict[str, float]
    peaked: float
    rate: float
    rate_cpu: float
    setup: float
    setup_cpu: float
    memory: int
    spread: tuple[float, float]

    def seconds(self, measure: str, cpu: bool = False) -> float:
        """To the target, set-up counted in."""
        setup, rate = (self.setup_cpu, self.rate_cpu) if cpu else (self.setup, self.rate)
        return setup + (self.sigma[measure] / TARGET) ** 2 / rate


@dataclass
class Comparison:
    """All runs on a scene, by renderer, and the reference's mean where there is one."""

    runs: dict[str, list[dict]]
    reference: np.ndarray | None

    @cached_property
    def pixels(self) -> np.ndarray:
        """(h, w) those whose every sample met the object first, in all of our runs."""
        return np.logical_and.reduce([run["object_pixels"] for run in self.runs[OURS]])

    def mean(self, kinds) -> tuple[np.ndarray, np.ndarray]:
        """(p, 3) mean over all samples of the renderers ``kinds``, object pixels only, and its variance."""
        runs = [run for kind in kinds for run in self.runs[kind]]
        total = sum(run["samples"] for run in runs)
        mean = sum(run["samples"] * run["mean"] for run in runs) / total
        variance = sum(run["samples"] * run["variance"] for run in runs) / total**2
        return mean[self.pixels], variance[self.pixels]

    @cached_property
    def truth(self) -> np.ndarray:
        """(p, 3) what errors are relative to."""
        if self.reference is not None:
            return self.reference[self.pixels]
        # each by its average variance: pixel by pixel, dark noise would weigh too much
        (one, noise), (other, other_noise) = self.mean([OURS]), self.mean(DEEPEST)
        share = other_noise.mean() / (noise.mean() + other_noise.mean())
        return share * one + (1 - share) * other

    def figures(self, kind: str) -> Figures:
        """Of one renderer."""
        runs = self.runs[kind]
        freedom = sum(int(run["freedom"]) for run in runs)
        variance = sum(run["freedom"] * run["variance"] for run in runs)[self.pixels] / freedom
        usable = self.truth > 0
        relative = np.maximum(variance[usable], 0) / self.truth[usable] ** 2
        # E[s] = c4 sigma for normal noise
        c4 = np.sqrt(2 / freedom) * np.exp(gammaln((freedom + 1) / 2) - gammaln(freedom / 2))
        sigma = {"mean": float(np.sqrt(relative).mean() / c4), "rms": float(np.sqrt(relative.mean()))}
        ordered = np.sort(relative)
        rates = [float(run["samples"] / run["render"]) for run in runs]

        def middle(name: str) -> float:
            return median(float(run[name]) for run in runs)

        return Figures(
            sigma=sigma,
            peaked=float(ordered[-max(len(ordered) // 100, 1) :].sum() / ordered.sum()),
            rate=median(rates),
            rate_cpu=median(float(run["samples"] / run["cpu"]) for run in runs),
            setup=middle("setup"),
            setup_cpu=middle("setup_cpu"),
            memory=max(int(run["memory"]) for run in runs),
            spread=(min(rates) / median(rates), max(rates) / median(rates)),
        )

    def trusted(self, kind: str) -> bool:
        """Whether the measured noise of a peer can be taken for its noise."""
        mean, variance = self.mean([kind])
        error = np.sqrt(variance.sum(axis=0)).sum() / self.truth.sum()
        if kind in DEEPEST:
            return True
        deepest = next(other for other in DEEPEST if other.split()[0] == kind.split()[0])
        peaked = [self.figures(other).peaked for other in (kind, deepest) if other in self.runs]
        return abs(mean.sum() / self.truth.sum() - 1) <= 2.5 * error and not (peaked[0] > 0.5 >= peaked[-1])

    def best(self, measure: str, cpu: bool = False) -> str:
        """The fastest trusted peer, of those with the most runs."""
        most = max(len(self.runs[kind]) for kind in PEERS if kind in self.runs)
        peers = [kind for kind in PEERS if len(self.runs.get(kind, ())) == most and self.trusted(kind)]
        return min(peers, key=lambda kind: self.figures(kind).seconds(measure, cpu))

    def difference(self) -> tuple[float, float]:
        """Our mean over the object relative to theirs of the greatest depth, less one, and the standard error."""
        (one, noise), (other, other_noise) = self.mean([OURS]), self.mean(DEEPEST)
        # channels share paths: their noise is added up as if it were one
        errors = [np.sqrt(v.sum(axis=0)).sum() / m.sum() for m, v in ((one, noise), (other, other_noise))]
        return one.sum() / other.sum() - 1, float(np.hypot(*errors))


@dataclass
class Row:
    """A scene with its comparison."""

    name: str
    comparison: Comparison

    def ratio(self, measure: str, cpu: bool = False) -> float:
        """How many times faster than the best peer."""
        best = self.comparison.best(measure, cpu)
        return self.comparison.figures(best).seconds(measure, cpu) / self.comparison.figures(OURS).seconds(measure, cpu)


# ---- writing ----


def markdown(rows: list[Row], options: argparse.Namespace) -> str:
    """The page."""
    about = machine(None)
    kind = "quick run: single short runs, good for a first look only" if options.quick else "full run"
    lines = [
        "# Against Mitsuba 3",
        "",
        f"Seconds to {100 * TARGET:g} % relative standard error, whole picture, set-up counted in; how it is measured, "
        f"and what that is blind to, is said in `benchmarks/against_mitsuba.py` ({kind}; {options.runs} run(s) of "
        f"{options.seconds:g} s each, medians). {about['processor']}, {about['threads']} threads, load before "
        f"{options.load:.1f}; Python {about['python']}, NumPy {about['numpy']}, embreex {about['embreex']}, Mitsuba "
        f"{version('mitsuba')}: the better of its scalar and LLVM variants and of roulette depths 5, 64, 10000. Ratios "
        "above 1: we are faster. CPU ratios count seconds of all cores and suffer less from a busy machine.",
        "",
        "| scene | rms: ours | Mitsuba | best peer | ratio | CPU | mean: ours | Mitsuba | ratio | CPU |",
        "|---|---:|---:|---|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        cells = [row.name]
        for measure in ("rms", "mean"):
            best = row.comparison.best(measure)
            cells += [f"{row.comparison.figures(kind).seconds(measure):.3g}" for kind in (OURS, best)]
            cells += [best.replace("_rgb", "").replace("_ad", "")] if measure == "rms" else []
            cells += [f"**{row.ratio(measure):.2f}**", f"{row.ratio(measure, cpu=True):.2f}"]
        lines.append(f"| {' | '.join(cells)} |")
    for label, chosen in (
        ("public", [row for row in rows if row.name not in DENSE]),
        ("dense", [row for row in rows if row.name in DENSE]),
        ("all", rows),
    ):
        if not chosen:
            continue
        means = {
            (measure, cpu): np.exp(np.mean([np.log(row.ratio(measure, cpu)) for row in chosen]))
            for measure in ("rms", "mean")
            for cpu in (False, True)
        }
        cells = [f"geometric mean, {label}", "", "", ""]
        cells += [f"**{means['rms', False]:.2f}**", f"{means['rms', True]:.2f}", "", ""]
        cells += [f"**{means['mean', False]:.2f}**", f"{means['mean', True]:.2f}"]
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "Where the ratio comes from: thousand samples (of all pixels) a second, and a CPU second, and the standard "
        "deviation of one relative to its mean, root mean square. Faster by the ratio of speeds over the square of "
        "that of deviations. Ours first, then the best peer by rms.",
        "",
        "| scene | k/s | | k/CPU s | | deviation | | set-up s | | memory MB | | means differ by |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        pixels = row.comparison.pixels.size / 1000
        pair = [row.comparison.figures(kind) for kind in (OURS, row.comparison.best("rms"))]
        difference, noise = row.comparison.difference()
        cells = [row.name]
        cells += [f"{pixels * figures.rate:.3g}" for figures in pair]
        cells += [f"{pixels * figures.rate_cpu:.3g}" for figures in pair]
        cells += [f"{figures.sigma['rms']:.2f}" for figures in pair]
        cells += [f"{figures.setup:.1f}" for figures in pair]
        cells += [f"{figures.memory / 2**20:.0f}" for figures in pair]
        lines.append(f"| {' | '.join(cells)} | {100 * difference:+.2f} +- {100 * noise:.2f} % |")
    spreads = [row.comparison.figures(kind).spread for row in rows for kind in (OURS, row.comparison.best("rms"))]
    lines += [
        "",
        f"Speeds of single runs lie between {min(low for low, _ in spreads):.2f} and "
        f"{max(high for _, high in spreads):.2f} times their median.",
        "",
    ]
    return "\n".join(lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one run of 4 seconds each: about 8 minutes")
    parser.add_argument("--runs", type=int, help="rounds (default: 5); after the first with the two best peers")
    parser.add_argument("--seconds", type=float, help="of rendering in each run (default: 20)")
    parser.add_argument("--only", action="append", default=[], metavar="SCENE", help="not all scenes")
    parser.add_argument("--again", choices=("ours", "mitsuba"), help="measure these anew, whatever is there")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with reference/")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "against_mitsuba", help="where runs are kept")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "against_mitsuba.md")
    options = parser.parse_args()
    options.work, options.output = options.work.resolve(), options.output.resolve()
    options.runs = options.runs or (1 if options.quick else 5)
    options.seconds = options.seconds or (4.0 if options.quick else 20.0)
    options.load = os.getloadavg()[0]
    return options


if __name__ == "__main__":
    main()
