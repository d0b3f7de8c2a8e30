import numpy as np
import pytest

from sss_tools.errors import InputError
from sss_tools.loading import load_mesh
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, icosphere
from sss_tools.writing import ply_bytes, write_mesh


def test_what_is_written_is_read_again_bit_for_bit(tmp_path):
    ball = icosphere(1.0, 2)
    attributes = {
        "uv": np.float32(ball.vertices[:, :2]).astype(float),
        "normal": np.float32(ball.vertices).astype(float),
        "color": np.arange(4 * len(ball.vertices), dtype=np.uint8).reshape(-1, 4),
    }
    written = Mesh(ball.vertices, ball.faces, vertex_attributes=attributes)
    write_mesh(written, tmp_path / "ball.ply")
    found = load_mesh(tmp_path / "ball.ply")
    assert np.array_equal(found.vertices, written.vertices)
    assert np.array_equal(found.faces, written.faces)
    assert found.vertex_attributes.keys() == attributes.keys()
    for name, values in attributes.items():
        assert np.array_equal(found.vertex_attributes[name], values)


def test_single_precision_is_used_where_it_loses_nothing():
    assert b"property float x" in ply_bytes(box())
    assert b"property double x" in ply_bytes(box(0.1))


def test_a_mesh_without_faces_can_be_written(tmp_path):
    write_mesh(Mesh(np.zeros((2, 3)), np.zeros((0, 3), int)), tmp_path / "points.ply")
    assert len(load_mesh(tmp_path / "points.ply").vertices) == 2


def test_other_readers_agree(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    write_mesh(icosphere(1.0, 2), tmp_path / "ball.ply")
    found = trimesh.load_mesh(tmp_path / "ball.ply", process=False)
    assert np.array_equal(found.vertices, icosphere(1.0, 2).vertices)
    assert np.array_equal(found.faces, icosphere(1.0, 2).faces)


def test_a_failed_write_is_one_line_and_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_mesh(box(), tmp_path / "missing" / "box.ply")
    with pytest.raises(InputError, match="PLY only"):
        write_mesh(box(), tmp_path / "box.stl")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(InputError):
        write_mesh(box(), tmp_path / "folder.ply")
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder.ply"]
