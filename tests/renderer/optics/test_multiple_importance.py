"""Two ways to find one light: their weights add up to one."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from renderer.optics.multiple_importance import power_heuristic


def test_weights_of_both_ways_add_up_to_one_and_prefer_the_denser():
    mine, other = np.exp(np.random.default_rng(1).normal(0, 8, (2, 1000))).astype(np.float32)
    one, two = power_heuristic(mine, other), power_heuristic(other, mine)
    assert_allclose(one + two, 1, atol=1e-6)
    assert ((one > two) == (mine > other)).all()


def test_ways_that_cannot_find_it_leave_all_to_the_other():
    infinite, none, some = np.float32([np.inf]), np.float32([0]), np.float32([3])
    assert_array_equal(power_heuristic(infinite, some), [1])
    assert_array_equal(power_heuristic(some, infinite), [0])
    assert_array_equal(power_heuristic(some, none), [1])
    assert_array_equal(power_heuristic(none, some), [0])
    assert np.isfinite(power_heuristic(none, none)).all()
    assert_array_equal(power_heuristic(np.float32([1e-25]), np.float32([1e25])), [0])
