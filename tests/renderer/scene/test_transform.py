"""Placing meshes."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.transform import read_transform, rotation, transformed
from sss_tools.errors import InputError
from sss_tools.keys import Place
from sss_tools.mesh import Mesh

PLACE = Place(Path("scene.toml"), '"transform" of [[object]] 1')


def corner(attributes=None) -> Mesh:
    """A tetrahedron of volume 1/6."""
    return Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
        np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        vertex_attributes=attributes or {},
    )


def moved(point, **table):
    matrix = read_transform(table, PLACE)
    return matrix[:3, :3] @ point + matrix[:3, 3]


def test_scale_acts_first_then_rotation_then_translation():
    # x = 1 is scaled to 2, turned a quarter about +y (right-handed: x to -z), moved up by 5
    assert_allclose(
        moved([1, 0, 0], scale=[2, 3, 4], rotate=[0, 1, 0, 90.0], translate=[0, 5, 0]), [0, 5, -2], atol=1e-15
    )


def test_three_scales_act_along_the_axes():
    assert_array_equal(moved([1, 1, 1], scale=[2, 3, 4]), [2, 3, 4])


def test_axis_of_rotation_needs_no_unit_length():
    assert_allclose(rotation([0, 0, 7], np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_matrix_is_row_major_and_acts_on_columns():
    matrix = [[0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]]
    assert_array_equal(moved([1, 0, 0], matrix=matrix), [10, 21, 30])


def test_empty_transform_leaves_the_mesh_itself():
    mesh = corner()
    assert transformed(mesh, read_transform({}, PLACE)) is mesh


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -2, 1], -1], ids=["one-axis", "another", "all"])
def test_mirrored_solid_still_faces_outward(scale):
    matrix = read_transform({"scale": scale}, PLACE)
    assert transformed(corner(), matrix).volume == pytest.approx(abs(np.linalg.det(matrix)) / 6)


def test_two_mirrored_axes_are_a_rotation_and_keep_the_faces():
    mesh = corner()
    assert_array_equal(transformed(mesh, read_transform({"scale": [-1, -1, 1]}, PLACE)).faces, mesh.faces)


def test_normals_stay_perpendicular_and_outward():
    normal = np.array([1, 1, 1]) / np.sqrt(3)  # of the slanted face
    mesh = corner({"normal": np.tile(normal, (4, 1)), "uv": np.zeros((4, 2))})
    for scale in ([1, 1, 4], [-1, 1, 4]):
        placed = transformed(mesh, read_transform({"scale": scale, "rotate": [1, 2, 3, 40.0]}, PLACE))
        assert_allclose(placed.vertex_attributes["normal"][0], placed.face_normals[3], atol=1e-14)
        assert_array_equal(placed.vertex_attributes["uv"], mesh.vertex_attributes["uv"])


@pytest.mark.parametrize(
    ("table", "said"),
    [
        pytest.param({"scale": [1, 0, 1]}, '"scale" in', id="a-zero-scale"),
        pytest.param({"scale": [1, 1]}, '"scale" in', id="two-scales"),
        pytest.param({"rotate": [0, 0, 0, 90.0]}, '"rotate" in', id="no-axis"),
        pytest.param({"rotate": [0, 1, 0]}, '"rotate" in', id="no-angle"),
        pytest.param({"translate": [1, 2]}, '"translate" in', id="two-coordinates"),
        pytest.param({"matrix": [[1, 0, 0, 0]] * 3}, '"matrix" in', id="three-rows"),
        pytest.param({"matrix": 4}, '"matrix" in', id="matrix-of-a-number"),
        pytest.param({"matrix": [[1, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, '"matrix" in', id="ragged"),
        pytest.param(
            {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 1]]}, "the last row", id="projective"
        ),
        pytest.param({"matrix": [[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, "no inverse", id="singular"),
        pytest.param({"matrix": np.eye(4).tolist(), "scale": 2}, 'has "matrix" beside', id="matrix-and-scale"),
    ],
)
def test_bad_transform_is_refused(table, said):
    with pytest.raises(InputError, match=r"scene\.toml") as caught:
        read_transform(table, PLACE)
    assert said in caught.value.line()
