"""Materials from their tables."""

from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from renderer.scene.materials import read_material
from sss_tools.errors import InputError
from sss_tools.keys import Place
from sss_tools.medium import Medium

PLACE = Place(Path("scene.toml"), "[material.wax]")


def medium(unit="mm", **table) -> Medium:
    return read_material({"type": "translucent", **table}, unit, PLACE).medium


def test_coefficients_arrive_as_they_are():
    made = medium(sigma_a=0.1, sigma_s=[1, 2, 3], g=0.5, ior=1.3)
    assert_allclose(made.sigma_a, 0.1)
    assert_allclose(made.sigma_s, [1, 2, 3])
    assert (made.g, made.ior) == (0.5, 1.3)


def test_albedo_and_extinction_are_one_way():
    made = medium(albedo=[0.9, 0.8, 0.7], sigma_t=10)
    assert_allclose(made.sigma_s, [9, 8, 7])
    assert made.ior == 1.5


def test_color_and_radius_are_one_way():
    made = medium(color=0.5, radius=[1, 2, 4], g=0.3)
    assert_allclose(made.transport_mean_free_path, [1, 2, 4])
    assert_allclose(made.reduced_albedo, Medium.from_color(0.5, 1.0).reduced_albedo)


def test_coefficients_are_per_scene_unit_whatever_the_unit():
    assert medium("cm", sigma_a=1, sigma_s=2) == medium("mm", sigma_a=1, sigma_s=2)


def test_preset_is_converted_by_the_unit():
    # marble, Jensen et al. 2001: sigma_s' = 2.19 /mm in red, so 21.9 /cm
    assert_allclose(medium("cm", preset="marble").sigma_s[0], 21.9)
    assert medium("mm", preset="marble") == Medium.preset("marble")


def test_preset_keeps_its_index_unless_another_is_given():
    assert medium(preset="skin1").ior == 1.3
    assert medium(preset="skin1", ior=1.4).ior == 1.4


def test_preset_with_another_g_keeps_its_reduced_scattering():
    made = medium(preset="marble", g=0.8)
    assert made.g == 0.8
    assert_allclose(made.reduced_scattering, [2.19, 2.62, 3.00])
    assert_allclose(made.sigma_a, [0.0021, 0.0041, 0.0071])


def test_key_beside_a_preset_overrides_it_alone():
    marble = Medium.preset("marble")
    assert_allclose(medium(preset="marble", sigma_a=0.5).sigma_a, 0.5)
    assert_allclose(medium(preset="marble", sigma_a=0.5).sigma_s, marble.sigma_s)
    assert_allclose(medium(preset="marble", sigma_t=7).single_scattering_albedo, marble.single_scattering_albedo)
    assert_allclose(medium(preset="marble", albedo=0.5).sigma_t, marble.sigma_t)
    assert_allclose(medium(preset="marble", color=0.5).transport_mean_free_path, marble.transport_mean_free_path)


def test_roughness_is_of_the_boundary():
    assert read_material({"type": "translucent", "preset": "marble", "roughness": 0.3}, "mm", PLACE).roughness == 0.3


@pytest.mark.parametrize(
    ("table", "said"),
    [
        pytest.param({}, "says no medium", id="nothing"),
        pytest.param({"sigma_a": 1}, 'missing key "sigma_s" in [material.wax]', id="half-of-a-way"),
        pytest.param({"color": 0.5}, 'missing key "radius"', id="color-alone"),
        pytest.param({"preset": "marble", "radius": 2}, 'missing key "color"', id="radius-beside-a-preset"),
        pytest.param({"albedo": 0.5, "sigma_s": 1}, 'says its medium twice, by "sigma_s" and "albedo"', id="two-ways"),
        pytest.param({"preset": "marbel"}, '"preset" in [material.wax] (translucent) is "marbel"', id="preset"),
        pytest.param({"sigma_a": -1, "sigma_s": 1}, '"sigma_a" in', id="negative-absorption"),
        pytest.param({"sigma_a": 1, "sigma_s": [1, -1, 1]}, '"sigma_s" in', id="negative-scattering"),
        pytest.param({"sigma_a": float("nan"), "sigma_s": 1}, '"sigma_a" in', id="nan"),
        pytest.param({"sigma_a": [1, 2], "sigma_s": 1}, '"sigma_a" in', id="two-channels"),
        pytest.param({"albedo": 1.1, "sigma_t": 1}, '"albedo" in', id="albedo-above-one"),
        pytest.param({"albedo": 0.5, "sigma_t": 0}, "in [material.wax], sigma_t is 0", id="vacuum"),
        pytest.param({"sigma_a": 0, "sigma_s": 0}, "must absorb or scatter", id="nothing-inside"),
        pytest.param({"color": 1, "radius": 1}, "in [material.wax], color is 1", id="white"),
        pytest.param({"color": 0.5, "radius": 0}, '"radius" in', id="no-radius"),
        pytest.param({"preset": "marble", "g": 1}, '"g" in', id="g-of-one"),
        pytest.param({"preset": "marble", "g": [0, 0, 0]}, '"g" in', id="g-per-channel"),
        pytest.param({"preset": "marble", "ior": 0.9}, '"ior" in', id="ior-below-one"),
        pytest.param({"preset": "marble", "roughness": -0.1}, '"roughness" in', id="negative-roughness"),
        pytest.param({"preset": "marble", "roughness": 1.5}, '"roughness" in', id="roughness-above-one"),
        pytest.param({"preset": "marble", "sigma_x": 1}, 'unknown key "sigma_x"', id="unknown-key"),
    ],
)
def test_bad_medium_is_refused_naming_the_material(table, said):
    with pytest.raises(InputError) as caught:
        medium(**table)
    assert said in caught.value.line()
    assert "material.wax" in caught.value.line()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        pytest.param({"type": "diffuse"}, 'missing key "reflectance"', id="diffuse-without-reflectance"),
        pytest.param({"type": "diffuse", "reflectance": 1.5}, '"reflectance" in', id="brighter-than-its-light"),
        pytest.param({"type": "mirror", "reflectance": -1}, '"reflectance" in', id="negative-mirror"),
        pytest.param({"type": "mirror", "ior": 1.5}, 'unknown key "ior"', id="mirror-with-an-ior"),
        pytest.param("marble", '[material.wax] is "marble"', id="no-table"),
    ],
)
def test_bad_opaque_material_is_refused(table, said):
    with pytest.raises(InputError) as caught:
        read_material(table, "mm", PLACE)
    assert said in caught.value.line()
