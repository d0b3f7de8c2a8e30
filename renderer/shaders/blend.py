"""Objects near a threshold, lit by two shaders or more: each camera sample by one of them.

Which one is a hash of the sample and the object alone. So a path keeps to it wherever it meets the object again, and
the picture does not depend on threads, blocks or how passes were split.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..tracing.streams import GOLDEN, mix
from .fast_body import FastBody

_CHOICE = np.uint64(0xA0761D6478BD642F)  # any number: the choice must not follow the sample's other draws


@dataclass(frozen=True)
class Blend:
    """The shaders of one object, cheapest first.

    index   of the object
    bodies  the object lit by each, None for path
    shares  of the camera samples; they add up to 1
    """

    index: int
    bodies: tuple[FastBody | None, ...]
    shares: tuple[float, ...]

    def choose(self, streams: NDArray[np.uint64]) -> NDArray[np.int8]:
        """(n,) which of ``bodies`` lights the camera samples with the streams ``streams`` (n,)."""
        words = streams ^ _CHOICE
        words += np.uint64((self.index + 1) * int(GOLDEN) % 2**64)
        mix(words, words, np.empty_like(words))
        uniform = (words >> np.uint64(11)) * 2.0**-53
        return np.searchsorted(np.cumsum(self.shares)[:-1], uniform, side="right").astype(np.int8)


class Choices:
    """What each of ``count`` camera samples chooses, for every object lit by several shaders.

    Samples beyond the last are the branches of those that came before.
    """

    def __init__(self, blends: Mapping[int, Blend], count: int):
        self._count, self._blends = count, blends
        self._chosen = {index: np.zeros(count, np.int8) for index in blends}
        self._fast = {index: np.zeros(count, bool) for index in blends}

    def choose(self, samples: NDArray[np.int64], streams: NDArray[np.uint64]) -> None:
        """Choose for the camera samples ``samples`` (n,), with the streams (n,)."""
        for index, blend in self._blends.items():
            chosen = blend.choose(streams)
            self._chosen[index][samples] = chosen
            self._fast[index][samples] = np.array([body is not None for body in blend.bodies])[chosen]

    def of(self, index: int, sample: NDArray[np.signedinteger]) -> NDArray[np.int8]:
        """(n,) which shader lights the object ``index`` for ``sample`` (n,)."""
        return self._chosen[index][sample % self._count]

    def stay_outside(self, thing: NDArray[np.int16], sample: NDArray[np.int32]) -> NDArray[np.bool_]:
        """(n,) whether the object that a sample meets (n,) is one that a fast shader lights for it."""
        result = np.zeros(len(thing), bool)
        for index, fast in self._fast.items():
            here = np.flatnonzero(thing == index)
            result[here] = fast[sample[here] % self._count]
        return result
