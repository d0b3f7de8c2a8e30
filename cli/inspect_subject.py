"""What sss-inspect is given, read and checked: a mesh, a scene, or a record."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sss_tools.errors import InputError
from sss_tools.keys import did_you_mean
from sss_tools.loading import SUFFIXES, load_mesh
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.reading import read_file
from sss_tools.record import Record, geometry_hash, read_record, record_path
from sss_tools.validation.outcome import FixSafety, MeshReport, Outcome, RuleReport, Severity
from sss_tools.validation.rule import Context, Subject, all_rules
from sss_tools.validation.run import FAULTS, LISTED, check_subject
from sss_tools.validation.settings import Settings
from sss_tools.waivers import waive

from .check_tasks import rule_code
from .materials import medium_of

if TYPE_CHECKING:
    from renderer.inspection.specimen import Inspection, Specimen
    from renderer.scene.description import Scene

RECORD = ".sss.json"

Warn = Callable[[str], None]


def inspection_of(options: Any, warn: Warn) -> Inspection:
    """What there is to look at. ``warn`` is told what is odd, one line each. Raises InputError."""
    path = Path(options.subject)
    if path.name.endswith(RECORD):
        return _of_record(path, options, warn)
    if path.suffix.lower() == ".toml":
        return _of_scene(path, options, warn)
    return _of_mesh(path, options, warn)


def scene_of(options: Any) -> Scene:
    """The scene to render: the one of the file, or one around a bare mesh. Raises InputError."""
    path = Path(options.subject)
    if path.suffix.lower() == ".toml":
        _refuse_mesh_options(path, options)
        from renderer.scene.scene_file import load_scene

        return load_scene(path)
    from renderer.scene.staging import stage_mesh

    return stage_mesh(_drawable(path), _medium(options), unit=options.unit or "mm")


def _refuse_mesh_options(path: Path, options: Any) -> None:
    for option in ("material", "unit"):
        if getattr(options, option) is not None:
            raise InputError(f"--{option}", "is for meshes without a scene", f"set it in {path}, or leave it out")


def _of_mesh(path: Path, options: Any, warn: Warn) -> Inspection:
    from renderer.inspection.specimen import Inspection

    medium = _medium(options)
    specimen = _checked(path, _drawable(path), Context(medium, options.unit), _settings(options), warn)
    specimen = replace(specimen, medium=medium)
    scene = None
    if options.color == "shader":
        from renderer.scene.staging import stage_mesh

        scene = stage_mesh(specimen.mesh, medium, unit=options.unit or "mm")
        specimen = _planned(scene, (specimen,))[0]
    return Inspection(path.name, (specimen,), scene, options.unit or "units")


def _of_record(path: Path, options: Any, warn: Warn) -> Inspection:
    """The findings as a record has them; nothing is checked."""
    from renderer.inspection.specimen import Inspection, Specimen

    if options.material is not None:
        raise InputError("--material", "says nothing to a record, which was judged already", "leave it out")
    data = _read_json(path)
    mesh_path = path.with_name(path.name.removesuffix(RECORD))
    if not mesh_path.is_file():
        raise InputError(path, f"there is no mesh {mesh_path.name} beside it", "put the mesh there")
    mesh = _drawable(mesh_path)
    record = read_record(mesh_path, mesh)
    if record is None:
        raise InputError(path, f"does not go with {mesh_path.name}, or with this version",
                         f"write it anew: sss-check {mesh_path} --record")  # fmt: skip
    report = _recorded(mesh_path, mesh, record, _wanted(options))
    subject = Subject(mesh)
    specimen = Specimen(mesh_path.name, mesh, report, subject.assessment, record=data)
    notes = [f"of {rule.code} {rule.name} only the first {LISTED} places of each kind, which a record lists, are drawn"
             for rule in report.shown if rule.truncated]  # fmt: skip
    for note in notes:
        warn(f"{path}: {note}; sss-inspect {mesh_path} shows all")
    return Inspection(path.name, (_capped(specimen),), notes=tuple(notes))


def _of_scene(path: Path, options: Any, warn: Warn) -> Inspection:
    from renderer.inspection.specimen import Inspection
    from renderer.scene.scene_file import load_scene
    from sss_tools.surroundings import moved

    from .check_scene import SceneMeshes

    _refuse_mesh_options(path, options)
    scene = load_scene(path)
    specimens = []
    for thing, entry in zip(scene.objects, SceneMeshes(str(path)).all(), strict=True):
        source = thing.source if thing.source is not None else thing.mesh
        neighbours, problems = entry.surroundings.neighbours()
        for problem in problems:
            warn(problem)
        footprint = entry.surroundings.pixel_footprint(source)
        context = Context(entry.medium, entry.unit, neighbours, footprint, not entry.surroundings.placed.translucent)
        specimen = _checked(Path(entry.path), source, context, _settings(options), warn)
        medium = getattr(thing.material, "medium", None)
        cap = None if specimen.cap is None else moved(specimen.cap, entry.surroundings.placed.matrix)
        specimens.append(replace(specimen, name=thing.name, mesh=thing.mesh, medium=medium, cap=cap))
    return Inspection(path.name, _planned(scene, tuple(specimens)), scene, scene.unit)


def _medium(options: Any) -> Medium | None:
    """What a bare mesh is made of, as ``--material`` says. Raises InputError."""
    return None if options.material is None else medium_of(options.material, options.unit or "mm")


def _drawable(path: Path) -> Mesh:
    """The mesh of a file. Raises InputError for one with nothing to draw."""
    if path.is_dir():
        raise InputError(path, "is a folder", "name one mesh, scene or record in it")
    if path.exists() and path.suffix.lower() not in SUFFIXES:
        suffixes = (*SUFFIXES, ".toml", RECORD)
        raise InputError(path, "is no mesh, scene or record", did_you_mean(path.suffix.lower(), suffixes))
    from renderer.inspection.specimen import finite_faces

    mesh = load_mesh(path)
    if len(mesh.faces) == 0:
        raise InputError(path, "has no faces: there is nothing to look at", "give a mesh with triangles")
    if not finite_faces(mesh).any():
        raise InputError(path, "has no face with finite coordinates: there is nothing to look at", "repair it")
    return mesh


def _checked(path: Path, mesh: Mesh, context: Context, settings: Settings, warn: Warn) -> Specimen:
    """A mesh with all that the rules say of it, and the record beside it."""
    from renderer.inspection.specimen import Specimen

    subject = Subject(mesh, context)
    report = check_subject(subject, settings, path, listed=None)
    report.hash = geometry_hash(mesh)
    waive(report, str(path), settings)
    for warning in report.warnings:
        warn(warning)
    for rule in report.rules:
        if rule.raised:
            warn(f"{path}: {rule.code}: {rule.reason}; please report this")
    record = read_record(path, mesh)
    data = None if record is None else _read_json(record_path(path))
    assessment = None
    if report.closedness is not None:
        assessment = subject.assessment
    return _capped(Specimen(path.name, mesh, report, assessment, record=data))


def _capped(specimen: Specimen) -> Specimen:
    """The specimen with the caps that light meets, where the verdict is to cap its holes."""
    closedness = specimen.report.closedness
    if closedness is None or closedness["hole_handling"] != "cap":
        return specimen
    from sss_tools.sealing import seal

    try:
        sealed = seal(specimen.mesh)
    except FAULTS:
        return specimen  # what cannot be closed is drawn open
    caps = sealed.mesh.faces[sealed.faces :]
    return replace(specimen, cap=Mesh(sealed.mesh.vertices, caps)) if len(caps) else specimen


def _planned(scene: Scene, specimens: tuple[Specimen, ...]) -> tuple[Specimen, ...]:
    """The specimens with the shader that would be chosen for each."""
    from renderer.scene.description import Translucent
    from renderer.shaders.selection import select
    from sss_tools.closedness import Closedness

    objects = []
    for thing, specimen in zip(scene.objects, specimens, strict=True):
        closedness = specimen.report.closedness
        if isinstance(thing.material, Translucent):
            if closedness is None:
                return specimens
            thing = replace(thing, closedness=Closedness.from_json(closedness))
        objects.append(thing)
    plans = select(replace(scene, objects=tuple(objects)))
    return tuple(replace(specimen, plan=plan) for specimen, plan in zip(specimens, plans, strict=True))


def _settings(options: Any) -> Settings:
    return Settings(select=_wanted(options))


def _wanted(options: Any) -> tuple[str, ...]:
    """The code that ``--rule`` names, if it is there. Raises InputError for a rule that does not exist."""
    return () if options.rule is None else (rule_code(options.rule),)


def _recorded(path: Path, mesh: Mesh, record: Record, wanted: tuple[str, ...]) -> MeshReport:
    """A report that says what a record does."""
    rules = {rule.code: rule for rule in all_rules()}
    found = []
    for finding in record.findings:
        rule = rules.get(finding["code"])
        if rule is None or (wanted and rule.code not in wanted):
            continue
        known = {key: finding[key] for key in RuleReport.__dataclass_fields__ if key in finding}
        report = RuleReport(**{**known, "why": rule.why})
        report.severity, report.outcome = Severity(report.severity), Outcome(report.outcome)
        report.fix = FixSafety(report.fix)
        found.append(report)
    return MeshReport(
        str(path), hash=record.hash, vertices=len(mesh.vertices), faces=len(mesh.faces),
        closedness=record.closedness.to_json(), components=record.components, rules=found,
    )  # fmt: skip


def _read_json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(read_file(path))
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "name a record of sss-check --record") from None
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"is no record: {error}", "write it anew with sss-check --record") from None
    if not isinstance(data, dict):
        raise InputError(path, "is no record", "write it anew with sss-check --record")
    return data
