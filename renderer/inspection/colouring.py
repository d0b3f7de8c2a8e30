"""A colour for every face: by finding, by wall thickness, by shader, by component."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError
from sss_tools.thickness import wall_thickness

from . import palette
from .specimen import Inspection, Specimen
from .spots import URGENCY, faces_of

THIN, THICK = 0.1, 100.0
"""Ends of the scale of wall thickness, mean free paths; in between it is logarithmic."""
SLIGHT = 1e-3
"""Thin end of the scale where no mean free path is known, shares of the longest side; the thick one is 1."""


@dataclass
class Legend:
    """What the colours mean, in the order they were met.

    entries  (key, words, colour), a key once
    scale    words for the ends and the middle of the ramp, where it is used
    """

    entries: list[tuple[str, str, palette.Colour]] = field(default_factory=list)
    scale: tuple[str, str, str, str] | None = None

    def add(self, key: str, words: str, colour: palette.Colour) -> None:
        """Add an entry unless the key is there."""
        if key not in [entry[0] for entry in self.entries]:
            self.entries.append((key, words, colour))


def colour_faces(inspection: Inspection, number: int, by: str, legend: Legend) -> NDArray[np.uint8]:
    """(m, 3) colours of the faces of a specimen; what they mean goes into ``legend``.

    by  "finding", "thickness", "shader" or "component"

    Raises InputError for "shader" where no scene says which.
    """
    specimen = inspection.specimens[number]
    match by:
        case "thickness":
            return _by_thickness(inspection, specimen, legend)
        case "shader":
            return _by_shader(specimen, legend)
        case "component":
            return _by_component(specimen, legend)
    return _by_finding(specimen, legend)


def _plain(specimen: Specimen, colour: palette.Colour = palette.WALL) -> NDArray[np.uint8]:
    return np.tile(np.array(colour, np.uint8), (len(specimen.mesh.faces), 1))


def _by_finding(specimen: Specimen, legend: Legend) -> NDArray[np.uint8]:
    """The most urgent finding of each face; of equally urgent ones the one with the fewest faces."""
    colours = _plain(specimen)
    if specimen.plan is not None and specimen.plan.state is None:
        colours[:] = palette.mixed(palette.WALL, palette.BACKGROUND, 0.4)  # opaque: the stage, not the play
    faces = {rule.code: faces_of(rule) for rule in specimen.findings}
    order = sorted(specimen.findings, key=lambda rule: (URGENCY[rule.severity], len(faces[rule.code])))
    for rule in reversed(order):
        colours[faces[rule.code]] = palette.of_rule(rule)
    for rule in specimen.findings:
        legend.add(rule.code, f"{rule.code} {rule.name}", palette.of_rule(rule))
    return colours


def _by_component(specimen: Specimen, legend: Legend) -> NDArray[np.uint8]:
    if specimen.assessment is None:
        return _plain(specimen, palette.UNKNOWN)
    roles = [part.role for part in specimen.assessment.components]
    table = np.empty((len(roles) + 1, 3), np.uint8)
    table[-1] = palette.UNKNOWN  # faces without area belong to no component
    solids = 0
    for number, role in enumerate(roles):
        table[number] = palette.ROLES[role]
        if role == "solid":
            table[number] = palette.COMPONENTS[solids % len(palette.COMPONENTS)]
            solids += 1
    for kind, colour in palette.ROLES.items():
        count = sum(role == kind for role in roles)
        if count:
            plural = "s, a colour each" if kind == "solid" else "s"
            words = f"{count} {kind} component{'' if count == 1 else plural}"
            legend.add(f"{specimen.name}: {kind}", words, colour)
    return table[specimen.assessment.component_of_face]


def _by_shader(specimen: Specimen, legend: Legend) -> NDArray[np.uint8]:
    plan = specimen.plan
    if plan is None:
        raise InputError("--color shader", "there is no scene to choose shaders for", "give a scene")
    colour = palette.SHADERS.get(plan.shader, palette.UNKNOWN)
    legend.add(plan.shader, plan.shader, colour)
    return _plain(specimen, colour)


def _by_thickness(inspection: Inspection, specimen: Specimen, legend: Legend) -> NDArray[np.uint8]:
    mesh = specimen.mesh
    if specimen.assessment is None:
        return _plain(specimen, palette.UNKNOWN)
    if specimen.medium is None:
        if any(other.medium is not None for other in inspection.specimens):
            return _plain(specimen, palette.UNKNOWN)
        thin, thick, unit = SLIGHT, 1.0, mesh.longest_side
        words = ("wall thickness, shares of the longest side", f"{thin:g}", "0.03", f"{thick:g}")
    else:
        thin, thick, unit = THIN, THICK, float(specimen.medium.mean_free_path.min())
        words = ("wall thickness, mean free paths", f"{thin:g}", "3", f"{thick:g}")
    legend.scale = words
    legend.add("unknown", "no wall behind", palette.UNKNOWN)
    with np.errstate(divide="ignore"):
        share = np.log(wall_thickness(mesh) / unit / thin) / np.log(thick / thin)
    return palette.ramp(np.where(np.isneginf(share), 0, share))
