"""What all commands share: one-line errors, exit statuses, verbosity, a progress bar, lazily everything."""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from sss_tools.errors import InputError, one_line

from .interruption import interruptible

EXIT_UNUSABLE = 2
EXIT_INTERRUPTED = 130
PATIENCE = 1.0
"""Seconds before a progress bar shows."""


class ArgumentParser(argparse.ArgumentParser):
    """argparse with ``--version``, ``-q``, ``-v`` and errors of one line."""

    def __init__(self, prog: str, **options: Any):
        super().__init__(prog=prog, allow_abbrev=False, **options)
        self.add_argument("--version", action=_Version)
        verbosity = self.add_mutually_exclusive_group()
        verbosity.add_argument("-q", "--quiet", action="store_true", help="no progress, no warnings, no summary")
        verbosity.add_argument("-v", "--verbose", action="store_true", help="say more")

    def error(self, message: str) -> NoReturn:
        """One line, and status 2."""
        complain(self.prog, f"{message} (see {self.prog} --help)")
        raise SystemExit(EXIT_UNUSABLE)


class _Version(argparse.Action):
    """Looks the version up only when asked: that takes as long as all of argparse."""

    def __init__(self, option_strings, dest):
        super().__init__(option_strings, dest, nargs=0, help="print the version and exit")

    def __call__(self, parser, namespace, values, option_string=None):
        print(f"{parser.prog} {version()}")
        parser.exit()


def version() -> str:
    """The installed version of the distribution."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed("sss-tools")
    except PackageNotFoundError:  # run from a checkout
        return "0+unknown"


def complain(program: str, message: str, kind: str = "error") -> None:
    """``PROGRAM: error: message`` on stderr, on one line whatever the message contains."""
    sys.stderr.write(one_line(f"{program}: {kind}: {message}") + "\n")


def run(program: str, body: Callable[[Sequence[str] | None], int], argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    program  the command's name, in front of its errors
    body     takes the arguments, returns the status
    InputError and MemoryError become one line and status 2, Ctrl-C and SIGTERM status 130; library warnings become
    lines on stderr.
    """
    try:
        with interruptible() as interrupted:
            return _run(program, body, argv, interrupted)
    except KeyboardInterrupt:  # in the moments before ``_run`` is ready for it, and after
        complain(program, "interrupted")
        return EXIT_INTERRUPTED


def _run(
    program: str,
    body: Callable[[Sequence[str] | None], int],
    argv: Sequence[str] | None,
    interrupted: Callable[[], bool],
) -> int:
    for stream in (sys.stdout, sys.stderr):
        # names of files need not be text in the terminal's encoding
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: complain(program, str(message), "warning")
        try:
            status = body(argv)
            sys.stdout.flush()
            return status
        except InputError as error:
            complain(program, error.line())
            return EXIT_UNUSABLE
        except MemoryError:
            complain(program, "out of memory; give it less to do, or more with --max-memory")
            return EXIT_UNUSABLE
        except KeyboardInterrupt:
            complain(program, "interrupted")
            return EXIT_INTERRUPTED
        except BrokenPipeError:
            # the reader has seen enough (``| head``); the interpreter must not try to flush again
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            return EXIT_UNUSABLE
        except SystemExit as end:
            return end.code if isinstance(end.code, int) else EXIT_UNUSABLE if end.code else 0
        except Exception:
            if not interrupted():
                raise
            complain(program, "interrupted")
            return EXIT_INTERRUPTED


@contextmanager
def progress(total: float, description: str, quiet: bool = False) -> Iterator[Callable[..., None]]:
    """A progress bar on stderr for what takes longer than a second; none where stderr is no terminal.

    Yields a function that is told how much was done since it was last called (1 by default), and optionally
    a new description.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda amount=1.0, text=None: None
        return
    start, bar, task, finished = time.monotonic(), None, None, 0.0

    def advance(amount: float = 1.0, text: str | None = None) -> None:
        nonlocal bar, task, finished, description
        finished += amount
        description = text or description
        if bar is None and time.monotonic() - start >= PATIENCE and finished < total:
            from rich.console import Console
            from rich.progress import Progress

            bar = Progress(console=Console(stderr=True), transient=True)
            task = bar.add_task(description, total=total)
            bar.start()
        if bar is not None and task is not None:
            bar.update(task, completed=finished, description=description)

    try:
        yield advance
    finally:
        if bar is not None:
            bar.stop()
