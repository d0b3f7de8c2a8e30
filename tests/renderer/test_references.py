"""The six public reference scenes against another renderer's pictures of them (Mitsuba 3.9.1)."""

import functools

import numpy as np
import pytest

from renderer.scene.scene_file import load_scene
from tests.assertions import assert_mean, seed, shared_rate
from tests.renderer.scenes import picture

PASSES = {"p1_sphere": 200, "p2_bunny_marble": 24, "p3_bunny_backlit": 100, "p4_slab": 64, "p5_spot_matched": 120}
VISIBLE = {"p1_sphere": 0.012, "p2_bunny_marble": 0.02, "p3_bunny_backlit": 0.12, "p4_slab": 0.05,
           "p5_spot_matched": 0.025}  # fmt: skip
"""Share of the object's mean that is seen if it is wrong."""

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


def test_every_block_of_the_marble_bunny_agrees(rendered):
    """Blocks of 8 x 8 pixels: the largest of their z stays within what chance allows. Sees 12 % in a block."""
    shown, reference, on_object = rendered("p2_bunny_marble")

    def blocks(pixels):
        return pixels.reshape(*pixels.shape[:-1], 8, 8, 8, 8).sum(axis=(-3, -1)).reshape(*pixels.shape[:-1], 64)

    full = blocks(on_object.astype(float)) == 64
    ours = blocks(shown.samples[:, 0])[:, full]
    theirs = blocks(reference["image"][..., 0].astype(float).ravel())[full]
    noise = np.sqrt(blocks(reference["stderr"][..., 0].astype(float).ravel() ** 2)[full])
    assert full.sum() >= 8
    for k in range(int(full.sum())):
        error = np.hypot(ours[:, k].std(ddof=1) / np.sqrt(len(ours)), noise[k])
        assert_mean((ours[:, k].mean() / theirs[k], error / theirs[k], len(ours)), 1,
                    false_alarm=shared_rate(1e-3, int(full.sum())), detects=0.12, what=f"block {k}")  # fmt: skip


def test_furnace_is_white_in_every_pixel(shared):
    shown, _, on_object = _rendered(shared, "p6_furnace", 8)
    assert on_object.mean() > 0.2
    np.testing.assert_allclose(shown.samples, 1, atol=1e-6)
    # Mitsuba lets 1e-5 of its paths slip
    assert shown.tally.leaked <= 1e-5 * shown.tally.samples
