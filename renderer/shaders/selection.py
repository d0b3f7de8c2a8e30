"""Which shader for which object: the cheapest whose predicted error is within the tolerance.

One number, the quality q in [0, 1], sets the tolerance of an object n pixels across (cost-benefit level of detail:
Funkhouser & Sequin 1993, SIGGRAPH):

    e0 = 0.3 * 10^(-2 q),    e = e0 (1 + 64 / n)

so that what is small in the picture may be rougher, and objects fall from path through plumb and scalar to the
diffuse fallback as they recede. A shader with error b is good enough up to n = 64 / (b / e0 - 1). Within a factor
``FADE`` of that size its samples turn into the next one's, camera sample by camera sample, so that nothing pops and no
frame needs to know the one before; what a share s of them is wrong by, s b, stays below 0.6 e. The errors are those of
``prediction``, or measured by pilots.

Where the number of passes is not given it follows as well: as many as path needs, in nine of ten cases, for its noise
to be within e and within the error of the shaders that it replaces (``noise_allowed``). The first passes then tell how
many are enough (``renderer.enough``).
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..scene.description import Scene, SceneObject, Translucent
from .appearance import Appearance, appearance, pixel_footprint
from .cost import predicted_seconds
from .prediction import FAST_NOISE, Error, predicted_errors, predicted_noise

DEFAULT_QUALITY = 0.5
CHEAPEST_FIRST = ("diffuse", "scalar", "plumb", "path")
FADE = 2.2
"""Factor around a threshold, in sizes or errors, within which both shaders have samples: so wide that shaders a tenth
apart change an object by less than a hundredth while it recedes by a tenth."""
LEAST_SHARE = 0.002
"""A shader with a smaller share of an object's samples is left out: nobody sees it, and something is built for it."""
ADDED = 0.1
"""Share of its noise, squared, that path may bring to an object where it begins to take a part in it: it then has
passes in proportion to its part, and not at once all that it needs to outweigh its noise by the error it takes away."""
MOST_PASSES = 16384
"""Passes are n / sqrt(1 + (n / this)^2) for the n = (noise / e)^2 that are needed: never more than this, more for every
higher quality, and not far from enough up to half of it."""


@dataclass(frozen=True)
class Candidate:
    """A shader that an object could have.

    predicted_error    of its light; of path, the noise after ``passes``
    error_bound        what is held against the tolerance: so much more that 19 of 20 choices prove right
    passes             those given, or as many as its noise needs to be within the tolerance
    predicted_seconds  wall seconds that the object's samples take in these passes, without set-up
    measured           whether a pilot measured the error
    """

    shader: str
    predicted_error: float
    error_bound: float
    passes: int
    predicted_seconds: float
    measured: bool = False


@dataclass(frozen=True)
class Plan:
    """What is done with one object, and why.

    shader              that of most of its camera samples
    distance            of the camera from the box around the object, scene units
    mean_free_path_px   in pixels at that distance, mean of the channels; None for opaque objects
    size_px             diameter of the object in pixels
    predicted_error     relative, of the chosen shader; None where nothing is predicted
    tolerance           relative error allowed; None for opaque objects
    shares              of its camera samples that each shader lights: one, or several near a threshold
    passes              that its chosen shaders need, or those given
    noise_allowed       to the mean of its samples, where path lights some of them, see ``noise_allowed``
    candidates          cheapest first; none for opaque objects and those without an inside
    """

    name: str
    state: str | None
    hole_handling: str
    shader: str
    reason: str
    distance: float
    mean_free_path_px: float | None
    size_px: float
    predicted_error: float | None
    warning: str | None = None
    tolerance: float | None = None
    shares: dict[str, float] = field(default_factory=dict)
    passes: int = 1
    noise_allowed: float | None = None
    candidates: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Measured:
    """What a pilot found of an object: the error of each shader but path, and the noise of path's samples."""

    errors: Mapping[str, Error]
    noise: Error


@dataclass(frozen=True)
class Demand:
    """How right the user wants it: by quality, or where ``target_error`` is given by that."""

    quality: float = DEFAULT_QUALITY
    target_error: float | None = None

    def tolerance(self, size_px: float) -> float:
        """The relative error allowed for an object ``size_px`` pixels across."""
        return tolerance(self.quality, size_px) if self.target_error is None else self.target_error

    def share(self, error: float, size_px: float, fade: bool = True) -> float:
        """Share of the camera samples for which a shader so far off is good enough.

        1 while the object is small or the shader right, 0 beyond, and a smooth step between (with ``fade``) in the
        logarithm: around the threshold in sizes, and just below it where it is an error that must not be exceeded.
        """
        if self.target_error is None:
            allowed = tolerance(self.quality, math.inf)
            beyond = max(size_px, 1e-3) * (error / allowed - 1) / 64
        else:
            beyond = error / self.target_error * (FADE if fade else 1)
        if not fade or beyond <= 0:
            return float(beyond <= 1)
        t = min(max((math.log(beyond) / math.log(FADE) + 1) / 2, 0.0), 1.0)
        return 1 - t * t * (3 - 2 * t)

    def __str__(self) -> str:
        """As it is said in reasons."""
        if self.target_error is not None:
            return f"target error {100 * self.target_error:.2g} %"
        return f"quality {self.quality:g}"


def tolerance(quality: float, size_px: float) -> float:
    """The relative error allowed for an object ``size_px`` pixels across."""
    return 0.3 * 10 ** (-2 * quality) * (1 + 64 / max(size_px, 1e-3))


def passes_within(noise: float, allowed: float) -> int:
    """Camera samples a pixel after which their mean is noisy by ``allowed``, see ``MOST_PASSES``."""
    return max(math.ceil(1 / math.hypot((allowed / max(noise, 1e-6)) ** 2, 1 / MOST_PASSES) - 1e-9), 1)


def noise_allowed(allowed: float, others: Sequence[float], share: float = 1.0) -> float:
    """The noise that an object may have within ``allowed`` where path lights a ``share`` of its samples, chosen over
    shaders with the errors ``others``.

    A dearer picture that is noisier than the cheaper one would be wrong is of use to nobody. So the noise r is within
    ``allowed`` and below the least of the others in the end, as many passes as both need together, so that more quality
    is always more of them. While others light a share s of the samples it is within

        r sqrt(1 - s^2),

    which with their own error, s times as large, is no more than that error was: as s falls the whole never rises, but
    for ``ADDED`` at the beginning.
    """
    least = 1 / math.hypot(1 / allowed, 1 / min(others, default=math.inf))
    return least * math.sqrt(1 - (1 - ADDED) * (1 - share) ** 2)


def picture_passes(plans: Sequence[Plan]) -> int:
    """As many as the most demanding object needs."""
    return max((plan.passes for plan in plans), default=1)


def select(
    scene: Scene,
    quality: float = DEFAULT_QUALITY,
    shader: str = "auto",
    hole_handling: str = "auto",
    passes: int | None = None,
    *,
    target_error: float | None = None,
    measured: Mapping[str, Measured] | None = None,
    threads: int | None = None,
) -> list[Plan]:
    """A plan for each object of a scene whose translucent objects carry their closedness.

    shader, hole_handling  "auto" or what the user asks for, for all objects; the scene's own wishes come second
    passes                 of the picture; None: as many as the tolerance asks for
    target_error           the tolerance of all objects, in place of that of ``quality``
    measured               by object name, what pilots found; it replaces the prediction
    threads                for the predicted seconds; None: as many as there are cores
    """
    chooser = _Chooser(
        scene,
        Demand(quality, target_error),
        shader,
        hole_handling,
        passes,
        measured or {},
        threads or os.cpu_count() or 1,
    )
    return [chooser.plan(thing) for thing in scene.objects]


@dataclass(frozen=True)
class _Chooser:
    """``select``, object by object."""

    scene: Scene
    demand: Demand
    shader: str
    hole_handling: str
    passes: int | None
    measured: Mapping[str, Measured]
    threads: int

    def plan(self, thing: SceneObject) -> Plan:
        look = appearance(self.scene, thing)
        allowed = self.demand.tolerance(look.size_px)
        fast_passes = self.passes or passes_within(FAST_NOISE, allowed)
        if not isinstance(thing.material, Translucent):
            kind = "opaque" if type(thing.material).__name__ == "Diffuse" else "mirror"
            return Plan(thing.name, None, "surface", kind, "opaque", look.distance, None, look.size_px, None,
                        passes=fast_passes)  # fmt: skip
        assert thing.closedness is not None, "check the scene's objects first"
        handling, because = _handling(thing, self.hole_handling)
        wanted = thing.shader if self.shader == "auto" else self.shader
        warning, error, passes = None, None, fast_passes
        candidates = () if handling == "surface" else self._candidates(thing, look, allowed, wanted == "auto")
        if handling == "surface":
            none = "the mesh encloses no volume" if thing.closedness.state == "open" else "only its surface is lit"
            shares, reason = {"diffuse": 1.0}, f"{none}, so there is no inside for light"
            if wanted != "auto":
                warning = f"{thing.name}: {wanted} needs an inside, and {none}; the diffuse fallback is used"
        elif wanted != "auto":
            shares, reason = {wanted: 1.0}, "asked for"
        else:
            bounds = {one.shader: one.error_bound for one in candidates}
            shares = shares_of(bounds, self.demand, look.size_px, _fades(thing))
            reason = self._reason(shares, candidates, allowed, look.size_px)
        quiet = None
        if candidates:
            noise, by_path = self._noise(thing, look), shares.get("path", 0.0)
            if by_path:
                others = [one.predicted_error for one in candidates[:-1]] if wanted == "auto" else []
                quiet = noise_allowed(allowed, others, by_path)
                passes = self.passes or max(fast_passes, passes_within(by_path**0.5 * noise.bound, quiet))
            wrong = sum(shares.get(one.shader, 0.0) * one.predicted_error for one in candidates[:-1])
            error = math.hypot(wrong, noise.error * (by_path / passes) ** 0.5)
        return Plan(
            name=thing.name,
            state=thing.closedness.state,
            hole_handling=handling,
            shader=max(shares, key=shares.__getitem__),
            reason=f"{reason}; {because}",
            distance=look.distance,
            mean_free_path_px=float(np.mean(thing.material.medium.mean_free_path)) / look.footprint,
            size_px=look.size_px,
            predicted_error=error,
            warning=warning,
            tolerance=allowed,
            shares=shares,
            passes=passes,
            noise_allowed=quiet,
            candidates=candidates,
        )

    def _candidates(self, thing: SceneObject, look: Appearance, allowed: float, free: bool) -> tuple[Candidate, ...]:
        found = self.measured.get(thing.name)
        errors = found.errors if found else predicted_errors(look)
        noise = self._noise(thing, look)
        quiet = noise_allowed(allowed, [error.error for error in errors.values()] if free else [])
        candidates = []
        for name in CHEAPEST_FIRST:
            needed = passes_within(noise.bound, quiet) if name == "path" else passes_within(FAST_NOISE, allowed)
            passes = self.passes or needed
            error = errors.get(name) or Error(noise.error * passes**-0.5, noise.bound * passes**-0.5)
            seconds = predicted_seconds(name, thing, look, passes, self.threads)
            candidates.append(Candidate(name, error.error, error.bound, passes, seconds, found is not None))
        return tuple(candidates)

    def _noise(self, thing: SceneObject, look: Appearance) -> Error:
        """Of a camera sample of path."""
        found = self.measured.get(thing.name)
        return found.noise if found else predicted_noise(look)

    def _reason(self, shares: dict[str, float], candidates: tuple[Candidate, ...], allowed: float, size_px: float):
        by_name = {one.shader: one for one in candidates}
        where = f"tolerance {100 * allowed:.2g} % at {size_px:.3g} pixels and {self.demand}"
        how = "measured by a pilot to be" if candidates[0].measured else "predicted"
        chosen = max(shares, key=shares.__getitem__)
        if len(shares) > 1:
            mixture = ", ".join(f"{100 * share:.3g} % of the samples by {name}" for name, share in shares.items())
            where = f"near a threshold: {mixture}; {where}"
        if chosen == "path":
            best = min(candidates[:-1], key=lambda one: one.error_bound)
            return f"the best faster shader, {best.shader}, is {how} {_percent(best)} wrong; {where}"
        right = "measured" if candidates[0].measured else "predicted"
        return f"the cheapest {right} right enough: {_percent(by_name[chosen])} wrong; {where}"


def shares_of(bounds: Mapping[str, float], demand: Demand, size_px: float, fade: bool = True) -> dict[str, float]:
    """Of the camera samples, by shader: one with the uniform u takes the cheapest that is good enough for more than u
    of them.

    bounds  errors that count, of each shader but path
    """
    shares, taken = {}, 0.0
    for name in CHEAPEST_FIRST:
        enough = 1.0 if name == "path" else demand.share(bounds[name], size_px, fade)
        if enough > taken:
            shares[name] = enough - taken
            taken = enough
    kept = {name: share for name, share in shares.items() if share >= LEAST_SHARE}
    whole = sum(kept.values())
    return {name: share / whole for name, share in kept.items()} if len(kept) < len(shares) else shares


def _fades(thing: SceneObject) -> bool:
    """Shadow rays pass a body of index 1 that path lights, and end at others: it must be one or the other."""
    return isinstance(thing.material, Translucent) and bool(thing.material.medium.ior != 1)


def thresholds(scene: Scene, thing: SceneObject, quality: float = DEFAULT_QUALITY) -> list[tuple[float, str, str]]:
    """At which distances between the camera and the middle of ``thing`` its shader would change, nearest first.

    Each is (distance in scene units, shader nearer than that, shader farther), as if the camera moved along its line
    to the object, and to 1 %; looked for from a tenth of the object's size to 10 000 times.
    """
    look, camera, size = appearance(scene, thing), scene.camera, thing.mesh.longest_side
    distances = size * 10 ** np.arange(-1, 4, np.log10(1.01))
    chosen = []
    for distance in distances:
        footprint = pixel_footprint(camera, float(distance))
        near = thing.mesh.diagonal / 2 / float(distance)
        there = replace(look, footprint=footprint, size_px=size / footprint, view_near=near)
        bounds = {name: error.bound for name, error in predicted_errors(there).items()}
        shares = shares_of(bounds, Demand(quality), there.size_px, _fades(thing))
        chosen.append(max(shares, key=shares.__getitem__))
    return [
        (float(distances[k]), chosen[k - 1], chosen[k]) for k in range(1, len(chosen)) if chosen[k] != chosen[k - 1]
    ]


def _percent(one: Candidate) -> str:
    text = f"{100 * one.predicted_error:.2g} %"
    return text if one.error_bound == one.predicted_error else f"{text} (counted as {100 * one.error_bound:.2g} %)"


def _handling(thing: SceneObject, wish: str) -> tuple[str, str]:
    """What is done at holes, and why."""
    assert thing.closedness is not None
    if wish == "auto":
        wish = thing.hole_handling
    if wish == "cap" and thing.closedness.state == "open":
        return "surface", "caps asked for, and the mesh encloses no volume to close"
    if wish != "auto":
        return wish, "hole handling asked for"
    recorded, state = thing.closedness.hole_handling, thing.closedness.state
    holes = len(thing.closedness.holes)
    because = {
        "strict": "closed, manifold and oriented",
        "cap": f"{holes} {'hole' if holes == 1 else 'holes'} to close for light by caps",
        "terminate": f"state {state} with flaws: paths that contradict the surface take the material's colour",
        "surface": "open",
    }
    return recorded, because[recorded]
