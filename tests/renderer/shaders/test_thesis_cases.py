"""Cases the thesis names: tangent rays, light straight on, several translucent things in line, unlit folds."""

import numpy as np
import pytest

from renderer.optics.ball import ball_profile
from renderer.shaders import plumb, scalar
from renderer.shaders.surface import BodyOptics
from sss_tools.medium import Medium
from sss_tools.shapes import box, icosphere, joined, moved, slab

RADIUS = 0.5
ALBEDOS = (0.9, 0.99, 0.999)
SHADERS = pytest.mark.parametrize("shader", [plumb, scalar])


def body(mean_free_path, bounds=0.87, **keywords):
    return BodyOptics.prepare(0, Medium.from_albedo(ALBEDOS, 1 / mean_free_path, ior=1.3), bounds, **keywords)


@SHADERS
def test_tangent_rays_have_no_stretch_inside(stage, shader):
    """s = 0: light that grazes a ball of paths of a tenth of its radius; the series has x = 0. A vertex whose normal
    is across the light, which a facet before it may hide by its corner: not counted."""
    ball = icosphere(RADIUS, 5)
    points = stage.vertex_points(ball, 1 / RADIUS)
    rim = points.take(np.flatnonzero(np.abs(points.normal[2]) < 1e-6))
    assert len(rim) > 10
    found = shader.exitance(stage.Objects(ball), rim, body(0.05), [stage.Directional([0, 0, 1])])
    for channel, albedo in enumerate(ALBEDOS):
        expected = ball_profile(albedo, 1.3, 10.0, 0.0)
        np.testing.assert_allclose(found[channel], expected, rtol=0.03)


@SHADERS
def test_light_straight_on_enters_and_leaves_at_the_poles(stage, shader):
    ball = icosphere(RADIUS, 5)
    for side in (1, -1):
        pole = stage.one_point([0, 0, side * RADIUS], [0, 0, side], 1 / RADIUS)
        found = shader.exitance(stage.Objects(ball), pole, body(0.1), [stage.Directional([0, 0, 1])])
        for channel, albedo in enumerate(ALBEDOS):
            # straight lines between radii 16 % apart lie above what falls by a factor of two between them
            assert found[channel, 0] == pytest.approx(ball_profile(albedo, 1.3, 5.0, float(side)), rel=0.04)


def test_each_translucent_thing_in_line_dims_further(stage):
    """In any order, and as one of the thickness of both."""
    ball = icosphere(RADIUS, 4)
    points, light = stage.vertex_points(ball, 1 / RADIUS), stage.Directional([0, 0, 1])
    medium = body(0.1).medium
    thin, thick = slab(3.0, 0.1), slab(3.0, 0.3)

    def seen(*screens):
        others = {index + 1: medium for index in range(len(screens))}
        return plumb.exitance(stage.Objects(ball, *screens), points, body(0.1, others=others), [light])

    free, one = seen(), seen(moved(thin, (0, 0, 1)))
    two, swapped = (seen(moved(a, (0, 0, 1)), moved(b, (0, 0, 2))) for a, b in ((thin, thick), (thick, thin)))
    assert (one < free).all()
    assert (two < one).all()
    np.testing.assert_allclose(two, swapped, rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(two, seen(moved(slab(3.0, 0.4), (0, 0, 1))), rtol=1e-2, atol=1e-7)


@SHADERS
def test_folds_that_no_light_reaches_stay_dark(stage, shader):
    """Figure 23: ground that faces the light under a thick part of the same body."""
    ground, roof = box((2.0, 2.0, 0.4)), moved(box((1.0, 1.0, 0.4)), (0, 0, 0.8))
    point = stage.one_point([0.05, 0.02, 0.2], [0, 0, 1], 0.0)
    light = stage.Directional([0, 0, 1])
    optics = body(0.02, bounds=1.5)
    free = shader.exitance(stage.Objects(ground), point, optics, [light])
    fold = shader.exitance(stage.Objects(joined(ground, roof)), point, optics, [light])
    assert free.min() > 0.1
    # of the clearest channel 2 z_b/(d + 2 z_b) = 11 % pass twenty paths of roof
    assert (fold < 0.13 * free).all()
    assert (fold[0] < 1e-3 * free[0]).all()
