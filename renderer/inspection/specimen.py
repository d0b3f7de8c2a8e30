"""What is looked at: meshes with all that is known of them, and the scene they stand in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.closedness import Assessment
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import UnitFrame
from sss_tools.validation.outcome import MeshReport, RuleReport

from ..scene.description import Scene
from ..shaders.selection import Plan


@dataclass(frozen=True, eq=False)
class Specimen:
    """One mesh under inspection, where it stands.

    mesh        in scene units where there is a scene, else as the file has it; its faces are numbered as the report's
    report      what the check found, with all indices where ``report.rules`` says so
    assessment  components and their roles; None where they could not be found out
    medium      what it is made of, coefficients per unit of ``mesh``; None where nobody said, or it is opaque
    plan        the shader chosen for it and why; None without a scene
    cap         surface that closes its holes, where the verdict is that light is kept in there; else None
    record      the record beside it as the file has it, where there is one that can be trusted
    """

    name: str
    mesh: Mesh
    report: MeshReport
    assessment: Assessment | None = None
    medium: Medium | None = None
    plan: Plan | None = None
    cap: Mesh | None = None
    record: dict[str, Any] | None = None

    @property
    def findings(self) -> list[RuleReport]:
        """What was found, waived or not, by code."""
        return self.report.shown

    def finite_faces(self) -> NDArray[np.bool_]:
        """(m,) faces whose corners all have finite coordinates: the others cannot be drawn."""
        return finite_faces(self.mesh)


def finite_faces(mesh: Mesh) -> NDArray[np.bool_]:
    """(m,) faces whose corners all have finite coordinates."""
    finite = np.logical_and.reduce(np.isfinite(mesh.vertices), axis=1)
    return np.logical_and.reduce(finite[mesh.faces], axis=1)


@dataclass(frozen=True, eq=False)
class Inspection:
    """All that is looked at together.

    title  the file's name
    scene  with camera and lights; None for a mesh by itself
    unit   what a unit of length is called
    notes  what a reader should know besides, one line each
    """

    title: str
    specimens: tuple[Specimen, ...]
    scene: Scene | None = None
    unit: str = "units"
    notes: tuple[str, ...] = field(default=())

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) least and greatest finite coordinates of all that faces use; zeros where there are none."""
        corners = []
        for specimen in self.specimens:
            places = specimen.mesh.vertices[np.unique(specimen.mesh.faces[specimen.finite_faces()])]
            if len(places):
                corners += [places.min(axis=0), places.max(axis=0)]
        return np.array([np.min(corners, axis=0), np.max(corners, axis=0)]) if corners else np.zeros((2, 3))

    @property
    def frame(self) -> UnitFrame:
        """Where all meshes together are one unit long, about the origin: single precision is enough there."""
        return UnitFrame.around(*self.bounds)
