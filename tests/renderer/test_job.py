"""Budgets, checkpoints and the report."""

import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from renderer import checkpoint, job
from renderer.checkpoint import Refreshed, checkpoint_path
from renderer.guides import guide_arrays
from renderer.job import Budget, execute, merged
from renderer.output import image
from renderer.render import Renderer, Settings
from renderer.report import light_methods, rare_event_warnings, report
from renderer.scene.description import DirectionalLight, EnvironmentLight, PointLight, RectangleLight
from sss_tools import shapes
from sss_tools.errors import InputError
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, placed, scene, translucent

SUN = DirectionalLight(np.array([-1.0, -1, -1]), np.full(3, 2.0))


def ready(lights=(WHITE_SKY,), material=None, resolution=(16, 12), **settings) -> Renderer:
    ball = placed(shapes.icosphere(1.0, 2), material or translucent(0.8, 4.0), name="ball")
    of = scene([ball], lights, camera((0, 0.5, 5), resolution=resolution))
    return Renderer(of, Settings(**{"shader": "path", **settings}))


def test_what_is_left_of_a_budget():
    assert list(Budget(2, 5).left(())) == [2, 3, 4]
    assert list(Budget(0, 8).left(((1, 3), (5, 6)))) == [0, 3, 4, 6, 7]
    assert list(Budget(0, 3).left(((0, 3),))) == []
    assert Budget(0, None, seconds=1).left(((2, 7),))[0] == 7
    assert Budget(0, None, seconds=1).left(())[0] == 0


def test_passes_are_rendered_and_written_and_the_checkpoint_goes(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint, "REFRESH_EVERY", 0.0)
    monkeypatch.setattr(checkpoint, "REFRESH_SHARE", 1e9)
    seen = []
    out = tmp_path / "out.npz"

    def progress(done, total, text):
        seen.append((done, total, text))
        assert len(image.read(checkpoint_path(out)).film.ranges) == 1

    picture = execute(ready(), out, Budget(3, 6), progress=progress)
    assert seen == [(1, 3, "pass 1"), (2, 3, "pass 2"), (3, 3, "pass 3")]
    assert picture.film.ranges == image.read(out).film.ranges == ((3, 6),)
    assert [path.name for path in tmp_path.iterdir()] == ["out.npz"]


def test_time_allows_one_pass_at_least(tmp_path):
    budget = Budget(0, None, seconds=0.01, started=time.monotonic() - 100)
    assert execute(ready(), tmp_path / "out.png", budget).film.passes == 1


def test_no_pass_is_added_when_the_time_is_over(tmp_path, monkeypatch):
    """A clock that jumps 2 s a pass: of 7 s, the fourth is the last. Which passes are begun is told by the tests of
    ``renderer.strips``."""
    clock = [1000.0]
    monkeypatch.setattr(job.time, "monotonic", lambda: clock[0])
    renderer = ready()
    run = renderer.run

    def slow_run(passes, done, seconds_left):
        def after(index):
            clock[0] += 2.0
            return done(index)

        run(passes, after, seconds_left)

    monkeypatch.setattr(renderer, "run", slow_run)
    assert execute(renderer, tmp_path / "out.png", Budget(0, None, seconds=7.0, started=1000.0)).film.passes == 4


def test_a_target_error_ends_at_the_first_pass_that_meets_it(tmp_path):
    errors = []
    renderer = ready()
    budget = Budget(0, None, target_error=0.25)
    execute(renderer, tmp_path / "out.png", budget,
            progress=lambda *_: errors.append(renderer.film.mean_relative_stderr()))  # fmt: skip
    assert errors[-1] <= 0.25 and all(not error <= 0.25 for error in errors[:-1])


def test_a_target_error_where_there_is_no_error_to_measure_ends_too(tmp_path):
    budget = Budget(0, None, target_error=0.01)
    assert execute(ready(shader="scalar"), tmp_path / "out.png", budget).film.passes == job.DEFAULT_PASSES


def test_an_interrupt_writes_the_picture_and_keeps_the_film_for_resume(tmp_path):
    def interrupt(done, total, text):
        if done == 2:
            raise KeyboardInterrupt

    out = tmp_path / "out.png"
    with pytest.raises(KeyboardInterrupt):
        execute(ready(), out, Budget(0, 10), progress=interrupt)
    assert out.read_bytes().startswith(b"\x89PNG")
    assert image.read(checkpoint_path(out)).film.ranges == ((0, 2),)
    resumed = execute(ready(), out, Budget(0, 4), resume=True).film
    whole = execute(ready(), tmp_path / "whole.png", Budget(0, 4)).film
    assert resumed.ranges == whole.ranges
    np.testing.assert_allclose(resumed.sum, whole.sum, rtol=1e-12, atol=0)
    assert not checkpoint_path(out).exists()


def test_an_interrupted_npz_is_its_own_checkpoint(tmp_path, monkeypatch):
    """An older one beside it would be resumed in its place."""
    monkeypatch.setattr(checkpoint, "REFRESH_EVERY", 0.0)

    def interrupt(done, total, text):
        if done == 3:
            raise KeyboardInterrupt

    out = tmp_path / "out.npz"
    with pytest.raises(KeyboardInterrupt):
        execute(ready(), out, Budget(0, 10), progress=interrupt)
    assert image.read(out).film.ranges == ((0, 3),)
    assert not checkpoint_path(out).exists()


def test_a_finished_render_resumed_is_written_again_without_a_pass(tmp_path):
    out = tmp_path / "out.npz"
    execute(ready(), out, Budget(0, 2))
    renderer = ready()
    assert execute(renderer, out, Budget(0, 2), resume=True).film.passes == 2
    assert renderer.tally.samples == 0


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"shader": "scalar"},
        {"material": translucent(0.7, 4.0)},
        {"lights": (SUN,)},
        {"resolution": (12, 12)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_another_render_is_not_resumed(tmp_path, change):
    out = tmp_path / "out.npz"
    execute(ready(), out, Budget(0, 1))
    before = out.read_bytes()
    with pytest.raises(InputError, match="belongs to another render"):
        execute(ready(**change), out, Budget(0, 2), resume=True)
    assert out.read_bytes() == before


def test_a_corrupt_checkpoint_is_no_film(tmp_path):
    out = tmp_path / "out.png"
    checkpoint_path(out).write_bytes(b"PK half a file")
    with pytest.raises(InputError, match="holds no film"):
        execute(ready(), out, Budget(0, 2), resume=True)
    assert not out.exists()


def test_merging_reads_and_adds_parts(tmp_path):
    for first in range(3):
        execute(ready(), tmp_path / f"{first}.npz", Budget(first, first + 1))
    film = merged([tmp_path / f"{first}.npz" for first in (2, 0, 1)]).film
    assert film.ranges == ((0, 3),)
    whole = ready()
    whole.run(range(3))
    np.testing.assert_allclose(film.sum, whole.film.sum, rtol=1e-12, atol=0)
    with pytest.raises(InputError, match="there twice"):
        merged([tmp_path / "0.npz", Path(shutil.copy(tmp_path / "0.npz", tmp_path / "copy.npz"))])


def test_seconds_a_frame_are_of_the_passes_of_this_run(tmp_path):
    out = tmp_path / "out.npz"
    execute(ready(), out, Budget(0, 3))
    renderer = ready()
    picture = execute(renderer, out, Budget(0, 5), resume=True)
    seconds = report(renderer, picture, "0", 1.0)["seconds"]
    assert picture.film.passes == 5
    assert seconds["frame"] == pytest.approx(seconds["render"] / 2)


@pytest.mark.parametrize(
    ("samples", "leaked", "warns"),
    [(10**4, 1, False), (10**4, 3, True), (10**8, 1000, False), (10**8, 1090, False), (10**8, 1100, True)],
)
def test_leaks_are_held_against_one_in_a_hundred_thousand_and_chance(samples, leaked, warns):
    renderer = ready()
    renderer.tally.samples = samples
    renderer.tally.leak(0, np.zeros((3, leaked), np.float32))
    found = rare_event_warnings(renderer)
    assert bool(found) == warns
    assert not warns or f"{leaked} of {samples} paths" in found[0]


def test_samples_that_are_not_finite_are_warned_of():
    renderer = ready()
    renderer.run(range(2))
    assert rare_event_warnings(renderer) == []
    renderer.film.left_out[0, 0] = 1
    assert "1 samples (2.6e-03 of all) were not finite" in rare_event_warnings(renderer)[0]


def test_a_preview_that_can_no_longer_be_written_does_not_end_the_render(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint, "REFRESH_EVERY", 0.0)
    folder = tmp_path / "gone"
    folder.mkdir()

    def remove(done, total, text):
        shutil.rmtree(folder, ignore_errors=True)

    with pytest.warns(UserWarning, match="tried again"):
        execute(ready(), tmp_path / "out.npz", Budget(0, 5), progress=remove, preview=folder / "preview.png")
    assert image.read(tmp_path / "out.npz").film.passes == 5


def test_writing_again_and_again_takes_a_small_share_of_the_time(tmp_path, monkeypatch):
    """A clock that writing moves on by 3 s: the next is due 60 s later."""
    clock = [1000.0]
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(checkpoint.image, "write", lambda *_: clock.__setitem__(0, clock[0] + 3))
    kept, renderer = Refreshed(tmp_path / "preview.png"), ready()
    kept.refresh(renderer, 0.0)
    assert kept.due == pytest.approx(1003 + 60)
    kept.refresh(renderer, 0.0)
    assert clock[0] == 1003


def test_the_bias_of_lights_without_extent_is_named_where_there_is_one():
    assert light_methods(ready()) == []
    assert light_methods(ready((SUN,), shader="plumb")) == []
    (smooth,) = light_methods(ready((SUN,)))
    assert smooth["object"] == "ball" and "each facet" in smooth["method"] and "%" in smooth["known_bias"]
    point = PointLight(np.array([3.0, 3, 3]), np.ones(3))
    for material in (translucent(ior=1.0), translucent(roughness=0.3)):
        (method,) = light_methods(ready((point,), material))
        assert method["known_bias"] == "none"


def test_light_through_one_smooth_body_into_another_is_named_as_missing():
    near = placed(shapes.icosphere(1.0, 1), translucent(), name="near")
    for material, missing in (
        (translucent(), True),
        (translucent(ior=1.0), False),
        (translucent(roughness=0.3), False),
    ):
        far = placed(shapes.moved(shapes.icosphere(1.0, 1), (3, 0, 0)), material, name="far")
        renderer = Renderer(scene([near, far], (SUN,), camera((0, 0.5, 9))), Settings(shader="path"))
        said = light_methods(renderer)[0]["known_bias"]
        assert ("another body" in said) == missing


def test_lights_with_an_extent_are_sampled_where_the_boundary_lets_them_through():
    lamp = RectangleLight(np.array([0.0, 3, 0]), np.zeros(3), np.array([1.0, 0, 0]), (1, 1), np.ones(3))
    sun = np.zeros((8, 16, 3), np.float32)
    sun[2, 3] = 1
    for material, said in ((translucent(ior=1.0), "at collisions and chance"), (translucent(), "chance"),
                           (translucent(roughness=0.3), "rough boundary and chance")):  # fmt: skip
        (method,) = light_methods(ready((lamp, EnvironmentLight(image=sun)), material))
        assert method["lights"] == "rectangles, uneven skies" and said in method["method"]
        assert ("next-event" in method["method"]) == (said != "chance")
        assert method["known_bias"] == "none"
    assert [entry["lights"] for entry in light_methods(ready((lamp, SUN)))] == ["without extent", "rectangles"]


def test_guides_are_in_scene_units_and_outward():
    renderer = ready(resolution=(15, 15))
    guides = guide_arrays(renderer, ["depth", "normal"])
    # a ball of radius 1 seen from sqrt(25.25): the chord height of an icosphere of 320 faces is below 2 %
    assert guides["depth"][7, 7] == pytest.approx(25.25**0.5 - 1, abs=0.02)
    view = renderer.camera.centre_directions().T.reshape(15, 15, 3)[7, 7]
    assert guides["normal"][7, 7] @ view < -0.95
    assert guides["depth"][0, 0] == np.inf and not guides["normal"][0, 0].any()
    with pytest.raises(InputError, match="choose from depth, normal"):
        guide_arrays(renderer, ["depth", "albedo"])


def test_an_output_that_cannot_be_written_is_refused_before_the_first_pass(tmp_path):
    renderer = ready()
    with pytest.raises(InputError):
        execute(renderer, tmp_path / "missing" / "out.png", Budget(0, 2))
    assert renderer.tally.samples == 0


def test_opaque_objects_are_in_the_report(tmp_path):
    base = ready()
    floor = placed(shapes.moved(shapes.box(1.0), (0, -2, 0)), diffuse(0.5), name="floor")
    renderer = Renderer(replace(base.scene, objects=(*base.scene.objects, floor), hash=""), Settings(shader="path"))
    picture = execute(renderer, Path(tmp_path, "out.png"), Budget(0, 1))
    ball, floor = report(renderer, picture, "0", 1.0)["objects"]
    assert (ball["name"], floor["name"], floor["shader"]) == ("ball", "floor", "opaque")
    assert floor["mean_free_path_px"] is None and floor["predicted_error"] is None
