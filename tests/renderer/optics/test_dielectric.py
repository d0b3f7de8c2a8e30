import numpy as np
import pytest

from renderer.optics.dielectric import (
    boundary_mismatch,
    diffuse_external_reflectance,
    diffuse_internal_reflectance,
    fresnel_reflectance,
    transmittance,
)


def test_normal_incidence_reflects_the_squared_ratio():
    for eta in (1.3, 1.5, 1 / 1.5):
        reflectance, refracted = fresnel_reflectance(np.array([1.0]), eta)
        assert reflectance == pytest.approx(((eta - 1) / (eta + 1)) ** 2, rel=1e-12)
        assert refracted == pytest.approx(1, rel=1e-12)


def test_the_refracted_cosine_obeys_snell():
    cosine = np.linspace(0, 1, 101)
    _, refracted = fresnel_reflectance(cosine, 1.4)
    np.testing.assert_allclose(1.4**2 * (1 - refracted**2), 1 - cosine**2, atol=1e-12)


def test_a_matched_boundary_reflects_exactly_nothing():
    cosine = np.concatenate([[0], np.geomspace(1e-7, 1, 100_001)]).astype(np.float32)
    for eta in (1.0, np.ones_like(cosine)):
        reflectance, refracted = fresnel_reflectance(cosine, eta)
        assert not reflectance.any()
        np.testing.assert_array_equal(refracted[1:], cosine[1:])


def test_beyond_the_critical_angle_everything_is_reflected():
    critical = np.sqrt(1 - 1 / 1.5**2)
    cosine = np.array([0, 0.5 * critical, critical - 1e-9])
    reflectance, refracted = fresnel_reflectance(cosine, 1 / 1.5)
    np.testing.assert_array_equal(reflectance, 1)
    np.testing.assert_array_equal(refracted, 0)


def test_grazing_light_is_reflected_whole():
    for eta in (1.5, 1 / 1.5):
        assert fresnel_reflectance(np.zeros(1, np.float32), eta)[0] == 1


def test_reflectance_is_the_same_from_both_sides():
    cosine = np.linspace(0.01, 1, 50)
    outside, refracted = fresnel_reflectance(cosine, 1.5)
    inside, back = fresnel_reflectance(refracted, 1 / 1.5)
    np.testing.assert_allclose(inside, outside, rtol=1e-10)
    np.testing.assert_allclose(back, cosine, rtol=1e-10)


def test_at_brewsters_angle_only_one_polarisation_is_reflected():
    cosine = 1 / np.sqrt(1 + 1.5**2)
    across = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2
    assert fresnel_reflectance(np.array([cosine]), 1.5)[0] == pytest.approx(across / 2, rel=1e-12)


@pytest.mark.parametrize("eta", [1.5, np.float64(1.5), np.full(3, 1.5)])
def test_single_precision_stays_single(eta):
    for values in fresnel_reflectance(np.full(3, 0.5, np.float32), eta):
        assert values.dtype == np.float32
    assert transmittance(np.full(3, 0.5, np.float32), eta).dtype == np.float32


def test_single_precision_agrees_with_double():
    cosine = np.linspace(0, 1, 10_001)
    for eta in (1.0001, 1.33, 2.0, 1 / 1.33):
        exact = fresnel_reflectance(cosine, eta)[0]
        single = fresnel_reflectance(cosine.astype(np.float32), eta)[0]
        # the slope near grazing and critical angles turns half an ulp of the cosine into a thousandth
        np.testing.assert_allclose(single, exact, atol=2e-3)
        assert np.abs(single - exact).mean() < 2e-6


def test_the_input_is_left_alone():
    cosine = np.linspace(0, 1, 5)
    kept = cosine.copy()
    fresnel_reflectance(cosine, 1.5)
    np.testing.assert_array_equal(cosine, kept)


def walsh(n):
    """Closed form of the diffuse external reflectance (Walsh 1926; Duntley 1942)."""
    a, b = n * n + 1, n**4 - 1
    return (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / a**3 * np.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / (a * b)
        + 8 * n**4 * (n**4 + 1) / (a * b**2) * np.log(n)
    )


@pytest.mark.parametrize("eta", [1.05, 1.3, 1.5, 2.0, 3.0])
def test_diffuse_external_reflectance_is_walshs(eta):
    assert diffuse_external_reflectance(eta) == pytest.approx(walsh(eta), rel=1e-8)


@pytest.mark.parametrize(("eta", "external", "internal"), [(1.3, 0.0611, 0.4445), (1.5, 0.0918, 0.5964)])
def test_diffuse_reflectances_of_the_handbook(eta, external, internal):
    assert diffuse_external_reflectance(eta) == pytest.approx(external, abs=5e-5)
    # .59635 stands there as .5964: from the rounded Fe
    assert diffuse_internal_reflectance(eta) == pytest.approx(internal, abs=1e-4)


@pytest.mark.parametrize("eta", [1.1, 1.5, 2.2])
def test_internal_reflectance_by_reciprocity_is_the_integral(eta):
    """The identity 1 - rho_i = (1 - Fe)/eta^2 against direct quadrature of 2 int F mu dmu from inside."""
    cosine = (np.arange(200_000) + 0.5) / 200_000
    direct = np.mean(2 * cosine * fresnel_reflectance(cosine, 1 / eta)[0])
    # midpoint rule across the kink at the critical angle
    assert diffuse_internal_reflectance(eta) == pytest.approx(direct, abs=1e-5)
    assert diffuse_external_reflectance(1 / eta) == pytest.approx(direct, abs=1e-5)


def test_a_matched_boundary_has_no_mismatch():
    assert diffuse_external_reflectance(1.0) == 0
    assert boundary_mismatch(1.0) == 1
