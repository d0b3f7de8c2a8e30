"""From the options of sss-check and the configuration files to the meshes to check, each with its settings."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from sss_tools.configuration import Configuration, Configurations, code_of, codes_of
from sss_tools.errors import InputError
from sss_tools.medium import Medium
from sss_tools.validation.outcome import UNUSABLE, Severity
from sss_tools.validation.settings import Settings
from sss_tools.worker import TIMEOUT, Task

from .materials import medium_of

if TYPE_CHECKING:
    from .check_scene import SceneMesh, SceneMeshes


class TaskMaker:
    """Makes the task of each mesh. The command line wins over configuration files.

    jobs           meshes checked at a time: as the command line says, else as the strictest configuration met so far
    outside_scene  meshes met so far that the scene of ``--scene`` does not show

    Raises InputError for options and configuration files that cannot be used.
    """

    def __init__(self, options: argparse.Namespace):
        self._options = options
        self._configurations = Configurations()
        self._select = _codes(options.select, "--select")
        self._ignore = _codes(options.ignore, "--ignore")
        self._severities = _severities(options.severity)
        self._waive = _waivers(options)
        self._fix = _fix(options)
        self._media: dict[tuple[str, str], Medium] = {}
        self.jobs: int | None = options.jobs
        self._scene = None if options.scene is None else self._read_scene(options.scene)
        self.outside_scene: list[str] = []
        if options.material is not None:
            self._medium(options.material, options.unit, Configuration())

    def tasks(self, path: str) -> list[Task]:
        """The tasks for a mesh file or a scene: one an object, where there is a scene, else one."""
        if path.lower().endswith(".toml"):
            return [self._task(entry.path, entry) for entry in self._read_scene(path).all()]
        entries = [] if self._scene is None else self._scene.of(path)
        if entries:
            return [self._task(path, entry) for entry in entries]
        if self._scene is not None:
            self.outside_scene.append(path)
        return [self._task(path, None)]

    def with_outputs(self, tasks: Sequence[Task]) -> list[Task]:
        """The same tasks, each knowing where the repaired copy of its mesh goes."""
        if not self._fix:
            return list(tasks)
        from sss_tools.repair.output import plan_outputs

        meshes = list(dict.fromkeys(task.path for task in tasks))
        places = plan_outputs(meshes, self._options.paths, self._options.fix_out)
        return [
            replace(task, settings=replace(task.settings, outputs={task.path: places[task.path]})) for task in tasks
        ]

    def _read_scene(self, path: str) -> SceneMeshes:
        from .check_scene import SceneMeshes

        for option in ("material", "unit"):
            if getattr(self._options, option) is not None:
                raise InputError(f"--{option}", "is for meshes without a scene", f"set it in {path}, or leave it out")
        return SceneMeshes(path)

    def _task(self, mesh: str, placed: SceneMesh | None) -> Task:
        """The task for a mesh file; what a scene says of it goes before what a configuration says."""
        options = self._options
        configuration = Configuration() if options.isolated else self._configurations.of(mesh)
        if options.jobs is None and configuration.jobs is not None:
            self.jobs = min(self.jobs or configuration.jobs, configuration.jobs)
        material: str | None
        if placed is not None:
            material, unit, medium = placed.material, placed.unit, placed.medium
        else:
            material, unit = options.material or configuration.material, options.unit or configuration.unit
            medium = None if material is None else self._medium(material, unit, configuration)
        settings = Settings(
            select=self._select or configuration.select,
            ignore=(self._ignore or configuration.ignore) + configuration.ignored_for(mesh),
            severities={**configuration.severity, **self._severities},
            material=material,
            medium=medium,
            unit=unit,
            surroundings=None if placed is None else placed.surroundings,
            record=options.record,
            fix=self._fix,
            diff=options.diff,
            waive=self._waive,
            cache=not options.no_cache,
            isolated=options.isolated,
        )
        return Task(
            mesh,
            settings,
            options.timeout or configuration.timeout or TIMEOUT,
            options.max_memory or configuration.max_memory,
        )

    def _medium(self, name: str, unit: str | None, configuration: Configuration) -> Medium:
        key = name, unit or "mm"
        if key not in self._media:
            source = "--material" if self._options.material is not None else f"{configuration.source}: material"
            self._media[key] = medium_of(*key, source)
        return self._media[key]


def _codes(texts: Sequence[str], option: str) -> tuple[str, ...]:
    """Codes, beginnings of codes and names from comma-separated lists; each must mean at least one rule."""
    try:
        codes = codes_of(",".join(texts))
    except ValueError as error:
        raise InputError(
            f"{option} {error}", "no rule has such a code or name", "use for example SSS1 or SSS101"
        ) from None
    if texts and not codes:
        raise InputError(option, "no code given", "use for example SSS1 or SSS101,SSS203")
    return codes


def _severities(texts: Sequence[str]) -> dict[str, Severity]:
    severities = {}
    for text in texts:
        code, _, level = text.partition("=")
        if level.lower() not in list(Severity):
            raise InputError(f"--severity {text}", "not CODE=LEVEL", "use for example SSS202=error")
        severities[rule_code(code)] = Severity(level.lower())
    return severities


def _fix(options: argparse.Namespace) -> Literal["", "safe", "unsafe"]:
    if options.unsafe_fixes:
        return "unsafe"
    if options.fix or options.diff:
        return "safe"
    if options.fix_out is not None:
        raise InputError("--fix-out", "there is nothing to write without a fix", "add --fix or --unsafe-fixes")
    return ""


def _waivers(options: argparse.Namespace) -> dict[str, str]:
    codes = [rule_code(code.strip()) for text in options.waive for code in text.split(",") if code.strip()]
    reason = (options.reason or "").strip()
    if bool(options.waive) != bool(reason):
        raise InputError("--waive", "goes with --reason", 'give both: --waive SSS402 --reason "baked decimation"')
    for code in codes:
        if code in UNUSABLE:
            raise InputError(f"--waive {code}", "a file that cannot be used cannot be waived", "repair the file")
    return dict.fromkeys(codes, reason)


def rule_code(text: str) -> str:
    """The code of the rule with this code or name. Raises InputError where there is none."""
    try:
        return code_of(text)
    except ValueError:
        from sss_tools.validation.rule import all_rules

        codes = ", ".join(rule.code for rule in all_rules())
        raise InputError(text, "no such rule", f"use one of {codes}") from None
