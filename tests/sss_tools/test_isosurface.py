import numpy as np
import pytest

from sss_tools.isosurface import mesh_isosurface


def ball(x, y, z):
    return np.sqrt(x**2 + y**2 + z**2) - 1


def saddle_in_a_ball(x, y, z):
    """The lower half of a ball, cut off by a saddle that lies flat in the grid plane z = 0 inside a cell."""
    return np.maximum(ball(x, y, z), z + (x - 0.04) * (y - 0.07))


def test_vertices_lie_on_the_surface_and_faces_look_outwards():
    mesh = mesh_isosurface(ball, [-1.2] * 3, [1.2] * 3, 0.1)
    # Newton's last step leaves the square of a step that is a hundredth of a cell at most
    assert np.abs(ball(*mesh.vertices.T)).max() < 1e-6
    assert mesh.volume == pytest.approx(4 / 3 * np.pi, rel=0.01)
    assert (np.einsum("ij,ij->i", mesh.face_normals, mesh.vertices[mesh.faces].mean(axis=1)) > 0.9).all()


@pytest.mark.parametrize("field", [ball, saddle_in_a_ball])
def test_every_edge_has_two_faces(field):
    mesh = mesh_isosurface(field, [-1.2] * 3, [1.2] * 3, 0.1)
    assert mesh.topology.live.all()
    assert (mesh.topology.faces_per_edge == 2).all()
    assert len(mesh.topology.misoriented_edges) == 0


def test_a_finer_grid_does_not_move_the_surface():
    def dumbbell(x, y, z):
        return np.minimum(ball(x - 1.5, y, z), ball(x + 1.5, y, z))

    coarse, fine = (mesh_isosurface(dumbbell, [-2.7, -1.2, -1.2], [2.7, 1.2, 1.2], c) for c in (0.1, 0.05))
    assert coarse.topology.component_count == fine.topology.component_count == 2
    assert coarse.volume == pytest.approx(fine.volume, rel=0.01)
