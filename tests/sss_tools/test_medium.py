import json

import numpy as np
import pytest

from sss_tools.medium import PRESETS, UNITS, Medium, diffuse_reflectance, reduced_albedo_of_color


def test_coefficients_add_up():
    medium = Medium.from_coefficients([0.1, 0.2, 0.3], [0.9, 1.8, 2.7], g=0.5)
    assert medium.sigma_t == pytest.approx([1, 2, 3])
    assert medium.single_scattering_albedo == pytest.approx([0.9] * 3)
    assert medium.mean_free_path == pytest.approx([1, 1 / 2, 1 / 3])
    assert medium.reduced_scattering == pytest.approx([0.45, 0.9, 1.35])
    assert medium.reduced_extinction == pytest.approx([0.55, 1.1, 1.65])
    assert medium.reduced_albedo == pytest.approx([9 / 11] * 3)
    assert medium.transport_mean_free_path == pytest.approx([1 / 0.55, 1 / 1.1, 1 / 1.65])


def test_one_number_serves_all_channels():
    assert Medium.from_albedo(0.9, 2.0) == Medium.from_albedo([0.9] * 3, [2.0] * 3)


def test_albedo_and_extinction_come_back():
    medium = Medium.from_albedo([1.0, 0.5, 0.0], 4.0, g=-0.3, ior=1.3)
    assert medium.single_scattering_albedo == pytest.approx([1, 0.5, 0])
    assert medium.sigma_t == pytest.approx([4] * 3)
    assert (medium.g, medium.ior) == (-0.3, 1.3)


def test_authored_extinction_is_achromatic_whatever_the_albedo():
    assert Medium.from_albedo([0.999, 0.7, 0.123456789], 0.1 + 0.2).is_achromatic
    assert not Medium.from_albedo(0.9, [1, 1, 1.001]).is_achromatic


@pytest.mark.parametrize("g", [0.0, 0.8, -0.5])
def test_color_and_radius_become_reduced_coefficients(g):
    """The radius is the transport mean free path, and g takes no part in the reduced albedo."""
    medium = Medium.from_color([0.8, 0.5, 0.1], [1.0, 0.5, 0.25], g=g)
    assert medium.transport_mean_free_path == pytest.approx([1.0, 0.5, 0.25])
    assert medium.reduced_albedo == pytest.approx(reduced_albedo_of_color([0.8, 0.5, 0.1]))
    assert medium.reduced_scattering == pytest.approx((1 - g) * medium.sigma_s)


def test_color_inverts_the_matched_reflectance():
    """Two independent fits, in error by 0.003 (van de Hulst) and about 0.002 (d'Eon) in A."""
    color = np.linspace(0.01, 0.97, 49)
    found = [diffuse_reflectance(Medium.from_color(c, 1.0, ior=1.0))[0] for c in color]
    assert np.abs(np.array(found) - color).max() < 0.005


@pytest.mark.parametrize(
    ("reflectance", "albedo", "error"),
    # Monte Carlo of a half-space under diffuse light, matched boundary; the fit is off by 0.007 at most
    [(0.1465, 0.5, 0.007), (0.4780, 0.9, 0.007), (0.7946, 0.99, 0.001), (0.9297, 0.999, 0.0002)],
)
def test_color_of_a_known_albedo_finds_it(reflectance, albedo, error):
    assert reduced_albedo_of_color(reflectance)[0] == pytest.approx(albedo, abs=error)


def test_white_stays_white():
    """The whites are where another well-known fit goes dark: it gives 0.9974 for a reflectance of 0.929."""
    assert reduced_albedo_of_color(0.929)[0] == pytest.approx(0.9990, abs=5e-5)


@pytest.mark.parametrize("ior", [1.0, 1.33, 1.5])
def test_reflectance_of_half_spaces_is_that_of_adding_doubling(shared, ior):
    """The reference includes the specular part; errors of the forward map as its sources state them."""
    reference = json.loads((shared / "reference" / "analytic.json").read_text())["half_space_iadpython"]
    seen = 0
    for row in reference:
        if row["g"] != 0 or row["n"] != ior or row["albedo"] < 0.9:
            continue
        medium = Medium.from_albedo(row["albedo"], 1.0, ior=ior)
        lossless = Medium.from_albedo(1.0, 1.0, ior=ior)
        specular = 1 - diffuse_reflectance(lossless)[0]  # a lossless body returns all but the specular part
        allowed = 0.003 if ior == 1 else 0.03 if row["albedo"] == 0.9 else 0.014
        assert diffuse_reflectance(medium)[0] + specular == pytest.approx(row["R_diffuse"], abs=allowed)
        seen += 1
    assert seen >= 3


@pytest.mark.parametrize(("ior", "external"), [(1.3, 0.0611), (1.5, 0.0918)])
def test_a_lossless_body_returns_what_enters(ior, external):
    assert diffuse_reflectance(Medium.from_albedo(1.0, 1.0, ior=ior)) == pytest.approx([1 - external] * 3, abs=5e-5)


def test_presets_are_the_published_table(shared):
    table = json.loads((shared / "reference" / "analytic.json").read_text())["jensen2001"]
    rows = {name.lower(): row for name, row in table.items() if isinstance(row, dict) and "sigma_a" in row}
    assert set(rows) == set(PRESETS)
    assert len(PRESETS) == 12
    for name, row in rows.items():
        medium = Medium.preset(name)
        assert medium.sigma_a.tolist() == row["sigma_a"]
        assert medium.reduced_scattering.tolist() == row["sigma_s_prime"]
        assert medium.ior == row["eta"]
        assert medium.g == 0
        # printed with six digits
        assert medium.single_scattering_albedo == pytest.approx(row["albedo"], abs=6e-7)


def test_the_mean_free_path_of_a_preset_does_not_depend_on_the_unit():
    in_mm = Medium.preset("marble", "mm").mean_free_path
    for unit, mm in UNITS.items():
        assert Medium.preset("marble", unit).mean_free_path * mm == pytest.approx(in_mm)
    assert Medium.preset("marble", "m").sigma_a[0] == pytest.approx(2.1)
    assert Medium.preset("marble", "inch").ior == 1.5


@pytest.mark.parametrize(
    ("build", "named"),
    [
        (lambda: Medium.from_coefficients([-1, 1, 1], 1), "sigma_a"),
        (lambda: Medium.from_coefficients(1, [1, np.nan, 1]), "sigma_s"),
        (lambda: Medium.from_coefficients(1, np.inf), "sigma_s"),
        (lambda: Medium.from_coefficients(0, [1, 0, 1]), "both 0"),
        (lambda: Medium.from_coefficients([1, 2], 1), "one number or three"),
        (lambda: Medium.from_coefficients("red", 1), "one number or three"),
        (lambda: Medium.from_albedo(1.1, 1), "albedo"),
        (lambda: Medium.from_albedo(-0.1, 1), "albedo"),
        (lambda: Medium.from_albedo(0.5, 0), "sigma_t"),
        (lambda: Medium.from_color(1.0, 1), "color"),
        (lambda: Medium.from_color(-0.1, 1), "color"),
        (lambda: Medium.from_color(0.5, 0), "radius"),
        (lambda: Medium.from_color(0.5, 1, g=1), "g is 1"),
        (lambda: Medium.from_albedo(0.5, 1, g=-1), "g is -1"),
        (lambda: Medium.from_albedo(0.5, 1, ior=0.9), "ior"),
        (lambda: Medium.from_albedo(0.5, 1, ior=np.nan), "ior"),
        (lambda: Medium.preset("Marble"), "marble"),
        (lambda: Medium.preset("marble", "yard"), "inch"),
    ],
)
def test_values_out_of_range_are_named(build, named):
    with pytest.raises(ValueError, match=named) as caught:
        build()
    assert "\n" not in str(caught.value)
