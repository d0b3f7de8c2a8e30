import numpy as np
import pytest

from sss_tools.curvature import mean_curvature
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, ellipsoid, icosphere, inverted, moved, torus


def ellipsoid_curvature(points, radii):
    """Closed form of the mean curvature of an ellipsoid with half axes ``radii``."""
    radii = np.asarray(radii)
    squared = np.sum(radii**2) - np.sum(points**2, axis=1)
    return squared / (2 * np.prod(radii) ** 2 * np.sum(points**2 / radii**4, axis=1) ** 1.5)


def relative_error(mesh, expected, rings=4.0):
    return np.sqrt(np.mean((mean_curvature(mesh, rings) / expected - 1) ** 2))


def noisy_ball(share, seed=3):
    """A ball of radius 1, each vertex moved along its radius by ``share`` of an edge (standard deviation)."""
    ball = icosphere(1.0, 5)
    edges = ball.topology.edges
    edge = np.linalg.norm(ball.topology.points[edges[:, 0]] - ball.topology.points[edges[:, 1]], axis=1).mean()
    noise = np.random.Generator(np.random.PCG64(seed)).standard_normal(len(ball.vertices))
    return Mesh(ball.vertices * (1 + share * edge * noise)[:, None], ball.faces)


def test_a_ball_has_one_over_its_radius():
    # the polyhedron lies inside the ball: 1e-3 at this tessellation; at the twelve vertices with five edges 2 %
    curvature = mean_curvature(icosphere(2.5, 4))
    assert curvature.mean() == pytest.approx(0.4, rel=3e-3)
    np.testing.assert_allclose(curvature, 0.4, rtol=0.03)


def test_ellipsoids_follow_the_closed_form():
    """The average over four edges blurs the pointed ends, where the radius of curvature is seven edges."""
    radii = (2.0, 1.0, 1.0)
    mesh = ellipsoid(radii, 4)
    assert relative_error(mesh, ellipsoid_curvature(mesh.vertices, radii)) < 0.04


def test_a_torus_follows_the_closed_form_inside_and_out():
    mesh = torus(1.0, 0.4, 96, 48)
    from_axis = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
    expected = (1 / 0.4 + (from_axis - 1) / 0.4 / from_axis) / 2
    # blur: the tube is 48 edges round, its radius eight of them
    assert relative_error(mesh, expected) < 0.06


def test_noise_cancels():
    """2 % of an edge, which without averaging makes the curvature worthless."""
    mesh = noisy_ball(0.02)
    assert relative_error(mesh, 1.0, rings=0) > 0.8
    assert relative_error(mesh, 1.0) < 0.1


def test_noise_disturbs_no_more_than_quadrics_of_libigl():
    """Quadrics over five rings, on a ball with noise; benchmarks/curvature.py has more, and a torus."""
    igl = pytest.importorskip("igl")
    for share in (0.0, 0.02):
        mesh = noisy_ball(share)
        first, second = igl.principal_curvature(mesh.vertices, np.ascontiguousarray(mesh.faces, np.int64))[2:4]
        quadrics = np.abs(np.ravel(first) + np.ravel(second)) / 2
        assert relative_error(mesh, 1.0) <= np.sqrt(np.mean((quadrics - 1) ** 2))


def test_the_integral_over_a_surface_survives_averaging():
    """int H dA of a box is pi/4 sum of edge lengths (each right angle gives half of pi/2)."""
    mesh = box((1.0, 2.0, 3.0))
    weight = np.zeros(len(mesh.topology.points))
    for corner in mesh.topology.faces.T:
        np.add.at(weight, corner, mesh.face_areas / 3)
    for rings in (0.0, 4.0):
        total = weight[mesh.topology.point_of_vertex] @ mean_curvature(mesh, rings)
        # the solver stops at 1e-4
        assert total == pytest.approx(np.pi / 4 * 4 * 6, rel=1e-3)


def test_planes_are_flat():
    grid = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0), [0.0], indexing="ij"), -1).reshape(-1, 3)
    corner = (np.arange(7)[:, None] * 8 + np.arange(7)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 8, corner + 9], 1), np.stack([corner, corner + 9, corner + 1], 1)]
    )
    np.testing.assert_allclose(mean_curvature(Mesh(grid, faces)), 0, atol=1e-12)


def test_scale_and_place_do_not_matter():
    ball = icosphere(1.0, 3)
    plain = mean_curvature(ball)
    tiny = mean_curvature(Mesh(ball.vertices * 1e-6, ball.faces)) * 1e-6
    np.testing.assert_allclose(tiny, plain, rtol=1e-4)
    # a thousand sizes away the coordinates keep thirteen digits, their second differences ten
    np.testing.assert_allclose(mean_curvature(moved(ball, (1e3, 0, 0))), plain, rtol=1e-4)


def test_turned_inside_out_the_sign_turns():
    ball = icosphere(1.0, 3)
    np.testing.assert_allclose(mean_curvature(inverted(ball)), -mean_curvature(ball), rtol=1e-4)


def test_both_sides_of_a_seam_have_one_value():
    ball = icosphere(1.0, 3)
    # every face with vertices of its own
    split = Mesh(ball.vertices[ball.faces.ravel()], np.arange(3 * len(ball.faces)).reshape(-1, 3))
    np.testing.assert_allclose(mean_curvature(split), mean_curvature(ball)[ball.faces.ravel()], rtol=1e-3)


def test_broken_meshes_give_finite_numbers():
    ball = icosphere(1.0, 2)
    vertices = np.concatenate([ball.vertices, [[5, 5, 5]]])
    needle = [[0, 1, 1], [3, 3, 3]]
    sliver = [ball.faces[0][[0, 1, 0]]]
    flipped = ball.faces[:1, ::-1]
    faces = np.concatenate([ball.faces[1:], flipped, needle, sliver, ball.faces[5:6], ball.faces[5:6]])
    for rings in (0.0, 4.0):
        curvature = mean_curvature(Mesh(vertices, faces), rings)
        assert curvature.shape == (len(vertices),)
        assert np.isfinite(curvature).all()


def test_faces_without_area_and_no_faces_are_flat():
    line = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    np.testing.assert_array_equal(mean_curvature(line), 0)
    np.testing.assert_array_equal(mean_curvature(Mesh(np.zeros((2, 3)), np.zeros((0, 3)))), 0)


def test_the_bunny_has_sensible_curvature(shared):
    """Half of it rounder than a ball of its own size, next to none sharper than a fiftieth of it."""
    from sss_tools.loading import load_mesh

    bunny = load_mesh(shared / "meshes" / "bunny_stanford.obj")
    curvature = mean_curvature(bunny) * bunny.longest_side
    assert np.isfinite(curvature).all()
    assert 2 < np.median(curvature) < 6
    assert np.percentile(np.abs(curvature), 99) < 50
