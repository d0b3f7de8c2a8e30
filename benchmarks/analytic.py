"""The path shader against every number of shared/reference/analytic.json, at full precision.

    python benchmarks/analytic.py [--error E] [--seconds S] [--resume] [--only PART]... [-o FILE.md]

Slabs and half-spaces (adding-doubling, Chandrasekhar, van de Hulst, Giovanelli) are seen straight down on, or up
through, in a sky that is white above the horizon: by reciprocity R and T at normal incidence. Diffuse incidence is the
same slab seen in all directions from a point just above or below it, weighted by the cosine: the faces of a cube around
that point, of which the four sideways ones are alike. The furnace is looked at, too. Slabs are boxes so wide that next
to nothing goes through their sides; half-spaces are slabs so deep that nothing comes back from below.

Each case runs until its standard error is --error (0.1 %) of the value, or its time is up: then the table says what was
reached. z counts the table's own uncertainty. All cases together raise a false alarm with probability 1e-3 (Sidak); the
limit is stated. --resume adds to what an earlier call has measured. Exit status 1 where a case is beyond the limit.

All cases draw the same random numbers, so those that are alike have like z: their mean tells nothing, and --seed makes
others.

Blind to: what cancels between directions and positions of light, as only totals are compared; errors of less than
(limit + 1.64) standard errors are found with less than 95 % probability.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from first_figures import machine
from scipy import stats

from renderer.render import Renderer, Settings
from renderer.scene.description import Camera, EnvironmentLight, Scene, SceneObject, Translucent
from renderer.study.judges import sidak
from sss_tools.medium import Medium
from sss_tools.shapes import box

ROOT = Path(__file__).resolve().parents[1]
FAMILY = 1e-3
INFINITE = "inf"
LEAST_VALUE = 1e-3
LEAST_MEANS = 12
SIZE, CUBE_SIZE = (128, 64), (96, 96)
NEAR = 1e-3
"""Distance of the point for diffuse incidence from the slab, of the slab's width: where it sees the slab's end, within
two thousandths of the horizon, it looks with four millionths of the weight."""
_FINER = 16


@dataclass
class Row:
    """A measured case: sums over independent means of samples.

    value, uncertainty  of the table
    count, mean, square number of means, their mean and the sum of squared differences from it
    seconds             of rendering so far
    """

    value: float
    uncertainty: float
    count: int = 0
    mean: float = 0.0
    square: float = 0.0
    seconds: float = 0.0
    leaked: int = 0
    samples: int = 0

    def add(self, values: np.ndarray) -> None:
        """Count means in (Chan, Golub & LeVeque 1983)."""
        n, before = len(values), self.count
        shift = float(values.mean()) - self.mean
        self.square += float(((values - values.mean()) ** 2).sum()) + shift**2 * before * n / (before + n)
        self.mean += shift * n / (before + n)
        self.count += n

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return float(np.sqrt(self.square / (self.count - 1) / self.count)) if self.count > 1 else np.inf

    @property
    def z(self) -> float:
        """Difference from the table in standard errors of both, as normal as if the means told their error exactly."""
        t = (self.mean - self.value) / np.hypot(self.error, self.uncertainty)
        return float(np.copysign(stats.norm.isf(stats.t.sf(abs(t), self.count - 1)), t))


@dataclass(frozen=True)
class Case:
    """A slab: albedo, optical thickness (inf for half-spaces), g, index; which quantity and its value."""

    albedo: float
    tau: float
    g: float
    ior: float
    what: str
    value: float
    uncertainty: float

    @property
    def name(self) -> str:
        """As in the table."""
        depth = "half-space" if np.isinf(self.tau) else f"tau {self.tau:g}"
        return f"albedo {self.albedo:g}, {depth}, g {self.g:g}, n {self.ior:g}: {self.what}"

    @property
    def width(self) -> float:
        """Of the slab, in mean free paths."""
        # light fades sideways by a diffusion length, or by two thicknesses over pi, whichever is less
        return 24 * max(min(self._diffusion, self.depth + 2 / self._reduced), 1.0) + 40

    @property
    def depth(self) -> float:
        """Of the slab, in mean free paths."""
        return min(self.tau, 14 * max(self._diffusion, 1.0) + 12 / self._reduced)

    @property
    def _reduced(self) -> float:
        return 1 - self.albedo * self.g

    @property
    def _diffusion(self) -> float:
        return float(1 / np.sqrt(3 * max(1 - self.albedo, 1e-9) * self._reduced))

    def views(self) -> list[View]:
        """From where the slab is looked at."""
        outwards = np.array([0.0, -1.0 if self.what.startswith("T") else 1.0, 0.0])
        surface, aside = outwards * self.depth / 2, np.array([0.0, 0.0, 1.0])
        if self.what.endswith("normal"):
            camera = Camera(surface + 2 * self.width * outwards, surface, aside, 1e-3, SIZE)
            return [View(camera, np.full(SIZE[::-1], 1 / (SIZE[0] * SIZE[1])))]
        point = surface + NEAR * self.width * outwards
        facing, sideways = _cosine_weights()
        return [
            View(Camera(point, point - outwards, aside, 90.0, CUBE_SIZE), facing),
            View(Camera(point, point + aside, outwards, 90.0, CUBE_SIZE), 4 * sideways),
        ]

    def scene(self, camera: Camera) -> Scene:
        """The slab as a camera sees it."""
        slab = SceneObject("slab", box((self.width, self.depth, self.width)),
                           Translucent(Medium.from_albedo(self.albedo, 1.0, self.g, self.ior)))  # fmt: skip
        return Scene("mm", camera, (_half_white_sky(),), (slab,))


@dataclass(frozen=True)
class View:
    """A camera, and the (h, w) weights of its pixels in the quantity that is measured."""

    camera: Camera
    weights: np.ndarray


def _cosine_weights() -> tuple[np.ndarray, np.ndarray]:
    """(h, w) shares of the pixels of a cube's face in the integral of cos / pi, the face that is met by the normal and
    one beside it: cos dOmega is dx dy / (1 + x^2 + y^2)^2, and on the other -y times that, below the horizon."""
    width, height = CUBE_SIZE
    x = (np.arange(_FINER * width) + 0.5) / (_FINER * width) * 2 - 1
    y = 1 - (np.arange(_FINER * height) + 0.5)[:, None] / (_FINER * height) * 2
    facing = 1 / (1 + x * x + y * y) ** 2
    both = [facing, np.maximum(-y, 0) * facing]
    both = [part.reshape(height, _FINER, width, _FINER).sum(axis=(1, 3)) for part in both]
    total = both[0].sum() + 4 * both[1].sum()
    return both[0] / total, both[1] / total


def _half_white_sky() -> EnvironmentLight:
    image = np.zeros((512, 4, 3), np.float32)
    image[:256] = 1
    return EnvironmentLight(image=image)


def cases(tables: dict) -> list[Case]:
    """All slabs and half-spaces."""
    found = []

    def add(row, tau, what, value, uncertainty):
        # smaller shares are carried by so few paths that their spread is not seen before most of them are; and
        # walks in a white half-space have no mean length
        if value > LEAST_VALUE and (row["albedo"] < 1 or np.isfinite(tau)):
            found.append(Case(row["albedo"], tau, row["g"], row["n"], what, value, max(uncertainty, 5e-7)))

    quantities = ("R_normal", "T_normal", "R_diffuse", "T_diffuse")
    for row in tables["slabs_iadpython"] + tables["half_space_iadpython"]:
        tau = np.inf if row["tau"] == INFINITE else float(row["tau"])
        for k, what in enumerate(quantities):
            add(row, tau, what, row[what], row["uncertainty"][k])
    for row in tables["isotropic_half_space_matched"]:
        for what in ("R_normal", "R_diffuse"):
            if not any(c.name == Case(row["albedo"], np.inf, 0.0, 1.0, what, 0, 0).name for c in found):
                add({**row, "g": 0.0, "n": 1.0}, np.inf, what, row[what], 5e-7)
    hulst = {"albedo": 0.9, "g": 0.75, "n": 1.0}
    add(hulst, 2.0, "R_normal", 0.09739, 5e-6)
    add(hulst, 2.0, "T_normal", 0.66096, 5e-6)
    return found


def measure(case: Case, row: Row, error: float, seconds: float, seed: int) -> None:
    """Add samples until the relative standard error or the time is reached."""
    started, before = time.monotonic(), row.seconds
    while row.count < LEAST_MEANS or (row.error > error * case.value and row.seconds < seconds):
        row.add(_means(case, row, seed))
        row.seconds = before + time.monotonic() - started


def _means(case: Case, row: Row, seed: int) -> np.ndarray:
    """The quantity by each of some passes; as many as there are already, so that set-up takes the lesser part."""
    passes, found = int(np.clip(row.count, LEAST_MEANS, 256)), np.zeros(0)
    for k, view in enumerate(case.views()):
        renderer = Renderer(case.scene(view.camera), Settings(shader="path", seed=seed + 7919 * (row.count + k)))
        sums = [0.0]

        def done(_: int, renderer=renderer, sums=sums, weights=view.weights) -> bool:
            sums.append(float((renderer.film.mean()[..., 0] * weights).sum() * renderer.film.passes))
            return False

        renderer.run(range(passes), done)
        found = np.diff(sums) + (found if k else 0)
        row.leaked += renderer.tally.leaked
        row.samples += renderer.tally.samples
    return found


def furnace(seconds: float) -> tuple[float, float]:
    """Worst pixel of a white body in a white sky, and its share of leaked paths."""
    from sss_tools.shapes import icosphere

    body = SceneObject("ball", icosphere(0.5, 5), Translucent(Medium.from_albedo(1.0, 8.0, 0.5, 1.5)))
    camera = Camera(np.array([0.3, 0.4, 2.5]), np.zeros(3), np.array([0.0, 1, 0]), 24.0, (256, 256))
    sky = EnvironmentLight(radiance=np.ones(3))
    renderer, begun = Renderer(Scene("mm", camera, (sky,), (body,)), Settings(shader="path")), time.monotonic()
    renderer.run(range(100_000), lambda _: time.monotonic() - begun > seconds)
    return float(np.abs(renderer.film.mean() - 1).max()), renderer.tally.leaked / renderer.tally.samples


def main() -> int:
    """The command; 1 where a case is beyond the limit."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--error", type=float, default=1e-3, help="relative standard error (default: 0.001)")
    parser.add_argument("--seconds", type=float, default=60.0, help="a case at most")
    parser.add_argument("--only", action="append", default=[], metavar="PART", help="cases with this in their name")
    parser.add_argument("--every", type=int, default=1, help="only every so manieth case")
    parser.add_argument("--resume", action="store_true", help="add to what an earlier call has measured")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with reference/")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "analytic.json", help="where sums are kept")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "analytic.md")
    options = parser.parse_args()
    tables = json.loads((options.shared / "reference" / "analytic.json").read_text())
    options.work.parent.mkdir(parents=True, exist_ok=True)
    kept = json.loads(options.work.read_text()) if options.resume and options.work.is_file() else {}
    rows = {name: Row(**row) for name, row in kept.items()}
    all_cases = cases(tables)
    chosen = [case for case in all_cases if not options.only or any(part in case.name for part in options.only)]
    for case in chosen[:: options.every]:
        row = rows.setdefault(case.name, Row(case.value, case.uncertainty))
        measure(case, row, options.error, options.seconds, options.seed)
        options.work.write_text(json.dumps({name: asdict(row) for name, row in rows.items()}))
        print(f"{case.name} {row.z:+.2f} {row.error / row.value:.2g} {row.seconds:.0f} s", file=sys.stderr)
    text, good = page({case.name: rows[case.name] for case in all_cases if case.name in rows}, len(all_cases))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(text)
    return 0 if good else 1


def page(rows: dict[str, Row], cases_in_all: int) -> tuple[str, bool]:
    """The page, and whether all is well."""
    about, limit = machine(None), float(stats.norm.isf(sidak(FAMILY, cases_in_all) / 2))
    worst, leaks = furnace(10.0)
    z = np.array([row.z for row in rows.values()])
    good = bool((np.abs(z) <= limit).all()) and worst < 1e-5
    reached = [row.error / row.value for row in rows.values()]
    lines = [
        "# Against closed forms",
        "",
        f"The path shader against `shared/reference/analytic.json`; how, and what that is blind to, is said in "
        f"`benchmarks/analytic.py`. {len(rows)} of {cases_in_all} cases were measured, "
        f"{sum(r <= 1e-3 for r in reached)} of them to 0.1 %, the worst to {100 * max(reached):.2g} %. Largest |z| "
        f"{np.abs(z).max():.2f}; the limit, for a false alarm in a thousand runs of all cases, is {limit:.2f}. Root "
        f"mean square z {np.sqrt((z**2).mean()):.2f}. Furnace: worst pixel off by {worst:.1g}, leaks {leaks:.1g} of "
        f"the paths. {about['processor']}, {about['threads']} threads; Python {about['python']}, NumPy "
        f"{about['numpy']}, embreex {about['embreex']}.",
        "",
        "| case | table | measured | standard error | z | seconds |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {name} | {row.value:.6f} | {row.mean:.6f} | {100 * row.error / row.value:.2g} % | {row.z:+.2f} | "
        f"{row.seconds:.0f} |"
        for name, row in rows.items()
    ]
    return "\n".join([*lines, ""]), good


if __name__ == "__main__":
    raise SystemExit(main())
