import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.elephant import elephant

SOLIDS = {
    "box": lambda: shapes.box((1, 2, 3)),
    "slab": lambda: shapes.slab(2, 0.1),
    "icosphere": lambda: shapes.icosphere(2.0, 2),
    "ellipsoid": lambda: shapes.ellipsoid(),
    "torus": lambda: shapes.torus(),
    "cylinder": lambda: shapes.cylinder(),
    "elephant": lambda: elephant(),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_manifold_and_oriented_outwards(name):
    solid = SOLIDS[name]()
    topology = solid.topology
    assert len(topology.points) == len(solid.vertices)
    assert topology.live.all()
    assert (topology.faces_per_edge == 2).all()
    assert len(topology.misoriented_edges) == len(topology.pinched_points) == 0
    assert topology.component_count == 1
    assert solid.volume > 0
    assert solid.face_areas.min() > 0


@pytest.mark.parametrize(
    ("solid", "volume", "area"),
    [
        (shapes.box((1, 2, 3)), 6, 22),
        (shapes.slab(2, 0.1), 0.4, 8.8),
        (shapes.icosphere(2.0, 5), 4 / 3 * np.pi * 8, 16 * np.pi),
        (shapes.ellipsoid((3, 2, 1), 5), 4 / 3 * np.pi * 6, 48.8821),
        (shapes.torus(1, 0.3, 256, 128), 2 * np.pi**2 * 0.09, 4 * np.pi**2 * 0.3),
        (shapes.cylinder(0.5, 2, 256), np.pi / 2, 2.5 * np.pi),
    ],
)
def test_sizes_are_as_asked(solid, volume, area):
    # facets inside curved surfaces: less by about (edge / radius)^2 / 4, at most 5e-4 of what is asked here
    assert solid.volume == pytest.approx(volume, rel=1e-3)
    assert solid.area == pytest.approx(area, rel=1e-3)
    assert solid.bounds.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_hollow_ball_lacks_its_cavity():
    hollow = shapes.hollow_ball(1.0, 0.5, 4)
    assert hollow.topology.component_count == 2
    assert hollow.volume == pytest.approx(4 / 3 * np.pi * (1 - 1 / 8), rel=5e-3)
    assert [body.face_count for body in hollow.bodies] == [5120, 5120]
    assert [body.first_face for body in hollow.bodies] == [0, 5120]


def test_internal_geometry_counts_twice_where_a_cavity_is_taken_away():
    ball, inside = shapes.icosphere(1.0, 3), shapes.icosphere(0.5, 3)
    nested = shapes.with_internal(ball, [0.1, 0, 0], 0.5)
    assert nested.volume == pytest.approx(ball.volume + inside.volume)
    assert len(nested.topology.boundary_edges) == 0


def test_punctures_are_as_many_holes_as_asked():
    ball = shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1], [1, 0, 0], [0, -1, 0]], 0.2)
    assert len(ball.topology.boundary_loops) == 3
    assert len(np.unique(ball.faces)) == len(ball.vertices)
    assert len(ball.topology.pinched_points) == 0


def test_inverting_negates_the_volume():
    assert shapes.inverted(shapes.box()).volume == pytest.approx(-1)


def test_the_elephant_has_thick_and_thin_parts_and_is_the_same_every_time():
    animal = elephant()
    assert 30_000 < len(animal.faces) < 60_000
    assert animal.bounds[0, 1] == pytest.approx(0, abs=1e-3)  # it stands on the ground
    # thin parts: far more surface than a ball of that volume, 1.96
    assert animal.area > 1.8 * (36 * np.pi * animal.volume**2) ** (1 / 3)
    assert np.array_equal(animal.vertices, elephant().vertices)


def test_the_elephant_does_not_pass_through_itself():
    pymeshlab = pytest.importorskip("pymeshlab")
    animal = elephant()
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(animal.vertices, animal.faces))
    meshes.compute_selection_by_self_intersections_per_face()
    assert meshes.current_mesh().selected_face_number() == 0
