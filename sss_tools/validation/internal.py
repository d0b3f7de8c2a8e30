"""What lies inside solids: SSS301 internal-geometry, SSS305 cavity."""

from __future__ import annotations

import numpy as np

from ..interior import SOLID
from .outcome import FixSafety, Severity
from .rule import Finding, NotRun, Rule, Subject, plural


def find_internal_geometry(subject: Subject) -> Finding | None:
    """Components, patches between non-manifold edges or intersections, and faces that reach into solids."""
    assessment = subject.assessment
    interior = assessment.interior
    nested = [number for number, part in enumerate(assessment.components) if part.role == "internal"]
    if not interior and not nested:
        if interior.skipped:
            raise NotRun(f"{plural(interior.skipped, 'patch', 'patches')} could not be looked at in time")
        return None
    whole = np.unique(np.concatenate([assessment.faces_of(nested), *interior.patches]))
    apart = [patch for patch in interior.patches if assessment.component_of_face[patch[0]] not in nested]
    single = np.setdiff1d(interior.faces, whole)
    accounted = [*nested, *(assessment.component_of_face[patch[0]] for patch in apart)]
    overlapping = np.setdiff1d(assessment.component_of_face[single], accounted)
    found = []
    if nested:
        found.append(f"{plural(len(nested), 'component')} inside a solid")
    if apart:
        found.append(f"{plural(len(apart), 'patch', 'patches')} with solid on both sides")
    if len(overlapping):
        found.append(f"{plural(len(overlapping), 'component')} reaching into a solid with a few faces")
    if interior.skipped:
        found.append(f"{plural(interior.skipped, 'smaller patch', 'smaller patches')} not looked at")
    return Finding(
        count=len(nested) + len(apart) + len(overlapping),
        message=f"{', '.join(found)} (inside: wound round by more than {SOLID:g} of a turn; no length is tolerated)",
        faces=np.union1d(whole, single),
    )


def find_cavities(subject: Subject) -> Finding | None:
    """Voids inside solids."""
    assessment = subject.assessment
    cavities = [number for number, part in enumerate(assessment.components) if part.role == "cavity"]
    if not cavities:
        return None
    volumes = [assessment.components[number].volume for number in cavities]
    known = sum(-volume for volume in volumes if volume is not None)
    return Finding(
        count=len(cavities),
        message=f"{plural(len(cavities), 'void')} inside a solid, {known:.3g} cubic units in all "
        f"(inside: wound round by more than {SOLID:g} of a turn)",
        faces=assessment.faces_of(cavities),
    )


INTERNAL_GEOMETRY = Rule(
    code="SSS301",
    name="internal-geometry",
    severity=Severity.ERROR,
    finds="faces with the solid on both sides (generalised winding number), not a cavity",
    why="Light that should pass unhindered is refracted and reflected at a wall that is not there: dark skin over "
    "eyes and teeth, seams where parts overlap.",
    fix="remove what lies inside, or unite the overlapping solids; a void must be wound inwards",
    fix_safety=FixSafety.UNSAFE,
    check=find_internal_geometry,
)

CAVITY = Rule(
    code="SSS305",
    name="cavity",
    severity=Severity.INFO,
    finds="a void inside a solid (information, legitimate)",
    why="Light crosses the void unscattered, after two more boundaries: the object is brighter than a massive one. "
    "Right for a bubble, wrong for a forgotten shell.",
    fix="none needed; remove the inner shell if the object is meant to be massive",
    fix_safety=FixSafety.NONE,
    check=find_cavities,
)
