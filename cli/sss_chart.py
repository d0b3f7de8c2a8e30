"""sss-chart: speed against accuracy, and stability."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sss_tools.errors import InputError

from .command import ArgumentParser, run

if TYPE_CHECKING:
    from renderer.study.measured_runs import Run

PROGRAM = "sss-chart"


def main(argv: Sequence[str] | None = None) -> int:
    """The command. Returns the exit status: 0 written, 2 refused, 130 interrupted; a second run goes on from there."""
    return run(PROGRAM, _chart, argv)


def _chart(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    if options.command is None:
        raise InputError(PROGRAM, "says nothing of what to chart", "name speed or stability")
    if options.list:
        return _list()
    if options.output is None:
        raise InputError("-o", "is missing", "name a folder for charts, CSV and page")
    from renderer.study import drawing

    drawing.require()
    return {"speed": _speed, "stability": _stability}[options.command](options)


def _parser() -> Any:
    parser = ArgumentParser(PROGRAM, description="Charts of speed against accuracy, and of where each method fails.")
    parser.set_defaults(list=False)
    commands = parser.add_subparsers(dest="command", metavar="speed|stability", parser_class=_Plain)
    speed = commands.add_parser(
        "speed", prog=f"{PROGRAM} speed", description="Error against time of every method, one chart a scene.",
        epilog="An interrupted command goes on where it was. Needs the extra charts; with the extra peers also "
        "Mitsuba 3 (DRJIT_LIBLLVM_PATH should name an LLVM library) and FLIP.",
    )  # fmt: skip
    speed.add_argument("scenes", nargs="+", type=Path, metavar="SCENE", help="scene (.toml) or mesh")
    speed.add_argument("--minutes", type=_positive, help="a scene, about (default: 9; 2.5 with --quick)")
    speed.add_argument("--turns", type=_turns, help="runs of every point (default: 3; 2 with --quick)")
    speed.add_argument("--threads", type=_turns, metavar="N", help="of our renderer (default: one a core)")
    speed.add_argument("--no-peers", action="store_true", help="leave Mitsuba out")
    stability = commands.add_parser(
        "stability", prog=f"{PROGRAM} stability",
        description="Error of every method while a parameter walks through its point of failure.",
        epilog="An interrupted command goes on where it was. Needs the extra charts.",
    )  # fmt: skip
    stability.add_argument("--study", action="append", metavar="NAME", help="only this one; may be repeated")
    stability.add_argument("--list", action="store_true", help="name the studies")
    for command in (speed, stability):
        command.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for charts, CSV and page")
        command.add_argument("--quick", action="store_true", help="minutes in place of an hour, with more noise")
    return parser


class _Plain(ArgumentParser):
    """A subcommand's parser."""

    def __init__(self, prog: str, **options: Any):
        super().__init__(prog, **options)


def _speed(options: Any) -> int:
    from dataclasses import replace

    from renderer.study import speed, speed_chart, speed_page
    from renderer.study.drawing import write, write_csv
    from renderer.study.machine import machine
    from renderer.study.measured_runs import Lab

    for source in options.scenes:
        _check(source)
    effort = speed.QUICK if options.quick else speed.FULL
    if options.minutes is not None:
        effort = replace(effort, seconds=60 * options.minutes)
    if options.turns is not None:
        effort = replace(effort, turns=options.turns)
    python = [sys.executable, "-m"]
    progress = _Progress(options.quiet)
    about = machine(options.threads)
    lab = Lab(options.output, [*python, "cli.sss_render"], [*python, "cli.mitsuba_peer"], options.threads, progress.ran)
    lab.open(about)
    named = speed.names(options.scenes)
    peer = "mitsuba" in about and not options.no_peers
    scenes: list[speed.Measured] = []
    rows: list[dict[str, object]] = []
    for k, (name, source) in enumerate(named.items()):
        progress.after = (len(named) - k - 1) * effort.seconds
        measured = speed.measure(lab, name, str(source), effort, peer, progress.left)
        scenes.append(measured)
        rows += speed.rows(measured)
        write_csv(options.output / "speed.csv", speed.COLUMNS, rows)
        speed_chart.draw(measured, options.output, name)
        write(options.output / "speed.md", speed_page.page(scenes, about, options.quick).encode())
    if not options.quiet:
        print(f"{options.output / 'speed.md'}: {len(scenes)} scene(s), {len(rows)} runs")
    return 0


def _check(source: Path) -> None:
    """Refuse what cannot be rendered, before the hour of measuring."""
    if source.suffix.lower() == ".toml":
        from renderer.scene.scene_file import load_scene

        load_scene(source)
    else:
        from sss_tools.loading import load_mesh

        load_mesh(source)


def _stability(options: Any) -> int:
    from renderer.study import stability_report
    from renderer.study.studies import STUDIES

    wanted = options.study or list(STUDIES)
    for name in wanted:
        if name not in STUDIES:
            raise InputError(f"--study {name}", "is no study", f"choose from {', '.join(STUDIES)}")
    progress = _Progress(options.quiet)
    found = stability_report.make(
        [STUDIES[name] for name in dict.fromkeys(wanted)], options.output, options.quick, progress.point
    )
    if not options.quiet:
        print(f"{options.output / 'stability.md'}: {len(found)} studies")
    return 0


def _list() -> int:
    from renderer.study.studies import STUDIES

    for study in STUDIES.values():
        print(f"{study.name}: {study.title}")
    return 0


class _Progress:
    """Lines on stderr: what was measured, and about how long it still takes."""

    def __init__(self, quiet: bool):
        self.quiet, self.remaining, self.after, self.begun = quiet, 0.0, 0.0, time.monotonic()

    def left(self, seconds: float) -> None:
        """Be told how long the scene under way still takes; ``after`` it the others do."""
        self.remaining = seconds + self.after

    def ran(self, made: Run) -> None:
        """A run was made."""
        task = made.task
        left = max(self.remaining - made.seconds, 0.0)
        self._line(f"{task.scene}: {task.method}, {task.setting}, turn {task.turn}: {made.seconds:.1f} s", left)

    def point(self, text: str, share: float) -> None:
        """A point of a study was measured; ``share`` of all is done, counted by this session's points alone."""
        spent = time.monotonic() - self.begun
        self._line(text, spent * (1 - share) / share if share > 0 else 0.0)

    def _line(self, text: str, left: float) -> None:
        if not self.quiet:
            about = f"{left / 60:.0f} min" if left >= 90 else f"{left:.0f} s"
            sys.stderr.write(f"{PROGRAM}: {text}; about {about} remain\n")
            sys.stderr.flush()


# ---- option types: argparse turns a ValueError into "invalid VALUE" with the function's name ----


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise ValueError
    return value


def _turns(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


_positive.__name__, _turns.__name__ = "positive number", "whole number above 0"

if __name__ == "__main__":
    sys.exit(main())
