"""Source and sensor may be swapped: Helmholtz's reciprocity of surfaces, bodies and boundaries in between.

A sun at the angle a is seen at the angle b as radiance L(a -> b) by a camera that looks at a wide stack of two layers
(one where the boundary is smooth).
Per irradiance of the stack, L(a -> b)/(E cos a) is the same for the way back, reflected or transmitted. The two layers
differ, so nothing but reciprocity makes the two equal: Fresnel's factors,
eta^2, the Jacobian of rough facets and of refracted beams, phase function and attenuation.

Blind to factors that both ways share, and to those that depend on the cosine in the same way: slabs against
adding-doubling see those (test_path, test_refracted_light).
"""

from __future__ import annotations

import numpy as np
import pytest

from renderer.scene.description import DirectionalLight
from renderer.scene.lights import DirectionalSource
from sss_tools.shapes import box, moved
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import camera, picture, placed, scene, translucent

WIDTH = 60.0
STEEP, FLAT = np.radians(20), np.radians(65)
BOUNDARIES = {"matched": (1.0, 0.0), "smooth": (1.4, 0.0), "rough": (1.4, 0.4)}
PASSES = {"matched": 8, "smooth": 3, "rough": 40}
RATE = shared_rate(1e-3, 6)


def towards(angle: float, turn: float, below: bool) -> np.ndarray:
    """Unit vector that leaves the stack."""
    flat = np.sin(angle)
    return np.array([flat * np.cos(turn), -np.cos(angle) if below else np.cos(angle), flat * np.sin(turn)])


def scattering(boundary: str, light: np.ndarray, sensor: np.ndarray, number: int) -> np.ndarray:
    """(n,) samples of radiance over irradiance of the stack; ``light`` and ``sensor`` lead away from it."""
    ior, roughness = BOUNDARIES[boundary]
    upper = placed(moved(box((WIDTH, 0.4, WIDTH)), (0, 0.21, 0)), translucent(0.9, 1.0, 0.6, ior, roughness))
    lower = placed(moved(box((WIDTH, 0.6, WIDTH)), (0, -0.31, 0)), translucent(0.6, 1.0, 0.0, ior, roughness))
    # behind a smooth boundary no light is found that comes through another one
    stack = [upper] if boundary == "smooth" else [upper, lower]
    sun = DirectionalLight(-light, np.ones(3))
    view = camera(200 * sensor, (0, 0, 0), (0, 0, 1), fov=0.02, resolution=(64, 64))
    shown = picture(scene(stack, [sun], view), PASSES[boundary], seed=seed(number)).channel()
    return shown / abs(light[1])


def compare(boundary: str, below: bool) -> None:
    one, other = towards(STEEP, 0.3, False), towards(FLAT, 2.0, below)
    there, back = scattering(boundary, one, other, 1), scattering(boundary, other, one, 2)
    noise = np.sqrt((there.var(ddof=1) + back.var(ddof=1)) / len(there))
    assert_mean((there.mean() / back.mean(), noise / back.mean(), len(there)), 1, false_alarm=RATE, detects=0.2,
                what=f"{boundary}, {'transmitted' if below else 'reflected'}")  # fmt: skip


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("below", [False, True])
def test_light_and_camera_may_be_swapped(boundary, below):
    """Sees 20 %."""
    compare(boundary, below)


def test_irradiance_taken_across_the_surface_is_caught(monkeypatch):
    """The companion: a cosine too many, which differs by a factor of two between the two ways."""
    illuminate = DirectionalSource.illuminate

    def slanted(self, position):
        light = illuminate(self, position)
        return type(light)(light.direction, light.distance, light.irradiance * abs(self.towards[1]))

    monkeypatch.setattr(DirectionalSource, "illuminate", slanted)
    with pytest.raises(AssertionError, match="wrong mean"):
        compare("matched", False)
