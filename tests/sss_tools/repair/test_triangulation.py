import numpy as np
import pytest

from sss_tools.repair.triangulation import triangulate_loop


def all_triangulations(first, last):
    """Of the stretch of a curve between two of its points, each a list of triangles."""
    if last - first < 2:
        return [[]]
    return [
        [(first, middle, last), *before, *after]
        for middle in range(first + 1, last)
        for before in all_triangulations(first, middle)
        for after in all_triangulations(middle, last)
    ]


def area(points, triangles):
    a, b, c = (points[np.asarray(triangles)[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def uses(triangles, taken):
    return any(taken[a, c] or taken[a, b] or taken[b, c] for a, b, c in triangles)


@pytest.mark.parametrize("seed", range(8))
def test_no_triangulation_of_a_curved_loop_has_less_area(seed):
    """All 132 of a loop of eight points, those without the chords that must not be."""
    random = np.random.default_rng(seed)
    turn = np.arange(8) * np.pi / 4
    points = np.stack([np.cos(turn), np.sin(turn), np.cos(2 * turn)], axis=1) + 0.2 * random.standard_normal((8, 3))
    taken = np.zeros((8, 8), bool)
    # two neighbouring diagonals: there are always others
    taken[0, 2 + seed % 4] = taken[2 + seed % 4, 0] = taken[1, 5] = taken[5, 1] = True
    found, flat = triangulate_loop(points, taken)
    allowed = [each for each in all_triangulations(0, 7) if not uses(each, taken)]
    assert not flat
    assert sorted(map(tuple, found.tolist())) in [sorted(each) for each in allowed]
    assert area(points, found) == pytest.approx(min(area(points, each) for each in allowed), rel=1e-12)
