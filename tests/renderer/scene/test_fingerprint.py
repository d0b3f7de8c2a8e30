"""The scene's hash."""

import dataclasses

import numpy as np
import pytest

from renderer.scene.fingerprint import scene_hash, with_hash
from renderer.scene.scene_file import load_scene


def test_hash_does_not_depend_on_where_files_lie_or_how_they_are_written(folder):
    first = load_scene(folder.write())
    elsewhere = folder.path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "shape.ply").write_bytes((folder.path / "tetrahedron.ply").read_bytes())
    text = folder.file.read_text().replace("tetrahedron.ply", "shape.ply").replace("30.0", "3e1")
    (elsewhere / "other.toml").write_text("# the same\n" + text)
    assert load_scene(elsewhere / "other.toml").hash == first.hash


def test_hash_does_not_depend_on_names(folder):
    text = folder.write().read_text()
    first = load_scene(folder.file).hash
    folder.file.write_text(text.replace("wax", "soap").replace("corner", "thing"))
    assert load_scene(folder.file).hash == first


@pytest.mark.parametrize(
    ("old", "new"),
    [
        pytest.param("4.0]", "4.0000001]", id="camera-position"),
        pytest.param("fov = 30.0", "fov = 30.1", id="fov"),
        pytest.param("[40, 30]", "[30, 40]", id="resolution"),
        pytest.param("radiance = 0.5", "radiance = [0.5, 0.5, 0.4]", id="light"),
        pytest.param("radiance = 0.5", "radiance = 0.5\nrotation = 1", id="rotation"),
        pytest.param("sigma_t = 10.0", "sigma_t = 10.1", id="medium"),
        pytest.param("sigma_t = 10.0", "sigma_t = 10.0\ng = 0.1", id="g"),
        pytest.param("sigma_t = 10.0", "sigma_t = 10.0\nior = 1.4", id="ior"),
        pytest.param("sigma_t = 10.0", "sigma_t = 10.0\nroughness = 0.1", id="roughness"),
        pytest.param('"corner"', '"corner"\nnormals = "smooth"', id="normals"),
        pytest.param('"corner"', '"corner"\nshader = "path"', id="shader"),
        pytest.param('"corner"', '"corner"\nhole_handling = "cap"', id="hole-handling"),
        pytest.param('"corner"', '"corner"\ntransform = { translate = [0, 0, 1e-9] }', id="transform"),
    ],
)
def test_hash_changes_with_what_the_picture_depends_on(folder, old, new):
    assert load_scene(folder.write()).hash != load_scene(folder.write(old, new)).hash


def test_hash_changes_with_a_vertex_of_the_mesh(folder):
    before = load_scene(folder.write()).hash
    mesh = folder.path / "tetrahedron.ply"
    mesh.write_text(mesh.read_text().replace("1 0 0\n", "1.001 0 0\n"))
    assert load_scene(folder.file).hash != before


def test_hash_changes_with_a_pixel_of_the_environment(folder):
    image = np.ones((2, 4, 3), np.float32)
    np.save(folder.path / "sky.npy", image)
    before = load_scene(folder.write("radiance = 0.5", 'image = "sky.npy"')).hash
    image[1, 3, 2] = 2
    np.save(folder.path / "sky.npy", image)
    assert load_scene(folder.file).hash != before


def test_hash_does_not_depend_on_what_was_found_out(folder):
    scene = load_scene(folder.write())
    thing = dataclasses.replace(scene.objects[0], closedness=object())
    assert scene_hash(dataclasses.replace(scene, objects=(thing,))) == scene.hash


def test_hash_is_taken_again_after_a_change(folder):
    scene = load_scene(folder.write())
    camera = dataclasses.replace(scene.camera, resolution=(8, 8))
    changed = with_hash(dataclasses.replace(scene, camera=camera))
    assert changed.hash == scene_hash(changed) != scene.hash
