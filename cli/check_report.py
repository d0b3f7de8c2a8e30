"""Writing what sss-check found: in the format asked for, to stdout or to a file."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO, TypeVar

from sss_tools.errors import InputError
from sss_tools.validation.outcome import MeshReport

from .command import version

T = TypeVar("T")

FORMATS = ("full", "concise", "json", "jsonl", "sarif", "github")

STDOUT = (None, "-", "/dev/stdout")
"""Names of stdout. Opening /dev/stdout anew would write over what follows where stdout is a file."""


@contextmanager
def lines_as_they_come(options: argparse.Namespace) -> Iterator[Callable[[MeshReport], None]]:
    """A function that writes the line of a mesh at once, where lines were asked for.

    A file is not written beside and renamed, but grows: that is what lines are for. Of a command that is killed every
    line but the last is whole. Raises InputError where the file cannot be written.
    """
    if options.format != "jsonl":
        yield lambda report: None
        return
    if options.statistics:
        raise InputError("--statistics", "has no place among the lines of meshes", "use --format json")
    from sss_tools.report import json_report

    def tried(action: Callable[..., T], *arguments: object) -> T:
        try:
            return action(*arguments)
        except BrokenPipeError:
            raise
        except OSError as error:
            problem = f"cannot be written ({error.strerror})"
            raise InputError(options.output or "stdout", problem, "make room, or name another file") from error

    def write(report: MeshReport) -> None:
        tried(stream.write, json_report.line(report))
        tried(stream.flush)

    if options.output in STDOUT:
        stream: TextIO = sys.stdout
        yield write
        return
    stream = tried(lambda: open(options.output, "w", encoding="utf-8"))  # noqa: SIM115, PTH123 - closed below
    try:
        yield write
    finally:
        with suppress(OSError):
            stream.close()


def write_report(options: argparse.Namespace, reports: Sequence[MeshReport], seconds: float) -> None:
    """Write the report of the run, but for lines, which are written by then. Raises InputError where that is not
    possible."""
    if options.format == "jsonl":
        return
    chunks = _chunks(options, reports, seconds)
    if options.output in STDOUT:
        for chunk in chunks:
            sys.stdout.write(chunk)
        return
    from sss_tools.files import write_atomically

    try:
        write_atomically(options.output, (chunk.encode(errors="backslashreplace") for chunk in chunks))
    except OSError as error:
        problem = f"cannot be written ({error.strerror})"
        raise InputError(options.output, problem, "name a file in a folder you may write to") from error


def refuse_to_overwrite(output: str | None, paths: Sequence[str]) -> None:
    """Raise InputError for an output that is a mesh or cannot be a file."""
    if output in STDOUT:
        return
    target = Path(str(output))
    if any(target.resolve() == Path(path).resolve() for path in paths):
        raise InputError(str(output), "is one of the meshes", "write the report to another file")
    if target.is_dir() or not target.parent.is_dir():
        problem = "is a folder" if target.is_dir() else "its folder does not exist"
        raise InputError(str(output), f"cannot be written: {problem}", "name a file in an existing folder")


def _chunks(options: argparse.Namespace, reports: Sequence[MeshReport], seconds: float) -> Iterator[str]:
    from sss_tools.report import concise, full, github, json_report, sarif, statistics_table

    match options.format:
        case "json":
            yield from json_report.chunks(reports, version(), seconds, options.statistics)
            return
        case "sarif":
            yield from sarif.chunks(reports, version(), options.statistics)
            return
        case "concise":
            yield from concise.chunks(reports)
        case "github":
            yield from github.chunks(reports)
        case _:
            yield from full.chunks(reports, options.verbose)
            if not options.quiet and len(reports) > 1:
                bad = sum(report.exit_status > 0 for report in reports)
                yield f"\n{len(reports)} meshes, {bad} with errors, {seconds:.1f} s\n"
    if options.statistics:
        yield "\n" + statistics_table.render(reports)
