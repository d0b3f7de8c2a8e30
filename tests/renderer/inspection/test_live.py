"""The live picture turns, follows the time it has, and rests on the reference."""

import time
from dataclasses import replace

import numpy as np
import pytest

from renderer.inspection.live import LEAST, Live
from renderer.render import Renderer, Settings
from renderer.scene.description import Scene
from renderer.scene.staging import stage_mesh
from sss_tools import shapes
from sss_tools.medium import Medium


def staged() -> Scene:
    """An ellipsoid in which light is scattered five times or so: passes are short."""
    return stage_mesh(shapes.ellipsoid((1.0, 0.7, 0.5), 2), Medium.from_albedo(0.8, 2.0))


@pytest.fixture
def live():
    made = Live(staged(), (96, 64))
    yield made
    made.close()


def wait_for_passes(live, count: int):
    limit = time.monotonic() + 120
    while time.monotonic() < limit:
        best = live.resting()
        if best is not None and int(best[1].split()[1]) >= count:
            return best
        time.sleep(0.02)
    raise AssertionError("the reference does not come")


def test_turning_keeps_the_distance_and_a_full_turn_comes_back(live):
    first = live.camera.position.copy()
    distance = np.linalg.norm(first - live.camera.target)
    for _ in range(8):
        live.turn(np.pi / 4, 0.0)
        assert np.linalg.norm(live.camera.position - live.camera.target) == pytest.approx(distance)
    assert np.allclose(live.camera.position, first)
    live.turn(0.0, 0.3)
    assert live.camera.position[1] > first[1]
    live.turn(0.0, 10.0)
    assert live.camera.position[1] - live.camera.target[1] == pytest.approx(distance * np.sin(1.5))


def test_the_preview_is_of_the_window_s_size_and_grows_no_finer_than_time_allows(live, monkeypatch):
    assert live.moving().shape == (64, 96, 3) and live._rows >= LEAST
    monkeypatch.setattr("renderer.inspection.live.FRAME", 1e-9)
    for _ in range(5):
        live.moving()
    assert live._rows == LEAST


@pytest.mark.parametrize("preview", ["scalar", "plumb"])
def test_the_preview_is_seen_from_where_the_camera_is(preview):
    scene = staged()
    turning = Live(scene, (96, 64), preview)
    turning._rows = 64
    before = turning.moving()
    turning.turn(0.7, 0.2)
    turning._rows = 64
    after = turning.moving()
    assert (before != after).any()
    fresh = Live(replace(scene, camera=turning.camera), (96, 64), preview)
    fresh._rows = 64
    assert np.array_equal(fresh.moving(), after)


def test_at_rest_passes_of_the_reference_add_up_and_say_their_error(live):
    image, words = wait_for_passes(live, 3)
    assert image.shape == (64, 96, 3) and words.startswith("path, ") and "standard error" in words


def test_a_movement_drops_the_pass_under_way():
    """Of a body in which light is scattered so often that a pass takes seconds."""
    dense = stage_mesh(shapes.icosphere(1.0, 2), Medium.from_albedo(0.9999, 50.0, g=0.5))
    live = Live(dense, (320, 240))
    live.resting()
    worker = live._worker
    while worker.is_alive() and live._exact._under_way is None:
        time.sleep(0.01)
    live.turn(0.1, 0.0)
    worker.join(60)
    assert not worker.is_alive() and live._exact.film.passes == 0


def test_a_movement_ends_the_film_and_the_next_is_of_the_new_camera(live):
    wait_for_passes(live, 1)
    live.turn(0.7, 0.2)
    wait_for_passes(live, 2)
    live.close()
    film = live._exact.film
    scene = staged()
    again = Renderer(replace(scene, camera=replace(scene.camera, resolution=(96, 64))), Settings(shader="path"))
    again.look_from(live.camera)
    again.run(range(film.passes))
    # the same passes from the same camera are the same samples
    assert np.array_equal(again.film.mean(), film.mean())
