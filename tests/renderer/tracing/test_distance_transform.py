"""Distances between voxels, against every pair."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.tracing.distance_transform import LARGEST, squared_distances


def with_border(marked):
    for axis in range(3):
        layers = np.moveaxis(marked, axis, 0)
        layers[0] = layers[-1] = True
    return marked


@pytest.mark.parametrize("shape", [(9, 14, 11), (3, 30, 4)])
@pytest.mark.parametrize("share", [0, 0.01, 0.3])
def test_distances_are_exact(shape, share):
    marked = with_border(np.random.default_rng(1).uniform(size=shape) < share)
    every = np.stack(np.unravel_index(np.arange(marked.size), shape), axis=1)
    offset = every[:, None] - every[marked.ravel()][None]
    assert_array_equal(squared_distances(marked).ravel(), (offset**2).sum(axis=2).min(axis=1))


def test_sixteen_bits_hold_the_largest_grid():
    """The middle of a slab whose sides are as far as they may be."""
    marked = with_border(np.zeros((LARGEST, LARGEST, LARGEST // 4), bool)[:, :, :LARGEST])
    assert squared_distances(marked).max() == (LARGEST // 8 - 1) ** 2
    marked = np.zeros((LARGEST, 3, 3), bool)
    marked[0] = marked[-1] = True
    with pytest.raises(ValueError, match="outermost"):
        squared_distances(marked)
    with pytest.raises(ValueError, match="voxels a side"):
        squared_distances(np.ones((LARGEST + 1, 3, 3), bool))
