"""sss-check: is this mesh fit for subsurface scattering?"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from sss_tools.errors import InputError
from sss_tools.validation.outcome import MeshReport, Severity
from sss_tools.validation.settings import Settings

from .command import ArgumentParser, complain, progress, run, unavailable, version

if TYPE_CHECKING:
    from sss_tools.validation.rule import Rule

PROGRAM = "sss-check"
FORMATS = ("full", "concise", "json", "sarif", "github")
LATER_FORMATS = ("sarif", "github")


def main(argv: Sequence[str] | None = None) -> int:
    """The command. Returns the exit status: 0 no finding at error level, 1 at least one, 2 unusable input."""
    return run(PROGRAM, _check, argv)


def _check(argv: Sequence[str] | None) -> int:
    start = time.perf_counter()
    parser = _parser()
    options = parser.parse_args(argv)
    _refuse_what_comes_later(options)
    if options.explain is not None:
        sys.stdout.write(explain(options.explain))
        return 0
    if not options.paths:
        parser.error("no mesh given: name a file, a folder, or - for a list on stdin")
    settings = _settings(options)

    from sss_tools.batch import check_files, find_meshes

    paths = find_meshes(options.paths, sys.stdin if "-" in options.paths else ())
    for path in paths:
        if path.lower().endswith(".toml"):
            raise unavailable(path, "name the meshes of the scene instead; checking scenes comes later")
    if settings.fix:
        from dataclasses import replace

        from sss_tools.repair.output import plan_outputs

        settings = replace(settings, outputs=plan_outputs(paths, options.paths, options.fix_out))
    if options.output not in (None, "-", "/dev/stdout"):
        _refuse_to_overwrite(options.output, paths)
    if not paths:
        raise InputError("-", "the list on stdin names no mesh", "give one path a line")
    with progress(len(paths), "checking", options.quiet) as advance:
        reports = check_files(
            paths, settings, options.jobs, options.timeout, done=lambda report: advance(1, report.path)
        )
    for report in reports:
        if report.error is not None:
            complain(PROGRAM, report.error, "error" if report.exit_status == 2 else "warning")
        for rule in report.rules:
            if rule.raised and report.status == "ok":
                complain(PROGRAM, f"{report.path}: {rule.code}: {rule.reason}; please report this")
        if not options.quiet:
            for warning in report.warnings:
                complain(PROGRAM, warning, "warning")
    _write(_render(options, reports, time.perf_counter() - start), options.output)
    status = max((report.exit_status for report in reports), default=0)
    if options.diff and any(report.repair and report.repair["after"] for report in reports):
        status = max(status, 1)
    return 0 if status == 1 and options.exit_zero else status


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        PROGRAM,
        description="Check meshes before subsurface scattering: are they closed, oriented, free of inner walls?",
        epilog="Exit status: 0 no finding at error level, 1 at least one, 2 a file that could not be used or a bad "
        "option. A check that crashes or takes too long is not-run and changes no status.",
    )
    add = parser.add_argument
    add("paths", nargs="*", metavar="PATH", help="a mesh file, a folder (recursively), or - for a list on stdin")
    add("--material", metavar="NAME", help="preset the meshes are made of, for rules about scale")
    add("--scene", metavar="SCENE.toml", help="take materials and neighbours from a scene (not available yet)")
    add("--format", choices=FORMATS, default="full", help="how to report (sarif and github: not available yet)")
    add("-o", "--output", metavar="FILE", help="write the report there instead of to stdout")
    add("--unit", choices=("mm", "cm", "m", "inch"), help="what one mesh unit is")
    add("--select", metavar="CODES", action="append", default=[], help="run these rules: codes or prefixes, a,b,c")
    add("--ignore", metavar="CODES", action="append", default=[], help="leave these out (SSS602, SSS70x always run)")
    add("--severity", metavar="CODE=LEVEL", action="append", default=[], help="error, warning or info instead")
    fix = parser.add_mutually_exclusive_group()
    fix.add_argument("--fix", action="store_true", help="write STEM.fixed.EXT, repaired without changing the shape")
    fix.add_argument("--unsafe-fixes", action="store_true", help="the same, and close holes, unite, split, rebuild")
    add("--fix-out", metavar="DIR", help="where repaired copies go, the folders mirrored")
    add("--diff", action="store_true", help="write nothing, say what a fix would change; exit 1 if anything")
    add("--record", action=argparse.BooleanOptionalAction, default=False, help="write MESH.sss.json beside it")
    add("--explain", metavar="CODE", help="say what a rule finds and why that matters, and exit")
    add("--statistics", action="store_true", help="add how often each rule found something")
    add("--jobs", type=_positive_int, metavar="N", help="meshes checked at a time (default: one a processor)")
    add("--scheduler", metavar="ADDRESS", help="check on a cluster (not available yet)")
    add("--timeout", type=_positive, default=300.0, metavar="S", help="seconds a mesh may take (default 300)")
    add("--exit-zero", action="store_true", help="findings do not change the exit status")
    return parser


def _refuse_what_comes_later(options: argparse.Namespace) -> None:
    """Nothing that was asked for is ignored in silence."""
    for name in ("scene", "scheduler"):
        if getattr(options, name):
            raise unavailable("--" + name.replace("_", "-"))
    if options.format in LATER_FORMATS:
        raise unavailable(f"--format {options.format}", "use full, concise or json")


def _settings(options: argparse.Namespace) -> Settings:
    severities = {}
    for text in options.severity:
        code, _, level = text.partition("=")
        if level.lower() not in list(Severity):
            raise InputError(f"--severity {text}", "not CODE=LEVEL", "use for example SSS202=error")
        severities[_rule(code).code] = Severity(level.lower())
    if options.material is not None:
        from sss_tools.medium import PRESETS

        if options.material not in PRESETS:
            raise InputError(f"--material {options.material}", "no such preset", f"use {', '.join(PRESETS)}")
    fix: Literal["", "safe", "unsafe"] = (
        "unsafe" if options.unsafe_fixes else "safe" if options.fix or options.diff else ""
    )
    if options.fix_out is not None and not fix:
        raise InputError("--fix-out", "there is nothing to write without a fix", "add --fix or --unsafe-fixes")
    return Settings(
        select=_codes(options.select, "--select"),
        ignore=_codes(options.ignore, "--ignore"),
        severities=severities,
        material=options.material,
        unit=options.unit,
        record=options.record,
        fix=fix,
        diff=options.diff,
    )


def _codes(texts: list[str], option: str) -> tuple[str, ...]:
    """Codes and prefixes of codes from comma-separated lists; each must mean at least one rule."""
    prefixes = tuple(part.strip().upper() for text in texts for part in text.split(",") if part.strip())
    if texts and not prefixes:
        raise InputError(option, "no code given", "use for example SSS1 or SSS101,SSS203")
    if prefixes:
        from sss_tools.validation.rule import all_rules

        for prefix in prefixes:
            if not any(rule.code.startswith(prefix) for rule in all_rules()):
                raise InputError(f"{option} {prefix}", "no rule has such a code", "use for example SSS1 or SSS101")
    return prefixes


def _rule(code: str) -> Rule:
    from sss_tools.validation.rule import all_rules

    for rule in all_rules():
        if code.upper() == rule.code or code.lower() == rule.name:
            return rule
    raise InputError(code, "no such rule", f"use one of {', '.join(rule.code for rule in all_rules())}")


def explain(code: str) -> str:
    """What a rule finds, what that does to the light, and what helps. Raises InputError for an unknown code."""
    rule = _rule(code)
    return (
        f"{rule.code} {rule.name} ({rule.severity})\n\n"
        f"Finds: {rule.finds}\n"
        f"Why:   {rule.why}\n"
        f"Fix:   {rule.fix} (automatic fix: {rule.fix_safety})\n"
    )


def _refuse_to_overwrite(output: str, paths: list[str]) -> None:
    target = Path(output)
    if any(target.resolve() == Path(path).resolve() for path in paths):
        raise InputError(output, "is one of the meshes", "write the report to another file")
    if target.is_dir() or not target.parent.is_dir():
        problem = "is a folder" if target.is_dir() else "its folder does not exist"
        raise InputError(output, f"cannot be written: {problem}", "name a file in an existing folder")


def _render(options: argparse.Namespace, reports: list[MeshReport], seconds: float) -> str:
    from sss_tools.report import concise, full, json_report, statistics_table

    if options.format == "json":
        return json_report.render(reports, version(), seconds)
    if options.format == "concise":
        text = concise.render(reports)
    else:
        text = full.render(reports, options.verbose)
        if not options.quiet and len(reports) > 1:
            bad = sum(report.exit_status > 0 for report in reports)
            text += f"\n{len(reports)} meshes, {bad} with errors, {seconds:.1f} s\n"
    return text + ("\n" + statistics_table.render(reports) if options.statistics else "")


def _write(text: str, output: str | None) -> None:
    # opening /dev/stdout anew would write over what follows where stdout is a file
    if output in (None, "-", "/dev/stdout"):
        sys.stdout.write(text)
        return
    from sss_tools.files import write_atomically

    try:
        write_atomically(output, text.encode(errors="backslashreplace"))
    except OSError as error:
        raise InputError(
            output, f"cannot be written ({error.strerror})", "name a file in a folder you may write to"
        ) from error


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be greater than 0, not {text}")
    return value


def _positive_int(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, not {text}")
    return value


if __name__ == "__main__":
    sys.exit(main())
