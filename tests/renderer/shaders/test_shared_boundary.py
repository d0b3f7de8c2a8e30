"""What a boundary reflects is the same whichever shader finds the scattered light.

The medium is black, so that nothing is scattered: all that is seen is the boundary's reflection.
"""

import numpy as np
import pytest

from renderer.optics.dielectric import fresnel_reflectance
from renderer.render import Renderer, Settings
from renderer.scene.description import RectangleLight, SphereLight
from renderer.shaders import fast_body
from sss_tools.shapes import icosphere
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import camera, half_white_sky, placed, scene, translucent

SHADERS = ["path", "plumb", "scalar"]
LIGHTS = {
    "sky": half_white_sky(),
    "rectangle": RectangleLight(np.array([1.5, 2, 3]), np.zeros(3), np.array([0.0, 1, 0]), (0.8, 0.8), np.full(3, 4.0)),
    "ball": SphereLight(np.array([1.5, 2, 3]), 0.8, np.full(3, 4.0)),
}
PASSES = 64


def passes(shader: str, light: str, roughness: float, count: int) -> np.ndarray:
    """(count, h, w) radiance of a black ball, pass by pass."""
    ball = placed(icosphere(1.0, 4), translucent(0.0, 1e4, roughness=roughness), normals="smooth")
    view = camera((0, 0, 5), fov=20, resolution=(32, 32))
    of = Renderer(scene([ball], [LIGHTS[light]], view), Settings(shader=shader, seed=seed(1) + SHADERS.index(shader)))
    if roughness == 0:
        of = Renderer(of.scene, Settings(shader=shader, seed=seed(1)))
    found, before = [], 0.0
    for index in range(count):
        of.run([index])
        found.append(of.film.sum[..., 0] - before)
        before = of.film.sum[..., 0].copy()
    return np.stack(found)


def assert_same_mirror_image(shown: np.ndarray, path: np.ndarray) -> None:
    """To rounding, but where the reflection of an edge of the light crosses a sample: one in a thousand."""
    assert (path[0] > 0).mean() > 0.005  # the light is seen
    assert (np.abs(shown - path) > 1e-4 * (path + 0.01)).mean() < 1e-3


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shader", ["plumb", "scalar"])
def test_smooth_boundaries_reflect_alike_sample_by_sample(shader, light):
    """Same camera rays: reflections are followed without chance by all three shaders."""
    assert_same_mirror_image(passes(shader, light, 0.0, 2), passes("path", light, 0.0, 2))


def test_a_difference_of_mirror_images_is_found(monkeypatch):
    """The companion: an index of 1.52 in place of 1.5, 3 % of the reflectance head on."""
    from renderer import direct

    path = passes("path", "rectangle", 0.0, 2)
    monkeypatch.setattr(direct, "fresnel_reflectance", lambda cosine, ior: fresnel_reflectance(cosine, 1.52))
    with pytest.raises(AssertionError):
        assert_same_mirror_image(passes("scalar", "rectangle", 0.0, 2), path)


def assert_same_highlight(shown: np.ndarray, path: np.ndarray, tests: int) -> None:
    """Means of each pass over the quarter with the highlight and over the rest: independent from pass to pass.

    Errors of a fifth are seen; the rest of the picture is a few faint, noisy pixels.
    """
    quarter = np.zeros(path.shape[1:], bool)
    quarter[:16, 16:] = True
    for where in (quarter, ~quarter):
        ours, theirs = (each[:, where].mean(axis=1) for each in (shown, path))
        difference = (ours - theirs) / theirs.mean()
        assert_mean(difference, 0.0, false_alarm=shared_rate(1e-4, 2 * tests), detects=0.2)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shader", ["plumb", "scalar"])
def test_rough_boundaries_have_the_same_highlights(shader, light):
    assert_same_highlight(passes(shader, light, 0.3, PASSES), passes("path", light, 0.3, PASSES), 6)


def test_a_difference_of_highlights_is_found(monkeypatch):
    """The companion: half as much again of roughness in one of the shaders' densities."""
    exact = fast_body.turning
    monkeypatch.setattr(fast_body, "turning", lambda view, turned, eta, alpha: exact(view, turned, eta, 1.5 * alpha))
    with pytest.raises(AssertionError):
        assert_same_highlight(passes("scalar", "ball", 0.3, PASSES), passes("path", "ball", 0.3, PASSES), 6)
