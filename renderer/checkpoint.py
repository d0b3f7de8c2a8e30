"""What keeps a render from being lost: files that are written again and again, and films to go on with."""

from __future__ import annotations

import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

from sss_tools.errors import InputError

from .output import image
from .output.film import Film
from .output.image import Picture
from .render import Renderer

REFRESH_EVERY, REFRESH_SHARE = 1.0, 0.05
"""Checkpoint and preview are written at most once in so many seconds, and take at most this share of the time each."""
RETRY_EVERY = 30.0
"""Seconds until what could not be written is tried again: somebody may have made room on a full disk."""


@dataclass
class Refreshed:
    """A file that is written again and again, whole or not at all, from ``due`` on.

    seconds  what writing it took the last time
    failed   whether it could not be written once
    """

    path: Path
    due: float = 0.0
    seconds: float = 0.0
    failed: bool = False

    def refresh(self, renderer: Renderer, started: float) -> None:
        """Write the film so far, if it is time."""
        start = time.monotonic()
        if start < self.due:
            return
        try:
            image.write(self.path, renderer.picture(start - started))
        except InputError as error:
            # the render goes on without
            if not self.failed:
                warnings.warn(f"{error.line()}; it is tried again every {RETRY_EVERY:g} s", stacklevel=2)
            self.failed, self.due = True, time.monotonic() + RETRY_EVERY
            return
        end = time.monotonic()
        self.seconds = end - start
        self.due = end + max(REFRESH_EVERY, self.seconds / REFRESH_SHARE)


def checkpoint_path(output: Path) -> Path:
    """Where the film of an unfinished render to ``output`` is kept."""
    return output.with_name(f"{output.name}.unfinished.npz")


def rescued(error: InputError, picture: Picture, checkpoint: Path) -> InputError:
    """Keep what was rendered for an output that cannot be written, beside it or in the folder for temporary files;
    the error to raise."""
    for place in (checkpoint, Path(tempfile.mkdtemp(prefix="sss-render-"), checkpoint.name)):
        try:
            image.write(place, picture)
        except InputError:
            continue
        remedy = "use --resume" if place == checkpoint else f"move it to {checkpoint} and use --resume"
        return InputError(error.subject, f"{error.problem}; all passes are in {place}", f"make room, then {remedy}")
    return error


def resumed(blank: Film, output: Path, checkpoint: Path) -> Film:
    """The film to go on with."""
    source = next((path for path in (checkpoint, output) if path.suffix == ".npz" and path.is_file()), None)
    if source is None:
        raise InputError(checkpoint, "there is nothing to resume", "leave --resume out")
    film = image.read(source).film
    try:
        blank.merge(film)
    except ValueError as error:
        raise InputError(
            source, f"belongs to another render ({error})", "leave --resume out, or undo the change"
        ) from None
    return film
