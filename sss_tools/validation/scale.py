"""Size against the light: SSS404 coarse-tessellation, SSS501 thin-wall, SSS502 scale-mismatch."""

from __future__ import annotations

from typing import NoReturn

from .outcome import FixSafety, Severity
from .rule import NotRun, Rule, Subject, without_engine, without_scene


def without_material(subject: Subject) -> NoReturn:
    """The check of a rule that needs a material, in a version that has no use for it yet."""
    if subject.context.medium is None:
        raise NotRun("no material")
    without_engine(subject)


COARSE_TESSELLATION = Rule(
    code="SSS404",
    name="coarse-tessellation",
    severity=Severity.INFO,
    finds="facets large against the curvature, the scattering length or the pixel",
    why="Light scatters between the facets' edges as in the faceted solid it is: corners glow, planes do not.",
    fix="subdivide",
    fix_safety=FixSafety.UNSAFE,
    check=without_scene,
)

THIN_WALL = Rule(
    code="SSS501",
    name="thin-wall",
    severity=Severity.WARNING,
    finds="walls thinner than the mean free path, or than the ray offset",
    why="Light goes straight through: the wall looks like glass, and below the ray offset rays miss it altogether.",
    fix="thicken the wall, or use a denser medium",
    fix_safety=FixSafety.NONE,
    check=without_material,
)

SCALE_MISMATCH = Rule(
    code="SSS502",
    name="scale-mismatch",
    severity=Severity.WARNING,
    finds="object size against the mean free path: glass-like, or so dense that scattering is invisible",
    why="Most likely the units are wrong: a bunny of metres in marble is opaque, one of micrometres is glass.",
    fix="say what a mesh unit is with --unit, or scale the mesh",
    fix_safety=FixSafety.NONE,
    check=without_material,
)
