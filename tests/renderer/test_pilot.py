"""Small pictures that measure errors."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.pilot import _looking_at, _relative, measure, pilot
from renderer.render import Settings
from renderer.scene.admission import admit
from renderer.scene.camera import CameraRays
from renderer.scene.description import DirectionalLight, EnvironmentLight
from renderer.shaders import plumb
from sss_tools import shapes
from sss_tools.rays import UnitFrame
from tests.renderer.scenes import camera, diffuse, placed, scene, translucent

LIGHTS = [EnvironmentLight(radiance=np.full(3, 0.3)), DirectionalLight(np.array([-1.0, -0.5, -0.6]), np.full(3, 3.0))]
QUICK = Settings(threads=1)


def ball_scene(**more):
    thing = placed(shapes.icosphere(1.0, 3), translucent(0.9, 8.0), normals="smooth", **more)
    return admit(scene([thing], LIGHTS, camera((0, 0, 8), fov=30, resolution=(40, 40))))[0]


def test_the_cross_half_product_finds_a_planted_bias_under_far_larger_noise():
    """Bias 0.1 under noise 0.5 in 4000 pixels: the product's standard error is 0.26/sqrt(4000) = 0.004, and the mean
    0.01 above; plain differences would say 0.7. Fixed seed."""
    rng = np.random.default_rng(5)
    truth = rng.uniform(0.8, 1.2, (4000, 3))
    m1, m2, s1, s2 = (truth + rng.normal(0, 0.5, (4000, 1)) for _ in range(4))
    planted = _relative((m1 - s1 - 0.1) * (m2 - s2 - 0.1), 1.0)
    assert 0.05 < planted.error < 0.16 and planted.bound > planted.error
    none = _relative((m1 - s1) * (m2 - s2), 1.0)
    # it says no better than it knows
    assert 0.02 < none.error < 0.12 and none.bound >= none.error


def test_a_pilot_sees_a_shader_that_is_half_as_bright_again(monkeypatch):
    of = ball_scene()
    honest = pilot(of, 0, QUICK, passes=12).errors["plumb"]
    true = plumb.exitance
    monkeypatch.setattr(plumb, "exitance", lambda *arguments: 1.5 * true(*arguments))
    wrong = pilot(of, 0, QUICK, passes=12).errors["plumb"]
    assert honest.error < 0.25 < 0.35 < wrong.error


def test_pilots_are_made_of_what_the_selection_is_free_to_choose():
    of = ball_scene()
    assert measure(of, replace(QUICK, shader="plumb")) == {}
    assert measure(ball_scene(shader="path"), QUICK) == {}
    opaque = admit(scene([placed(shapes.box(1.0), diffuse(0.5))], LIGHTS, camera((0, 0, 8))))[0]
    assert measure(opaque, QUICK) == {}


@pytest.mark.parametrize("up", [(0, 1, 0), (0, 0, 1)])
def test_a_pilot_looks_at_the_whole_object_from_where_the_camera_is(up):
    thing = placed(shapes.moved(shapes.box((1, 2, 3)), (4, -1, -9)), translucent())
    view = _looking_at(camera((0, 0, 8), up=up), thing, 32)
    frame = UnitFrame.around(*thing.mesh.bounds)
    rays = CameraRays(view, frame)
    inward = thing.mesh.bounds.mean(axis=0) - view.position
    cosine = rays.centre_directions().T @ inward / np.linalg.norm(inward)
    widest = np.arccos(cosine.min())
    corners = thing.mesh.vertices - view.position
    needed = np.arccos((corners @ inward / np.linalg.norm(corners, axis=1) / np.linalg.norm(inward)).min())
    assert needed < widest and view.resolution == (32, 32)
