"""Random numbers: a counter hash of (seed, pass, pixel, dimension), so that nothing depends on the schedule.

Every camera sample owns a stream. Its n-th draw is a hash of the stream's key and n alone, so the picture is the
same however samples are spread over blocks, threads and machines, and however finished slots are refilled.

The hash is SplitMix64 (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators", OOPSLA,
figure 12, with Stafford's mix 13): ``mix(key + n * GOLDEN)``. One draw gives two uniforms of 24 bits each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
"""Odd, nearest to 2**64 over the golden ratio: the counter's step."""

_BRANCH = np.uint64(0xD1B54A32D192ED03)  # any number: a branch must not follow its parent's stream
_MULTIPLIERS = (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))
_SHIFTS = (np.uint64(30), np.uint64(27), np.uint64(31))
_TO_UNIT = np.float32(2.0**-24)


def mix(words: NDArray[np.uint64], out: NDArray[np.uint64], scratch: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """SplitMix64's finaliser of (n,) words into ``out``; a bijection in which each input bit flips half the output."""
    np.right_shift(words, _SHIFTS[0], out=scratch)
    np.bitwise_xor(words, scratch, out=out)
    for multiplier, shift in zip(_MULTIPLIERS, _SHIFTS[1:], strict=True):
        np.multiply(out, multiplier, out=out)
        np.right_shift(out, shift, out=scratch)
        np.bitwise_xor(out, scratch, out=out)
    return out


def stream_keys(seed: int, pass_index: int | NDArray[np.int64], pixels: NDArray[np.int64]) -> NDArray[np.uint64]:
    """(n,) keys of the streams of camera sample ``pass_index``, one or (n,), of each pixel.

    The three numbers are hashed one into the other, so neighbours in any of them share nothing.
    """
    key = np.zeros(len(pixels), np.uint64)
    scratch = np.empty_like(key)
    for word in (np.uint64(seed & (2**64 - 1)), np.asarray(pass_index).astype(np.uint64), pixels.astype(np.uint64)):
        key += word
        key *= GOLDEN  # odd: a bijection, and (a, b + 1) does not meet (a + 1, b)
        mix(key, key, scratch)
        key += GOLDEN
    return key


def branch_streams(streams: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """(n,) keys of the streams of paths that branch off from those with the states ``streams`` (n,)."""
    branched = streams ^ _BRANCH
    return mix(branched, branched, np.empty_like(branched))


class Uniforms:
    """Draws from up to ``capacity`` streams at once, into buffers of its own.

    Call ``draw(state)``: it advances the (n,) uint64 states in place and returns two (n,) float32 views with
    values in [0, 1), valid until the fourth call after (four sets of buffers take turns).
    """

    def __init__(self, capacity: int):
        self._words = np.empty(capacity, np.uint64)
        self._scratch = np.empty(capacity, np.uint64)
        self._bits = np.empty((3, capacity), np.uint32)
        self._buffers = np.empty((4, 3, capacity), np.float32)
        self._turn = 0

    def _hash(self, state: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], NDArray[np.float32]]:
        """Advance the states; their hashes, and the buffers whose turn it is."""
        words = self._words[: len(state)]
        np.add(state, GOLDEN, out=state)
        mix(state, words, self._scratch[: len(state)])
        self._turn = (self._turn + 1) % len(self._buffers)
        return words, self._buffers[self._turn]

    def draw(self, state: NDArray[np.uint64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The next two uniforms of each stream; see the class."""
        n = len(state)
        words, result = self._hash(state)
        halves = words.view(np.uint32).reshape(n, 2)
        for k in range(2):
            bits = self._bits[k, :n]
            np.right_shift(halves[:, k], np.uint32(8), out=bits)
            np.multiply(bits.view(np.int32), _TO_UNIT, out=result[k, :n], casting="unsafe")
        return result[0, :n], result[1, :n]

    def draw_three(
        self, state: NDArray[np.uint64]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """As ``draw``, but three uniforms out of one hash: the first of 22 bits, the others of 21."""
        n = len(state)
        words, result = self._hash(state)
        low, high = words.view(np.uint32).reshape(n, 2).T
        first, second, rest = self._bits[0, :n], self._bits[1, :n], self._bits[2, :n]
        np.right_shift(high, np.uint32(10), out=first)
        np.right_shift(low, np.uint32(11), out=second)
        np.bitwise_and(high, np.uint32(0x3FF), out=rest)
        np.left_shift(rest, np.uint32(11), out=rest)
        np.bitwise_or(rest, np.bitwise_and(low, np.uint32(0x7FF)), out=rest)
        for k, bits in enumerate((22, 21, 21)):
            np.multiply(self._bits[k, :n].view(np.int32), np.float32(2.0**-bits), out=result[k, :n], casting="unsafe")
        return result[0, :n], result[1, :n], result[2, :n]

    def draw_at(
        self, state: NDArray[np.uint64], index: NDArray[np.intp]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The next two uniforms of the streams ``index`` alone, as fresh (m,) arrays."""
        chosen = state[index]
        first, second = self.draw(chosen)
        state[index] = chosen
        return first.copy(), second.copy()
