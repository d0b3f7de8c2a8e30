"""What the user asked of a check, as plain data that travels to worker processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from .outcome import Severity

if TYPE_CHECKING:
    from ..medium import Medium
    from ..surroundings import Surroundings


@dataclass(frozen=True)
class Settings:
    """Which rules to run, how bad to take them, and what the meshes are made of.

    select, ignore  codes or beginnings of codes; an empty ``select`` means all. The rules that say whether a
                    file can be used at all (SSS602, SSS701, SSS702) always run
    severities      code -> severity, instead of the rule's own
    material        name of a preset, or what reports and records call ``medium``; None where nothing was said
    medium          coefficients per mesh unit, of a material that is no preset
    unit            what one mesh unit is: mm, cm, m, inch; None where it was not said (presets then take mm)
    surroundings    the mesh's place in a scene, where there is one
    record          whether to write MESH.sss.json beside each mesh
    waive           code -> reason: findings that the user accepts, beside those waived in the record
    cache           whether to look for the findings among, and keep them with, those of earlier runs
    isolated        whether to leave what lies beside a mesh without effect: its record's waivers do not count
    fix             "safe" or "unsafe": repair each mesh and check the result; "" leaves meshes alone
    diff            repair, but write nothing
    outputs         path of a mesh -> where its repaired copy goes, without extension (``repair.plan_outputs``)
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    severities: Mapping[str, Severity] = field(default_factory=dict)
    material: str | None = None
    medium: Medium | None = None
    unit: str | None = None
    surroundings: Surroundings | None = None
    record: bool = False
    waive: Mapping[str, str] = field(default_factory=dict)
    cache: bool = False
    isolated: bool = False
    fix: Literal["", "safe", "unsafe"] = ""
    diff: bool = False
    outputs: Mapping[str, str] = field(default_factory=dict)

    def wants(self, code: str) -> bool:
        """Whether a rule is to run: selected, and not ignored by as long a prefix or a longer one."""
        selected = max((len(prefix) for prefix in self.select if code.startswith(prefix)), default=-1)
        ignored = max((len(prefix) for prefix in self.ignore if code.startswith(prefix)), default=-1)
        if ignored < 0:
            return selected >= 0 or not self.select
        return selected > ignored
