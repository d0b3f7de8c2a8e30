"""A small scene in a temporary folder."""

from pathlib import Path

import pytest

TETRAHEDRON = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""

SCENE = """
[scene]
unit = "mm"

[camera]
position = [0.0, 0.5, 4.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 30.0
resolution = [40, 30]

[[light]]
type = "environment"
radiance = 0.5

[[object]]
name = "corner"
mesh = "tetrahedron.ply"
material = "wax"

[material.wax]
type = "translucent"
albedo = [0.9, 0.8, 0.7]
sigma_t = 10.0
"""


class SceneFolder:
    """A folder with a tetrahedron (volume 1/6, outward faces) and the scene file of the test."""

    def __init__(self, path: Path):
        self.path = path
        self.file = path / "scene.toml"
        (path / "tetrahedron.ply").write_text(TETRAHEDRON)

    def write(self, old: str = "", new: str = "", more: str = "") -> Path:
        """The scene file with ``old``, which must be there, replaced by ``new``, and ``more`` at its end."""
        assert old in SCENE
        self.file.write_text((SCENE.replace(old, new) if old else SCENE) + more)
        return self.file


@pytest.fixture
def folder(tmp_path) -> SceneFolder:
    return SceneFolder(tmp_path)
