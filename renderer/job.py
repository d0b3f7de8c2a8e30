"""A render from the first pass to the written file: when it is done, and what is told meanwhile."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError

from . import adaptive, checkpoint, enough
from .checkpoint import Refreshed, checkpoint_path
from .cluster.queue import ClusterLost
from .output import image, passes
from .output.film import Film
from .output.image import Picture
from .render import Renderer

DEFAULT_PASSES = 64
LEAST_PASSES_FOR_ERROR = 4
"""A target error is not met by fewer: of two samples the square root of the variance is 20 % too small in the mean, of
four 8 %."""


@dataclass(frozen=True)
class Budget:
    """When a render is done. ``first`` is the number of its first pass.

    last          one past the last pass; None where seconds or target_error decide
    seconds       wall seconds since ``started`` until the file is written
    target_error  mean relative standard error over object pixels
    adaptive      noisy pixels take part in more passes than others, see ``adaptive``
    started       when the command began, by ``time.monotonic``: clocks may be set while a render runs
    by_noise      ``last`` is a guess: the first passes tell how many are enough, see ``enough``
    expected      one past the last pass, as far as is known
    """

    first: int = 0
    last: int | None = DEFAULT_PASSES
    seconds: float | None = None
    target_error: float | None = None
    adaptive: bool = False
    started: float = 0.0
    by_noise: bool = False
    expected: int | None = None

    def left(self, done: passes.Ranges) -> range | list[int]:
        """The passes still to do."""
        if self.last is None:
            return range(max((stop for _, stop in done), default=self.first), sys.maxsize)
        return [index for start, stop in passes.missing(done, self.first, self.last) for index in range(start, stop)]


def execute(
    renderer: Renderer,
    output: Path,
    budget: Budget,
    resume: bool = False,
    aovs: dict[str, NDArray] | None = None,
    progress: Callable[[float, float, str], None] | None = None,
    preview: Path | None = None,
) -> Picture:
    """Render until the budget is used up and write the picture.

    preview   a picture that is kept up to date while rendering, of any kind
    progress  is told what is done, of how much, and in which words

    A checkpoint beside the output keeps what is done of a render that dies; ``resume`` goes on from it, or from the
    output itself where that is an npz. On KeyboardInterrupt and ClusterLost the whole passes so far are written, and
    the exception goes on. Raises InputError where the output cannot be written or there is nothing that fits to resume.
    """
    image.check_writable(output)
    unfinished = checkpoint_path(output)
    kept = [Refreshed(unfinished, time.monotonic() + checkpoint.REFRESH_EVERY)]
    if preview is not None:
        image.check_writable(preview)
        if preview.resolve() in (output.resolve(), unfinished.resolve()):
            raise InputError(preview, "is a file of the render itself", "give --preview another name")
        kept.insert(0, Refreshed(preview))  # what somebody waits for comes first
    if resume:
        renderer.film = checkpoint.resumed(renderer.film, output, unfinished)
    error = float("nan")

    def finished() -> bool:
        if budget.seconds is not None:
            return seconds_left() <= 0
        return budget.target_error is not None and _enough(renderer.film, error, budget.target_error)

    def seconds_left() -> float:
        assert budget.seconds is not None
        writing = max(0.1, *(file.seconds for file in kept)) * len(kept)
        return budget.started + budget.seconds - time.monotonic() - writing

    def after_pass(index: int) -> bool:
        nonlocal error
        now = time.monotonic()
        if budget.target_error is not None:
            error = renderer.film.mean_relative_stderr()
        for file in kept:
            file.refresh(renderer, budget.started)
        if progress is not None:
            progress(*_progress(renderer, budget, now, error))
        return finished()

    def write() -> Picture:
        with renderer.stages.stage("write"):
            picture = renderer.picture(time.monotonic() - budget.started, aovs)
            try:
                image.write(output, picture)
            except InputError as error:
                raise checkpoint.rescued(error, picture, unfinished) from None
        if preview is not None:
            Refreshed(preview).refresh(renderer, budget.started)
        return picture

    try:
        if resume:
            error = renderer.film.mean_relative_stderr()
        if not (resume and renderer.film.passes and finished()):
            for budget in _rounds(renderer, budget):  # noqa: B020  progress goes by the last
                _run(renderer, budget, after_pass, seconds_left if budget.seconds else None)
    except (KeyboardInterrupt, ClusterLost):
        if renderer.film.passes:
            write()
            if output.suffix != ".npz":
                image.write(unfinished, renderer.picture(time.monotonic() - budget.started))
            else:
                unfinished.unlink(missing_ok=True)
        raise
    picture = write()
    unfinished.unlink(missing_ok=True)
    return picture


def _rounds(renderer: Renderer, budget: Budget) -> Iterator[Budget]:
    """The budget; where noise decides, with as many passes as what was seen so far asks for, round after round."""
    if not budget.by_noise:
        yield budget
        return
    assert budget.last is not None
    for last, needed in enough.rounds(renderer, budget.last - budget.first):
        yield replace(budget, last=budget.first + last, expected=budget.first + needed)


def _run(
    renderer: Renderer,
    budget: Budget,
    after_pass: Callable[[int], bool],
    seconds_left: Callable[[], float] | None,
) -> None:
    """Add the passes that the budget asks for."""
    left = budget.left(renderer.film.ranges)
    if not budget.adaptive:
        renderer.film.resting[:] = False
        renderer.run(left, after_pass, seconds_left)
        return
    for part, decide in adaptive.rounds(left):
        if decide:
            renderer.film.resting = adaptive.resting(renderer.film, budget.target_error)
        if not renderer.run(part, after_pass, seconds_left, ~renderer.film.resting):
            return


def _enough(film: Film, error: float, target: float) -> bool:
    """Whether the film has so small an error; where none can be measured, whether it has the default passes."""
    if not np.isfinite(error):
        return film.passes >= DEFAULT_PASSES
    return error <= target and film.passes >= LEAST_PASSES_FOR_ERROR


def _progress(renderer: Renderer, budget: Budget, now: float, error: float) -> tuple[float, float, str]:
    film = renderer.film
    text = f"pass {film.passes}"
    if budget.seconds is not None:
        return now - budget.started, budget.seconds, text
    if budget.target_error is not None:
        done = (budget.target_error / error) ** 2 if np.isfinite(error) and error > 0 else 0.0
        return min(done, 1.0), 1.0, text
    assert budget.last is not None
    return film.passes, (budget.expected or budget.last) - budget.first, text


def merged(parts: list[Path]) -> Picture:
    """The picture of all parts of one render. Raises InputError for parts that do not belong together."""
    for path in parts:
        if parts.count(path) > 1:
            raise InputError(path, "is named twice", "name each part once")
    return image.merge({path: image.read(path) for path in parts})
