"""The distance grid: its bound holds for all surfaces, and the tests see the bugs a plausible proof would have."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial import cKDTree

from renderer.tracing import distance_grid
from renderer.tracing.distance_grid import (
    EPSILON,
    DistanceGrid,
    Scratch,
    Walks,
    choose_resolution,
    closes,
)
from renderer.tracing.surface_samples import COVERING, cover
from sss_tools.mesh import Mesh
from sss_tools.shapes import hollow_ball, icosphere, inverted, joined, moved, punctured, torus
from sss_tools.winding import winding_numbers


def one_triangle() -> Mesh:
    """Oblique to the voxels, with a corner in the middle of the box's diagonal."""
    return Mesh(np.array([[-0.5, -0.5, -0.5], [0.5, 0.31, 0.02], [-0.07, 0.5, 0.5]]), [[0, 1, 2]])


def needles() -> Mesh:
    """A fan of triangles 1 long and 1e-4 wide, and one without area."""
    turn = np.linspace(0, 1, 8)
    far = np.stack([np.cos(turn), np.sin(turn), turn], axis=1)
    points = np.concatenate([np.zeros((1, 3)), far, far + np.array([0, 1e-4, 0])])
    faces = [[0, k, k + 8] for k in range(1, 9)] + [[0, 1, 1]]
    return in_unit_frame(Mesh(points, faces))


def in_unit_frame(mesh: Mesh) -> Mesh:
    lower, upper = mesh.bounds
    return Mesh((mesh.vertices - (lower + upper) / 2) / (upper - lower).max(), mesh.faces)


MESHES = {
    "one triangle": one_triangle(),
    "needles": needles(),
    "open": in_unit_frame(punctured(icosphere(1, 3), [[0, 0, 1]], 0.4)),
    "nested shells": in_unit_frame(joined(hollow_ball(1, 0.5, 2), icosphere(0.2, 2))),
    "torus": in_unit_frame(torus()),
}


def distance_to_triangles(points, mesh: Mesh):
    """(n,) exact distances of points (n, 3) to a mesh, by libigl in double precision."""
    import igl

    squared = igl.point_mesh_squared_distance(points, np.array(mesh.vertices), np.array(mesh.faces))[0]
    return np.sqrt(squared)


def samples_of(grid: DistanceGrid, mesh: Mesh, spacing: float = 0.5) -> cKDTree:
    """Those the grid was built from, or denser ones; ``spacing`` in voxels."""
    return cKDTree(cover(mesh.vertices, mesh.faces, spacing * grid.voxel, grid.origin, -grid.origin))


def hard_points(grid: DistanceGrid, samples: cKDTree):
    """(n, 3) points where the bound has least slack, and the flat indices of their voxels.

    In each voxel, the point nearest to the sample nearest to its middle: mostly a corner that faces the sample.
    """
    index = np.flatnonzero(grid.bounds > 0)
    centres = grid.centres(index)
    nearest = samples.data[samples.query(centres)[1]]
    half = grid.voxel / 2
    return centres + np.clip(nearest - centres, -half, half), index


def excess(grid: DistanceGrid, mesh: Mesh) -> float:
    """By how much the bound exceeds the exact distance at worst, in voxels; negative where it holds."""
    points, index = hard_points(grid, samples_of(grid, mesh, 1 / 4))
    return float((grid.bounds[index] - distance_to_triangles(points, mesh)).max() / grid.voxel)


def excess_over_samples(grid: DistanceGrid, mesh: Mesh) -> float:
    """By how much bound and covering radius exceed the distance to the nearest sample at worst, in voxels."""
    samples = samples_of(grid, mesh)
    points, index = hard_points(grid, samples)
    covering = 0.5 / np.sqrt(3) * grid.voxel
    return float((grid.bounds[index] + covering - samples.query(points)[0]).max() / grid.voxel)


def built(mesh: Mesh, resolution: int = 24) -> DistanceGrid:
    return DistanceGrid(mesh.vertices, mesh.faces, resolution)


@pytest.mark.parametrize("name", MESHES)
def test_bound_stays_below_the_exact_distance(name):
    """At points that face the nearest bit of surface. Double precision on both sides but for the bounds' own 1e-7."""
    grid = built(MESHES[name])
    assert (grid.bounds > 0).any()
    assert excess(grid, MESHES[name]) <= 1e-5


@pytest.mark.parametrize("name", MESHES)
def test_bound_and_covering_radius_stay_below_the_nearest_sample(name):
    """What the proof says of samples: |p - s| >= D + delta for those the grid was built from."""
    assert excess_over_samples(built(MESHES[name]), MESHES[name]) <= 1e-5


@pytest.mark.parametrize("name", ["one triangle", "torus"])
def test_a_grid_without_a_half_diagonal_is_caught(name, monkeypatch):
    """The slack of the voxel the point is in, or of the one the sample is in, forgotten: each alone is seen."""
    monkeypatch.setattr(distance_grid, "_HALF_DIAGONAL", np.sqrt(3) / 4)
    assert excess(built(MESHES[name]), MESHES[name]) > 0.1


def test_a_tight_band_without_the_half_diagonal_is_caught(monkeypatch):
    def tighten(grid, samples, squared):
        original(grid, samples, squared)
        band = (squared.reshape(-1) > 0) & (squared.reshape(-1) <= distance_grid.BAND) & (grid.bounds > 0)
        grid.bounds[band] += np.float32(distance_grid._HALF_DIAGONAL * grid.voxel / 2)

    original = DistanceGrid._tighten
    monkeypatch.setattr(DistanceGrid, "_tighten", tighten)
    assert excess(built(MESHES["one triangle"]), MESHES["one triangle"]) > 0.1


@pytest.mark.parametrize("name", ["one triangle", "torus"])
def test_a_grid_that_forgets_the_covering_radius_is_caught(name, monkeypatch):
    """Against the surface itself the gap between samples goes unseen, as points seldom face its very middle."""
    monkeypatch.setattr(distance_grid, "COVERING", 0.0)
    assert excess_over_samples(built(MESHES[name]), MESHES[name]) > 0.1


def test_bound_is_three_quarters_of_the_distance_at_128_voxels():
    """Ratio of the means over a ball's inside; .75 by the slack of two voxels, some more in the tight band."""
    ball = in_unit_frame(icosphere(1, 4))
    grid = built(ball, 128)
    points = np.random.default_rng(2).uniform(-0.5, 0.5, (20_000, 3)).astype(np.float32)
    points = points[np.linalg.norm(points, axis=1) < 0.49]
    bound = grid.distance(np.ascontiguousarray(points.T), np.empty(len(points), np.float32), Scratch(len(points)))
    assert 0.75 < bound.mean() / (0.5 - np.linalg.norm(points, axis=1)).mean() < 1


def test_look_up_gives_the_voxel_and_zero_beyond_the_grid():
    grid = built(MESHES["torus"])
    index = np.random.default_rng(3).integers(0, grid.bounds.size, 500)
    middles = np.ascontiguousarray(grid.centres(index).T, np.float32)
    out = np.empty(500, np.float32)
    assert_array_equal(grid.distance(middles, out, Scratch(600)), grid.bounds[index])
    far = np.float32([[9, 0, 0, -9, 1e30, -1e30], [0, -9, 0, 0, 0, 0], [0, 0, 9, 0, 0, 0]])
    assert_array_equal(grid.distance(far, np.empty(6, np.float32), Scratch(6)), 0)


def outside_at(grid: DistanceGrid, points):
    """(n,) whether the voxels of points (n, 3) within the grid surely lie outside."""
    cells = np.floor((points - grid.origin) / grid.voxel).astype(int)
    return grid.outside.reshape(grid.shape)[tuple(cells.T)]


def test_what_is_surely_outside_is_and_has_no_bound():
    """Two rings, one inverted as a whole, and a ball with a cavity: no point inside is called outside."""
    rings = joined(torus(), inverted(moved(torus(), (0, 0, 1))))
    mesh = in_unit_frame(joined(rings, moved(hollow_ball(0.6, 0.3, 3), (0, 0, 2))))
    split = [slice(0, 2 * 64 * 24), slice(2 * 64 * 24, 4 * 64 * 24), slice(4 * 64 * 24, len(mesh.faces))]
    grid = DistanceGrid(mesh.vertices, mesh.faces, 48, split)
    points = np.random.default_rng(4).uniform(*mesh.bounds, (300, 3)).astype(np.float32)
    inside = np.any([np.abs(winding_numbers(points, mesh.vertices, mesh.faces[part])) > 0.5 for part in split], axis=0)
    outside = outside_at(grid, points)
    assert not (inside & outside).any()
    # and says so of most that are
    assert outside[~inside].mean() > 0.5
    cavity = mesh.vertices[mesh.faces[split[2]]].mean(axis=(0, 1))[None]
    assert outside_at(grid, cavity)
    assert grid.distance(np.ascontiguousarray(cavity.T, np.float32), np.empty(1, np.float32), Scratch(1)) == 0


def test_nothing_is_surely_outside_an_open_mesh():
    assert not built(MESHES["open"]).outside.any()


def test_only_surfaces_without_boundary_close():
    assert closes(torus().faces)
    assert not closes(MESHES["open"].faces)
    turned = icosphere(1, 1).faces.copy()
    turned[3] = turned[3, ::-1]
    assert not closes(turned)


def test_other_surfaces_are_bounded_too_and_far_ones_cost_nothing():
    """A floor a thousand boxes wide passes through the box; its samples stop there, and the bound sees it."""
    ball = in_unit_frame(icosphere(1, 3))
    floor = Mesh(np.array([[-999.0, -0.1, -999], [999, -0.1, -999], [0, -0.1, 999]]), [[0, 1, 2]])
    mesh = joined(ball, floor)
    grid = DistanceGrid(mesh.vertices, mesh.faces, 24, [slice(0, len(ball.faces))])
    assert max(grid.shape) == 26
    assert excess(grid, mesh) <= 1e-5
    near_floor = np.float32([[0], [-0.1], [0]])
    assert grid.distance(near_floor, np.empty(1, np.float32), Scratch(1)) == 0


def test_samples_cover_the_surface_within_the_covering_radius():
    draw = np.random.default_rng(5)
    for mesh, spacing in ((MESHES["needles"], 0.01), (MESHES["torus"], 0.02), (one_triangle(), 0.03)):
        samples = cover(mesh.vertices, mesh.faces, spacing, [-1, -1, -1], [1, 1, 1])
        face = draw.integers(0, len(mesh.faces), 500)
        points = np.einsum("ij,ijk->ik", draw.dirichlet(np.ones(3), 500), mesh.vertices[mesh.faces[face]])
        assert cKDTree(samples).query(points)[0].max() <= COVERING * spacing + EPSILON


def test_needles_cost_by_their_length():
    """Eight triangles 1 long: 1/spacing points each, some more for overlaps, not 1/2 (1/spacing)^2."""
    assert len(cover(needles().vertices, needles().faces, 0.002, [-1] * 3, [1] * 3)) < 8 * 500 * 12


def test_resolution_grows_with_the_work_and_no_grid_is_built_for_a_few_bounces():
    ball = {"area": np.pi, "volume": np.pi / 6}
    dense = Walks(1e6, mean_free_path=0.005, albedo=0.999, ior=1.5, **ball)
    assert choose_resolution([dense], np.ones(3)) >= 128
    assert choose_resolution([Walks(100, mean_free_path=0.005, albedo=0.999, **ball)], np.ones(3)) is None
    assert choose_resolution([Walks(1e7, mean_free_path=0.02, albedo=0.6, **ball)], np.ones(3)) is None
    assert choose_resolution([Walks(1e7, mean_free_path=0.5, albedo=0.999, **ball)], np.ones(3)) is None
    few, many = (Walks(n, mean_free_path=0.005, albedo=0.999, **ball) for n in (5e4, 1e7))
    assert choose_resolution([few], np.ones(3)) < choose_resolution([many], np.ones(3))
