import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.intersection import self_intersections
from sss_tools.mesh import Mesh
from sss_tools.sealing import seal
from sss_tools.winding import winding_numbers

BALL = shapes.icosphere(1.0, 4)
TOP, SIDE, BELOW = [0, 1, 0], [1, 0, 0], [0, -0.8, -0.6]


def punctured(half_angle: float, *places) -> Mesh:
    """The ball without caps of this half angle, degrees."""
    return shapes.punctured(BALL, places or [TOP], 2 * np.sin(np.radians(half_angle) / 2))


def spiked() -> Mesh:
    """A ball with a hole on top, through which a dent in its far side sticks out."""
    mesh = punctured(35)
    points = mesh.vertices.copy()
    off_axis = np.linalg.norm(points[:, [0, 2]], axis=1)
    dented = (points[:, 1] < 0) & (off_axis < 0.35)
    points[dented, 1] += 2.4 * (1 - (off_axis[dented] / 0.35) ** 2)
    return Mesh(points, mesh.faces)


def winds(mesh: Mesh) -> np.ndarray:
    """Winding numbers at places all over the box."""
    lower, upper = mesh.bounds
    places = lower + np.random.default_rng(1).random((300, 3)) * (upper - lower)
    return np.round(winding_numbers(places, mesh.vertices, mesh.faces), 6)


@pytest.mark.parametrize("places", [[TOP], [TOP, SIDE, BELOW]], ids=["one hole", "three holes"])
@pytest.mark.parametrize("half_angle", [5, 15, 25])
def test_a_cut_ball_becomes_whole_again(half_angle, places):
    """Flat caps would take 0.1 % of the volume at 15 and 0.6 % at 25 degrees, each; these go on with the curve.

    The angle is that of a jagged loop, true to a facet: 4 degrees across.
    """
    mesh = punctured(half_angle, *places)
    sealed = seal(mesh)
    topology = sealed.mesh.topology
    assert sealed.closed and len(topology.boundary_edges) == len(topology.misoriented_edges) == 0
    assert sealed.mesh.volume == pytest.approx(BALL.volume, rel=1e-3 * len(places))
    assert len(sealed.loops) == len(places) and all(loop.capped for loop in sealed.loops)
    for loop in sealed.loops:
        assert loop.half_angle == pytest.approx(half_angle, abs=2.5) and loop.radius == pytest.approx(1, abs=0.1)
    assert set(np.unique(winds(sealed.mesh))) == {0.0, 1.0}


def test_the_mesh_given_stays_as_it_is_and_its_faces_come_first():
    mesh = punctured(20)
    before = mesh.vertices.copy(), mesh.faces.copy()
    sealed = seal(mesh)
    np.testing.assert_array_equal(mesh.vertices, before[0])
    np.testing.assert_array_equal(mesh.faces, before[1])
    assert sealed.faces == len(mesh.faces) < len(sealed.mesh.faces)
    corners = sealed.mesh.vertices[sealed.mesh.faces[: sealed.faces]]
    np.testing.assert_array_equal(corners, mesh.vertices[mesh.faces])


def test_a_curved_loop_gets_a_cap_within_its_curve():
    """A saddle cut out of a ring's outer side, 53 degrees of the tube to either side of its middle.

    A chord across it would lie 0.5 (1 - cos 53 degrees) = 0.2 below the tube in the middle.
    """
    tube = shapes.torus(2.0, 0.5, 128, 48)
    hole = shapes.punctured(tube, [[2.5, 0, 0]], 0.45)
    sealed = seal(hole)
    assert sealed.closed and sealed.mesh.volume == pytest.approx(tube.volume, rel=1e-3)
    caps = sealed.mesh.vertices[sealed.mesh.faces[sealed.faces :]].mean(axis=1)
    reach = np.hypot(np.hypot(caps[:, 0], caps[:, 1]) - 2, caps[:, 2])
    assert np.abs(reach - 0.5).max() < 0.05


def test_solids_are_turned_outwards_and_caps_with_them():
    mesh = punctured(20)
    for wrong in (
        shapes.inverted(mesh),
        Mesh(mesh.vertices, np.where(np.arange(len(mesh.faces))[:, None] % 3 == 0, mesh.faces[:, ::-1], mesh.faces)),
    ):
        sealed = seal(wrong)
        assert sealed.turned > 0 and sealed.closed
        assert sealed.mesh.volume == pytest.approx(BALL.volume, rel=1e-3)
        assert set(np.unique(winds(sealed.mesh))) == {0.0, 1.0}


def test_a_cap_that_would_cut_through_the_body_is_left_out():
    sealed = seal(spiked())
    (loop,) = sealed.loops
    assert not loop.capped and not sealed.closed and len(sealed.mesh.faces) == sealed.faces
    # and only that one, where there are others
    both = shapes.joined(spiked(), shapes.moved(punctured(20), (3, 0, 0)))
    sealed = seal(both)
    assert sorted(loop.capped for loop in sealed.loops) == [False, True]


def test_a_fold_at_the_rim_does_not_cost_the_cap():
    """A ring cut through: two faces of the caps cross their surroundings."""
    ring = shapes.punctured(shapes.torus(1.0, 0.4, 64, 32), [[1.4, 0, 0]], 0.8)
    sealed = seal(ring)
    crossing = self_intersections(sealed.mesh.topology)
    assert len(crossing) > 0 and (crossing >= sealed.faces).any(axis=1).all()
    assert sealed.closed and sealed.overlapping and [loop.capped for loop in sealed.loops] == [True, True]


def test_a_cap_may_pass_through_another_solid():
    """A rod stuck through the hole: each closed for itself, together a union."""
    rod = shapes.moved(shapes.box((0.2, 2.0, 0.2)), (0, 0.6, 0))
    sealed = seal(shapes.joined(punctured(20), rod))
    assert sealed.closed and sealed.overlapping
    assert set(np.unique(winds(sealed.mesh))) <= {0.0, 1.0, 2.0}


def test_of_two_caps_in_one_plane_the_smaller_is_bulged_out():
    """A lid upon a pot, cut at one height: rays could not tell which cap comes first."""
    pot = shapes.cylinder(1.0, 1.0, 48)
    pot = Mesh(pot.vertices, pot.faces[~(pot.vertices[pot.faces][..., 2] > 0.49).all(axis=1)])
    lid = shapes.moved(shapes.cylinder(0.6, 0.4, 48), (0, 0, 0.7))
    lid = Mesh(lid.vertices, lid.faces[~(lid.vertices[lid.faces][..., 2] < 0.51).all(axis=1)])
    sealed = seal(shapes.joined(pot, lid))
    assert sealed.closed and len(sealed.loops) == 2
    # from the lid down through both caps: one crossing would be lost where they coincide
    caps = sealed.mesh.vertices[sealed.mesh.faces[sealed.faces :]]
    assert caps[..., 2].min() == pytest.approx(0.5 - 0.01 * 1.2) and caps[..., 2].max() == pytest.approx(0.5)
    assert set(np.unique(winds(sealed.mesh))) <= {0.0, 1.0, 2.0}


def test_without_caps_loops_are_measured_all_the_same():
    mesh = punctured(20)
    sealed = seal(mesh, caps=False)
    assert len(sealed.mesh.faces) == len(mesh.faces) and not sealed.closed
    (loop,) = sealed.loops
    assert not loop.capped and loop.half_angle == pytest.approx(20, abs=2.5)


def test_a_sheet_is_no_hole():
    square = Mesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]]))
    sealed = seal(square)
    assert sealed.loops == () and not sealed.closed
