"""What small files may unfold to."""

import pytest

from sss_tools.unfolding import FACTOR, MOST_GEOMETRY, MOST_LEVELS, MOST_NODES, check_geometry, check_tree


def test_a_fixed_amount_or_a_factor_of_the_file_whichever_is_more():
    check_geometry(MOST_GEOMETRY, 10)
    check_geometry(FACTOR * MOST_GEOMETRY, MOST_GEOMETRY)
    for unfolded, size in ((MOST_GEOMETRY + 1, 10), (FACTOR * MOST_GEOMETRY + 1, MOST_GEOMETRY)):
        with pytest.raises(ValueError, match=f"its {size} bytes unfold to {unfolded} bytes of geometry"):
            check_geometry(unfolded, size)


def test_a_node_weighs_as_often_as_a_way_leads_to_it():
    graph = {"root": ["a", "b", "b"], "a": ["b"], "b": ["leaf"], "leaf": []}
    assert check_tree(["root"], graph.__getitem__, lambda node: 5 if node == "leaf" else 0) == 15
    assert check_tree(["a", "root"], graph.__getitem__, lambda node: 1) == 11


@pytest.mark.parametrize(
    "graph", [{0: [0]}, {0: [1], 1: [0]}, {0: [2, 1], 1: [3], 2: [3], 3: [1]}], ids=["itself", "two", "below"]
)
def test_circles_are_found(graph):
    with pytest.raises(ValueError, match="contains itself"):
        check_tree([0], graph.__getitem__)


def test_nodes_shared_without_a_circle_are_none():
    assert check_tree([0], {0: [1, 2], 1: [3], 2: [3, 1], 3: []}.__getitem__, lambda node: 1) == 7


def test_levels_and_places_have_a_limit():
    chain = {number: [number + 1] for number in range(MOST_LEVELS - 1)} | {MOST_LEVELS - 1: []}
    check_tree([0], chain.__getitem__)
    with pytest.raises(ValueError, match=f"{MOST_LEVELS + 1} levels"):
        check_tree([-1], (chain | {-1: [0]}).__getitem__)
    check_tree([0], lambda node: range(1, MOST_NODES) if node == 0 else ())
    with pytest.raises(ValueError, match="nodes"):
        check_tree([0], lambda node: range(1, MOST_NODES + 1) if node == 0 else ())
