"""Scenes from TOML: what is read, and the one line for what cannot be."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.description import (
    Diffuse,
    DirectionalLight,
    EnvironmentLight,
    Mirror,
    PointLight,
    RectangleLight,
    SphereLight,
    Translucent,
)
from renderer.scene.scene_file import load_scene
from sss_tools.errors import InputError


def refusal(path) -> str:
    """The line with which the scene is refused."""
    with pytest.raises(InputError) as caught:
        load_scene(path)
    line = caught.value.line()
    assert "\n" not in line
    return line


# ---- what is read ----


def test_every_part_of_a_scene_arrives(folder):
    scene = load_scene(folder.write())
    assert scene.unit == "mm"
    assert scene.path == folder.file
    assert_array_equal(scene.camera.position, [0, 0.5, 4])
    assert_array_equal(scene.camera.target, [0, 0, 0])
    assert scene.camera.fov == 30
    assert scene.camera.resolution == (40, 30)
    (light,) = scene.lights
    assert isinstance(light, EnvironmentLight)
    assert_array_equal(light.radiance, [0.5, 0.5, 0.5])
    (thing,) = scene.objects
    assert (thing.name, thing.normals, thing.shader, thing.hole_handling) == ("corner", "flat", "auto", "auto")
    assert thing.mesh.volume == pytest.approx(1 / 6)
    assert isinstance(thing.material, Translucent)
    assert_allclose(thing.material.medium.single_scattering_albedo, [0.9, 0.8, 0.7])


def test_what_is_left_out_has_a_default(folder):
    text = """
    [camera]
    position = [0, 0, 5]
    target = [0, 0, 0]
    fov = 30
    [[light]]
    type = "environment"
    radiance = 1
    [[object]]
    mesh = "tetrahedron.ply"
    material = "wax"
    [material.wax]
    type = "translucent"
    sigma_a = 0.1
    sigma_s = 1
    """
    folder.file.write_text(text)
    scene = load_scene(folder.file)
    assert scene.unit == "mm"
    assert scene.objects[0].name == "tetrahedron"
    assert_array_equal(scene.camera.up, [0, 1, 0])
    assert scene.camera.resolution == (500, 500)


def test_every_kind_of_light_is_read(folder):
    more = """
    [[light]]
    type = "point"
    position = [1, 2, 3]
    intensity = [4, 5, 6]
    [[light]]
    type = "directional"
    direction = [0, -1, 0]
    irradiance = 2
    [[light]]
    type = "rectangle"
    center = [0, 3, 0]
    target = [0, 0, 1]
    half = [1, 2]
    radiance = 7
    [[light]]
    type = "sphere"
    center = [3, 3, 3]
    radius = 0.5
    radiance = [1, 2, 3]
    """
    _, point, directional, rectangle, sphere = load_scene(folder.write(more=more)).lights
    assert isinstance(point, PointLight)
    assert_array_equal(point.intensity, [4, 5, 6])
    assert isinstance(directional, DirectionalLight)
    assert_array_equal(directional.direction, [0, -1, 0])
    assert isinstance(rectangle, RectangleLight)
    assert rectangle.half == (1, 2)
    assert_array_equal(rectangle.up, [0, 1, 0])
    assert isinstance(sphere, SphereLight)
    assert sphere.radius == 0.5


def test_rectangle_straight_overhead_needs_no_up(folder):
    overhead = '[[light]]\ntype = "rectangle"\ncenter = [0, 3, 0]\ntarget = [0, 0, 0]\nhalf = [1, 1]\nradiance = 1'
    light = load_scene(folder.write(more=overhead)).lights[1]
    assert np.linalg.norm(np.cross(light.up, light.target - light.center)) > 0


def test_opaque_materials_are_read(folder):
    more = '[material.floor]\ntype = "diffuse"\nreflectance = [0.1, 0.2, 0.3]\n[material.glass]\ntype = "mirror"\n'
    more += '[[object]]\nname = "floor"\nmesh = "tetrahedron.ply"\nmaterial = "floor"\n'
    more += '[[object]]\nname = "wall"\nmesh = "tetrahedron.ply"\nmaterial = "glass"\n'
    _, floor, wall = load_scene(folder.write(more=more)).objects
    assert isinstance(floor.material, Diffuse)
    assert_array_equal(floor.material.reflectance, [0.1, 0.2, 0.3])
    assert isinstance(wall.material, Mirror)
    assert_array_equal(wall.material.reflectance, [1, 1, 1])


def test_environment_image_is_read_beside_the_scene(folder):
    np.save(folder.path / "sky.npy", np.full((2, 4, 3), 0.25, np.float32))
    light = load_scene(folder.write("radiance = 0.5", 'image = "sky.npy"\nrotation = 90')).lights[0]
    assert light.radiance is None
    assert light.rotation == 90
    assert_array_equal(light.image, np.full((2, 4, 3), 0.25))


def test_transform_places_the_object_and_keeps_the_source(folder):
    moved = 'material = "wax"\ntransform = { scale = 2, translate = [0, 0, 5] }'
    thing = load_scene(folder.write('material = "wax"', moved)).objects[0]
    assert_array_equal(thing.mesh.bounds, [[0, 0, 5], [2, 2, 7]])
    assert_array_equal(thing.source.bounds, [[0, 0, 0], [1, 1, 1]])


def test_objects_of_one_file_share_one_mesh(folder, monkeypatch):
    from renderer.scene import scene_file

    read = []
    original = scene_file.load_mesh
    monkeypatch.setattr(scene_file, "load_mesh", lambda path: read.append(path) or original(path))
    another = '[[object]]\nname = "again"\nmesh = "./tetrahedron.ply"\nmaterial = "wax"\n'
    first, second = load_scene(folder.write(more=another)).objects
    assert len(read) == 1
    assert first.mesh is second.mesh


@pytest.mark.parametrize(
    ("name", "resolution", "lights"),
    [
        ("p1_sphere", (64, 64), 1),
        ("p2_bunny_marble", (64, 64), 2),
        ("p3_bunny_backlit", (64, 64), 1),
        ("p4_slab", (64, 64), 1),
        ("p5_spot_matched", (64, 64), 1),
        ("p6_furnace", (128, 128), 1),
    ],
)
def test_reference_scene_loads(shared, name, resolution, lights):
    scene = load_scene(shared / "reference" / "scenes" / f"{name}.toml")
    assert scene.camera.resolution == resolution
    assert len(scene.lights) == lights
    assert scene.objects[0].name == name
    assert scene.objects[0].material.medium.is_achromatic


# ---- what is refused ----


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        pytest.param("[scene]", "[scene", "is no valid TOML", id="syntax"),
        pytest.param("[scene]", "[scen]", 'unknown key "scen" in the scene file; did you mean "scene"?', id="table"),
        pytest.param(
            "position", "postion", 'unknown key "postion" in [camera]; did you mean "position"?', id="camera-key"
        ),
        pytest.param("unit =", "units =", 'unknown key "units" in [scene]; did you mean "unit"?', id="scene-key"),
        pytest.param(
            "radiance =",
            "radience =",
            'unknown key "radience" in [[light]] 1 (environment); did you mean "radiance"?',
            id="light-key",
        ),
        pytest.param(
            'type = "env', 'typ = "env', 'unknown key "typ" in [[light]] 1; did you mean "type"?', id="type-key"
        ),
        pytest.param("mesh =", "Mehs =", 'unknown key "Mehs" in [[object]] 1; did you mean "mesh"?', id="object-key"),
        pytest.param(
            "albedo =",
            "albdo =",
            'unknown key "albdo" in [material.wax] (translucent); did you mean "albedo"?',
            id="material-key",
        ),
        pytest.param(
            'material = "wax"',
            'material = "wax"\ntransform = { sacle = 2 }',
            'unknown key "sacle" in "transform" of [[object]] 1; did you mean "scale"?',
            id="transform-key",
        ),
        pytest.param("fov = 30.0", "zzzz = 1", 'unknown key "zzzz" in [camera]; did you mean "', id="unlike-any-key"),
        pytest.param("position = [0.0, 0.5, 4.0]", "", 'missing key "position" in [camera]', id="missing-position"),
        pytest.param("fov = 30.0", "", 'missing key "fov" in [camera]', id="missing-fov"),
        pytest.param("radiance = 0.5", "", 'neither of "radiance" and "image"', id="missing-radiance"),
        pytest.param("radiance = 0.5", 'radiance = 1\nimage = "a.exr"', 'both of "radiance" and "image"', id="both"),
        pytest.param('type = "environment"', "", 'missing key "type" in [[light]] 1', id="missing-light-type"),
        pytest.param('type = "translucent"', "", 'missing key "type" in [material.wax]', id="missing-material-type"),
        pytest.param('mesh = "tetrahedron.ply"', "", 'missing key "mesh" in [[object]] 1', id="missing-mesh-key"),
        pytest.param('material = "wax"', "", 'missing key "material" in [[object]] 1', id="missing-material-key"),
        pytest.param('"environment"', '"enviroment"', '"type" in [[light]] 1 is "enviroment"', id="light-type"),
        pytest.param('"translucent"', '"glassy"', '"type" in [material.wax] is "glassy"', id="material-type"),
        pytest.param('"mm"', '"km"', '"unit" in [scene] is "km"; give one of "mm", "cm", "m", "inch"', id="unit"),
        pytest.param("[0.0, 0.5, 4.0]", "[0.0, 0.5]", '"position" in [camera] is [0.0, 0.5]', id="two-coordinates"),
        pytest.param("[0.0, 0.5, 4.0]", '"here"', '"position" in [camera] is "here"', id="text-for-a-vector"),
        pytest.param("[0.0, 0.5, 4.0]", "[0.0, nan, 4.0]", '"position" in [camera] is [0.0, nan, 4.0]', id="nan"),
        pytest.param("[0.0, 0.5, 4.0]", "[0.0, inf, 4.0]", '"position" in [camera] is [0.0, inf, 4.0]', id="inf"),
        pytest.param("30.0", "nan", '"fov" in [camera] is nan', id="nan-fov"),
        pytest.param("30.0", "0", '"fov" in [camera] is 0', id="zero-fov"),
        pytest.param("30.0", "180", '"fov" in [camera] is 180', id="flat-fov"),
        pytest.param("30.0", "-5", '"fov" in [camera] is -5', id="negative-fov"),
        pytest.param("30.0", "true", '"fov" in [camera] is True', id="boolean-for-a-number"),
        pytest.param("30.0", "1" + 400 * "0", '"fov" in [camera] is 1000', id="integer-beyond-float"),
        pytest.param("[40, 30]", "[0, 30]", '"resolution" in [camera] is [0, 30]', id="no-width"),
        pytest.param("[40, 30]", "[40, -1]", '"resolution" in [camera] is [40, -1]', id="negative-height"),
        pytest.param("[40, 30]", "[40.5, 30]", '"resolution" in [camera] is [40.5, 30]', id="half-pixels"),
        pytest.param("[40, 30]", "[40]", '"resolution" in [camera] is [40]', id="one-dimension"),
        pytest.param("[40, 30]", "[1000000, 1000000]", '"resolution" in [camera]', id="too-many-pixels"),
        pytest.param("target = [0.0, 0.0, 0.0]", "target = [0.0, 0.5, 4.0]", "equals", id="camera-at-its-target"),
        pytest.param("up = [0.0, 1.0, 0.0]", "up = [0.0, -1.0, -8.0]", "parallel", id="camera-up-along-the-view"),
        pytest.param("up = [0.0, 1.0, 0.0]", "up = [0, 0, 0]", '"up" in [camera] is [0, 0, 0]', id="camera-up-zero"),
        pytest.param("radiance = 0.5", "radiance = -0.5", '"radiance" in [[light]] 1', id="negative-light"),
        pytest.param("radiance = 0.5", "radiance = [1, 2]", '"radiance" in [[light]] 1', id="two-channels"),
        pytest.param("radiance = 0.5", 'image = "no.exr"', "no.exr: there is no such environment image", id="no-image"),
        pytest.param("radiance = 0.5", 'image = "tetrahedron.ply"', "is no image of a kind", id="image-kind"),
        pytest.param('[[light]]\ntype = "environment"\nradiance = 0.5', "", "nothing would be lit", id="no-light"),
        pytest.param("[[light]]", "[light]", "[light] is one table; write [[light]]", id="light-not-a-list"),
        pytest.param("[[object]]", "[object]", "[object] is one table; write [[object]]", id="object-not-a-list"),
        pytest.param('material = "wax"', 'material = "wox"', 'did you mean "wax"?', id="unknown-material"),
        pytest.param('material = "wax"', "material = 3", '"material" in [[object]] 1 is 3', id="number-for-a-name"),
        pytest.param('"tetrahedron.ply"', '"tetra.ply"', "tetra.ply: there is no such mesh", id="missing-mesh"),
        pytest.param('"tetrahedron.ply"', '"scene.toml"', "scene.toml", id="mesh-kind"),
        pytest.param('"corner"', '"corner"\nnormals = "round"', 'give one of "flat", "smooth"', id="normals"),
        pytest.param('"corner"', '"corner"\nshader = "fast"', '"shader" in [[object]] 1 is "fast"', id="shader"),
        pytest.param('"corner"', '"corner"\nhole_handling = "x"', '"hole_handling" in [[object]] 1', id="handling"),
        pytest.param(
            '"corner"', '"corner"\ntransform = { scale = 0 }', '"scale" in "transform" of [[object]] 1', id="flat-scale"
        ),
        pytest.param('"corner"', '"corner"\ntransform = 3', '"transform" of [[object]] 1 is 3', id="transform-type"),
        pytest.param(
            '"corner"',
            '"corner"\ntransform = { scale = 1e308, rotate = [1, 1, 1, 45], translate = [1e308, 1e308, 1e308] }',
            "not finite",
            id="transform-overflows",
        ),
    ],
)
def test_bad_scene_is_refused_in_one_line(folder, old, new, said):
    line = refusal(folder.write(old, new))
    assert said in line
    assert str(folder.path) in line


@pytest.mark.parametrize("old", ["radiance = 0.5", '"tetrahedron.ply"'], ids=["image", "mesh"])
@pytest.mark.parametrize("name", ["x" * 300, "\\u0000", "."], ids=["too-long", "null", "folder"])
def test_name_that_no_file_can_have_is_refused(folder, old, name):
    new = f'image = "{name}.exr"' if "radiance" in old else f'"{name}.ply"'
    assert "there is no such" in refusal(folder.write(old, new))


@pytest.mark.parametrize(
    ("light", "said"),
    [
        pytest.param('type = "point"\nposition = [0, 0, 0]', 'missing key "intensity"', id="point-without-intensity"),
        pytest.param('type = "point"\nposition = [0, 0, 0]\nintensity = -1', '"intensity"', id="negative-intensity"),
        pytest.param('type = "directional"\ndirection = [0, 0, 0]\nirradiance = 1', '"direction"', id="no-direction"),
        pytest.param('type = "sphere"\ncenter = [0, 0, 0]\nradius = 0\nradiance = 1', '"radius"', id="no-radius"),
        pytest.param('type = "point"\nradius = 1', 'unknown key "radius" in [[light]] 2 (point)', id="foreign-key"),
    ],
)
def test_bad_light_is_refused(folder, light, said):
    assert said in refusal(folder.write(more=f"[[light]]\n{light}\n"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        pytest.param("half = [1, 1]", "half = [1, 0]", '"half" in [[light]] 2 (rectangle)', id="no-height"),
        pytest.param("target = [0, 0, 0]", "target = [0, 3, 0]", '"center" equals "target"', id="no-direction"),
        pytest.param("half = [1, 1]", "half = [1, 1]\nup = [0, 2, 0]", "parallel", id="up-along-the-light"),
    ],
)
def test_bad_rectangle_is_refused(folder, old, new, said):
    light = '[[light]]\ntype = "rectangle"\ncenter = [0, 3, 0]\ntarget = [0, 0, 0]\nhalf = [1, 1]\nradiance = 1\n'
    assert said in refusal(folder.write(more=light.replace(old, new)))


def test_two_objects_of_one_name_are_refused(folder):
    line = refusal(folder.write(more='[[object]]\nname = "corner"\nmesh = "tetrahedron.ply"\nmaterial = "wax"\n'))
    assert 'two objects have the name "corner"' in line


def test_scene_without_objects_is_refused(folder):
    folder.file.write_text(folder.write().read_text().split("[[object]]")[0])
    assert "nothing to render" in refusal(folder.file)


def test_scene_without_camera_is_refused(folder):
    folder.file.write_text("[scene]\n")
    assert "missing table [camera]" in refusal(folder.file)


def test_missing_scene_file_is_refused(tmp_path):
    assert "there is no such scene file" in refusal(tmp_path / "nowhere.toml")


def test_folder_for_a_scene_is_refused(tmp_path):
    assert "cannot be read" in refusal(tmp_path)


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe\x00", b"a = " + b"[" * 100_000, b"a = " + b"1" * 5000],
    ids=["not-utf8", "nested-without-end", "number-without-end"],
)
def test_file_that_is_no_toml_is_refused(folder, content):
    folder.file.write_bytes(content)
    assert "is no valid TOML" in refusal(folder.file)


def test_mesh_without_faces_is_refused(folder):
    header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
    (folder.path / "tetrahedron.ply").write_text(header)
    assert "tetrahedron.ply" in refusal(folder.write())


def test_mesh_shrunk_to_a_point_is_refused(folder):
    file = folder.path / "tetrahedron.ply"
    file.write_text(re.sub(r"(?m)^[01] [01] [01]$", "1 1 1", file.read_text()))
    assert "no extent" in refusal(folder.write())


def test_mesh_with_nan_is_refused(folder):
    file = folder.path / "tetrahedron.ply"
    file.write_text(file.read_text().replace("1 0 0\n", "nan 0 0\n"))
    assert "not finite" in refusal(folder.write())


def test_truncated_mesh_is_refused(folder):
    file = folder.path / "tetrahedron.ply"
    file.write_text(file.read_text()[:-20])
    assert "tetrahedron.ply" in refusal(folder.write())
