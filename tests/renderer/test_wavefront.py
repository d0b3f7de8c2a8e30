"""The tracer's loop: the picture depends on scene, seed and pass alone, and roulette does not change its mean."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.scene.description import (
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
    SphereLight,
)
from renderer.strips import Strips
from renderer.tracing import roulette
from sss_tools.shapes import box, icosphere, moved
from tests.assertions import assert_mean, seed
from tests.renderer.scenes import (
    WHITE_SKY,
    Picture,
    bumpy_ball,
    camera,
    diffuse,
    mirror,
    picture,
    placed,
    scene,
    traced,
    translucent,
    wavefront,
)

WIDTH, HEIGHT = 36, 24
PIXELS = WIDTH * HEIGHT


def vector(*coordinates) -> np.ndarray:
    return np.array(coordinates, float)


def everything(sigma_t):
    """One of each: boundaries smooth, rough and matched, flat and interpolated normals, floor, mirror, all lights."""
    image = np.random.default_rng(1).random((8, 16, 3)).astype(np.float32)
    image[2, 5] = 30  # bright enough to be sampled
    objects = [
        placed(moved(icosphere(0.5, 3), (-0.6, 0.5, 0)), translucent([0.9, 0.8, 0.7], sigma_t, 0.3, 1.5)),
        # reaches into the next: its surface there is not a boundary
        placed(moved(icosphere(0.5, 3), (0.6, 0.6, -0.4)), translucent(0.95, 4.0, 0.0, 1.0), normals="smooth"),
        placed(moved(bumpy_ball(3), (0, 1.2, -1.2)), translucent([0.9, 0.95, 0.8], 4.0, -0.5, 1.4, 0.3)),
        placed(moved(box((6, 0.1, 6)), (0, -0.1, 0)), diffuse([0.5, 0.6, 0.7])),
        placed(moved(box((0.1, 2, 2)), (-2, 1, 0)), mirror(0.9)),
    ]
    lights = [
        EnvironmentLight(image=image, rotation=30),
        PointLight(vector(1, 3, 1), vector(5, 5, 5)),
        DirectionalLight(vector(-1, -1, 0), vector(1, 1, 1)),
        RectangleLight(vector(0, 3, 0), vector(0, 0, 0), vector(1, 0, 0), (0.5, 0.5), vector(3, 3, 3)),
        SphereLight(vector(1.5, 1, 1), 0.3, vector(2, 2, 2)),
    ]
    return scene(objects, lights, camera((1, 2, 5), (0, 0.5, 0), fov=40, resolution=(WIDTH, HEIGHT)))


SCENES = {"chromatic": [3.0, 5.0, 9.0], "achromatic": 5.0}


@pytest.fixture(scope="module", params=SCENES)
def rendered(request):
    """A scene, and pass 3 of it in one piece."""
    described = everything(SCENES[request.param])
    return described, traced(wavefront(described, seed=5), PIXELS, 3)


@pytest.mark.parametrize("block", [1, 7, 1024, 20000])
def test_picture_is_the_same_bit_for_bit_in_blocks_of_any_size(rendered, block):
    described, whole = rendered
    other = traced(wavefront(described, seed=5, block=block), PIXELS, 3)
    assert_array_equal(other.radiance, whole.radiance)
    assert_array_equal(other.first_object, whole.first_object)
    assert other.tally == whole.tally


@pytest.mark.parametrize("size", [1, 100, 1000])
def test_picture_is_the_same_bit_for_bit_in_any_pieces(rendered, size):
    """Backwards, from one tracer that has traced other things before."""
    described, whole = rendered
    tracer = wavefront(described, seed=5)
    traced(tracer, 50)
    starts = range(0, PIXELS, size)
    pieces = {start: traced(tracer, np.arange(start, min(start + size, PIXELS)), 3) for start in reversed(starts)}
    assert_array_equal(np.concatenate([pieces[start].radiance for start in starts], axis=2), whole.radiance)
    assert_array_equal(np.concatenate([pieces[start].first_object for start in starts], axis=1), whole.first_object)
    assert sum(piece.tally.collisions for piece in pieces.values()) == whole.tally.collisions


def test_same_call_gives_the_same_picture(rendered):
    described, whole = rendered
    assert_array_equal(traced(wavefront(described, seed=5), PIXELS, 3).radiance, whole.radiance)


@pytest.mark.parametrize("change", [{"seed": 6}, {"pass": 4}])
def test_other_seeds_and_passes_give_other_samples(rendered, change):
    described, whole = rendered
    other = traced(wavefront(described, seed=change.get("seed", 5)), PIXELS, change.get("pass", 3))
    hit = whole.first_object >= 0
    assert (other.radiance != whole.radiance).any(axis=1)[hit].mean() > 0.95


def test_every_sample_is_finite_and_counted(rendered):
    _, whole = rendered
    assert np.isfinite(whole.radiance).all()
    assert (whole.radiance >= 0).all()
    assert whole.tally.samples == PIXELS
    assert whole.tally.leaked == whole.tally.terminated == 0
    assert set(np.unique(whole.first_object)) == {-1, 0, 1, 2, 3, 4}


def test_tally_starts_afresh_with_each_call():
    described = everything(5.0)
    tracer = wavefront(described)
    first, second = traced(tracer, 200), traced(tracer, 200)
    assert first.tally == second.tally
    assert traced(tracer, 0).tally.samples == 0


def test_nothing_is_seen_of_objects_outside_the_view():
    view = camera((0, 0, 5), (0, 0, 9), resolution=(8, 8))
    shown = picture(scene([placed(icosphere(1, 2), translucent())], [WHITE_SKY], view), 1)
    assert (shown.first_object == -1).all()
    assert_array_equal(shown.samples, np.ones((1, 3, 64)))


@pytest.mark.parametrize(("passes", "longest", "block"), [(2, 300, 1024), (5, 70, 50), (5, 1000, 20000)])
def test_passes_that_overlap_are_the_passes_taken_one_by_one(rendered, passes, longest, block):
    described, whole = rendered
    pixels = np.arange(100, 400)
    together = traced(wavefront(described, seed=5, block=block), pixels, 3, passes, longest)
    assert together.tally.samples == passes * 300
    for k in range(passes):
        alone = traced(wavefront(described, seed=5), pixels, 3 + k)
        assert_array_equal(together.radiance[k], alone.radiance[0])
        assert_array_equal(together.first_object[k], alone.first_object[0])
    assert_array_equal(together.radiance[0], whole.radiance[0, :, 100:400])


def test_passes_do_overlap():
    """The last paths of a pass do not walk alone: the next is begun before."""
    begun, added = [], []

    class Noted(Strips):
        def take(self):
            begun.append(len(added))
            return super().take()

    for strip in wavefront(everything(5.0), block=PIXELS).trace(Noted(range(4), np.arange(PIXELS), 1, 100)):
        added.append(strip.strip.pass_index)
    assert begun[PIXELS // 100 + 1] < PIXELS // 100  # of the second pass, while strips of the first were under way


# ---- roulette ----


def forget_the_weight(patch: pytest.MonkeyPatch) -> None:
    """Roulette that does not weigh the survivors up."""

    def survive(paths, uniforms, index, chance):
        u, _ = uniforms.draw_at(paths.stream, index)
        paths.alive[index[u >= chance]] = False

    patch.setattr(roulette, "_survive", survive)


def absorbing_ball_means(number: int):
    """Pass means over a ball of albedo 0.9, 0.85, 0.75 behind glass, filling the picture; and the tally."""
    view = camera((0, 0, 5), fov=16, resolution=(48, 48))
    ball = placed(icosphere(1, 4), translucent([0.9, 0.85, 0.75], 8.0, 0.0, 1.5))
    shown = picture(scene([ball], [WHITE_SKY], view), 64, seed=seed(number))
    return [shown.pass_means(k) for k in range(3)], shown.tally


@pytest.fixture(scope="module")
def followed():
    """Paths followed until they leave."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("renderer.tracing.paths.ROULETTE_BELOW", np.float32(0))
        return absorbing_ball_means(2)


def test_roulette_changes_costs_and_not_means(followed):
    """Against no roulette at all. Sees 5 % in each channel."""
    played, cost = absorbing_ball_means(1)
    assert cost.collisions < 0.9 * followed[1].collisions
    for one, other in zip(played, followed[0], strict=True):
        assert_mean(one - other, 0, false_alarm=3e-4, detects=0.05 * other.mean())


def test_roulette_without_its_weight_is_caught(followed, monkeypatch):
    forget_the_weight(monkeypatch)
    played, _ = absorbing_ball_means(1)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(played[0] - followed[0][0], 0, false_alarm=3e-4, detects=0.05 * followed[0][0].mean())


def white_ball(monkeypatch, many_steps: int = 16) -> Picture:
    """All light comes out again. Half of the walks end after so many steps, half of the others after twice as many."""
    monkeypatch.setattr(roulette, "MANY_STEPS", many_steps)
    view = camera((0, 0, 5), fov=16, resolution=(48, 48))
    ball = placed(icosphere(1, 4), translucent(1.0, 8.0, 0.0, 1.5))
    return picture(scene([ball], [WHITE_SKY], view), 32, seed=seed(3))


def test_ending_half_of_the_long_walks_does_not_change_the_mean(monkeypatch):
    """Sees 3 %."""
    played = white_ball(monkeypatch)
    assert_mean(played.pass_means(), 1, false_alarm=3e-4, detects=0.03)
    assert played.tally.collisions < 0.7 * white_ball(monkeypatch, 2**30).tally.collisions


def test_long_walks_that_are_not_weighed_up_are_caught(monkeypatch):
    forget_the_weight(monkeypatch)
    with pytest.raises(AssertionError, match="wrong mean"):
        assert_mean(white_ball(monkeypatch).pass_means(), 1, false_alarm=3e-4, detects=0.03)


def test_light_caught_between_two_mirrors_comes_to_an_end():
    """Perfect mirrors facing each other, the camera between them: 256 surfaces on, chance ends each path."""
    walls = [placed(moved(box((4, 4, 0.1)), (0, 0, z)), mirror(1.0)) for z in (-1, 1)]
    view = camera((0, 0, 0), (0, 0, 1), fov=1e-4, resolution=(8, 8))
    shown = picture(scene(walls, [WHITE_SKY], view), 1)
    assert shown.tally.rays < 64 * 1000
    assert np.isfinite(shown.samples).all()
