"""Paths in flight: a structure of arrays, kept dense."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

OUTSIDE = np.int16(-1)


class Paths:
    """Up to ``capacity`` paths, one column each; the first ``count`` are in use. Lengths in the unit-size frame.

    origin      (3, n) float32
    direction   (3, n) float32 unit, the way the path is followed (against the light)
    throughput  (3, n) float32, a row a colour channel: radiance found next, times this, reaches the camera
    stream      (n,) uint64 state of the path's random numbers
    sample      (n,) int32 camera sample to which radiance is added
    inside      (k, n) int8 how many times inside each of the k translucent objects: entered minus left
    owner       (n,) int16 which of the k owns the medium here (the first that the path is inside of), -1 outside
    scattered   (n,) bool, whether the path has collided since a boundary last bent it inwards
    lit         (n,) bool, whether area lights were already sampled from the last vertex, so that meeting one
                now must not count again
    surfaces    (n,) int16 surfaces met since the last collision
    alive       (n,) bool
    """

    def __init__(self, capacity: int, translucent_objects: int):
        self.capacity, self.count = capacity, 0
        self._store: dict[str, NDArray[Any]] = {
            "origin": np.empty((3, capacity), np.float32),
            "direction": np.empty((3, capacity), np.float32),
            "throughput": np.empty((3, capacity), np.float32),
            "stream": np.empty(capacity, np.uint64),
            "sample": np.empty(capacity, np.int32),
            "inside": np.empty((max(translucent_objects, 1), capacity), np.int8),
            "owner": np.empty(capacity, np.int16),
            "scattered": np.empty(capacity, bool),
            "lit": np.empty(capacity, bool),
            "surfaces": np.empty(capacity, np.int16),
            "alive": np.empty(capacity, bool),
        }
        self._view()

    def _view(self) -> None:
        """Point the public arrays at the columns in use."""
        n = self.count
        store = {name: array[..., :n] for name, array in self._store.items()}
        self.origin, self.direction, self.throughput = (
            store["origin"],
            store["direction"],
            store["throughput"],
        )
        self.stream, self.sample, self.inside = store["stream"], store["sample"], store["inside"]
        self.owner, self.scattered = store["owner"], store["scattered"]
        self.lit, self.surfaces, self.alive = store["lit"], store["surfaces"], store["alive"]

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
        first, self.count = self.count, self.count + len(sample)
        if self.count > self.capacity:
            raise ValueError(f"{len(sample)} new paths do not fit into {self.capacity - first} free columns")
        new = slice(first, self.count)
        store = self._store
        store["origin"][:, new], store["direction"][:, new] = origin, direction
        store["stream"][new], store["sample"][new] = stream, sample
        store["throughput"][:, new] = 1
        store["inside"][:, new] = 0
        store["owner"][new] = OUTSIDE
        store["scattered"][new] = store["lit"][new] = False
        store["surfaces"][new] = 0
        store["alive"][new] = True
        self._view()

    def compact(self) -> None:
        """Keep the living, in their order."""
        keep = np.flatnonzero(self.alive)
        if len(keep) < self.count:
            for array in self._store.values():
                for row in array if array.ndim == 2 else (array,):
                    row[: len(keep)] = row[: self.count][keep]
            self.count = len(keep)
            self._view()
