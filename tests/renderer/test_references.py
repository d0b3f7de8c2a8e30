"""The six public reference scenes against another renderer's pictures of them (Mitsuba 3.9.1)."""

import functools
import json

import numpy as np
import pytest

from renderer.scene.scene_file import load_scene
from renderer.study.judges import Estimate, compare_tiles, with_rare_samples
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import picture

PASSES = {"p1_sphere": 200, "p2_bunny_marble": 24, "p3_bunny_backlit": 100, "p4_slab": 64, "p5_spot_matched": 120}
VISIBLE = {"p1_sphere": 0.012, "p2_bunny_marble": 0.02, "p3_bunny_backlit": 0.12, "p4_slab": 0.05,
           "p5_spot_matched": 0.025}  # fmt: skip
"""Share of the object's mean that is seen if it is wrong."""

TILE = 8
TILES_RATE = 1e-3
VISIBLE_IN_A_TILE = {"p1_sphere": 0.1, "p2_bunny_marble": 0.1, "p3_bunny_backlit": 1.0, "p4_slab": 0.4,
                     "p5_spot_matched": 0.2}  # fmt: skip
"""Share of the radiance of a tile with the median noise that is seen if it is wrong."""

HEAVY_TAILS = {"p3_bunny_backlit", "p4_slab"}
"""Scenes in which few samples carry much of the light, more than a short render meets: its own standard error would
be too small."""

RATE = shared_rate(1e-3, 3 * len(PASSES))


@pytest.fixture(scope="module")
def rendered(shared):
    """A function of the scene's name: our picture, the reference, (pixels,) whether wholly on the object."""
    return functools.cache(lambda name: _rendered(shared, name, PASSES[name]))


def _rendered(shared, name: str, passes: int):
    scene = load_scene(shared / "reference" / "scenes" / f"{name}.toml")
    reference = np.load(shared / "reference" / "public" / f"{name}.npz")
    on_object = (reference["coverage"] >= 1).ravel()
    return picture(scene, passes, seed=seed(1)), reference, on_object


def compared(shown, reference, on_object, factor: float = 1.0):
    """Per channel: means of ours over the reference's, and the standard error of that with both noises."""
    mean = reference["image"].reshape(-1, 3)[on_object].mean(axis=0, dtype=float)
    noise = np.sqrt((reference["stderr"].reshape(-1, 3)[on_object].astype(float) ** 2).sum(axis=0)) / on_object.sum()
    for k in range(3):
        ours = factor * shown.pass_means(k, on_object)
        error = np.hypot(ours.std(ddof=1) / np.sqrt(len(ours)), noise[k])
        yield ours.mean() / mean[k], error / mean[k], len(ours)


@pytest.mark.parametrize("name", PASSES)
def test_object_has_the_brightness_of_the_reference(rendered, name):
    """The mean over the object's pixels, channel by channel; blind to light that is moved within the object."""
    shown, reference, on_object = rendered(name)
    for k, summary in enumerate(compared(shown, reference, on_object)):
        assert_mean(summary, 1, false_alarm=RATE, detects=VISIBLE[name], what=f"{name}, channel {k}")
    assert shown.tally.leaked <= 1e-5 * shown.tally.samples
    assert shown.tally.non_finite == 0


def test_picture_one_percent_too_bright_is_caught(rendered):
    shown, reference, on_object = rendered("p1_sphere")
    with pytest.raises(AssertionError, match="wrong mean"):
        for summary in compared(shown, reference, on_object, factor=1.012):
            assert_mean(summary, 1, false_alarm=RATE, detects=VISIBLE["p1_sphere"])


def judged(shown, reference, on_object, planted=None):
    """The tiles of our picture, multiplied by ``planted`` (h, w, 1), against the reference's."""
    height, width, _ = reference["image"].shape
    samples = shown.samples.transpose(0, 2, 1).reshape(-1, height, width, 3) * (1 if planted is None else planted)
    ours = Estimate(samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(len(samples)), len(samples))
    about = json.loads(str(reference["meta"]))
    theirs = Estimate(reference["image"], reference["stderr"], about["chunks"])
    if about["scene"]["name"] in HEAVY_TAILS:
        ours = with_rare_samples(ours, len(samples), theirs, about["spp"])
    rate = shared_rate(TILES_RATE, len(PASSES))
    return compare_tiles(ours, theirs, on_object.reshape(height, width), TILE, rate)


@pytest.mark.parametrize("name", PASSES)
def test_every_tile_agrees_with_the_reference(rendered, name):
    """Tiles of 8 x 8 pixels, the noise of both pictures counted: no z beyond what chance allows.

    All scenes, tiles and channels together raise a false alarm with ``TILES_RATE``. Blind to errors that a single tile
    hides in its noise, below ``VISIBLE_IN_A_TILE``; the mean over the object sees what tiles share.
    """
    test = judged(*rendered(name))
    typical = test.detects * np.median(test.noise) / test.noise.max()
    assert typical <= VISIBLE_IN_A_TILE[name], "too few passes to see what must be seen"
    assert test.agrees, f"{name}: {test.summary()}"


@pytest.mark.parametrize("name", PASSES)
def test_single_wrong_tile_is_caught(rendered, name):
    """The mean over the object would not show it."""
    shown, reference, on_object = rendered(name)
    test = judged(shown, reference, on_object)
    # a tile with typical noise
    middle = np.argsort(test.noise.max(axis=1))[len(test.noise) // 2]
    row, column = test.corner[middle]
    planted = np.ones((*reference["coverage"].shape, 1))
    planted[row : row + TILE, column : column + TILE] += 1.5 * VISIBLE_IN_A_TILE[name]
    wrong = judged(shown, reference, on_object, planted)
    assert not wrong.agrees
    assert np.argmin(wrong.p.min(axis=1)) == middle


def test_furnace_is_white_in_every_pixel(shared):
    shown, _, on_object = _rendered(shared, "p6_furnace", 8)
    assert on_object.mean() > 0.2
    np.testing.assert_allclose(shown.samples, 1, atol=1e-6)
    # Mitsuba lets 1e-5 of its paths slip
    assert shown.tally.leaked <= 1e-5 * shown.tally.samples
