"""Objects lit by several shaders: every camera sample by one of them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.columns import Columns
from renderer.render import Renderer, Settings, planned_hash
from renderer.scene.description import DirectionalLight, EnvironmentLight, RectangleLight
from renderer.shaders import selection
from renderer.shaders.blend import Blend, Choices
from renderer.tracing.streams import stream_keys
from sss_tools.shapes import moved
from tests.renderer.scenes import bumpy_ball, camera, placed, scene, translucent

LIGHTS = [
    EnvironmentLight(radiance=np.array([0.3, 0.2, 0.1])),
    DirectionalLight(np.array([-1.0, -1, -0.3]), np.full(3, 2.0)),
]
LAMP = RectangleLight(np.array([3.0, 3.0, 2.0]), np.zeros(3), np.array([0.0, 1.0, 0.0]), (2.0, 2.0), np.full(3, 2.0))
VIEW = camera((0.5, 1.5, 6), fov=35, resolution=(40, 30))
KEYS = stream_keys(3, 0, np.arange(200_000))


def lit(shares, things=None, threads=1, lights=LIGHTS):
    """A renderer whose objects have these shares, whatever the selection says."""
    things = things or [placed(bumpy_ball(3), translucent(0.8, 4.0))]
    select = selection.select

    def chosen(*arguments, **options):
        plans = select(*arguments, **options)
        return [replace(plan, shares=dict(shares), shader=max(shares, key=shares.get)) for plan in plans]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(selection, "select", chosen)
        return Renderer(scene(things, lights, VIEW), Settings(threads=threads))


def sums(renderer, passes=(0,)):
    renderer.run(passes)
    return renderer.film.sum


def test_shares_are_met_and_objects_choose_apart():
    """200 000 choices of share 0.3: 6 standard deviations are 0.006; false alarms 2e-9 each."""
    first, second = (Blend(index, (None, None), (0.3, 0.7)).choose(KEYS) for index in (0, 1))
    for chosen in (first, second):
        assert abs((chosen == 0).mean() - 0.3) < 0.006
    assert abs((first == second).mean() - (0.3**2 + 0.7**2)) < 0.007
    assert abs((first[1:] == first[:-1]).mean() - (0.3**2 + 0.7**2)) < 0.007


def test_branches_choose_as_their_path_did():
    choices = Choices({0: Blend(0, (None, None), (0.5, 0.5))}, 50)
    samples = np.arange(50, dtype=np.int32)
    choices.choose(samples, KEYS[:50])
    assert 0 < choices.of(0, samples).sum() < 50
    assert_array_equal(choices.of(0, samples), choices.of(0, samples + 50))


@pytest.mark.parametrize("shares", [{"plumb": 0.4, "path": 0.6}, {"scalar": 0.5, "plumb": 0.5},
                                    {"diffuse": 0.2, "scalar": 0.3, "path": 0.5}], ids=str)  # fmt: skip
def test_each_sample_is_that_of_the_shader_it_chose(shares):
    """Bit for bit, all that the sample meets on its way included. Frames of fast shaders alone have a tracer of their
    own, so where path takes part the others' samples are those of the wavefront."""
    mixed = lit(shares)
    got = sums(mixed)
    chosen = mixed._blends[0].choose(stream_keys(0, 0, np.arange(40 * 30))).reshape(30, 40)
    for number, name in enumerate(shares):
        pure = lit({name: 1.0})
        if "path" in shares:
            pure._frames = None
        assert (mixed._frames is None) == (pure._frames is None)
        here = chosen == number
        assert_array_equal(got[here], sums(pure)[here])
    hit = mixed.film.hits > 0
    for number in range(len(shares)):
        assert (hit & (chosen == number)).any()
    assert mixed.film.biased[hit].all()


def test_frames_that_mix_fast_shaders_are_the_wavefronts():
    """To rounding, but for a pixel of a hundred where a chord or a shadow slips past an edge."""
    things = [placed(moved(bumpy_ball(3), (x, 0, 0)), translucent(0.8, 4.0), name=str(x)) for x in (-1.2, 1.2)]
    direct, wavefront = (lit({"diffuse": 0.3, "plumb": 0.7}, things) for _ in range(2))
    wavefront._frames = None
    assert direct._frames is not None
    ours, twins = sums(direct), sums(wavefront)
    assert_array_equal(direct.film.hits, wavefront.film.hits)
    assert (np.abs(ours - twins) > 1e-4 * (twins + 0.01)).any(axis=-1).mean() < 0.01


def test_two_objects_that_mix_path_and_plumb_are_bit_equal_for_any_threads_and_split():
    things = [placed(moved(bumpy_ball(3), (x, 0, 0)), translucent(0.8, 4.0), name=str(x)) for x in (-1.2, 1.2)]
    shares = {"plumb": 0.4, "path": 0.6}
    whole = sums(lit(shares, things), range(4))
    assert_array_equal(whole, sums(lit(shares, things, threads=2), range(4)))
    parts = [lit(shares, things) for _ in range(2)]
    sums(parts[0], range(1)), sums(parts[1], range(1, 4))
    parts[0].film.merge(parts[1].film)
    np.testing.assert_allclose(parts[0].film.sum, whole, rtol=1e-12)


@pytest.mark.parametrize("light", [EnvironmentLight(radiance=np.ones(3)), LAMP], ids=lambda light: type(light).__name__)
def test_passes_overlap_and_each_is_lit_by_its_own_beams(light):
    """Plumb probes an even sky along other axes in each pass, and a lamp at other places. Bit for bit; whole passes are
    begun before the one before has ended."""
    mixed = lit({"plumb": 0.4, "path": 0.6}, lights=[light])
    alone = [sums(lit({"plumb": 0.4, "path": 0.6}, lights=[light]), [number]) for number in (3, 4, 5)]
    assert not np.array_equal(alone[0], alone[1])
    most, put = 0, Columns.put

    def noted(columns, strip, step):
        nonlocal most
        put(columns, strip, step)
        most = max(most, len(columns.passes))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Columns, "put", noted)
        together = sums(mixed, range(3, 6))
    assert most == 3
    assert_array_equal(together, alone[0] + alone[1] + alone[2])


def test_films_of_other_shares_do_not_add_up():
    films = [lit({"plumb": share, "path": 1 - share}).film for share in (0.4, 0.5)]
    assert films[0].scene_hash != films[1].scene_hash
    of = lit({"plumb": 1.0})
    # and those of a single shader are called as they always were
    plans = [replace(plan, shares={}) for plan in of.plans]
    assert planned_hash(of.scene, of.plans) == planned_hash(of.scene, plans)
