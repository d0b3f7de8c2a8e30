"""Objects that share a side, or nearly so: rays meet their surfaces in an order, and no path is lost."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.tracing import traced_scene
from renderer.tracing.touching import GROWTH, grown_where_touching
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, icosphere, moved
from tests.assertions import seed
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, picture, placed, scene, translucent

CUBE = box(0.5)
PAIRS = {
    "side by side": (CUBE, moved(CUBE, (0.5, 0, 0))),
    "a millionth apart": (CUBE, moved(CUBE, (0.500001, 0, 0))),
    "shifted along the shared side": (CUBE, moved(CUBE, (0.5, 0.2, 0.1))),
    "the same twice": (icosphere(0.5, 3), icosphere(0.5, 3)),
    "one inside the other, flush": (box((0.5, 0.5, 0.3)), CUBE),
}


def grown(*meshes: Mesh):
    return grown_where_touching([mesh.vertices for mesh in meshes], [mesh.faces for mesh in meshes])


def leaks(pair, materials) -> float:
    """Share of paths lost by white bodies."""
    things = [
        placed(mesh, material, name=str(k)) for k, (mesh, material) in enumerate(zip(pair, materials, strict=True))
    ]
    view = camera((0.9, 0.7, 2.5), (0.2, 0, 0), fov=26, resolution=(64, 64))
    shown = picture(scene(things, [WHITE_SKY], view), 8, seed=seed(1))
    # where light circles in a film it plays roulette in the end
    assert (np.abs(shown.samples - 1) < 1e-6).mean() > 0.999
    return shown.tally.leaked / shown.tally.samples


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("iors", [(1.5, 1.3), (1.4, 1.4), (1.0, 1.5)])
def test_bodies_that_touch_lose_no_paths(pair, iors):
    """33 thousand paths: two leaks are allowed, where 1e-5 of the paths are 0.3."""
    materials = [translucent(1.0, 8.0, 0.0, ior) for ior in iors]
    assert leaks(PAIRS[pair], materials) <= 2 / 8 / 64**2


def test_paths_lost_where_sides_are_shared_are_caught(monkeypatch):
    """The companion: one path in ten."""
    monkeypatch.setattr(traced_scene, "grown_where_touching", lambda points, faces: points)
    assert leaks(PAIRS["side by side"], [translucent(1.0, 8.0, 0.0, ior) for ior in (1.5, 1.3)]) > 0.01


def test_a_body_that_stands_on_a_floor_takes_light_from_it():
    """It sinks into the white floor, which fills the shared side; else paths would be caught below the floor."""
    floor = moved(box((2, 0.2, 2)), (0, -0.35, 0))
    assert leaks((CUBE, floor), (translucent(1.0, 8.0), diffuse(1.0))) <= 2 / 8 / 64**2


def test_the_later_of_two_grows_and_by_a_hair():
    first, second = grown(*PAIRS["side by side"])
    assert_array_equal(first, CUBE.vertices)
    offset = second - PAIRS["side by side"][1].vertices
    touching = np.isclose(PAIRS["side by side"][1].vertices[:, 0], 0.25)
    assert_allclose(np.linalg.norm(offset[touching], axis=1), GROWTH, rtol=1e-9)
    assert (offset[touching, 0] < -GROWTH / 2).all()
    assert not offset[~touching].any()


def test_a_box_sinks_into_a_floor_whichever_is_listed_first():
    floor = moved(box((2, 0.2, 2)), (0, -0.35, 0))
    for meshes in ((CUBE, floor), (floor, CUBE)):
        points = dict(zip(map(id, meshes), grown(*meshes), strict=True))
        assert_array_equal(points[id(floor)], floor.vertices)
        assert points[id(CUBE)].min(axis=0)[1] < -0.25 - GROWTH / 2


def test_objects_apart_are_left_alone():
    meshes = (CUBE, moved(CUBE, (0.5001, 0, 0)), moved(icosphere(0.3, 2), (0, 2, 0)))
    for points, mesh in zip(grown(*meshes), meshes, strict=True):
        assert points is mesh.vertices


def test_seams_stay_closed():
    """Vertices in the same place move alike, and faces without area do no harm."""
    vertices = np.concatenate([CUBE.vertices, CUBE.vertices])
    faces = np.concatenate([CUBE.faces[:6], CUBE.faces[6:] + 8, [[0, 0, 1]]])
    _, points = grown(moved(CUBE, (0.5, 0, 0)), Mesh(vertices, faces))
    assert_array_equal(points[:8], points[8:])
    assert np.isfinite(points).all()
    assert (points != vertices).any()
