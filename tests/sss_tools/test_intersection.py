import numpy as np
import pytest

from sss_tools import box_tree, intersection, shapes
from sss_tools.intersection import self_intersections
from sss_tools.mesh import Mesh
from sss_tools.topology import Topology
from tests.sss_tools.exact_triangles import self_intersections as slowly


def pairs(mesh):
    return set(map(tuple, self_intersections(Topology(mesh)).tolist()))


def soup(count, seed, places=None):
    """Random triangles; with ``places``, corners on a grid of so many places a side, so that many touch."""
    random = np.random.default_rng(seed)
    vertices = random.random((3 * count, 3)) if places is None else random.integers(0, places, (3 * count, 3)) / 8
    return Mesh(vertices, np.arange(3 * count).reshape(-1, 3))


def bumpy(subdivisions, depth=0.1, noise=0.0):
    """A ball with hills; with ``noise`` its vertices are shaken by that share of an edge."""
    ball = shapes.icosphere(1.0, subdivisions)
    x, y, z = ball.vertices.T
    random = np.random.default_rng(1)
    shake = noise / 2**subdivisions * random.standard_normal(ball.vertices.shape)
    return Mesh(ball.vertices * (1 + depth * np.sin(7 * x) * np.cos(5 * y + 2 * z))[:, None] + shake, ball.faces)


@pytest.mark.parametrize("seed", range(4))
def test_random_triangles_meet_where_rational_arithmetic_says_so(seed):
    mesh = soup(36, seed)
    assert pairs(mesh) == slowly(mesh.vertices, mesh.faces) != set()


@pytest.mark.parametrize("seed", range(4))
def test_triangles_on_a_coarse_grid_meet_where_rational_arithmetic_says_so(seed):
    # shared corners and sides, touching corners, common planes, duplicates and faces without area, all of them
    mesh = soup(40, seed, places=4)
    topology = Topology(mesh)
    live = np.flatnonzero(topology.live)
    expected = {(int(live[i]), int(live[j])) for i, j in slowly(topology.points, topology.faces[live])}
    assert pairs(mesh) == expected != set()


@pytest.mark.parametrize("solid", [shapes.box(), shapes.icosphere(1.0, 5), shapes.torus(), shapes.cylinder()])
def test_sound_solids_do_not_meet_themselves(solid):
    assert pairs(solid) == set()


def test_corners_known_to_be_fans_take_nothing_from_the_verdict(monkeypatch):
    """Neighbours round such a corner are not looked at: a shortcut. Without it, the same pairs come out."""
    for noise in (0.0, 0.3, 0.6):
        ball = bumpy(4, noise=noise)
        both = shapes.joined(ball, shapes.moved(ball, [0.9, 0.1, 0.05]))
        quick = pairs(both)
        with monkeypatch.context() as patch:
            patch.setattr(intersection, "_spreads_out", lambda topology, *_: np.zeros(len(topology.points), bool))
            assert quick == pairs(both) != set()


def test_as_many_pairs_a_face_are_looked_at_whatever_the_number_of_faces(monkeypatch):
    """Cost that does not grow with the mesh, counted: four times the faces, four times the work, give or take.

    Comparisons of leaves are counted as well as of boxes; a search of all pairs would do 16 times the work.
    """
    seen = []
    for name in ("_overlapping", "_overlapping_boxes"):
        original = getattr(box_tree.BoxTree, name)

        def counting(*arguments, original=original, **options):
            seen.append(len(arguments[-1]))
            return original(*arguments, **options)

        monkeypatch.setattr(box_tree.BoxTree, name, counting)
    work = []
    for subdivisions in (4, 5, 6):
        ball = bumpy(subdivisions)
        seen.clear()
        assert pairs(ball) == set()
        work.append(sum(seen) / len(ball.faces))
    assert max(work) < 8
    assert work[2] < 1.2 * work[0]


def test_a_fold_back_onto_a_neighbour_is_found():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.4, 0], [0, -1, 0]])
    assert pairs(Mesh(points, [[0, 1, 2], [1, 0, 3]])) == {(0, 1)}
    assert pairs(Mesh(points, [[0, 1, 2], [1, 0, 4]])) == set()


def test_a_fan_that_turns_twice_round_its_corner_meets_itself_there():
    turns = np.arange(12) * np.pi / 3
    for around, expected in ((2, True), (1, False)):
        angle = turns * around / 2
        # the second turn crosses the first half way; a single turn only rises and falls
        rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(angle / 2)], axis=1)
        rim[:, :2] *= np.linspace(1.0, 1.3, 12)[:, None]
        fan = np.stack([np.zeros(12, int), 1 + np.arange(12), 1 + (np.arange(12) + 1) % 12], axis=1)
        mesh = Mesh(np.concatenate([[[0, 0, 0]], rim]), fan)
        assert (pairs(mesh) != set()) == expected
        assert pairs(mesh) == slowly(mesh.vertices, mesh.faces)


def test_a_corner_that_pokes_through_a_neighbour_at_another_corner_is_found():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0.5], [0.2, 0.2, -0.5]])
    assert pairs(Mesh(points, [[0, 1, 2], [0, 3, 4]])) == {(0, 1)}
    # beside the face, they have the corner in common and nothing else
    points[3:, 0] -= 1
    assert pairs(Mesh(points, [[0, 1, 2], [0, 3, 4]])) == set()


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 1.0, 1e9, 1e300])
def test_the_verdict_holds_at_any_scale(scale):
    mesh = soup(40, 3)
    power = 2.0 ** np.round(np.log2(scale))
    assert pairs(Mesh(mesh.vertices * power, mesh.faces)) == pairs(mesh)


def test_copies_of_a_face_and_faces_without_area_are_left_to_other_rules():
    box = shapes.box()
    sliver = [[box.faces[0, 0], box.faces[0, 1], box.faces[0, 1]]]
    assert pairs(Mesh(box.vertices, np.concatenate([box.faces, box.faces[:2], box.faces[:1, ::-1], sliver]))) == set()


def test_faces_whose_corners_all_lie_on_a_line_meet_nothing():
    points = np.arange(4)[:, None] * np.array([1.0, 2, 3])
    assert pairs(Mesh(points, [[0, 1, 2], [1, 2, 3]])) == set()


def test_coordinates_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="finite"):
        self_intersections(Topology(Mesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 0], [1, 1, 1]], [[0, 1, 2], [1, 2, 3]])))


@pytest.mark.parametrize(
    ("name", "faces"),
    # CGAL's exact verdict; pymeshlab has 17 of these wrong
    [
        ("duck.dae", 12),
        ("cow.obj", 83),
        ("boolean.glb", 2929),
        ("beetle_vw.obj", 71),
        ("wallhole.obj", 38),
        ("soup.stl", 99),
        ("shared.STL", 0),
        ("spot.obj", 0),
        ("Vase.stl", 0),
        ("derived_far_vase.stl", 4),
    ],
)
def test_as_many_faces_of_real_meshes_are_involved_as_an_exact_peer_says(shared, name, faces):
    from sss_tools.loading import load_mesh

    found = self_intersections(load_mesh(shared / "meshes" / name).topology)
    assert len(np.unique(found)) == faces
