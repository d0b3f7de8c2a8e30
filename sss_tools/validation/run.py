"""Running the rules: over a mesh in hand, or over a file."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..loading import load_mesh
from ..medium import Medium
from ..mesh import Mesh
from ..record import geometry_hash, read_repairs, write_record
from ..waivers import waive
from .outcome import UNUSABLE, FixSafety, MeshReport, Outcome, RuleReport
from .rule import Context, Finding, NotRun, Rule, Subject, all_rules
from .settings import Settings

LISTED = 1000
"""How many indices of each kind a report lists; beyond that it is ``truncated``."""

OPAQUE = "opaque in this scene: no light enters it"
"""Why rules about the inside do not run on floors and walls."""

FAULTS = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, NotImplementedError),
    *(OSError, RuntimeError, TypeError, ValueError),
)
"""What a faulty rule may raise. Anything else (running out of memory, an interrupt) is not the rule's fault."""


def check_file(path: str | Path, settings: Settings | None = None) -> MeshReport:
    """Read a mesh file and run the rules over it; a file that cannot be read is a report, too.

    Raises ValueError for a material or unit that does not exist.
    """
    settings = settings or Settings()
    start = time.perf_counter()
    try:
        mesh = load_mesh(Path(path))
    except InputError as error:
        report = _report_unreadable(path, error, settings)
        report.seconds = time.perf_counter() - start
        return report
    context, problems = _context(mesh, settings)
    report = _known_or_checked(mesh, context, settings, path)
    repairs = read_repairs(path, report.hash or "") if settings.record else []
    if settings.fix and report.error is None:
        report, result = _repaired(path, mesh, context, report, settings)
        if result is not None and report.repair is not None and report.repair["output"] is not None:
            # waivers and record are those of the result: it is other geometry
            path, mesh, report.hash = report.repair["output"], result, geometry_hash(result)
            repairs = [*repairs, *(rung for rung in report.repair["rungs"] if rung["status"] == "applied")]
    report.warnings += problems
    if settings.surroundings is not None:
        report.object = settings.surroundings.placed.name
    waivers = waive(report, path, settings)
    if settings.record and report.closedness is not None:
        try:
            write_record(path, mesh, report, settings.material, context.medium, settings.unit, waivers, repairs)
        except OSError as error:
            report.warnings.append(f"{path}: the record could not be written ({error.strerror or error})")
    report.seconds = time.perf_counter() - start
    return report


def _context(mesh: Mesh, settings: Settings) -> tuple[Context, list[str]]:
    """What is known besides the mesh, and what went wrong finding it out, one line each."""
    medium = settings.medium
    if medium is None and settings.material is not None:
        medium = Medium.preset(settings.material, settings.unit or "mm")
    surroundings = settings.surroundings
    if surroundings is None:
        return Context(medium, settings.unit), []
    neighbours, problems = surroundings.neighbours()
    opaque = not surroundings.placed.translucent
    return Context(medium, settings.unit, neighbours, surroundings.pixel_footprint(mesh), opaque), problems


def _known_or_checked(mesh: Mesh, context: Context, settings: Settings, path: str | Path) -> MeshReport:
    """The report on a mesh, from the cache where that is wanted and it is there."""
    digest = geometry_hash(mesh)
    report = key = None
    if settings.cache:
        from .. import findings_cache

        key = findings_cache.key_of(mesh, digest, context, settings)
        report = findings_cache.recall(key)
    if report is None:
        report = check_mesh(mesh, context, settings, path)
        if key is not None:
            findings_cache.keep(key, report)
    else:
        report.path, report.cached = str(path), True
    report.hash = digest
    return report


def check_mesh(
    mesh: Mesh,
    context: Context | None = None,
    settings: Settings | None = None,
    path: str | Path | None = None,
) -> MeshReport:
    """Run the rules over a mesh.

    A rule that raises one of ``FAULTS`` ends as ``not-run`` with ``raised`` set; the others still run.
    """
    return check_subject(Subject(mesh, context), settings, path)


def check_subject(
    subject: Subject,
    settings: Settings | None = None,
    path: str | Path | None = None,
    listed: int | None = LISTED,
) -> MeshReport:
    """Run the rules over a subject, which afterwards holds what they found out (``subject.assessment``).

    listed  how many indices of each kind the report lists; None for all
    """
    settings, mesh = settings or Settings(), subject.mesh
    start = time.perf_counter()
    report = MeshReport(str(path or mesh.path or ""), vertices=len(mesh.vertices), faces=len(mesh.faces))
    blocked = None
    opaque = OPAQUE if subject.context.opaque else None
    # numbers too large or small for double precision are findings, not warnings on the terminal
    with np.errstate(all="ignore"):
        for rule in sorted(all_rules(), key=lambda rule: not rule.on_file):
            result = _run(rule, subject, settings, None if rule.on_file else blocked or opaque, listed)
            report.rules.append(result)
            if result.outcome == Outcome.FAIL and rule.code in UNUSABLE:
                blocked = f"{rule.name}: {result.message}"
                report.error = InputError(report.path, result.message, rule.fix).line()
        report.rules.sort(key=lambda result: result.code)
        if blocked is None:
            _describe(subject, report)
    report.seconds = time.perf_counter() - start
    return report


def _repaired(
    path: str | Path, mesh: Mesh, context: Context, report: MeshReport, settings: Settings
) -> tuple[MeshReport, Mesh | None]:
    """The report on the repaired mesh, and that mesh; the one at hand and None where there is no result."""
    from ..repair.file import repair_file

    place = settings.outputs.get(str(path), str(Path(path).with_suffix(".fixed")))
    result, repair, failure = repair_file(mesh, place, settings.fix == "unsafe", settings.diff)
    repair.before["findings"] = {finding.code: finding.count for finding in report.findings}
    if result is not None:
        checked = check_mesh(result, context, settings, path)
        repair.after["findings"] = {finding.code: finding.count for finding in checked.findings}
        if not settings.diff:
            report = checked
    report.repair = repair.to_json()
    if failure is not None:
        report.warnings.append(f"{failure.line()}")
    return report, None if settings.diff else result


def report_not_checked(path: str | Path, reason: str, settings: Settings, raised: bool = False) -> MeshReport:
    """The report on a file whose check did not come to an end: every rule is ``not-run``."""
    report = MeshReport(str(path), status="unreadable", error=f"{path}: not checked: {reason}")
    report.rules = [_not_run(rule, settings, reason) for rule in all_rules()]
    for rule in report.rules:
        rule.raised = raised
    return report


def _report_unreadable(path: str | Path, error: InputError, settings: Settings) -> MeshReport:
    """The report on a file that holds no mesh."""
    if isinstance(error.__cause__, ImportError):
        package = (error.__cause__.name or "a package").split(".")[0]
        return report_not_checked(path, f"reading it needs the package {package}: install it", settings)
    report = report_not_checked(path, "unreadable", settings)
    report.error = error.line()
    for rule in report.rules:
        if rule.code == "SSS702":
            rule.outcome, rule.reason = Outcome.FAIL, None
            rule.count, rule.message = 1, f"{error.problem}; {error.remedy}"
    return report


def _run(
    rule: Rule, subject: Subject, settings: Settings, blocked: str | None, listed: int | None = LISTED
) -> RuleReport:
    """One rule's result; ``blocked`` is why the geometry cannot be looked at."""
    if not rule.on_file and not settings.wants(rule.code):
        return _not_run(rule, settings, "not selected")
    if blocked is not None:
        return _not_run(rule, settings, blocked)
    try:
        finding = rule.check(subject)
    except NotRun as absence:
        return _not_run(rule, settings, str(absence))
    except ImportError as error:
        return _not_run(rule, settings, f"needs the package {error.name}: install it")
    except FAULTS as error:
        result = _not_run(rule, settings, f"the rule failed ({type(error).__name__}: {error})")
        result.raised = True
        return result
    if finding is None:
        return _blank(rule, settings, Outcome.PASS)
    return _failure(rule, finding, subject.mesh, settings, listed)


def _blank(rule: Rule, settings: Settings, outcome: Outcome, reason: str | None = None) -> RuleReport:
    severity = settings.severities.get(rule.code, rule.severity)
    return RuleReport(rule.code, rule.name, severity, outcome, reason, fix=FixSafety(rule.fix_safety), why=rule.why)


def _not_run(rule: Rule, settings: Settings, reason: str) -> RuleReport:
    return _blank(rule, settings, Outcome.NOT_RUN, reason)


def _failure(rule: Rule, finding: Finding, mesh: Mesh, settings: Settings, listed: int | None = LISTED) -> RuleReport:
    """A finding with its place, cut to the first ``listed`` indices of each kind."""
    result = _blank(rule, settings, Outcome.FAIL)
    result.count, result.message = finding.count, finding.message
    faces, edges, vertices, pairs = (
        np.asarray(indices, np.int64)
        for indices in (finding.faces, finding.edges, finding.vertices, finding.face_pairs)
    )
    # the most precise thing known says where it is
    where = vertices if vertices.size else edges if edges.size else mesh.faces[faces] if faces.size else None
    if where is not None:
        places = mesh.vertices[np.unique(where)]
        places = places[np.isfinite(places).all(axis=1)]
        if len(places):
            result.bbox = [_numbers(places.min(axis=0)), _numbers(places.max(axis=0))]
            result.centroid = _numbers(places.mean(axis=0))
    result.faces, result.edges = faces[:listed].tolist(), edges[:listed].tolist()
    result.vertices, result.face_pairs = vertices[:listed].tolist(), pairs[:listed].tolist()
    result.truncated = listed is not None and any(len(indices) > listed for indices in (faces, edges, vertices, pairs))
    return result


def _describe(subject: Subject, report: MeshReport) -> None:
    """Size, volume, closedness and components of a usable mesh."""
    mesh = subject.mesh
    report.bbox = [_numbers(corner) for corner in mesh.bounds]
    report.area = _number(mesh.area)
    try:
        assessment = subject.assessment
    except FAULTS as error:
        report.warnings.append(f"{report.path}: closedness could not be found out ({type(error).__name__}: {error})")
        return
    report.volume = None if assessment.volume is None else _number(assessment.volume)
    report.closedness = assessment.closedness.to_json()
    report.components = [_component(part) for part in assessment.components]


def _component(part: Any) -> dict[str, Any]:
    return {"faces": part.faces, "role": part.role, "closed": part.closed, "volume": part.volume}


def _number(value: float) -> float | None:
    """A number that JSON can hold."""
    return float(value) if np.isfinite(value) else None


def _numbers(values: ArrayLike | NDArray) -> list[float]:
    return [float(value) for value in np.asarray(values)]
