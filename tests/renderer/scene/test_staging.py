"""The scene around a bare mesh."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.camera import CameraRays, view_basis
from renderer.scene.description import EnvironmentLight, RectangleLight
from renderer.scene.lights import RectangleSource
from renderer.scene.staging import FOV, MARGIN, stage_mesh
from sss_tools.errors import InputError
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import RayCaster, UnitFrame

SHAPES = [(1.0, 1.0, 1.0), (1.0, 0.02, 1.0), (0.02, 1.0, 0.02), (1.0, 0.1, 0.1), (0.1, 0.1, 1.0), (1.0, 1.0, 0.01)]


def box(sides=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0), path=None) -> Mesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[quad[0], quad[k], quad[k + 1]] for quad in quads for k in (1, 2)]
    return Mesh(corners * sides + centre, np.array(faces), path=path)


def picture_coordinates(scene, points):
    """(2, n) where points are in the picture: -1 left or top edge, 1 right or bottom edge."""
    forward, left, upward = view_basis(scene.camera)
    width, height = scene.camera.resolution
    x, y, z = np.stack([-left, -upward, forward]) @ (points - scene.camera.position).T
    tangent = np.tan(np.radians(scene.camera.fov) / 2)
    return np.stack([x / (z * tangent * width / height), y / (z * tangent)])


def test_staged_box_encloses_a_volume():
    assert box((1, 2, 3)).volume == pytest.approx(6)


@pytest.mark.parametrize("size", [(500, 500), (640, 360), (200, 600)])
@pytest.mark.parametrize("sides", SHAPES)
def test_mesh_fills_the_picture_but_for_the_margin(sides, size):
    scene = stage_mesh(box(sides, centre=(3, -2, 7)), size=size)
    points = picture_coordinates(scene, scene.objects[0].mesh.vertices)
    assert scene.camera.fov == FOV
    # the tighter direction meets both its edges
    extent = np.abs(points).max(axis=1)
    assert extent.max() == pytest.approx(1 - MARGIN, rel=1e-9)
    tight = int(extent.argmax())
    assert points[tight].min() == pytest.approx(-points[tight].max(), rel=1e-9)
    assert extent.min() <= 1 - MARGIN


@pytest.mark.parametrize("size", [(500, 500), (640, 360), (200, 600)])
@pytest.mark.parametrize("sides", SHAPES)
def test_light_is_out_of_the_picture_and_shines_on_the_mesh(sides, size):
    scene = stage_mesh(box(sides), size=size)
    (light,) = (light for light in scene.lights if isinstance(light, RectangleLight))
    frame = UnitFrame.around(*scene.objects[0].mesh.bounds)
    source = RectangleSource(light, frame)
    rays = CameraRays(scene.camera, frame)
    directions = rays.centre_directions()[:, ::7].copy()
    origins = np.broadcast_to(rays.origin[:, None], directions.shape).copy()
    _, triangle = RayCaster(source.vertices, source.triangles).closest(origins, directions)
    assert (triangle == -1).all()
    # and stands clear of the mesh
    heights = (frame.points_in(scene.objects[0].mesh.vertices) - source.vertices.mean(axis=0)) @ source.normal[:, 0]
    assert heights.min() > 0.5


def test_camera_looks_from_slightly_above_and_the_light_is_above_and_beside_it():
    scene = stage_mesh(box())
    view = scene.camera.position - scene.camera.target
    assert 5 < np.degrees(np.arcsin(view[1] / np.linalg.norm(view))) < 20
    assert_array_equal(scene.camera.up, [0, 1, 0])
    _, left, _ = view_basis(scene.camera)
    light = scene.lights[1]
    assert light.center[1] > scene.camera.position[1]
    assert light.center @ -left > 0.5


def test_default_medium_is_marble_at_two_hundredths_of_the_longest_side():
    scene = stage_mesh(box((1, 5, 2)))
    medium = scene.objects[0].material.medium
    assert_allclose(medium.mean_free_path, 0.02 * 5)
    assert_allclose(medium.single_scattering_albedo, [0.99904, 0.99844, 0.99764], atol=5e-6)
    assert medium.ior == 1.5
    assert medium.is_achromatic


def test_preset_is_converted_by_the_unit():
    assert stage_mesh(box(), "skin1", unit="cm").objects[0].material.medium == Medium.preset("skin1", "cm")


def test_a_medium_is_taken_as_it_is_whatever_the_unit():
    medium = Medium.from_albedo([0.9, 0.8, 0.7], 3.0)
    assert stage_mesh(box(), medium, unit="cm").objects[0].material.medium is medium


def test_environment_is_dim_beside_the_light():
    environment, rectangle = stage_mesh(box()).lights
    assert isinstance(environment, EnvironmentLight)
    assert (environment.radiance < 0.1 * rectangle.radiance).all()


def test_default_scene_is_the_same_at_any_scale_and_place():
    near, far = stage_mesh(box()), stage_mesh(box((1000, 1000, 1000), centre=(5e4, 0, 0)))
    # float64 leaves 1e-16 * 5e4 / 1000 of the relative position, times a few operations
    assert_allclose((far.camera.position - [5e4, 0, 0]) / 1000, near.camera.position, atol=1e-12)
    assert_allclose((far.lights[1].center - [5e4, 0, 0]) / 1000, near.lights[1].center, atol=1e-11)
    assert_allclose(np.array(far.lights[1].half) / 1000, near.lights[1].half, rtol=1e-12)


def test_staged_scene_is_named_after_its_file_and_has_a_hash():
    scene = stage_mesh(box(path=Path("folder/teapot.ply")))
    assert scene.objects[0].name == "teapot"
    assert scene.objects[0].mesh_path == Path("folder/teapot.ply")
    assert len(scene.hash) == 32
    assert scene.hash != stage_mesh(box(), "marble").hash


def test_unknown_preset_is_refused_naming_the_nearest():
    with pytest.raises(InputError, match='did you mean "marble"'):
        stage_mesh(box(), "marbel")


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        pytest.param(np.zeros((3, 3)), np.zeros((0, 3), int), "no faces", id="no-faces"),
        pytest.param(np.ones((3, 3)), [[0, 1, 2]], "no extent", id="one-point"),
        pytest.param([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], "not finite", id="nan"),
        pytest.param([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], [[0, 1, 2]], "not finite", id="inf"),
    ],
)
def test_mesh_that_cannot_be_framed_is_refused(vertices, faces, said):
    with pytest.raises(InputError, match=said):
        stage_mesh(Mesh(np.array(vertices, float), np.array(faces)))
