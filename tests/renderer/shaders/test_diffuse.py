import numpy as np
import pytest

from renderer.optics.dielectric import diffuse_external_reflectance, transmittance
from renderer.shaders import diffuse
from renderer.shaders.surface import BodyOptics
from sss_tools.medium import Medium, diffuse_reflectance
from sss_tools.shapes import box, icosphere, moved


def body_of(medium):
    return BodyOptics.prepare(0, medium, 1.0)


def test_exitance_is_the_half_spaces_under_a_beam(stage):
    medium = Medium.from_albedo([0.9, 0.99, 0.999], 50.0, ior=1.4)
    ball = icosphere(0.5, 3)
    light = stage.Directional([0.2, 0.4, 0.7], [1, 2, 3])
    points = stage.vertex_points(ball, 2.0)
    found = diffuse.exitance(stage.Objects(ball), points, body_of(medium), [light])
    x = np.maximum(light.towards @ points.normal, 0)
    lit = x > 0.1
    expected = x * transmittance(x, 1.4) / (1 - diffuse_external_reflectance(1.4))
    for channel in range(3):
        scale = (channel + 1) * diffuse_reflectance(medium)[channel]
        np.testing.assert_allclose(found[channel, lit], scale * expected[lit], rtol=1e-4)
        assert not found[channel, x == 0].any()


def test_light_from_everywhere_is_answered_with_the_diffuse_reflectance(stage):
    """Constant radiance 1 is irradiance pi; beams spread over the hemisphere must add up to the ambient answer."""
    medium = Medium.from_albedo(0.99, 50.0, ior=1.5)
    ball = icosphere(0.5, 2)
    point = stage.one_point([0, 0, 0.5], [0, 0, 1], 2.0)
    whole = diffuse.exitance(stage.Objects(ball), point, body_of(medium), [stage.Ambient()])
    np.testing.assert_allclose(whole[:, 0], np.pi * diffuse_reflectance(medium), rtol=1e-5)
    cosines = (np.arange(400) + 0.5) / 400
    beams = [stage.Directional([np.sqrt(1 - z * z), 0, z], np.full(3, 2 * np.pi / 400)) for z in cosines]
    added = diffuse.exitance(stage.Objects(ball), point, body_of(medium), beams)
    # midpoint rule over 400 rings
    np.testing.assert_allclose(added, whole, rtol=1e-3)


def test_a_matched_white_surface_is_lambertian(stage):
    ball = icosphere(0.5, 2)
    medium = Medium.from_coefficients(sigma_a=0.0, sigma_s=10.0, ior=1.0)
    found = diffuse.exitance(stage.Objects(ball), stage.one_point([0, 0, 0.5], [0, 0, 1], 2.0), body_of(medium),
                             [stage.Directional([0, 0.6, 0.8])])  # fmt: skip
    np.testing.assert_allclose(found[:, 0], 0.8, rtol=1e-5)


def test_shadows_are_black(stage):
    ball, screen = icosphere(0.5, 3), moved(box((3.0, 3.0, 0.1)), (0, 0, 1.5))
    body = body_of(Medium.from_albedo(0.99, 50.0))
    points = stage.vertex_points(ball, 2.0)
    assert not diffuse.exitance(stage.Objects(ball, screen), points, body, [stage.Directional([0, 0, 1])]).any()
    assert diffuse.exitance(stage.Objects(ball, screen), points, body, [stage.Point([0, 0, 1.4])]).any()


@pytest.mark.parametrize("dtype", [np.float32])
def test_results_are_single_precision(stage, dtype):
    ball = icosphere(0.5, 1)
    body = body_of(Medium.from_albedo(0.99, 50.0))
    lights = [stage.Directional([0, 0, 1]), stage.Ambient()]
    assert diffuse.exitance(stage.Objects(ball), stage.vertex_points(ball, 2.0), body, lights).dtype == dtype
