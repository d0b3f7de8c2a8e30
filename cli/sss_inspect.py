"""sss-inspect: look at a mesh or a scene. Not part of this version yet."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from .command import ArgumentParser, complain, run

PROGRAM = "sss-inspect"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; it says that it is not there yet, and returns 2."""
    return run(PROGRAM, _refuse, argv)


def _refuse(argv: Sequence[str] | None) -> int:
    parser = ArgumentParser(PROGRAM, description="Look at a mesh or a scene (not part of this version yet).")
    parser.parse_known_args(argv)
    complain(PROGRAM, "the viewer is not part of this version yet")
    return 2


if __name__ == "__main__":
    sys.exit(main())
