"""Paths in flight: a structure of arrays, kept dense."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

OUTSIDE = np.int16(-1)
ROULETTE_BELOW = np.float32(0.25)
"""Throughput below which roulette plays, as a share of what a path began with: later thresholds cost 10-25 % on
thick bodies, earlier ones deep shadow."""


class Paths:
    """Up to ``capacity`` paths, one column each; the first ``count`` are in use. Lengths in the unit-size frame.

    The order of the columns means nothing: where a path is removed, the last one takes its place.

    origin      (3, n) float32
    direction   (3, n) float32 unit, the way the path is followed (against the light)
    throughput  (3, n) float32, a row a colour channel: radiance found next, times this, reaches the camera
    faint       (n,) float32 largest throughput below which roulette plays
    axis        (3, n) float32 unit, in media with guided flights: where they lead
    led         (n,) bool, there: whether the path's flights are guided
    stream      (n,) uint64 state of the path's random numbers
    sample      (n,) int32 column of the radiance that the path adds to
    triangle    (n,) int32 where the path stands, for paths on surfaces
    inside      (k, n) int8 how many times inside each of the k translucent objects: entered minus left
    owner       (n,) int16 which of the k owns the medium here (the first that the path is inside of), -1 outside
    density     (n,) float32 per steradian with which the direction was drawn at the last vertex, where lights were
                sampled there too, so that meeting one now counts in part; inf where they were not
    flown       (n,) float32 distance from there, as far as ``density`` is finite
    flies_on    (n,) bool, in media: whether the direction is that of the next flight, and not that before a collision
    branch      (n,) int8 what the path does at the next boundary, see ``WHOLE``
    surfaces    (n,) int16 surfaces met since the last collision
    steps       (n,) int32 steps in media so far
    alive       (n,) bool
    """

    def __init__(self, capacity: int, translucent_objects: int):
        self.capacity, self.count = capacity, 0
        self._store: dict[str, NDArray[Any]] = {
            "origin": np.empty((3, capacity), np.float32),
            "direction": np.empty((3, capacity), np.float32),
            "throughput": np.empty((3, capacity), np.float32),
            "faint": np.empty(capacity, np.float32),
            "axis": np.empty((3, capacity), np.float32),
            "led": np.empty(capacity, bool),
            "stream": np.empty(capacity, np.uint64),
            "sample": np.empty(capacity, np.int32),
            "triangle": np.empty(capacity, np.int32),
            "inside": np.empty((max(translucent_objects, 1), capacity), np.int8),
            "owner": np.empty(capacity, np.int16),
            "density": np.empty(capacity, np.float32),
            "flown": np.empty(capacity, np.float32),
            "flies_on": np.empty(capacity, bool),
            "branch": np.empty(capacity, np.int8),
            "surfaces": np.empty(capacity, np.int16),
            "steps": np.empty(capacity, np.int32),
            "alive": np.empty(capacity, bool),
        }
        self._rows = [row for array in self._store.values() for row in (array if array.ndim == 2 else (array,))]
        self._view()

    def _view(self) -> None:
        """Point the public arrays at the columns in use."""
        n = self.count
        store = {name: array[..., :n] for name, array in self._store.items()}
        self.origin, self.direction, self.throughput, self.axis = (
            store["origin"],
            store["direction"],
            store["throughput"],
            store["axis"],
        )
        self.faint, self.stream, self.sample = store["faint"], store["stream"], store["sample"]
        self.triangle, self.inside, self.owner = store["triangle"], store["inside"], store["owner"]
        self.density, self.flown, self.branch = store["density"], store["flown"], store["branch"]
        self.led, self.flies_on, self.alive = store["led"], store["flies_on"], store["alive"]
        self.surfaces, self.steps = store["surfaces"], store["steps"]

    @property
    def free(self) -> int:
        """Columns not in use."""
        return self.capacity - self.count

    def clear(self) -> None:
        """Forget all paths."""
        self.count = 0
        self._view()

    def emit(self, origin, direction, stream, sample) -> None:
        """Append paths that start outside all objects with throughput 1."""
        new = self._extend(len(sample))
        store = self._store
        store["origin"][:, new], store["direction"][:, new] = origin, direction
        store["stream"][new], store["sample"][new] = stream, sample
        store["throughput"][:, new] = 1
        store["faint"][new] = ROULETTE_BELOW
        store["inside"][:, new] = 0
        store["owner"][new] = OUTSIDE
        store["density"][new], store["flown"][new] = np.inf, 0
        store["flies_on"][new] = False
        store["branch"][new] = WHOLE
        store["surfaces"][new] = store["steps"][new] = 0
        store["alive"][new] = True

    def append(self, others: Paths, index: NDArray[np.intp]) -> slice:
        """Copies of the columns ``index`` of ``others`` at the end; where they are."""
        new = self._extend(len(index))
        for row, source in zip(self._rows, others._rows, strict=True):
            source.take(index, out=row[new], mode="clip")
        return new

    def move(self, index: NDArray[np.intp], into: Paths) -> slice:
        """Take the columns ``index``, ascending, away and append them to ``into``; where they are there."""
        new = into.append(self, index)
        self.remove(index)
        return new

    def remove(self, index: NDArray[np.intp]) -> None:
        """Take the columns ``index``, ascending, away; the last columns fill the gaps."""
        if not len(index):
            return
        last = self.count - len(index)
        first_beyond = int(np.searchsorted(index, last))
        gaps = index[:first_beyond]
        if len(gaps):
            stays = np.ones(self.count - last, bool)
            stays[index[first_beyond:] - last] = False
            fill = last + np.flatnonzero(stays)
            for row in self._rows:
                row[gaps] = row[fill]
        self.count = last
        self._view()

    def bury(self) -> None:
        """Remove the paths that are not alive."""
        self.remove(np.flatnonzero(~self.alive))

    def _extend(self, count: int) -> slice:
        """Place for ``count`` more columns."""
        if count > self.free:
            raise ValueError(f"{count} new paths do not fit into {self.free} free columns")
        new = slice(self.count, self.count + count)
        self.count += count
        self._view()
        return new


WHOLE, REFLECTS, REFRACTS, CHANCE = np.arange(4, dtype=np.int8)
"""``Paths.branch``. A path from the camera is whole: the first dielectric boundary splits it into one that reflects
and one that refracts. From there on chance decides."""
