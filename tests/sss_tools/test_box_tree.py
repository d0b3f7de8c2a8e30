import numpy as np
import pytest

from sss_tools.box_tree import LEAF, BoxTree, curve_keys, in_threads


def found(lower, upper, group=None):
    tree = BoxTree(lower, upper, group)
    blocks = tree.for_each_block(lambda a, b: np.stack([tree.order[a], tree.order[b]], axis=1))
    pairs = [tuple(sorted(pair)) for block in blocks for pair in block.tolist()]
    assert len(pairs) == len(set(pairs))
    return set(pairs)


def one_by_one(lower, upper, group=None):
    meets = (lower[:, :, None] <= upper[:, None]).all(axis=0)
    meets &= meets.T & np.tri(lower.shape[1], k=-1, dtype=bool).T
    if group is not None:
        meets &= group[:, None] != group
    return set(zip(*(side.tolist() for side in np.nonzero(meets)), strict=True))


@pytest.mark.parametrize("count", [1, 2, LEAF, LEAF + 1, 1000])
def test_the_pairs_are_those_that_comparing_all_with_all_finds(count):
    random = np.random.default_rng(count)
    middle = random.random((3, count)).astype(np.float32)
    # a few a hundred times as large as most
    half = (0.4 / count ** (1 / 3) * random.random((3, count)) ** 4).astype(np.float32)
    half[:, ::97] *= 5
    lower, upper = middle - half, middle + half
    group = random.integers(0, 2, count)
    assert found(lower, upper) == one_by_one(lower, upper)
    assert found(lower, upper, group) == one_by_one(lower, upper, group)
    assert count < 1000 or found(lower, upper)


def test_boxes_that_touch_overlap_and_flat_ones_do_too():
    lower = np.array([[0, 1, 2.5], [0, 0, 0], [0, 0, 0]])
    upper = np.array([[1, 2, 3.0], [1, 1, 1], [0, 0, 0]])
    assert found(lower, upper) == {(0, 1)}


def test_no_boxes_have_no_pairs():
    assert found(np.zeros((3, 0)), np.zeros((3, 0))) == set()


@pytest.mark.parametrize("bits", [1, 2, 3, 4])
def test_the_curve_goes_through_every_cell_and_from_each_to_a_neighbour(bits):
    cells = np.stack(np.meshgrid(*[np.arange(2.0**bits)] * 3)).reshape(3, -1)
    keys = curve_keys(cells, bits)
    assert sorted(keys.tolist()) == list(range(8**bits))
    steps = np.diff(cells[:, np.argsort(keys)], axis=1)
    assert (np.abs(steps).sum(axis=0) == 1).all()


def test_results_come_in_the_order_of_the_items_whatever_the_threads():
    assert in_threads(lambda item: item * item, range(100)) == [item * item for item in range(100)]
