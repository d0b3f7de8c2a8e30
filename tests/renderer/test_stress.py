"""The ends of the range in brief; ``benchmarks/stress.py`` covers it in full."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer.scene.description import DirectionalLight, PointLight
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, cylinder, ellipsoid, moved
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import WHITE_SKY, bumpy_ball, camera, picture, placed, scene, translucent

VIEW = camera((0.8, 1.1, 4), fov=30, resolution=(16, 16))
TINT = np.array([1.0, 2.0, 4.0])
LIGHTS = [DirectionalLight(np.array([1.0, -1, 0.6]), np.ones(3)), PointLight(np.array([-2.0, 2, 1]), np.ones(3))]


def rendered(mesh: Mesh, lights=(WHITE_SKY,), passes: int = 4, view=VIEW, **medium):
    shown = picture(scene([placed(mesh, translucent(**medium))], list(lights), view), passes, seed=seed(1), block=2**13)
    assert np.isfinite(shown.samples).all()
    assert shown.tally.non_finite == 0
    # budget 1e-5: of some thousand paths one is allowed
    assert shown.tally.leaked <= 1
    return shown


ENDS = [(1e-2, 0.0, 1.5), (1e-2, 0.95, 2.5), (1e-2, -0.95, 1.0), (1.0, 0.95, 1.0), (10.0, -0.95, 2.5), (10.0, 0.0, 1.0)]
RATE = shared_rate(1e-3, 3)


@pytest.mark.parametrize(("path", "g", "ior"), ENDS)
def test_white_bodies_vanish_at_the_ends_of_the_range(path, g, ior):
    shown = rendered(bumpy_ball(3), albedo=1.0, sigma_t=1 / path, g=g, ior=ior, passes=1)
    assert_allclose(shown.samples, 1, atol=2e-5)


@pytest.mark.parametrize(("path", "g", "ior"), [(0.05, 0.95, 1.3), (1.0, -0.95, 2.5), (10.0, 0.0, 1.5)])
def test_chromatic_white_bodies_vanish_on_average(path, g, ior):
    """Sees 40 % in the channel that is densest."""
    shown = rendered(bumpy_ball(3), albedo=1.0, sigma_t=TINT / path, g=g, ior=ior, passes=12)
    assert_mean(shown.channel(2), 1, false_alarm=RATE, detects=0.4)


NEEDLES = {
    "spindle 1000:1": lambda: ellipsoid((1, 1e-3, 1e-3), 2),
    "rod 600:1": lambda: cylinder(1 / 300, 2.0, 100),
    "sheet 10000:1": lambda: box((2, 2e-4, 2)),
}


@pytest.mark.parametrize("shape", NEEDLES)
@pytest.mark.parametrize("sigma_t", [500.0, 250 * TINT], ids=["grey", "chromatic"])
def test_needles_lose_nothing(shape, sigma_t):
    close = camera((0, 0.3, 3), fov=1.0, resolution=(16, 16))
    shown = rendered(NEEDLES[shape](), albedo=1.0, sigma_t=sigma_t, view=close)
    if np.ndim(sigma_t) == 0:
        assert_allclose(shown.samples, 1, atol=1e-6)


@pytest.mark.parametrize("degrees", [1.0, 1e-4])
def test_grazing_views_of_a_plate_are_white(degrees):
    slope = np.radians(degrees)
    view = camera((4 * np.cos(slope), 4 * np.sin(slope), 0), fov=0.5, resolution=(16, 16))
    shown = rendered(moved(box((2, 0.2, 2)), (0, -0.1, 0)), albedo=1.0, sigma_t=10.0, ior=1.5, view=view)
    assert_allclose(shown.samples, 1, atol=1e-6)
    rendered(moved(box((2, 0.2, 2)), (0, -0.1, 0)), LIGHTS, 1, view, albedo=0.9, sigma_t=5 * TINT, ior=1.5)
