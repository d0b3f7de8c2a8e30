"""Axes around a surface normal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.phase import around

Float32 = NDArray[np.float32]


class LocalFrame:
    """Orthonormal axes around unit normals (3, n), as the rows of ``phase.around``'s transform."""

    def __init__(self, normal: Float32):
        unit = np.zeros_like(normal)
        unit[0] = 1
        self.first = around(normal, unit)
        unit[0], unit[1] = 0, 1
        self.second = around(normal, unit)
        self.normal = normal

    def take(self, columns: NDArray[np.intp]) -> LocalFrame:
        """The axes at the given columns."""
        some = object.__new__(LocalFrame)
        some.first, some.second, some.normal = (a[:, columns] for a in (self.first, self.second, self.normal))
        return some

    def to_local(self, world: Float32) -> Float32:
        """(3, n) components along the axes."""
        return np.stack([np.einsum("ij,ij->j", axis, world) for axis in (self.first, self.second, self.normal)])

    def to_world(self, local: Float32) -> Float32:
        """(3, n) vectors of the given components."""
        return local[0] * self.first + local[1] * self.second + local[2] * self.normal
