"""Light in bodies with holes: each handling on a cut ball, and what happens when a cap is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.render import Renderer, Settings
from renderer.scene.admission import admit
from renderer.scene.description import DirectionalLight, EnvironmentLight, RectangleLight
from renderer.scene.holes import close_holes
from renderer.shaders import boundary
from sss_tools import shapes
from sss_tools.mesh import Mesh
from tests.assertions import assert_mean, seed
from tests.renderer.scenes import WHITE_SKY, camera, picture, placed, scene, translucent
from tests.sss_tools.test_sealing import BALL, SIDE, spiked

FRONT = [0.2, 0.3, 0.93]
CUT = shapes.punctured(BALL, [FRONT], 2 * np.sin(np.radians(25) / 2))
MATERIAL = translucent(0.95, 4.0)
PASSES = 400


def half_sky() -> EnvironmentLight:
    """Radiance 1 from +x, 0 from -x."""
    image = np.zeros((64, 128, 3), np.float32)
    image[:, 64:] = 1
    return EnvironmentLight(image=image)


def seen(mesh, handling, light=WHITE_SKY, material=MATERIAL, passes=PASSES, damage=None, **more):
    """All samples of a picture of the mesh, from the front."""
    of = scene([placed(mesh, material)], [light], camera((0, 0, 8), fov=17, resolution=(12, 12)))
    checked, _ = admit(of)
    tracing, (report,) = close_holes(checked, ["path"], [handling], [""])
    if damage is not None:
        tracing = damage(tracing, len(mesh.faces))
    return picture(tracing, passes, handling=[report.handling], seed=seed(11), **more)


@pytest.fixture(scope="module")
def whole():
    """The closed ball, by name of its light."""
    return {"sky": seen(BALL, "strict"), "half": seen(BALL, "strict", half_sky())}


def agree(shown, reference, detects: float) -> None:
    """The two pictures have the same mean. Passes are paired: they share their random numbers."""
    mean = reference.pass_means().mean()
    assert_mean(shown.pass_means() - reference.pass_means(), 0.0, false_alarm=1e-4, detects=detects * mean)


@pytest.mark.parametrize("light", ["sky", "half"])
def test_a_capped_ball_is_as_bright_as_the_whole_one(whole, light):
    """A cap of 25 degrees, which goes on with the curve: PHYSICS section 7 has 1 % of error for a flat one.

    Sees 1.2 % of the mean; blind to errors that cancel over the picture.
    """
    shown = seen(CUT, "cap", {"sky": WHITE_SKY, "half": half_sky()}[light])
    assert shown.tally.leaked <= 1 and shown.tally.terminated == 0
    agree(shown, whole[light], detects=0.012)


def flipped(tracing, first):
    """Caps that face inwards."""
    (thing,) = tracing.objects
    faces = thing.mesh.faces.copy()
    faces[first:] = faces[first:, ::-1]
    return replace(tracing, objects=(replace(thing, mesh=Mesh(thing.mesh.vertices, faces)),))


def test_a_flipped_cap_is_caught(whole):
    shown = seen(CUT, "cap", half_sky(), damage=flipped)
    assert shown.tally.leaked > 1e-2 * shown.tally.samples
    with pytest.raises(AssertionError, match="wrong mean"):
        agree(shown, whole["half"], detects=0.012)


def test_a_cap_without_fresnel_is_caught(whole, monkeypatch):
    """An open window: light goes in and out as it comes."""
    of = boundary.Crossings.of.__func__

    def without(cls, scene, paths, index, triangle):
        at = of(cls, scene, paths, index, triangle)
        return replace(at, eta=np.where(triangle >= len(CUT.faces), np.float32(1), at.eta))

    monkeypatch.setattr(boundary.Crossings, "of", classmethod(without))
    with pytest.raises(AssertionError, match="wrong mean"):
        agree(seen(CUT, "cap"), whole["sky"], detects=0.012)


def test_the_thesis_rule_ends_paths_at_the_hole_and_is_off_by_more(whole):
    shown = seen(CUT, "terminate", half_sky())
    assert shown.tally.terminated > 1e-2 * shown.tally.samples and shown.tally.leaked == 0
    with pytest.raises(AssertionError, match="wrong mean"):
        agree(shown, whole["half"], detects=0.012)


def test_strict_counts_what_leaves_through_a_hole_as_leaks_with_their_place():
    shown = seen(CUT, "strict", passes=20)
    assert shown.tally.leaked > 1e-2 * shown.tally.samples and shown.tally.terminated == 0
    count, *total = shown.tally.leaks[0]
    assert count == shown.tally.leaked
    # the frame's unit is the ball's diameter; paths are found beyond the hole, or at the far wall seen through it
    assert np.linalg.norm(np.array(total) / count) < 0.6


def test_a_lossless_body_with_caps_is_a_furnace():
    """Every sample is 1 where nothing is lost, whatever paths do. Sees lost paths, not what the cap reflects."""
    several = shapes.punctured(BALL, [FRONT, SIDE, [0, -1, 0]], 0.4)
    shown = seen(several, "cap", material=translucent(1.0, 4.0), passes=20)
    assert shown.tally.leaked <= 1 and shown.tally.terminated == 0
    np.testing.assert_allclose(shown.samples, 1, atol=2e-3)


def test_a_body_inside_out_shines_like_one_that_is_not(whole):
    shown = seen(shapes.inverted(CUT), "cap")
    assert shown.tally.leaked <= 1
    agree(shown, whole["sky"], detects=0.012)
    shown = seen(shapes.inverted(BALL), "terminate")
    assert shown.tally.terminated <= 1
    agree(shown, whole["sky"], detects=0.012)


def test_a_solid_inside_another_one_changes_nothing_and_capped_bodies_may_overlap(whole):
    """The counter makes a union of them. Its own random numbers: a surface inside takes some."""
    shown = seen(shapes.joined(CUT, shapes.icosphere(0.5, 2)), "cap")
    assert shown.tally.leaked <= 1 and shown.tally.terminated == 0
    agree(shown, whole["sky"], detects=0.02)


def test_where_no_cap_fits_paths_end_with_the_colour():
    shown = seen(spiked(), "cap", material=translucent(1.0, 4.0), passes=20)
    assert shown.tally.terminated > 0 and shown.tally.leaked == 0
    np.testing.assert_allclose(shown.samples, 1, atol=2e-3)


PARALLEL = DirectionalLight(np.array([0.2, -0.1, -1.0]), np.ones(3))
RECTANGLE = RectangleLight(np.array([2.0, 3, 4]), np.zeros(3), np.array([0, 1.0, 0]), (1.0, 1.0), np.full(3, 5.0))


@pytest.mark.parametrize(
    ("light", "boundary_of"),
    [(PARALLEL, {}), (PARALLEL, {"ior": 1.0}), (RECTANGLE, {"ior": 1.0}), (RECTANGLE, {"roughness": 0.5})],
    ids=["beams", "parallel, matched", "rectangle, matched", "rectangle, rough"],
)
def test_beams_and_shadow_rays_meet_caps(light, boundary_of):
    """Refracted beams through the cap's facets, and next-event estimation.

    Without the cap's facets a fifth of the visible lit surface would stay dark.
    """
    material = translucent(0.95, 4.0, **boundary_of)
    ball = seen(BALL, "strict", light, material, passes=100)
    shown = seen(CUT, "cap", light, material, passes=100)
    agree(shown, ball, detects=0.06)


@pytest.mark.parametrize("shader", ["plumb", "scalar"])
def test_the_faster_shaders_take_caps_for_surface(shader):
    light = DirectionalLight(np.array([0.3, -0.2, -1.0]), np.ones(3))
    means = []
    for mesh in (BALL, CUT):
        of = scene([placed(mesh, MATERIAL)], [light], camera((0, 0, 8), fov=17, resolution=(24, 24)))
        renderer = Renderer(of, Settings(shader=shader))
        renderer.run(range(4))
        means.append(renderer.film.mean().mean())
    # the cap's curvature is a few percent off the ball's, on a tenth of what is seen
    assert renderer.plans[0].hole_handling == "cap"
    assert means[1] == pytest.approx(means[0], rel=0.02)


def test_dense_bodies_jump_under_caps_as_if_there_were_no_hole():
    """The grid of distances knows the cap, and that the body is closed."""
    dense = translucent(0.999, 60.0)
    films = []
    for mesh in (BALL, CUT):
        of = scene([placed(mesh, dense)], [WHITE_SKY], camera((0, 0, 8), fov=17, resolution=(12, 12)))
        renderer = Renderer(of, Settings(shader="path"))
        renderer.run(range(8))
        films.append(renderer)
    jumps = [renderer.acceleration.jumps[0] is not None for renderer in films]
    assert jumps[0] == jumps[1] and films[1].tally.leaked <= 1
    error = np.hypot(*(renderer.film.stderr().mean() for renderer in films)) / 12
    assert abs(films[0].film.mean().mean() - films[1].film.mean().mean()) < 5 * error + 0.01


def test_pictures_of_capped_bodies_do_not_depend_on_threads():
    films = []
    for threads in (1, 3):
        of = scene([placed(CUT, MATERIAL)], [half_sky()], camera((0, 0, 8), fov=17, resolution=(16, 16)))
        renderer = Renderer(of, Settings(shader="path", threads=threads))
        renderer.run(range(6))
        films.append(renderer.film.sum)
    np.testing.assert_array_equal(*films)
