"""Whether this version has lost accuracy or speed against one that was measured before: small enough for every change.

Accuracy: the path shader's pictures tile by tile against kept exact ones (``judges.compare_tiles``), and the squared
biases of the faster shaders against their kept ones, one-sided: to become better is no loss.

Speed: CPU seconds of rendering over CPU seconds of a fixed kernel of NumPy and Embree calls that no change of ours
touches, both taken in turns within one process. The least of several repetitions stands for each: other work on the
machine can only make a repetition slower.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from sss_tools.shapes import icosphere, slab

from ..render import Renderer
from ..scene.description import Scene
from ..scene.scene_file import load_scene
from .accuracy import Truth
from .case import CAMERA, MEDIUM, SKY, SUN, Case
from .judges import Bias, Estimate, compare_tiles, sidak
from .methods import settings

FALSE_ALARM = 1e-3
"""Of all tests of accuracy together, in one run."""
SPEED_BOUND = 2.0
"""Times the kept ratio: a crowded cache makes some calls slower by half, and processors differ."""
REPEATS, ATTEMPTS = 5, 3
PASSES = {"path": 64, "plumb": 16, "scalar": 16, "diffuse": 16}
SPEED_PASSES = {"path": 12, "plumb": 24, "scalar": 64, "diffuse": 64}
TILE = 4
_VIEW = {**CAMERA, "resolution": [24, 24]}

CASES: dict[str, Callable[[], Case]] = {
    "ball": lambda: Case([icosphere(0.5, 3)], camera=_VIEW),
    "wall": lambda: Case([slab(1.0, 0.1)], lights=[{**SUN, "direction": [0.3, -0.4, 1.0]}, SKY], camera=_VIEW),
    "rough": lambda: Case(
        [icosphere(0.5, 3)], {**MEDIUM, "albedo": 0.8, "g": 0.6, "ior": 1.4, "roughness": 0.3},
        camera=_VIEW,
    ),
}  # fmt: skip
"""A round and a thin body under parallel light, and one with a rough boundary, by name."""


def scenes() -> dict[str, Scene]:
    """The guarded scenes."""
    with TemporaryDirectory() as folder:
        return {name: load_scene(case().write(Path(folder), name)) for name, case in CASES.items()}


# ---- accuracy ----


@dataclass(frozen=True, eq=False)
class Pictures:
    """A scene by one method, twice: (h, w, 3) means and standard errors, and (h, w) the pixels the object fills."""

    means: tuple[NDArray[np.float64], NDArray[np.float64]]
    stderrs: tuple[NDArray[np.float64], NDArray[np.float64]]
    where: NDArray[np.bool_]
    passes: int

    def together(self) -> Estimate:
        """Both as one picture."""
        one, two = self.stderrs
        return Estimate((self.means[0] + self.means[1]) / 2, np.sqrt(one**2 + two**2) / 2, 2 * self.passes)

    def times(self, factor: float) -> Pictures:
        """Brighter by a factor: a planted loss."""
        means, stderrs = ((factor * one, factor * two) for one, two in (self.means, self.stderrs))
        return Pictures(means, stderrs, self.where, self.passes)


def pictures(scene: Scene, method: str, seed: int, longer: int = 1) -> Pictures:
    """Two pictures of ``method`` with other random numbers; ``longer`` times the usual passes."""
    films = []
    for k in (0, 1):
        renderer = Renderer(scene, settings(method, 2 * seed + k))
        renderer.run(range(longer * PASSES[method]))
        films.append(renderer.film)
    one, two = films
    where = one.object_pixels() & two.object_pixels()
    return Pictures((one.mean(), two.mean()), (one.stderr(), two.stderr()), where, longer * PASSES[method])


def truth(exact: Pictures) -> Truth:
    """Path-traced pictures as what others are judged by."""
    return Truth(exact.means, exact.where)


def accuracy_losses(
    exact: Mapping[str, Pictures],
    biases: Mapping[tuple[str, str], Bias],
    now: Mapping[tuple[str, str], Pictures],
    false_alarm: float = FALSE_ALARM,
) -> list[str]:
    """What has become significantly worse, a line each; nothing where chance explains all.

    exact        kept path-traced pictures, by scene
    biases, now  kept squared biases of the faster shaders, and this version's pictures, by scene and method
    false_alarm  of all tests together (Sidak)
    """
    from scipy.special import ndtri

    level = sidak(false_alarm, len(now))
    lost = []
    for (name, method), shown in now.items():
        kept = exact[name]
        if method == "path":
            lost += [f"{name}, path: {text}" for text in _differences(shown, kept, sidak(level, 2))[:1]]
            continue
        before, after = biases[name, method], truth(kept).bias(shown.means)
        # both are judged by the same exact picture, whose noise is counted twice: cautious
        allowed = before.squared - float(ndtri(level)) * float(np.hypot(before.stderr, after.stderr))
        if after.squared > allowed:
            lost.append(
                f"{name}, {method}: squared bias {after.squared:.3g} +- {after.stderr:.1g}, was {before.squared:.3g} "
                f"+- {before.stderr:.1g}; more than {allowed:.3g} is no chance"
            )
    return lost


def _differences(shown: Pictures, kept: Pictures, level: float) -> list[str]:
    """Of path pictures from the exact one, in the mean over the object and in tiles, each tested at ``level``."""
    from scipy.special import ndtr

    where, one, two = shown.where & kept.where, shown.together(), kept.together()
    a, b = (np.asarray(picture.mean)[where].mean(axis=0) for picture in (one, two))
    noise = np.sqrt(sum((np.asarray(picture.stderr)[where] ** 2).sum(axis=0) for picture in (one, two))) / where.sum()
    p = 2 * ndtr(-np.abs(a - b) / noise)
    found = []
    if p.min() < sidak(level, len(p)):
        worst = int(p.argmin())
        found.append(
            f"the object's mean is {100 * (a / b - 1)[worst]:+.2g} % off in channel {worst}, with a standard error of "
            f"{100 * (noise / b)[worst]:.2g} %"
        )
    test = compare_tiles(one, two, where, TILE, level)
    return found if test.agrees else [*found, f"differs from the kept exact picture: {test.summary()}"]


# ---- speed ----


class Kernel:
    """Fixed work of the kind that rendering is made of."""

    def __init__(self) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        mesh = icosphere(0.5, 5)
        self._scene = EmbreeScene(robust=True)
        self._geometry = TriangleMesh(self._scene, mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32))
        mix = np.random.Generator(np.random.PCG64(1))
        # rays one by one, (n, 3) as Embree has them
        self._origins = mix.normal(size=(40_000, 3)).astype(np.float32)
        self._directions = (0.2 * mix.normal(size=self._origins.shape) - self._origins).astype(np.float32)
        self._numbers = mix.random(200_000, dtype=np.float32) + np.float32(0.01)

    def run(self) -> None:
        """The work, once: a tenth of a second, half of it NumPy's."""
        x = self._numbers
        for _ in range(16):
            y = np.log(x) * np.sqrt(x) + np.cos(x) * x
            kept = y > np.float32(0.2)
            y = np.where(kept, x, y)[np.flatnonzero(kept)]
        self._scene.run(self._origins, self._directions, output=1)


def speed_losses(kept: Mapping[str, float], now: Mapping[str, float], bound: float = SPEED_BOUND) -> list[str]:
    """What takes more than ``bound`` times its kept ratio to the kernel, a line each."""
    return [
        f"{what}: {now[what]:.3g} times the kernel, was {ratio:.3g}; the bound is {bound:g} times that"
        for what, ratio in kept.items()
        if now[what] > bound * ratio
    ]


def lasting_speed_losses(
    kept: Mapping[str, float], measure: Callable[[], Mapping[str, float]], attempts: int = ATTEMPTS
) -> list[str]:
    """The losses that every one of some measurements finds: a crowded cache passes, a slower program stays."""
    least: dict[str, float] = {}
    for _ in range(attempts):
        for what, ratio in measure().items():
            least[what] = min(ratio, least.get(what, ratio))
        lost = speed_losses(kept, least)
        if not lost:
            break
    return lost


def speed_ratios(scene: Scene, repeats: int = REPEATS, work: int = 1) -> dict[str, float]:
    """CPU seconds of set-up and of each method's passes, over those of the kernel.

    work  renders so many times what is measured: a planted loss
    """
    renderers = {method: Renderer(scene, settings(method, 1, threads=1)) for method in SPEED_PASSES}
    kernel, least = Kernel(), dict.fromkeys(["kernel", "set-up", *SPEED_PASSES], float("inf"))
    first = 0

    def clock(name: str, job: Callable[[], object]) -> None:
        begun = time.process_time()
        job()
        least[name] = min(least[name], time.process_time() - begun)

    for _ in range(repeats):
        clock("kernel", kernel.run)
        clock("set-up", lambda: [Renderer(scene, settings("path", 1, threads=1)) for _ in range(work)])
        for method, renderer in renderers.items():
            passes = range(first, first + work * SPEED_PASSES[method])
            clock(method, lambda renderer=renderer, passes=passes: renderer.run(passes))  # type: ignore[misc]
        first += work * max(SPEED_PASSES.values())
    return {name: seconds / least["kernel"] for name, seconds in least.items() if name != "kernel"}
