import json

import numpy as np
import pytest

from renderer.optics.slab import diffusion, slab_reflectance, slab_transmittance


def scattered_reference(shared, albedo, eta, thicknesses):
    """Adding-doubling slabs at normal incidence, isotropic: scattered R and T per flux that entered."""
    slabs = json.loads((shared / "reference" / "analytic.json").read_text())["slabs_iadpython"]
    specular = ((eta - 1) / (eta + 1)) ** 2
    for slab in slabs:
        if (slab["albedo"], slab["n"], slab["g"]) == (albedo, eta, 0.0) and slab["tau"] in thicknesses:
            once = np.exp(-slab["tau"])
            # unscattered light, going to and fro between the faces
            round_trips = (1 - specular) ** 2 / (1 - (specular * once) ** 2)
            through = slab["T_normal"] - round_trips * once
            back = slab["R_normal"] - specular - specular * round_trips * once**2
            yield slab["tau"], back / (1 - specular), through / (1 - specular)


@pytest.mark.parametrize("eta", [1.0, 1.33, 1.5])
@pytest.mark.parametrize("albedo", [0.99, 0.999])
def test_whitish_slabs_are_those_of_adding_doubling(shared, albedo, eta):
    """Diffusion's own error: 4 % up to sixteen mean free paths."""
    found = list(scattered_reference(shared, albedo, eta, (1, 4, 16)))
    assert len(found) == 3
    for thickness, back, through in found:
        assert slab_transmittance(thickness, 1.0, albedo, eta) == pytest.approx(through, rel=0.04)
        assert slab_reflectance(thickness, 1.0, albedo, eta) == pytest.approx(back, rel=0.02)


@pytest.mark.parametrize("eta", [1.0, 1.33, 1.5])
def test_very_thick_white_slabs_are_off_by_at_most_five_percent(shared, eta):
    """At 64 paths diffusion's decay length is a per mille off, which the exponential shows: 4.5 % at 1.33."""
    ((thickness, _, through),) = scattered_reference(shared, 0.999, eta, (64,))
    assert slab_transmittance(thickness, 1.0, 0.999, eta) == pytest.approx(through, rel=0.05)


@pytest.mark.parametrize("eta", [1.0, 1.33, 1.5])
def test_absorbing_slabs_are_off_by_at_most_17_percent(shared, eta):
    for thickness, back, through in scattered_reference(shared, 0.9, eta, (1, 4)):
        assert slab_transmittance(thickness, 1.0, 0.9, eta) == pytest.approx(through, rel=0.17)
        assert slab_reflectance(thickness, 1.0, 0.9, eta) == pytest.approx(back, rel=0.17)


@pytest.mark.parametrize("slant", [1.0, 1.3])
@pytest.mark.parametrize("thickness", [0.1, 3.0, 100.0])
def test_without_absorption_what_scatters_comes_out(thickness, slant):
    total = slab_transmittance(thickness, slant, 1.0, 1.5) + slab_reflectance(thickness, slant, 1.0, 1.5)
    assert total == pytest.approx(1 - np.exp(-slant * thickness), rel=1e-9)


def test_a_thick_slab_decays_as_the_handbook_says():
    albedo, eta, slant, thickness = 0.95, 1.5, 1.2, 40.0
    k, z_b = diffusion(albedo, eta)
    limit = (
        2 * albedo * k * slant * (1 + slant * z_b) / ((slant**2 - k**2) * (1 + k * z_b) ** 2) * np.exp(-k * thickness)
    )
    # the next term is exp(-2 k d) smaller, the unscattered one exp(-(s - k) d)
    assert slab_transmittance(thickness, slant, albedo, eta) == pytest.approx(limit, rel=1e-5)


def test_a_white_slab_follows_one_over_thickness():
    _, z_b = diffusion(1.0, 1.5)
    thickness = np.array([30.0, 300.0])
    # exp(-30) is what the limit neglects
    np.testing.assert_allclose(
        slab_transmittance(thickness, 1.25, 1.0, 1.5), (1 / 1.25 + z_b) / (thickness + 2 * z_b), rtol=1e-9
    )


def test_the_limit_of_no_absorption_is_smooth():
    nearly = slab_transmittance(10.0, 1.0, 1 - 1e-12, 1.4)
    assert nearly == pytest.approx(slab_transmittance(10.0, 1.0, 1.0, 1.4), rel=1e-6)


def test_quadrature_agrees_with_a_fine_sum():
    """psi(z) written out, summed over a hundred thousand layers."""
    albedo, eta, s, d = 0.8, 1.3, 1.4, 2.0
    k, z_b = diffusion(albedo, eta)
    z = (np.arange(100_000) + 0.5) * d / 100_000
    below = (1 + k**2 * z_b**2) * np.sinh(k * d) + 2 * k * z_b * np.cosh(k * d)
    leaving = (np.sinh(k * z) + k * z_b * np.cosh(k * z)) / below
    first = albedo * s * np.exp(-s * z) * d / 100_000
    assert slab_transmittance(d, s, albedo, eta) == pytest.approx(np.sum(first * leaving), rel=1e-8)
    assert slab_reflectance(d, s, albedo, eta) == pytest.approx(np.sum(first * leaving[::-1]), rel=1e-8)
