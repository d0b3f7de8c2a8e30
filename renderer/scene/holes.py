"""What is done where surface is missing, for each object: which handling, why, and what it will cost in error.

``strict``     the surface is closed: nothing is done, and what contradicts it is a leak
``cap``        virtual dielectric caps on the boundary loops, in the traced scene alone
``terminate``  paths that leave through a hole take the colour of the material (Wadkien 2008)
``surface``    there is no inside: the diffuse fallback

Caps are part of the body for every ray, those of the camera included. The picture is held against the closed solid;
a cap that the camera did not see would show it the inner side of the far wall, which no ray can be right about, and
light would leave where the same light sent backwards could not enter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sss_tools.sealing import Loop, Sealed, seal

from .description import Scene, SceneObject, Translucent

NEEDS_INSIDE = ("path", "plumb", "scalar")
"""Shaders that ask what is inside, or how the surface bends: scalar takes its radii from the curvature."""

HALF_ANGLES = (0.0, 5.0, 15.0, 30.0, 47.0)
ERRORS = {"cap": (0.0, 0.005, 0.006, 0.012, 0.04), "terminate": (0.0, 0.03, 0.16, 0.39, 0.65)}
"""Mean relative error of a ball with a hole of these half angles (degrees, seen from its middle), of the two lights
(uniform, from one half) the one that is worse: PHYSICS section 7 up to 30 degrees. At 47 that of caps is measured
(``benchmarks/holes.py``), that of the thesis' rule goes on as before; measured there, it is three times less."""
NAMED = 3
"""Loops left open that are named with their places."""


@dataclass(frozen=True)
class HoleReport:
    """What was done at one object's holes.

    handling        "strict", "cap", "terminate" or "surface"
    reason          why, in a few words
    expected_error  of the object's picture against that of the closed solid, relative, mean over the visible surface;
                    None where nothing is known
    loops, capped   boundary loops of what encloses a volume, and how many of them got a cap
    half_angle      degrees that the widest of them subtends from inside (see ``sss_tools.sealing.Loop``); None for none
    turned          faces turned over, so that solids face outwards
    """

    handling: str
    reason: str
    expected_error: float | None = None
    loops: int = 0
    capped: int = 0
    half_angle: float | None = None
    turned: int = 0


def close_holes(
    scene: Scene, shaders: Sequence[str], handling: Sequence[str], reasons: Sequence[str]
) -> tuple[Scene, list[HoleReport]]:
    """The scene as rays shall meet it, and what was done at the holes of each object.

    shaders, handling  chosen for each object; reasons: for the handling

    Objects that are handled by ``cap`` or ``terminate`` get meshes of their own, with solids turned outwards and, for
    ``cap``, with caps; ``closedness.state`` then tells of these. The scene given stays as it is. Nothing is built for
    shaders that do not need it.
    """
    objects, reports = [], []
    for thing, shader, how, why in zip(scene.objects, shaders, handling, reasons, strict=True):
        thing, report = _close(thing, shader, how, why)
        objects.append(thing)
        reports.append(report)
    return replace(scene, objects=tuple(objects)), reports


def _close(thing: SceneObject, shader: str, handling: str, reason: str) -> tuple[SceneObject, HoleReport]:
    closedness = thing.closedness
    if not isinstance(thing.material, Translucent) or closedness is None or shader not in NEEDS_INSIDE:
        return thing, HoleReport(handling, reason)
    if handling == "strict":
        # asked for where there are holes: nobody knows
        return thing, HoleReport(handling, reason, 0.0 if closedness.state == "closed" else None)
    if handling == "surface" or (closedness.state == "closed" and closedness.oriented):
        return thing, HoleReport(handling, reason)
    sealed = seal(thing.mesh, caps=handling == "cap")
    if sealed.turned:
        reason += f"; {sealed.turned} {'face' if sealed.turned == 1 else 'faces'} turned outwards"
    if handling == "cap":
        handling, reason = _after_capping(sealed, reason)
    closed = closedness.state == "closed" or (handling == "cap" and sealed.closed)
    closedness = replace(
        closedness,
        state="closed" if closed else closedness.state,
        self_intersecting=closedness.self_intersecting or sealed.overlapping,
    )
    widest = [loop.half_angle for loop in sealed.loops if np.isfinite(loop.half_angle)]
    report = HoleReport(
        handling,
        reason,
        expected_error(sealed.loops, sealed.mesh.area),
        len(sealed.loops),
        sum(loop.capped for loop in sealed.loops),
        max(widest, default=None),
        sealed.turned,
    )
    if sealed.turned or report.capped:
        thing = replace(thing, mesh=sealed.mesh, closedness=closedness)
    return thing, report


def _after_capping(sealed: Sealed, reason: str) -> tuple[str, str]:
    """The handling that is left, and why, where caps were wanted."""
    left = [loop for loop in sealed.loops if not loop.capped]
    if not left:
        return "cap", reason
    count, whole = len(left), len(sealed.loops)
    which = f"{count} of {whole} caps" if count < whole else "its cap" if whole == 1 else f"all {whole} caps"
    closes = "that it closes" if count == 1 else "that they close"
    places = ", ".join("(" + ", ".join(f"{x:.4g}" for x in loop.centroid) + ")" for loop in left[:NAMED])
    more = ", ..." if count > NAMED else ""
    unfit = f"{which} would pass through the surface {closes}, around {places}{more}"
    kept = "cap" if count < whole else "terminate"
    return kept, f"{reason}; but {unfit}: paths that leave there take the material's colour"


def expected_error(loops: Sequence[Loop], area: float) -> float | None:
    """Mean relative error of a body of surface ``area`` with these loops; None where one cannot be measured.

    Each loop spoils its surroundings as a hole of its half angle spoils a ball that fits into the room behind it (or
    one as wide as the loop, if that is larger), and that ball's share of the area of the whole.
    """
    if any(not np.isfinite(loop.half_angle) for loop in loops):
        return None
    angles = np.array([loop.half_angle for loop in loops])
    error = np.where(
        [loop.capped for loop in loops], _from_table(angles, ERRORS["cap"]), _from_table(angles, ERRORS["terminate"])
    )
    share = np.minimum(
        4 * np.pi * np.array([max(loop.radius, loop.width / 2) for loop in loops]) ** 2 / max(area, 1e-300), 1
    )
    return float(min((error * share).sum(), 1.0))


def _from_table(angle: NDArray[np.float64], errors: tuple[float, ...]) -> NDArray[np.float64]:
    """Beyond the last entry the error goes on as steeply as before."""
    slope = (errors[-1] - errors[-2]) / (HALF_ANGLES[-1] - HALF_ANGLES[-2])
    return np.interp(angle, HALF_ANGLES, errors) + slope * np.maximum(angle - HALF_ANGLES[-1], 0)


def in_mesh_units(thing: SceneObject, points: NDArray) -> NDArray[np.float64]:
    """(n, 3) points of the scene in the unit and frame of the object's file."""
    if thing.source is None or thing.source is thing.mesh:
        return np.asarray(points, float)
    # transforms are affine: a few hundred vertices, wherever they are, tell which
    chosen = np.linspace(0, len(thing.mesh.vertices) - 1, min(len(thing.mesh.vertices), 512)).astype(int)
    placed, own = thing.mesh.vertices[chosen], thing.source.vertices[chosen]
    middle, there = placed.mean(axis=0), own.mean(axis=0)
    linear, *_ = np.linalg.lstsq(placed - middle, own - there, rcond=None)
    return (np.asarray(points, float) - middle) @ linear + there
