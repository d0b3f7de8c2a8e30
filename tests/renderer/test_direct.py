"""Frames of fast shaders: the wavefront's picture, found without it."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer import direct
from renderer.direct import DirectTracer
from renderer.render import Renderer, Settings
from renderer.scene.description import DirectionalLight, EnvironmentLight, PointLight, RectangleLight, SphereLight
from renderer.strips import Strips
from renderer.wavefront import Wavefront
from sss_tools.shapes import box, icosphere, moved
from tests.renderer.scenes import bumpy_ball, camera, half_white_sky, placed, scene, traced, translucent

DIM_SKY = EnvironmentLight(radiance=np.array([0.3, 0.2, 0.1]))
LIGHTS = {
    "sun": DirectionalLight(np.array([-1.0, -1, -0.3]), np.array([2.0, 1, 1])),
    "bulb": PointLight(np.array([2.0, 3, 1]), np.array([20.0, 10, 5])),
    "window": RectangleLight(np.array([2.0, 3, 2]), np.zeros(3), np.array([0.0, 1, 0]), (1.0, 1.0), np.full(3, 5.0)),
    "globe": SphereLight(np.array([-2.0, 2, 1]), 0.5, np.full(3, 5.0)),
    "image": half_white_sky(),
    "sky": DIM_SKY,
}
VIEW = camera((0.5, 1.5, 6), fov=35, resolution=(80, 60))


def renderer(objects, lights, shader="plumb", view=VIEW, threads=1) -> Renderer:
    return Renderer(scene(objects, lights, view), Settings(shader=shader, threads=threads))


def both(of: Renderer, pass_index: int = 1):
    """Samples by the direct tracer and by the wavefront, its plain twin."""
    assert of._frames is not None
    twin = Wavefront(of.traced, of.camera, of._fast_bodies, of.settings.seed)
    count = of.film.hits.size
    return traced(DirectTracer(of._frames), count, pass_index), traced(twin, count, pass_index)


def assert_same_picture(ours, twins):
    """To rounding, but where it decides: which of two triangles a ray along their edge meets, or whether a chord
    or a shadow slips past one. Those are a pixel in a hundred thousand; one of these pictures' 4800 is let off."""
    assert_array_equal(ours.first_object, twins.first_object)
    # a float32 operation errs by 6e-8; some thirty of them follow one another, and grazing angles enlarge that
    far = np.abs(ours.radiance - twins.radiance) > 1e-4 * (twins.radiance + 0.01)
    assert far.any(axis=1).sum() <= 1
    assert abs(ours.tally.rays - twins.tally.rays) <= 4


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shader", ["plumb", "scalar", "diffuse"])
def test_the_picture_is_the_wavefronts(shader, light):
    lights = [LIGHTS[light], DIM_SKY] if light != "sky" else [DIM_SKY]
    assert_same_picture(*both(renderer([placed(bumpy_ball(), translucent(), normals="smooth")], lights, shader)))


def test_the_picture_is_the_wavefronts_with_several_bodies():
    """Flat and smooth, of other index and of none: a body without index reflects nothing."""
    things = [
        placed(moved(bumpy_ball(3), (-1.2, 0, 0)), translucent(), name="one", normals="smooth"),
        placed(moved(box(1.2), (1.2, 0, 0)), translucent(ior=1.3), name="two"),
        placed(moved(icosphere(0.5, 3), (0, 0.2, 1.2)), translucent(ior=1.0), name="three"),
    ]
    ours, twins = both(renderer(things, [LIGHTS["window"], DIM_SKY]))
    assert set(np.unique(ours.first_object)) == {-1, 0, 1, 2}
    assert_same_picture(ours, twins)


def test_a_difference_is_found(monkeypatch):
    """The companion: reflections a thousandth too bright."""
    of = renderer([placed(bumpy_ball(), translucent())], [LIGHTS["window"], DIM_SKY], "scalar")
    exact = direct.fresnel_reflectance
    monkeypatch.setattr(direct, "fresnel_reflectance", lambda *a: (exact(*a)[0] * np.float32(1.001), exact(*a)[1]))
    with pytest.raises(AssertionError):
        assert_same_picture(*both(of))


def test_blocks_and_threads_do_not_change_a_bit(monkeypatch):
    things = [placed(bumpy_ball(), translucent(), normals="smooth")]
    lights = [LIGHTS["window"], DIM_SKY]
    films = []
    for block, threads in ((16384, 1), (16384, 2), (1000, 2), (77, 1)):
        monkeypatch.setattr(direct, "BLOCK", block)
        of = renderer(things, lights, threads=threads)
        of.run([0, 1])
        films.append(of.film)
    for film in films[1:]:
        assert_array_equal(film.sum, films[0].sum)
        assert_array_equal(film.hits, films[0].hits)


def test_chosen_pixels_are_those_of_the_whole_picture():
    of = renderer([placed(bumpy_ball(3), translucent())], [LIGHTS["window"], DIM_SKY])
    tracer, count = DirectTracer(of._frames), of.film.hits.size
    whole = traced(tracer, count, 3)
    chosen = np.arange(5, count, 7)
    some = traced(tracer, chosen, 3, longest=100)
    assert_array_equal(some.radiance, whole.radiance[:, :, chosen])
    assert_array_equal(some.first_object, whole.first_object[:, chosen])


def test_frames_that_are_no_longer_wanted_end():
    of = renderer([placed(bumpy_ball(3), translucent())], [DIM_SKY])
    strips = Strips(range(5), np.arange(of.film.hits.size), 1, of.film.hits.size)
    frames = DirectTracer(of._frames).trace(strips)
    next(frames)
    strips.stop()
    assert list(frames) == []


@pytest.mark.parametrize(
    ("shader", "material", "taken"),
    [("scalar", translucent(), True), ("path", translucent(), False), ("scalar", translucent(roughness=0.2), False)],
)
def test_only_scenes_of_fast_shaders_behind_smooth_boundaries_are_taken(shader, material, taken):
    assert (renderer([placed(icosphere(1, 2), material)], [DIM_SKY], shader)._frames is not None) == taken
