"""Scene and settings to film: what the picture depends on, and what it does not."""

import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from renderer import render, strips
from renderer.render import Renderer, Settings, planned_hash
from renderer.scene.description import DirectionalLight
from sss_tools import shapes
from sss_tools.errors import InputError
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, mirror, placed, scene, translucent

SUN = DirectionalLight(np.array([-1.0, -1, -1]), np.full(3, 2.0))


def small_scene(resolution=(24, 16), material=None, distance=6.0):
    ball = placed(shapes.icosphere(1.0, 2), material or translucent(0.8, 4.0))
    return scene([ball], [WHITE_SKY, SUN], camera((0, 0.5, distance), resolution=resolution))


def filmed(of, passes=range(3), **settings):
    renderer = Renderer(of, Settings(**{"shader": "path", **settings}))
    renderer.run(passes)
    return renderer.film


def same_bits(one, two) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(two, name))
               for name in ("sum", "sum_of_squares", "hits", "left_out", "biased"))  # fmt: skip


@pytest.mark.parametrize("shader", ["path", "plumb", "scalar"])
def test_threads_and_the_size_of_strips_do_not_show(monkeypatch, shader):
    """Parts of passes as well as many passes at once."""
    whole = filmed(small_scene(), range(9), shader=shader, threads=1)
    for threads, longest, room in ((2, 2**13, 1), (1, 100, 1000), (2, 37, 50), (5, 1000, 10**5)):
        monkeypatch.setattr(render, "_STRIP", longest)
        monkeypatch.setattr(render, "_FRAME_STRIP", longest)
        monkeypatch.setattr(strips, "_FIRST_ROOM", room)
        assert same_bits(whole, filmed(small_scene(), range(9), shader=shader, threads=threads)), longest


def test_passes_are_the_same_in_one_run_and_in_many():
    whole = filmed(small_scene(), range(6))
    parts = Renderer(small_scene(), Settings(shader="path"))
    for passes in (range(1), range(1, 4), range(4, 6)):
        parts.run(passes)
    assert same_bits(whole, parts.film)  # added in the same order


def test_passes_in_another_order_add_up_to_the_same():
    forth, back = filmed(small_scene(), range(6)), filmed(small_scene(), [5, 3, 4, 0, 2, 1])
    assert forth.ranges == back.ranges == ((0, 6),)
    np.testing.assert_allclose(forth.sum, back.sum, rtol=1e-12, atol=0)


def test_seeds_and_passes_bring_new_noise():
    base, seed, later = (filmed(small_scene(), passes, seed=seed)
                         for passes, seed in ((range(1), 0), (range(1), 1), (range(1, 2), 0)))  # fmt: skip
    on_ball = base.object_pixels()
    for other in (seed, later):
        assert (base.sum[on_ball] != other.sum[on_ball]).all(axis=1).mean() > 0.5


def test_done_can_end_the_run_after_any_pass():
    renderer = Renderer(small_scene(), Settings(shader="path"))
    renderer.run(range(1000), lambda index: index == 2)
    assert renderer.film.ranges == ((0, 3),)
    # the passes under way were dropped without harm: the film goes on as if nothing had been
    renderer.run(range(3, 5))
    assert same_bits(renderer.film, filmed(small_scene(), range(5)))


def test_an_interrupt_leaves_whole_passes():
    renderer = Renderer(small_scene(), Settings(shader="path"))

    def interrupt(index):
        if index == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        renderer.run(range(1000), interrupt)
    assert renderer.film.ranges == ((0, 2),)
    assert same_bits(renderer.film, filmed(small_scene(), range(2)))


def test_no_thread_outlives_a_run():
    before = threading.active_count()
    filmed(small_scene(), threads=3)
    assert threading.active_count() == before


def test_opaque_things_and_the_background_are_no_object_pixels_and_have_no_shader():
    things = [
        placed(shapes.icosphere(0.5, 2), translucent(), name="ball"),
        placed(shapes.moved(shapes.box(1.0), (1.5, 0, 0)), diffuse(0.5), name="box"),
        placed(shapes.moved(shapes.box(1.0), (-1.5, 0, 0)), mirror(0.9), name="mirror"),
    ]
    of = scene(things, [WHITE_SKY], camera((0, 0, 8), resolution=(48, 16)))
    renderer = Renderer(of, Settings(shader="path"))
    renderer.run(range(2))
    picture = renderer.picture(1.0)
    # a column is 0.27 units wide; sky, mirror, ball, box from left to right
    row, columns = 8, [0, 18, 24, 30]
    assert picture.object_id[row, columns].tolist() == [-1, 2, 0, 1]
    assert picture.shader_id[row, columns].tolist() == [-1, -1, 0, -1]
    assert renderer.film.object_pixels()[row, columns].tolist() == [False, False, True, False]


def test_pixels_of_fast_shaders_are_biased_and_others_are_not():
    things = [
        placed(shapes.moved(shapes.icosphere(1.0, 2), (-1.2, 0, 0)), translucent(), name="fast", shader="plumb"),
        placed(shapes.moved(shapes.icosphere(1.0, 2), (1.2, 0, 0)), translucent(), name="path", shader="path"),
    ]
    film = filmed(scene(things, [WHITE_SKY], camera((0, 0, 12), resolution=(48, 24))), range(2), shader="auto")
    error = film.stderr()
    assert np.isnan(error[12, 19]).all() and np.isfinite(error[12, 28]).all() and np.isfinite(error[0, 0]).all()


def test_the_camera_may_not_be_inside_a_translucent_object():
    with pytest.raises(InputError, match="inside the object 'thing'"):
        Renderer(small_scene(distance=0.3), Settings())


def test_the_hash_is_of_the_scene_and_of_what_is_done_with_it():
    of = small_scene()
    plans = Renderer(of, Settings(shader="path")).plans
    base = planned_hash(of, plans)
    assert planned_hash(of, [replace(plans[0], reason="another", distance=3.0)]) == base
    assert planned_hash(of, [replace(plans[0], shader="plumb")]) != base
    assert planned_hash(of, [replace(plans[0], hole_handling="terminate")]) != base
    assert planned_hash(small_scene(material=translucent(0.8, 4.1)), plans) != base
    # the seed is kept beside the hash; quality that changes no plan changes no picture
    assert filmed(of, (), seed=3).scene_hash == filmed(of, (), seed=4).scene_hash == base
    assert filmed(of, (), quality=0.9).scene_hash == base


def test_the_camera_sees_what_is_in_front_of_it_the_right_way_up():
    things = [placed(shapes.moved(shapes.box(0.5), at), diffuse(colour), name=name) for name, at, colour in (
        ("red right", (1, 0, 0), (1, 0, 0)), ("green above", (0, 1, 0), (0, 1, 0)))]  # fmt: skip
    film = filmed(scene(things, [WHITE_SKY], camera((0, 0, 8), resolution=(33, 33))), range(1))
    right, above = film.mean()[16, 24], film.mean()[8, 16]
    assert right[0] > 0.3 and right[1] == right[2] == 0
    assert above[1] > 0.3 and above[0] == above[2] == 0


def test_light_in_a_scene_far_from_the_origin_is_the_same():
    """The unit-size frame: at 1e4 sizes from the origin float32 would leave no picture at all.

    Vertices are moved in float64 and come back to the frame off by 1e4 * 2^-53, which float32 does not see; so the
    rays agree but for roundings of the camera, and all but a few paths with them.
    """
    offset = np.array([1e4, -2e4, 3e4])
    near = small_scene()
    far = replace(
        near,
        objects=(replace(near.objects[0], mesh=shapes.moved(near.objects[0].mesh, offset)),),
        camera=replace(near.camera, position=near.camera.position + offset, target=near.camera.target + offset),
    )
    one, two = filmed(near).mean(), filmed(far).mean()
    assert (np.abs(one - two) < 1e-3 * (1 + one)).all(axis=-1).mean() > 0.97


@pytest.mark.skipif(sys.platform != "linux", reason="measured by the kernel's counter")
def test_rendering_pass_after_pass_does_not_grow():
    import resource

    renderer = Renderer(small_scene((64, 64)), Settings(shader="path"))
    renderer.run(range(3))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    renderer.run(range(3, 20))
    # kilobytes; one pass has 64 * 64 * 3 * 4 = 48 kB of radiance alone
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000


# ---- no more than a scene needs ----


def test_nothing_is_built_for_a_shader_that_does_not_need_it(monkeypatch):
    """A far object, diffuse, beside a near one lit by path: no curvature, no table; and each part is said to have been
    built for the object that needs it."""

    def never(*_arguments):
        raise AssertionError("built in vain")

    things = [
        placed(shapes.moved(shapes.icosphere(1.0, 2), (0, 0, -z)), translucent(0.8, 2.0), name=str(z))
        for z in (0, 4000)
    ]
    of = scene(things, [WHITE_SKY], camera((0, 0, 4), resolution=(64, 64)))
    with monkeypatch.context() as patch:
        patch.setattr("sss_tools.curvature.mean_curvature", never)
        patch.setattr("renderer.shaders.surface.ball_table", never)
        renderer = Renderer(of, Settings(quality=0.9))
        assert [plan.shader for plan in renderer.plans] == ["path", "diffuse"]
        assert set(renderer.stages.parts) == {""}
        with pytest.raises(AssertionError, match="in vain"):
            Renderer(of, Settings(shader="scalar"))
    renderer = Renderer(replace(of, objects=(replace(things[0], shader="plumb"), things[1])), Settings(quality=0.9))
    assert set(renderer.stages.parts) == {"", "0"}
    assert set(renderer.stages.parts["0"]) == {"curvature", "table of balls", "light of the sky at corners"}


def test_the_grid_is_built_for_dense_bright_bodies_lit_by_path_alone():
    dense = placed(shapes.icosphere(1.0, 3), translucent(0.999, 60.0), name="dense")
    of = scene([dense], [WHITE_SKY], camera((0, 0, 4), resolution=(256, 256)))
    assert "distance grid and ball jumps" in Renderer(of, Settings(shader="path")).stages.parts[""]
    assert "distance grid and ball jumps" not in Renderer(of, Settings(shader="scalar")).stages.parts[""]
