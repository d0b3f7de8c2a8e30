import numpy as np

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.patches import orient_consistently, patch_of_face


def flipped(mesh, chosen):
    faces = mesh.faces.copy()
    faces[chosen] = faces[chosen][:, ::-1]
    return Mesh(mesh.vertices, faces)


def moebius_strip(count=12):
    turn = np.arange(count) * 2 * np.pi / count
    half = turn / 2
    rim = np.stack([np.cos(half) * np.cos(turn), np.cos(half) * np.sin(turn), np.sin(half)], axis=1) * 0.3
    middle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    upper, lower = np.arange(count), np.arange(count) + count
    next_upper, next_lower = np.append(upper[1:], lower[0]), np.append(lower[1:], upper[0])
    faces = np.concatenate(
        [
            np.stack([upper, lower, next_upper], axis=1),
            np.stack([lower, next_lower, next_upper], axis=1),
        ]
    )
    return Mesh(np.concatenate([middle + rim, middle - rim]), faces)


def test_a_few_turned_faces_are_turned_back():
    ball = shapes.icosphere()
    chosen = np.arange(0, len(ball.faces), 7)
    faces, turned = orient_consistently(flipped(ball, chosen).topology)
    assert np.flatnonzero(turned).tolist() == chosen.tolist()
    np.testing.assert_array_equal(np.sort(faces, axis=1), np.sort(ball.topology.faces, axis=1))


def test_where_most_faces_are_turned_the_rest_follows():
    ball = shapes.icosphere(1.0, 2)
    chosen = np.arange(len(ball.faces)) % 4 > 0
    _, turned = orient_consistently(flipped(ball, chosen).topology)
    np.testing.assert_array_equal(turned, ~chosen)


def test_a_consistent_mesh_is_left_alone():
    ball = shapes.inverted(shapes.icosphere())
    faces, turned = orient_consistently(ball.topology)
    assert not turned.any() and faces is ball.topology.faces


def test_a_moebius_strip_stays_as_it_is():
    strip = moebius_strip()
    assert len(strip.topology.misoriented_edges) > 0
    assert not orient_consistently(strip.topology)[1].any()


def test_patches_end_at_edges_with_more_than_two_faces():
    box = shapes.box(2.0)
    # a wall through the middle of nothing: three boxes' worth of faces meet at one edge
    corner, other = box.vertices[box.topology.edges[0]]
    fin = Mesh(np.array([corner, other, corner + np.array([9, 9, 9])]), np.array([[0, 1, 2]]))
    both = shapes.joined(box, fin).topology
    assert both.component_count == 1
    patch = patch_of_face(both)
    assert (patch[:12] == patch[0]).all() and patch[12] != patch[0]
