"""Counts of what happened, above all of what should almost never happen."""

from __future__ import annotations

from dataclasses import dataclass, fields


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
    """

    samples: int = 0
    rays: int = 0
    collisions: int = 0
    leaked: int = 0
    contradicted: int = 0
    terminated: int = 0
    non_finite: int = 0

    def take(self) -> Tally:
        """The counts so far, from where counting starts anew."""
        counted = Tally(**vars(self))
        for entry in fields(self):
            setattr(self, entry.name, 0)
        return counted

    def add(self, other: Tally) -> None:
        """Count ``other`` in."""
        for entry in fields(self):
            setattr(self, entry.name, getattr(self, entry.name) + getattr(other, entry.name))
