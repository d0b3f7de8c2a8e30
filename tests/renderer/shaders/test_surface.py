from dataclasses import replace

import numpy as np
import pytest

from renderer.shaders import plumb, scalar
from renderer.shaders.surface import BodyOptics, outgoing_radiance
from sss_tools.medium import Medium
from sss_tools.shapes import icosphere


def test_radiance_integrates_to_the_exitance():
    cosine = ((np.arange(20_000) + 0.5) / 20_000).astype(np.float32)
    for ior in (1.0, 1.5):
        radiance = outgoing_radiance(np.array([[1.0], [2.0], [0.5]], np.float32), cosine, ior)
        assert radiance.dtype == np.float32
        flux = 2 * np.pi * np.mean(radiance.astype(float) * cosine, axis=1)
        np.testing.assert_allclose(flux, [1, 2, 0.5], rtol=1e-4)


def test_light_passed_on_follows_the_layers_law():
    medium = Medium.from_albedo([0.9, 0.99, 1.0], 10.0, ior=1.0)
    body = BodyOptics.prepare(0, medium, 1.0)
    nothing, depth = np.zeros(3, np.float32), np.array([0, 0.5, 2.0], np.float32)
    share = body.passed_on(nothing, depth)
    np.testing.assert_array_equal(share[:, 0], 1)
    # without absorption 2 z_b/(d + 2 z_b), z_b = 2/3 of a transport length of 1/10
    np.testing.assert_allclose(share[2], (4 / 3) / (10 * depth + 4 / 3), rtol=1e-3)
    assert (np.diff(share, axis=1) < 0).all()
    assert (np.diff(share[:, 2]) > 0).all()
    # two layers one after the other are one of both
    together = body.passed_on(nothing, depth + 1)
    np.testing.assert_allclose(share * body.passed_on(depth, np.ones(3, np.float32)), together, rtol=1e-5)


def test_depth_weights_tell_opaque_from_translucent():
    medium = Medium.from_albedo(0.9, 10.0)
    body = BodyOptics.prepare(1, medium, 1.0, others={0: None, 3: medium.scaled(2.0)})
    owners = np.array([0, 1, 2, 3, 4, -1], np.int16)
    np.testing.assert_array_equal(body.weight_of(owners), [np.inf, 1, np.inf, 2, np.inf, np.inf])


def test_channels_that_do_not_scatter_stay_dark():
    medium = Medium.from_coefficients(sigma_a=[1e-6, 1, 1], sigma_s=[0, 0, 9])
    body = BodyOptics.prepare(0, medium, 1.0)
    found = body.ball_exitance(np.array([1, -1], np.float32), np.ones(2, np.float32))
    assert np.isfinite(found).all()
    assert not found[:2].any()
    assert found[2].min() > 0


@pytest.mark.parametrize("scale", [0.5, 3.0])
def test_radii_scale_with_the_medium(scale):
    medium = Medium.from_albedo([0.9, 0.95, 0.99], [10.0, 10.0, 30.0])
    x, radius = np.linspace(-1, 1, 9, dtype=np.float32), np.full(9, 0.3, np.float32)
    plain = BodyOptics.prepare(0, medium, 1.0).ball_exitance(x, radius)
    scaled = BodyOptics.prepare(0, medium.scaled(scale), 1.0).ball_exitance(x, radius / np.float32(scale))
    np.testing.assert_allclose(scaled, plain, rtol=1e-3)


@pytest.mark.parametrize("shader", [plumb, scalar])
def test_a_grey_mediums_one_channel_is_what_each_of_three_would_be(stage, shader):
    ball = icosphere(0.5, 2)
    points = stage.vertex_points(ball, 2.0)
    view = np.repeat(np.array([[0.0], [0.6], [0.8]], np.float32), len(points), axis=1)
    points = replace(points, viewer=view)
    lights = [stage.Directional([0.3, 0.5, 0.8], (1, 2, 3)), stage.Ambient([2, 1, 0.5])]
    medium = Medium.from_albedo(0.9, 20.0, ior=1.5)
    grey, coloured = (BodyOptics.prepare(0, medium, 1.0) for _ in range(2))
    coloured.__dict__["channels"] = 3
    assert grey.channels == 1
    found, expected = (shader.exitance(stage.Objects(ball), points, each, lights) for each in (grey, coloured))
    np.testing.assert_array_equal(found, expected)
    assert found.min() > 0


def test_channels_that_differ_in_any_way_are_three():
    for albedo, sigma_t in (([0.9, 0.9, 0.8], 10.0), (0.9, [10.0, 10.0, 11.0])):
        assert BodyOptics.prepare(0, Medium.from_albedo(albedo, sigma_t), 1.0).channels == 3
