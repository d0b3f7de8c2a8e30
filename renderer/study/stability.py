"""What a sweep through a point of failure found: errors on the way, the bounds that the data mark, and whether ``auto``
keeps its promise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .judges import sidak
from .studies import Study

BOUND = 0.1
"""Relative RMS error up to which a picture is called usable."""
TARGET = 0.02
"""Noise to which the time of the path shader is reckoned."""
QUALITIES = (0.0, 0.25, 0.5, 0.75, 1.0)
SURE = 3.0
"""Standard errors."""
PROMISES_FALSE_ALARM = 1e-3
"""Of all of a study's tests of ``auto`` together."""


@dataclass(frozen=True)
class Choice:
    """What ``auto`` does at a quality, and the relative error it allows itself."""

    quality: float
    shader: str
    allowed: float
    predicted: float | None


@dataclass(frozen=True)
class Outcome:
    """A method at a value.

    squared_bias, stderr            relative, against the study's truth
    here_squared_bias, here_stderr  relative, against the exact picture of this very scene
    difference, difference_stderr   of the means over the object, relative to the truth
    noise     mean relative standard error after ``passes`` passes; None for the fast shaders
    cpu       seconds of all cores for one of the two pictures, and its rendering alone
    rare      what the renderer warns of, or ""
    commands  that make the two pictures, from the folder of the CSV
    """

    method: str
    passes: int
    squared_bias: float
    stderr: float
    here_squared_bias: float
    here_stderr: float
    difference: float
    difference_stderr: float
    noise: float | None
    cpu: float
    rare: str
    commands: str

    @property
    def error(self) -> float:
        """Relative RMS bias against the study's truth; zero where chance took the estimate below."""
        return math.sqrt(max(self.squared_bias, 0.0))

    @property
    def certain(self) -> bool:
        """Whether the error is more than chance."""
        return self.squared_bias > SURE * self.stderr

    @property
    def seconds_to_target(self) -> float:
        """CPU seconds of the path shader to the target noise."""
        return float("nan") if self.noise is None else self.cpu * (self.noise / TARGET) ** 2


@dataclass(frozen=True)
class Step:
    """A value with all that was found there.

    size_px   of the object in the picture
    judged    squares of pixels
    handling  of holes
    truth_commands  make the exact pictures that the study is judged by
    """

    value: float
    size_px: float
    judged: int
    outcomes: tuple[Outcome, ...]
    choices: tuple[Choice, ...]
    handling: str
    truth_commands: str

    def outcome(self, method: str) -> Outcome:
        """Of one method."""
        return next(outcome for outcome in self.outcomes if outcome.method == method)

    def broken(self, choice: Choice, level: float) -> bool:
        """Whether ``auto`` chose a shader whose error here is above what it allows itself, at the level of a one-sided
        z-test. Path is never wrong against itself."""
        from scipy.special import ndtri

        if choice.shader == "path":
            return False
        chosen = self.outcome(choice.shader)
        return chosen.here_squared_bias - choice.allowed**2 > -ndtri(level) * chosen.here_stderr


@dataclass(frozen=True)
class Found:
    """A study's sweep, done; steps in the order of their values."""

    study: Study
    steps: tuple[Step, ...]

    @cached_property
    def level(self) -> float:
        """Of each test of ``auto``."""
        return sidak(PROMISES_FALSE_ALARM, max(len(self.steps) * len(QUALITIES), 1))

    def broken(self) -> list[tuple[Step, Choice]]:
        """Where ``auto`` did not leave a method before it failed."""
        return [(step, choice) for step in self.steps for choice in step.choices if step.broken(choice, self.level)]

    def usable(self, method: str, bound: float = BOUND) -> list[tuple[float, float]]:
        """Ranges of the parameter in which a method's error stays within ``bound``.

        Ends inside the sweep are interpolated between the values on either side, in the logarithm of the error, and of
        the parameter where its axis is logarithmic.
        """
        values = np.array([step.value for step in self.steps])
        errors = np.array([step.outcome(method).error for step in self.steps])
        places = np.log(values) if self.study.log else values
        heights = np.log(np.maximum(errors, 1e-4) / bound)
        ranges: list[tuple[float, float]] = []
        start: float | None = places[0] if heights[0] <= 0 else None
        for k in range(1, len(places)):
            if (heights[k] <= 0) != (heights[k - 1] <= 0):
                share = heights[k - 1] / (heights[k - 1] - heights[k])
                crossing = places[k - 1] + share * (places[k] - places[k - 1])
                if start is None:
                    start = crossing
                else:
                    ranges.append((start, crossing))
                    start = None
        if start is not None:
            ranges.append((start, places[-1]))
        back: Callable = np.exp if self.study.log else (lambda x: x)
        ends = {places[0]: values[0], places[-1]: values[-1]}  # without the roundings of there and back
        return [(float(ends.get(low, back(low))), float(ends.get(high, back(high)))) for low, high in ranges]

    def unsure(self, method: str, bound: float = BOUND) -> bool:
        """Whether noise could take an error to the other side of the bound, at any value."""
        outcomes = [step.outcome(method) for step in self.steps]
        return any(abs(outcome.squared_bias - bound**2) < SURE * outcome.stderr for outcome in outcomes)

    def greatest_jump(self, method: str) -> float:
        """The greatest difference of a method's errors at neighbouring values."""
        errors = [step.outcome(method).error for step in self.steps]
        return float(np.abs(np.diff(errors)).max()) if len(errors) > 1 else 0.0

    def rare(self) -> list[tuple[Step, Outcome]]:
        """Where rare events were not rare enough."""
        return [(step, outcome) for step in self.steps for outcome in step.outcomes if outcome.rare]
