"""Repairing a file: the ladder, the result beside it, and the check of that result."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..loading import load_mesh
from ..mesh import Mesh
from .ladder import repair_mesh
from .output import encoded, write_result
from .result import Repair


def repair_file(mesh: Mesh, place: str, unsafe: bool, dry: bool) -> tuple[Mesh | None, Repair, InputError | None]:
    """Repair ``mesh``, as read from its file, and write the result to ``place`` plus an extension.

    dry  write nothing: the report says what would happen
    Returns the result as it reads back from the written file (None where nothing changed or could be written),
    the report, and why a result that there is could not be written.
    """
    result, report = repair_mesh(mesh, unsafe)
    if result is None:
        return None, report, None
    if dry:
        report.lost += encoded(result, mesh, place)[2]
        return result, report, None
    try:
        path, lost = write_result(result, mesh, place)
        report.output = str(path)
        report.lost += lost
        return load_mesh(Path(path)), report, None
    except InputError as error:
        report.reason = f"not written: {error.problem}"
        return None, report, error
