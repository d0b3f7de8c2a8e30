"""Small exhibits for tests: meshes checked and put together."""

from __future__ import annotations

from renderer.inspection.exhibit import Exhibit, put_together
from renderer.inspection.specimen import Inspection, Specimen
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.validation.rule import Context, Subject
from sss_tools.validation.run import check_subject


def specimen(mesh: Mesh, name: str = "thing", medium=None) -> Specimen:
    subject = Subject(mesh, Context(medium))
    report = check_subject(subject, path=name, listed=None)
    assessment = subject.assessment if report.closedness is not None else None
    return Specimen(name, mesh, report, assessment, medium)


def inspection(*meshes: Mesh, medium=None) -> Inspection:
    return Inspection("test", tuple(specimen(mesh, f"thing{k}", medium) for k, mesh in enumerate(meshes)))


def exhibit(*meshes: Mesh, colour: str = "finding", medium=None) -> Exhibit:
    return put_together(inspection(*meshes, medium=medium), colour)


def punctured_ball() -> Mesh:
    """A ball with two holes: one towards +z, one on the far side from the first view."""
    return shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1], [0, 0, -1]], 0.2)


def ball_in_ball() -> Mesh:
    """A ball within a ball, both facing outwards: internal geometry that nobody sees from outside."""
    return shapes.with_internal(shapes.icosphere(1.0, 3), [0, 0, 0], 0.4, 2)
