"""Light without extent connected to collisions through rough boundaries, against connections at boundaries alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from renderer.scene.description import DirectionalLight, PointLight, Scene
from renderer.shaders import boundary, path, rough_light
from renderer.tracing import traced_scene
from renderer.tracing.acceleration import Acceleration
from renderer.tracing.distance_grid import DistanceGrid
from sss_tools.shapes import box, ellipsoid, icosphere, moved
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import bumpy_ball, camera, picture, placed, scene, translucent, wavefront

RATE = shared_rate(1e-3, 8)
VIEW = camera((0.5, 0.4, 4), fov=34, resolution=(32, 32))
SUN = DirectionalLight(np.array([1.0, -1, 1.5]), np.full(3, 3.0))
SUN_IN_FRONT = replace(SUN, direction=-SUN.direction)
LAMP = PointLight(np.array([-1.0, 1.2, -1.6]), np.full(3, 6.0))


def organic() -> Scene:
    thing = placed(bumpy_ball(3), translucent(0.9, 4.0, 0.5, roughness=0.5), normals="smooth")
    return scene([thing], [SUN], VIEW)


def chromatic() -> Scene:
    thing = placed(bumpy_ball(3), translucent([0.95, 0.9, 0.8], [2.0, 4.0, 8.0], 0.0, 1.3, 0.8))
    return scene([thing], [SUN, LAMP], VIEW)


def nested() -> Scene:
    """A rough body in another, which bends light where it is met from there."""
    inner = placed(icosphere(0.5, 3), translucent(0.8, 5.0, 0.0, 1.8, 0.6), name="inner")
    outer = placed(box(1.6), translucent(0.9, 2.0, 0.0, 1.3, 0.6), name="outer")
    return scene([inner, outer], [SUN], VIEW)


def beside_a_wall() -> Scene:
    """Half of the light is shaded, and one side is seen through another body."""
    haze = placed(moved(ellipsoid((0.4, 0.4, 0.2), 3), (0.2, 0.2, 1.5)), translucent(0.5, 1.0, 0.0, 1.0), name="haze")
    wall = placed(moved(box((1.5, 1.5, 0.1)), (-1.0, 0.5, -1.5)), translucent(0.9, 9.0, 0.0, 1.4, 0.3), name="wall")
    return scene([placed(box(1.2), translucent(0.9, 3.0, 0.0, 1.4, 0.6)), haze, wall], [SUN], VIEW)


SCENES = {make.__name__: make for make in (organic, chromatic, nested, beside_a_wall)}


def means(of: Scene, passes: int, number: int, **how) -> np.ndarray:
    return picture(of, passes, seed=seed(number), **how).pass_means()


def without_connections(monkeypatch) -> None:
    """Let the boundary find all of the light, as it does where paths come from other surfaces."""
    lit = traced_scene.LitCollisions
    monkeypatch.setattr(traced_scene, "LitCollisions", lambda *how: replace(lit(*how), rough=False))


def assert_alike(of: Scene, monkeypatch, passes: int = 1000, detects: float = 0.1) -> None:
    connected = means(of, passes // 4, 1)
    without_connections(monkeypatch)
    alone = means(of, passes, 2)
    noise = np.hypot(*(values.std(ddof=1) / np.sqrt(len(values)) for values in (connected, alone)))
    ratio = (connected.mean() / alone.mean(), noise / alone.mean(), len(connected))
    assert_mean(ratio, 1, false_alarm=RATE, detects=detects)


@pytest.mark.slow
@pytest.mark.parametrize("which", SCENES)
def test_connections_do_not_change_the_light(which, monkeypatch):
    """Sees 10 %."""
    assert_alike(SCENES[which](), monkeypatch)


@pytest.mark.slow
def test_light_counted_at_the_collision_and_at_the_boundary_is_caught(monkeypatch):
    monkeypatch.setattr(boundary, "_lit_before", lambda transport, at: np.zeros(len(at.index), bool))
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_alike(organic(), monkeypatch)


@pytest.mark.slow
def test_directions_weighed_by_another_density_are_caught(monkeypatch):
    """As if the facets' half of the directions were a tenth."""
    drawn = rough_light.RoughLight._directions

    def wrong(self, *about):
        direction, phase, density = drawn(self, *about)
        return direction, phase, phase + np.float32(0.2) * (density - phase)

    monkeypatch.setattr(rough_light.RoughLight, "_directions", wrong)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_alike(organic(), monkeypatch)


def test_connections_take_most_of_the_noise(monkeypatch):
    """More than twenty times less variance. Those of 160 means are known to 11 %, their ratio to 16 %."""
    of = scene([placed(icosphere(1.0, 3), translucent(0.9, 4.0, roughness=0.2))], [SUN_IN_FRONT], VIEW)
    connected = means(of, 160, 3).var(ddof=1)
    without_connections(monkeypatch)
    assert means(of, 160, 4).var(ddof=1) > 20 * connected


def assert_grid_changes_nothing() -> None:
    """Sees 3 % of the light."""
    of = scene([placed(icosphere(1.0, 4), translucent(0.9, 10.0, 0.3, roughness=0.3))], [SUN_IN_FRONT], VIEW)
    grid = DistanceGrid(wavefront(of).scene.vertices, of.objects[0].mesh.faces, 48)
    plain = means(of, 240, 5)
    helped = means(of, 240, 6, acceleration=Acceleration(grid, (None,), (None,)))
    assert_mean(helped - plain, 0, false_alarm=RATE, detects=0.03 * plain.mean())


@pytest.mark.slow
def test_the_grid_leaves_out_only_what_is_too_deep():
    assert_grid_changes_nothing()


@pytest.mark.slow
def test_leaving_out_what_seems_too_deep_is_caught(monkeypatch):
    """Distances taken for three times as long as they are."""

    def with_longer(transport, slot, grid):
        longer = grid and SimpleNamespace(distance=lambda *where: 3 * grid.distance(*where))
        return sound(transport, slot, longer)

    sound = rough_light.RoughLight
    monkeypatch.setattr(path, "RoughLight", with_longer)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_grid_changes_nothing()
