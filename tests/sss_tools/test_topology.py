import csv

import numpy as np
import pytest

from sss_tools import topology
from sss_tools.loading import load_mesh
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, hollow_ball, icosphere, inverted, joined, moved, punctured
from sss_tools.topology import Topology, weld_exactly


def two_tetrahedra_sharing(shared_points: int) -> Mesh:
    """Two closed tetrahedra with one, two or three points in common."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [-1, 0, 0]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    second = {1: [0, 6, 5, 4], 2: [0, 1, 5, 4], 3: [0, 1, 2, 4]}[shared_points]
    # the second is the first with its corners renamed, mirrored if need be
    renamed = np.array(second)[faces]
    mesh = Mesh(points, renamed)
    return Mesh(points, np.concatenate([faces, renamed if mesh.volume > 0 else renamed[:, ::-1]]))


def as_soup(mesh: Mesh) -> Mesh:
    """The same triangles, none of which shares a vertex with another."""
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def test_vertices_at_equal_positions_are_one_point():
    soup = as_soup(icosphere(1.0, 2))
    closed = Topology(soup)
    assert len(closed.points) == 162
    assert len(closed.boundary_edges) == 0
    assert np.array_equal(closed.points[closed.faces], soup.vertices[soup.faces])


def test_negative_zero_is_zero_and_the_next_number_is_not():
    tiny = np.nextafter(0.0, 1.0)
    points, first = weld_exactly(np.array([[0.0, 1, 2], [-0.0, 1, 2], [tiny, 1, 2]]))
    assert points.tolist() == [0, 0, 1]
    assert first.tolist() == [0, 2]


def test_points_are_numbered_in_file_order():
    points, first = weld_exactly(np.array([[5.0, 0, 0], [1, 0, 0], [5, 0, 0], [3, 0, 0]]))
    assert points.tolist() == [0, 1, 0, 2]
    assert first.tolist() == [0, 1, 3]


def test_weld_survives_colliding_hashes(monkeypatch):
    soup = as_soup(icosphere(1.0, 2))
    expected = weld_exactly(soup.vertices)
    monkeypatch.setattr(topology, "_hash_rows", lambda bits: np.arange(len(bits), dtype=np.uint64) % 7)
    found = weld_exactly(soup.vertices)
    assert np.array_equal(found[0], expected[0])
    assert np.array_equal(found[1], expected[1])


def test_sides_name_their_edges_and_directions():
    mesh = box().topology
    for k in range(3):
        ends = np.stack([mesh.faces[:, k], mesh.faces[:, (k + 1) % 3]], axis=1)
        forward = mesh.side_direction[:, k]
        ends[~forward] = ends[~forward][:, ::-1]
        assert np.array_equal(mesh.edges[mesh.face_edges[:, k]], ends)
    assert (mesh.edges[:, 0] < mesh.edges[:, 1]).all()


def test_a_closed_solid_has_two_faces_at_every_edge():
    ball = icosphere(1.0, 2).topology
    assert (ball.faces_per_edge == 2).all()
    assert ball.boundary_loops == []
    assert len(ball.misoriented_edges) == len(ball.nonmanifold_edges) == len(ball.pinched_points) == 0
    assert ball.component_count == 1


def test_each_hole_is_a_loop_and_the_largest_comes_first():
    ball = punctured(punctured(icosphere(1.0, 3), [1, 0, 0], 0.5), [-1, 0, 0], 0.25).topology
    large, small = ball.boundary_loops
    assert len(large) > len(small) >= 3
    assert sorted([*large, *small]) == ball.boundary_edges.tolist()
    assert (ball.points[ball.edges[large]][..., 0] > 0).all()


def test_holes_that_touch_in_a_point_are_one_loop():
    mesh = box()
    point_of_both = mesh.faces[0][0]
    touching = [f for f in range(1, 12) if point_of_both in mesh.faces[f]]
    apart = [f for f in touching if len(set(mesh.faces[f]) & set(mesh.faces[0])) == 1]
    mesh = Mesh(mesh.vertices, np.delete(mesh.faces, [0, apart[0]], axis=0))
    assert [len(loop) for loop in mesh.topology.boundary_loops] == [6]
    assert mesh.topology.pinched_points.tolist() == [point_of_both]


def test_a_face_turned_over_disagrees_with_its_three_neighbours():
    mesh = box()
    faces = mesh.faces.copy()
    faces[4] = faces[4][::-1]
    turned = Mesh(mesh.vertices, faces).topology
    assert sorted(turned.misoriented_edges) == sorted(turned.face_edges[4])
    assert len(inverted(mesh).topology.misoriented_edges) == 0


@pytest.mark.parametrize(
    ("shared_points", "nonmanifold", "pinched", "components"),
    # faces that share an edge are connected, faces that share a point are not
    [(1, 0, 1, 2), (2, 1, 0, 1), (3, 3, 0, 1)],
)
def test_touching_solids(shared_points, nonmanifold, pinched, components):
    touching = two_tetrahedra_sharing(shared_points).topology
    assert len(touching.nonmanifold_edges) == nonmanifold
    assert len(touching.pinched_points) == pinched
    assert touching.component_count == components


def test_a_fan_beside_a_non_manifold_edge_is_still_a_pinch():
    mesh = two_tetrahedra_sharing(2)
    third = moved(Mesh(mesh.vertices[[0, 6, 4, 5]] - mesh.vertices[0], mesh.faces[:4]), [0, 0, 0])
    third = Mesh(third.vertices * [1, 0.1, -3], third.faces)
    assert joined(mesh, third).topology.pinched_points.tolist() == [0]


def test_components_are_numbered_by_first_face():
    mesh = hollow_ball(1.0, 0.5, 1).topology
    assert mesh.component_count == 2
    assert mesh.component_of_face.tolist() == [0] * 80 + [1] * 80


def test_collapsed_faces_take_no_part():
    mesh = box()
    faces = np.concatenate([mesh.faces, [[0, 0, 1], [2, 3, 2]]])
    collapsed = Mesh(mesh.vertices, faces).topology
    assert collapsed.live.tolist() == [True] * 12 + [False] * 2
    assert (collapsed.face_edges[12:] == -1).all()
    assert (collapsed.component_of_face[12:] == -1).all()
    assert len(collapsed.edges) == 18
    assert len(collapsed.boundary_edges) == len(collapsed.nonmanifold_edges) == 0


@pytest.mark.parametrize("faces", [np.zeros((0, 3), int), np.zeros((2, 3), int)])
def test_nothing_live_is_nothing_found(faces):
    empty = Mesh(np.zeros((1, 3)), faces).topology
    assert empty.component_count == 0
    assert empty.boundary_loops == []
    assert len(empty.edges) == len(empty.pinched_points) == len(empty.misoriented_edges) == 0


def test_real_meshes_have_the_topology_other_tools_found(shared):
    """Every readable file of the manifest; n_faces there counts faces before collapsed ones are dropped."""
    with (shared / "meshes" / "MANIFEST.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["class"] not in ("corrupt", "either")]
    assert len(rows) > 50
    differences = {}
    for row in rows:
        found = load_mesh(shared / "meshes" / row["file"]).topology
        facts = {
            "n_vertices": len(np.unique(found.faces[found.live])),
            "n_components": found.component_count,
            "n_boundary_loops": len(found.boundary_loops),
            "boundary_edges": len(found.boundary_edges),
            "nonmanifold_edges": len(found.nonmanifold_edges),
            "nonmanifold_vertices": len(found.pinched_points),
            "misoriented_edges": len(found.misoriented_edges),
        }
        wrong = {name: (count, row[name]) for name, count in facts.items() if count != int(row[name])}
        if wrong:
            differences[row["file"]] = wrong
    assert differences == {}
