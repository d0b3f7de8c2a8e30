"""sss-check: is this mesh fit for subsurface scattering?"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

from sss_tools.errors import InputError
from sss_tools.validation.outcome import MeshReport

from .check_report import FORMATS, lines_as_they_come, refuse_to_overwrite, write_report
from .command import ArgumentParser, complain, progress, run

PROGRAM = "sss-check"


def main(argv: Sequence[str] | None = None) -> int:
    """The command. Returns the exit status: 0 no finding at error level, 1 at least one, 2 unusable input."""
    return run(PROGRAM, _check, argv)


def _check(argv: Sequence[str] | None) -> int:
    start = time.perf_counter()
    parser = _parser()
    options = parser.parse_args(argv)
    if options.explain is not None:
        sys.stdout.write(explain(options.explain))
        return 0
    if not options.paths:
        parser.error("no mesh given: name a file, a folder, or - for a list on stdin")

    from sss_tools.batch import check_tasks, find_meshes

    from .check_tasks import TaskMaker

    maker = TaskMaker(options)
    paths = find_meshes(options.paths, sys.stdin if "-" in options.paths else ())
    if not paths:
        raise InputError("-", "the list on stdin names no mesh", "give one path a line")
    tasks = maker.with_outputs([task for path in paths for task in maker.tasks(path)])
    refuse_to_overwrite(options.output, [*paths, *(task.path for task in tasks)])
    if not options.quiet:
        for path in maker.outside_scene:
            complain(PROGRAM, f"{path}: is not in {options.scene}; it is checked by itself", "warning")
    with progress(len(tasks), "checking", options.quiet) as advance, lines_as_they_come(options) as write_line:

        def done(report: MeshReport) -> None:
            write_line(report)
            advance(1, report.path)

        reports = check_tasks(tasks, maker.jobs, done=done, scheduler=options.scheduler)
    status = 0
    for report in reports:
        _complain_of(report, options.quiet)
        status = max(status, report.exit_status)
        if options.diff and report.repair and report.repair["after"]:
            status = max(status, 1)
    write_report(options, reports, time.perf_counter() - start)
    return 0 if status == 1 and options.exit_zero else status


def _complain_of(report: MeshReport, quiet: bool) -> None:
    """What went wrong with a file, on stderr."""
    if report.error is not None:
        complain(PROGRAM, report.error, "error" if report.exit_status == 2 else "warning")
    for rule in report.rules:
        if rule.raised and report.status == "ok":
            complain(PROGRAM, f"{report.path}: {rule.code}: {rule.reason}; please report this")
    if not quiet:
        for warning in report.warnings:
            complain(PROGRAM, warning, "warning")


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        PROGRAM,
        description="Check meshes before subsurface scattering: are they closed, oriented, free of inner walls?",
        epilog="Exit status: 0 no finding at error level, 1 at least one, 2 a file that could not be used or a bad "
        "option. A check that crashes or takes too long is not-run and changes no status. Configuration: sss.toml, or "
        "[tool.sss-check] in pyproject.toml, the nearest upwards from each mesh, else from the working directory.",
    )
    add = parser.add_argument
    add("paths", nargs="*", metavar="PATH", help="a mesh file, a folder (recursively), a scene (all its objects), "
        "or - for a list on stdin")  # fmt: skip
    add("--material", metavar="NAME|FILE", help="what the meshes are made of: a preset, or a TOML file")
    add("--scene", metavar="SCENE.toml", help="give the meshes the materials, scale and neighbours they have there")
    add("--format", choices=FORMATS, default="full", help="how to report (default: full); jsonl: a line a mesh, as "
        "soon as it is checked")  # fmt: skip
    add("-o", "--output", metavar="FILE", help="write the report there instead of to stdout")
    add("--unit", choices=("mm", "cm", "m", "inch"), help="what one mesh unit is")
    add("--select", metavar="CODES", action="append", default=[], help="rules to run: codes, prefixes, names: a,b")
    add("--ignore", metavar="CODES", action="append", default=[], help="leave these out (SSS602, SSS70x always run)")
    add("--severity", metavar="CODE=LEVEL", action="append", default=[], help="error, warning or info instead")
    fix = parser.add_mutually_exclusive_group()
    fix.add_argument("--fix", action="store_true", help="write STEM.fixed.EXT, repaired without changing the shape")
    fix.add_argument("--unsafe-fixes", action="store_true", help="the same, and close holes, unite, split, rebuild")
    add("--fix-out", metavar="DIR", help="where repaired copies go, the folders mirrored")
    add("--diff", action="store_true", help="write nothing, say what a fix would change; exit 1 if anything")
    add("--record", action=argparse.BooleanOptionalAction, default=False, help="write MESH.sss.json beside it")
    add("--waive", metavar="CODES", action="append", default=[], help="accept these findings: with --record for as "
        "long as the geometry stays the same, else in this run")  # fmt: skip
    add("--reason", metavar="TEXT", help="why they are accepted; kept and shown with them")
    add("--explain", metavar="CODE", help="say what a rule finds and why that matters, and exit")
    add("--statistics", action="store_true", help="add how often each rule found something")
    add("--jobs", type=_positive_int, metavar="N", help="meshes checked at a time (default: one a processor)")
    add("--scheduler", metavar="ADDRESS", help="check on the Dask cluster with this scheduler")
    add("--timeout", type=_positive, metavar="S", help="seconds a mesh may take (default 300)")
    add("--max-memory", type=_size, metavar="SIZE", help="memory a mesh may take: 500M, 2G (default: half of "
        "the machine's)")  # fmt: skip
    add("--no-cache", action="store_true", help="check again what was checked before")
    add("--isolated", action="store_true", help="read no configuration file, apply no waivers of records")
    add("--exit-zero", action="store_true", help="findings do not change the exit status")
    return parser


def explain(code: str) -> str:
    """What a rule finds, what that does to the light, and what helps. Raises InputError for an unknown code."""
    from sss_tools.validation.rule import all_rules

    from .check_tasks import rule_code

    (rule,) = (rule for rule in all_rules() if rule.code == rule_code(code))
    return (
        f"{rule.code} {rule.name} ({rule.severity})\n\n"
        f"Finds: {rule.finds}\n"
        f"Why:   {rule.why}\n"
        f"Fix:   {rule.fix} (automatic fix: {rule.fix_safety})\n"
    )


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be greater than 0, not {text}")
    return value


def _size(text: str) -> int:
    from sss_tools.configuration import size_of

    try:
        return size_of(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a size like 500M or 2G, not {text}") from None


def _positive_int(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, not {text}")
    return value


if __name__ == "__main__":
    sys.exit(main())
