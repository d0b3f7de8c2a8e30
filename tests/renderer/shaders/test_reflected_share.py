"""The share of paths that follow reflections may be asked for, and the mean stays."""

import numpy as np
import pytest

from renderer.shaders import boundary
from sss_tools import shapes
from tests.renderer.scenes import camera, half_white_sky, picture, placed, scene, translucent

PASSES = 400


def means(share, seed: int, roughness: float = 0.0) -> np.ndarray:
    """(passes,) mean radiance of pictures of a ball whose lower half is dark."""
    ball = placed(shapes.icosphere(1.0, 2), translucent(0.9, 2.0, roughness=roughness), reflected_share=share)
    of = scene([ball], [half_white_sky()], camera((0, 0, 6), fov=18.0, resolution=(16, 16)))
    return picture(of, PASSES, seed=seed).pass_means()


def z(one: np.ndarray, two: np.ndarray) -> float:
    return (one.mean() - two.mean()) / np.sqrt((one.var(ddof=1) + two.var(ddof=1)) / PASSES)


@pytest.mark.parametrize("roughness", [0.0, 0.3])
@pytest.mark.parametrize("share", [0.2, 0.7])
def test_the_mean_stays(share, roughness):
    """False alarm 6e-5 each; 100 000 samples of relative deviation about 1 find an error of 2 %."""
    plain, asked = means(None, 1, roughness), means(share, 2, roughness)
    assert np.sqrt((plain.var() + asked.var()) / PASSES) < 0.01 * plain.mean()
    assert abs(z(plain, asked)) < 4
    assert not np.array_equal(means(share, 1, roughness), plain)


def test_a_forgotten_weight_would_be_seen(monkeypatch):
    monkeypatch.setattr(boundary, "_weigh", lambda *_: None)
    assert abs(z(means(None, 1), means(0.7, 2))) > 8
