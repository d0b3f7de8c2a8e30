"""Counts of what happened, above all of what should almost never happen."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass
class Tally:
    """Sums over camera samples; tallies of different work units add up.

    samples       camera samples
    rays          rays cast, shadow rays included
    collisions    scatterings inside media
    leaked        paths that contradicted a closed surface: a ray slipped between two triangles
    contradicted  those of them that were found by a crossing that does not fit the count of surfaces
    terminated    paths that left (or saw inside) through a hole of an object handled by ``terminate``
    non_finite    camera samples without a finite value, left out of the picture
    leaks         by object, (4,) how many of the leaked paths it lost, and the sum of their places in the frame
    """

    samples: int = 0
    rays: int = 0
    collisions: int = 0
    leaked: int = 0
    contradicted: int = 0
    terminated: int = 0
    non_finite: int = 0
    leaks: dict[int, NDArray[np.float64]] = field(default_factory=dict)

    def leak(self, thing: int, position: NDArray[np.float32]) -> None:
        """Count the paths that the object ``thing`` lost at ``position`` (3, n)."""
        self.leaked += position.shape[1]
        self._leak(thing, np.array([position.shape[1], *position.sum(axis=1, dtype=float)]))

    def _leak(self, thing: int, counted: NDArray[np.float64]) -> None:
        self.leaks[thing] = self.leaks.get(thing, 0.0) + counted

    def take(self) -> Tally:
        """The counts so far, from where counting starts anew."""
        counted = Tally(**vars(self))
        vars(self).update(vars(Tally()))
        return counted

    def add(self, other: Tally) -> None:
        """Count ``other`` in."""
        for name, count in vars(other).items():
            if name != "leaks":
                setattr(self, name, getattr(self, name) + count)
        for thing, counted in other.leaks.items():
            self._leak(thing, counted)
