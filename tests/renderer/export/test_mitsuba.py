"""What the export says, number by number. Whether Mitsuba means the same by it: test_mitsuba_pictures.py."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from renderer.export.mitsuba import rectangle_to_world, to_mitsuba
from renderer.scene.admission import admit
from renderer.scene.description import (
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
    SphereLight,
)
from renderer.scene.lights import RectangleSource
from sss_tools.ply import read_ply
from sss_tools.rays import UnitFrame
from sss_tools.shapes import box, hollow_ball, icosphere, joined, moved, punctured
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, mirror, placed, scene, translucent

VIEW = camera((0, 1, 6), fov=26, resolution=(24, 20))


def exported(objects=None, lights=(WHITE_SKY,), view=VIEW, **how):
    objects = [placed(icosphere(1.0, 2), translucent())] if objects is None else objects
    admitted, _ = admit(scene(objects, lights, view))
    export = to_mitsuba(admitted, "files", how.pop("passes", 16), **how)
    # as Mitsuba would get it
    export.document = ET.fromstring(ET.tostring(export.document))
    return export


def value(element, name):
    """The numbers, or the text, of the one property of that name."""
    (found,) = (child for child in element if child.get("name") == name)
    if found.tag == "point":
        return [float(found.get(axis)) for axis in "xyz"]
    try:
        numbers = [float(part) for part in found.get("value").split(",")]
    except ValueError:
        return found.get("value")
    return numbers if len(numbers) > 1 else numbers[0]


def only(element, tag):
    (found,) = element.findall(tag)
    return found


def test_camera_has_the_vertical_angle_the_size_and_a_box_filter():
    root = exported(view=camera((1, 2, 6), (0.1, 0.2, 0.3), fov=31.5, resolution=(24, 20)), passes=77, seed=5).document
    sensor = only(root, "sensor")
    assert (value(sensor, "fov_axis"), value(sensor, "fov")) == ("y", 31.5)
    look = only(only(sensor, "transform"), "lookat")
    assert [look.get(name) for name in ("origin", "target", "up")] == [
        "1.0, 2.0, 6.0",
        "0.1, 0.2, 0.3",
        "0.0, 1.0, 0.0",
    ]
    film = only(sensor, "film")
    assert (value(film, "width"), value(film, "height"), only(film, "rfilter").get("type")) == (24, 20, "box")
    assert value(only(sensor, "sampler"), "sample_count") == "$spp"
    assert value(only(sensor, "sampler"), "seed") == 5
    assert {child.get("name"): child.get("value") for child in root.findall("default")}["spp"] == "77"


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_everything_lies_between_the_cameras_clipping_distances(size):
    ball = placed(moved(icosphere(size, 2), (0, 0, -8 * size)), diffuse(0.5))
    light = SphereLight(np.array([0.0, 0, -30 * size]), 2 * size, np.ones(3))
    sensor = only(exported([ball], [light], camera((0, 0, 0), (0, 0, -size))).document, "sensor")
    assert value(sensor, "near_clip") <= 0.02 * 7 * size and value(sensor, "far_clip") >= 32 * size


def test_media_are_albedo_and_extinction_and_the_air_has_index_one():
    material = translucent((0.9, 0.5, 0.2), (3, 4, 5), g=0.8, ior=1.3)
    root = exported([placed(icosphere(1.0, 1), material)]).document
    shape = only(root, "shape")
    medium = only(shape, "medium")
    assert medium.get("name") == "interior"
    np.testing.assert_allclose(value(medium, "albedo"), [0.9, 0.5, 0.2])
    np.testing.assert_allclose(np.multiply(value(medium, "sigma_t"), value(medium, "scale")), [3, 4, 5])
    assert max(value(medium, "sigma_t")) <= 1
    assert value(medium, "has_spectral_extinction") == "true"
    assert only(root, "integrator").get("type") == "volpathmis"
    assert (only(medium, "phase").get("type"), value(only(medium, "phase"), "g")) == ("hg", 0.8)
    bsdf = only(shape, "bsdf")
    assert (bsdf.get("type"), value(bsdf, "int_ior"), value(bsdf, "ext_ior")) == ("dielectric", 1.3, 1)


def test_one_extinction_for_all_channels_takes_the_plain_integrator_without_a_bound_on_depth():
    root = exported().document
    integrator = only(root, "integrator")
    assert (integrator.get("type"), value(integrator, "max_depth")) == ("volpath", -1)
    assert only(only(only(root, "shape"), "medium"), "phase").get("type") == "isotropic"


def test_boundaries_are_ggx_or_nothing_at_all():
    rough, matched = (
        only(only(exported([placed(icosphere(1.0, 1), material)]).document, "shape"), "bsdf")
        for material in (translucent(roughness=0.25), translucent(ior=1.0))
    )
    assert (rough.get("type"), value(rough, "distribution"), value(rough, "alpha")) == ("roughdielectric", "ggx", 0.25)
    assert matched.get("type") == "null"


def test_opaque_surfaces_have_two_sides():
    for material, kind, name in ((diffuse((0.1, 0.2, 0.3)), "diffuse", "reflectance"),
                                 (mirror((0.1, 0.2, 0.3)), "conductor", "specular_reflectance")):  # fmt: skip
        bsdf = only(only(exported([placed(box(), material)]).document, "shape"), "bsdf")
        assert bsdf.get("type") == "twosided"
        assert only(bsdf, "bsdf").get("type") == kind
        assert value(only(bsdf, "bsdf"), name) == [0.1, 0.2, 0.3]


def test_lights_have_their_numbers():
    lights = [
        PointLight(np.array([1.0, 2, 3]), np.array([4.0, 5, 6])),
        DirectionalLight(np.array([1.0, -2, 0.5]), np.array([0.7, 0.8, 0.9])),
        SphereLight(np.array([0.0, 4, 0]), 0.25, np.array([7.0, 8, 9])),
    ]
    root = exported([placed(box(), diffuse(0.5))], lights).document
    point, beam = root.findall("emitter")
    assert (value(point, "position"), value(point, "intensity")) == ([1, 2, 3], [4, 5, 6])
    assert (value(beam, "direction"), value(beam, "irradiance")) == ([1, -2, 0.5], [0.7, 0.8, 0.9])
    (sphere,) = (shape for shape in root.findall("shape") if shape.get("type") == "sphere")
    assert (value(sphere, "center"), value(sphere, "radius")) == ([0, 4, 0], 0.25)
    assert value(only(sphere, "emitter"), "radiance") == [7, 8, 9]
    assert value(only(sphere, "bsdf"), "reflectance") == [0, 0, 0]


def test_rectangle_has_the_corners_that_the_tracer_gives_it():
    light = RectangleLight(
        np.array([1.0, 3, 2]), np.array([0.0, 0.5, 0]), np.array([0.0, 1, 0.2]), (0.5, 0.25), np.ones(3)
    )
    corners = np.array([(-1, -1, 0, 1), (1, -1, 0, 1), (1, 1, 0, 1), (-1, 1, 0, 1)]) @ rectangle_to_world(light).T
    traced = RectangleSource(light, UnitFrame(np.zeros(3), 1.0))
    np.testing.assert_allclose(corners[:, :3], traced.vertices, atol=1e-12)
    towards = rectangle_to_world(light)[:3, 2]
    assert towards @ (light.target - light.center) > 0


def test_constant_environments_add_up():
    lights = [EnvironmentLight(radiance=np.array([0.1, 0.2, 0.3])), EnvironmentLight(radiance=np.array([1.0, 1, 1]))]
    emitter = only(exported(lights=lights).document, "emitter")
    np.testing.assert_allclose(value(emitter, "radiance"), [1.1, 1.2, 1.3])


def test_meshes_are_written_as_they_stand_in_the_scene():
    shape = moved(icosphere(1.0, 2), (0.1, 0.7, 0))
    export = exported([placed(shape, translucent(), name="a ball, $x/../")])
    (name,) = export.files
    assert name == "files/00_a-ball-x.ply"
    vertices, faces, attributes = read_ply(export.files[name])
    np.testing.assert_array_equal(vertices, shape.vertices)
    np.testing.assert_array_equal(faces, shape.faces)
    assert not attributes
    assert value(only(export.document, "shape"), "filename") == name


def test_smooth_normals_go_with_opaque_meshes_only():
    ball = icosphere(1.0, 2)
    for material, smooth in ((diffuse(0.5), True), (translucent(), False)):
        export = exported([placed(ball, material, normals="smooth")])
        _, _, attributes = read_ply(next(iter(export.files.values())))
        assert ("normal" in attributes) == smooth
        assert value(only(export.document, "shape"), "face_normals") == ("false" if smooth else "true")


def test_a_plain_scene_gives_no_warning():
    assert exported().warnings == []


@pytest.mark.parametrize(
    "objects, lights, words",
    [
        ([placed(icosphere(1.0, 2), translucent(), name="one"),
          placed(moved(icosphere(0.5, 2), (0.9, 0, 0)), translucent(), name="two")], [WHITE_SKY],
         "one and two overlap"),
        ([placed(icosphere(1.0, 2), translucent(), name="one"), placed(icosphere(0.5, 2), translucent(), name="two")],
         [WHITE_SKY], "one and two overlap"),
        ([placed(punctured(icosphere(1.0, 3), [(0, 0, 1)], 0.2), translucent(), name="one")], [WHITE_SKY],
         "one is not closed"),
        ([placed(moved(icosphere(1e-3, 2), (50, 0, 0)), translucent(sigma_t=1e4), name="one")], [WHITE_SKY],
         "scale the scene up"),
        ([placed(icosphere(1.0, 2), translucent(), name="one")],
         [PointLight(np.array([0.0, 3, 0]), np.ones(3))], "no light of point"),
    ],
)  # fmt: skip
def test_what_mitsuba_does_otherwise_is_one_warning(objects, lights, words):
    (warning,) = exported(objects, lights, camera((0, 1, 60))).warnings
    assert words in warning


def test_neighbours_and_a_ball_in_a_cavity_do_not_overlap():
    apart = [placed(icosphere(1.0, 2), translucent()), placed(moved(box(), (1.2, 1.2, 1.2)), translucent())]
    nested = [placed(hollow_ball(1.0, 0.5), translucent()), placed(icosphere(0.3, 2), translucent())]
    assert exported(apart).warnings == exported(nested).warnings == []
    # a mesh of several bodies is one object
    assert (
        exported([placed(joined(icosphere(1.0, 2), moved(icosphere(1.0, 2), (3, 0, 0))), translucent())]).warnings == []
    )
