"""Which shader for which object."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.scene.admission import admit
from renderer.scene.description import DirectionalLight, PointLight, RectangleLight, SphereLight
from renderer.shaders.selection import (
    CHEAPEST_FIRST,
    Appearance,
    appearance,
    pixel_footprint,
    predicted_errors,
    select,
    tolerance,
)
from sss_tools import shapes
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, mirror, placed, scene, translucent

SIDE_LIGHT = DirectionalLight(np.array([1.0, 0, 0]), np.full(3, 3.0))
BALL = shapes.icosphere(1.0, 2)


def ball_at(distance, lights=(SIDE_LIGHT,), mesh=BALL, material=None, resolution=(160, 160), **more):
    thing = placed(mesh, material or translucent(0.8, 2.0), **more)
    of = scene([thing], lights, camera((0, 0, distance), resolution=resolution))
    return admit(of)[0]


def chosen(of, *arguments, **options):
    (plan,) = select(of, *arguments, **options)
    return plan.shader


def rank(shader) -> int:
    return CHEAPEST_FIRST.index(shader)


def test_the_tolerance_is_the_formula():
    assert tolerance(0, 1e9) == pytest.approx(0.3) and tolerance(1, 1e9) == pytest.approx(0.003)
    assert tolerance(0.5, 64) == pytest.approx(0.06)
    assert np.isfinite(tolerance(0.5, 0))


def test_farther_is_never_dearer_and_all_four_are_used():
    distances = np.geomspace(3, 5000, 60)
    ranks = [rank(chosen(ball_at(distance), 0.7)) for distance in distances]
    assert ranks == sorted(ranks, reverse=True)
    assert set(ranks) == {0, 1, 2, 3}


@pytest.mark.parametrize("distance", [3, 10, 40, 150, 1000])
def test_more_quality_is_never_cheaper(distance):
    of = ball_at(distance)
    ranks = [rank(chosen(of, quality)) for quality in np.linspace(0, 1, 41)]
    assert ranks == sorted(ranks)


def test_more_pixels_are_never_cheaper():
    ranks = [rank(chosen(ball_at(60, resolution=(n, n)), 0.7)) for n in (8, 40, 160, 640, 2560)]
    assert ranks == sorted(ranks) and ranks[0] < ranks[-1]


def test_the_choice_is_the_cheapest_within_the_tolerance():
    for distance in np.geomspace(3, 5000, 25):
        of = ball_at(distance)
        (plan,) = select(of, 0.7)
        look = appearance(of, of.objects[0])
        errors, allowed = predicted_errors(look), tolerance(0.7, look.size_px)
        good = [name for name in CHEAPEST_FIRST[:-1] if errors[name] <= allowed]
        assert plan.shader == (good[0] if good else "path")
        if good:
            assert plan.predicted_error == errors[plan.shader]


def test_the_reason_names_shader_error_tolerance_and_holes():
    (plan,) = select(ball_at(40), 0.7)
    assert plan.shader in ("plumb", "scalar")
    for part in ("% wrong", "tolerance", "quality 0.7", "closed, manifold and oriented"):
        assert part in plan.reason
    (near,) = select(ball_at(3), 0.9)
    assert near.reason.startswith("the best faster shader, plumb, is predicted")


def test_predicted_errors_of_a_ball_are_the_measured_ones():
    look = Appearance(5, 0.01, 200, depth=2.0, diffusion=1.0, aspect=1.0, unlit=0.5)
    errors = predicted_errors(look)
    assert errors["plumb"] == pytest.approx(np.hypot(0.03, 0.03))
    assert errors["scalar"] == pytest.approx(np.hypot(errors["plumb"], 0.15))
    assert errors["diffuse"] == pytest.approx(np.hypot(0.6, 0.03) + 0.01)
    # what is blurred within a pixel does not show
    assert predicted_errors(replace(look, footprint=100.0))["diffuse"] == pytest.approx(
        np.hypot(0.6 * 0.02, 0.03) + 0.01
    )
    # long and flat bodies are worse, and what is lit from the camera hides the scalar's weakness
    assert predicted_errors(replace(look, aspect=3.0))["plumb"] > 0.2
    assert predicted_errors(replace(look, unlit=0.0))["scalar"] == errors["plumb"]


def test_the_noise_of_path_is_predicted_where_the_passes_are_known():
    assert select(ball_at(3), shader="path", passes=100)[0].predicted_error == pytest.approx(0.1)
    assert select(ball_at(3), shader="path")[0].predicted_error is None


def test_how_a_ball_stands_in_the_picture():
    of = ball_at(11, resolution=(200, 100))
    look = appearance(of, of.objects[0])
    assert look.distance == pytest.approx(10)
    # 30 degrees over 100 rows, at the nearest point
    assert look.footprint == pytest.approx(2 * 10 * np.tan(np.radians(15)) / 100)
    assert pixel_footprint(of.camera, 10) == look.footprint
    assert look.size_px == pytest.approx(2 / (2 * 11 * np.tan(np.radians(15)) / 100), rel=1e-6)
    # 3 V / A of an icosphere is that of the ball within 4 %; sigma_t' = 2
    assert look.depth == pytest.approx(2, rel=0.04)
    assert look.aspect == pytest.approx(1, abs=1e-6)
    (plan,) = select(of)
    assert plan.mean_free_path_px == pytest.approx(0.5 / look.footprint)


def test_a_long_body_has_its_aspect():
    of = ball_at(20, mesh=shapes.box((1, 1, 4)))
    # in proportion to the spread of the surface, which is a little less than that of the solid
    assert 2.5 < appearance(of, of.objects[0]).aspect < 4.5


@pytest.mark.parametrize(
    ("lights", "share"),
    [
        ([DirectionalLight(np.array([0, 0, -1.0]), np.ones(3))], 0.0),
        ([DirectionalLight(np.array([0, 0, 1.0]), np.ones(3))], 1.0),
        ([DirectionalLight(np.array([1.0, 0, 0]), np.ones(3))], 0.5),
        ([PointLight(np.array([0, 0, 9.0]), np.ones(3))], 0.0),
        ([SphereLight(np.array([0, 9.0, 0]), 1.0, np.ones(3))], 0.5),
        ([RectangleLight(np.array([0, 0, -9.0]), np.zeros(3), np.array([0, 1.0, 0]), (1, 1), np.ones(3))], 1.0),
        ([WHITE_SKY], 0.0),
        # pi from the sky, which leaves nothing unlit, and pi from behind
        ([WHITE_SKY, DirectionalLight(np.array([0, 0, 1.0]), np.full(3, np.pi))], 0.5),
    ],
    ids=["in front", "behind", "beside", "point", "sphere", "rectangle", "sky", "half sky"],
)
def test_the_unlit_share_of_a_ball(lights, share):
    of = ball_at(20, lights)
    assert appearance(of, of.objects[0]).unlit == pytest.approx(share, abs=1e-6)


def test_what_is_asked_for_is_done_and_the_user_comes_before_the_scene():
    of = ball_at(3, shader="scalar")
    assert chosen(of, 1.0) == "scalar" and select(of, 1.0)[0].reason.startswith("asked for")
    assert chosen(of, 1.0, "plumb") == "plumb"


def test_hole_handling_comes_from_the_verdict_the_scene_or_the_user():
    holed = shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 0.2)
    shelled = shapes.with_internal(BALL, (0, 0, 0), 0.4, 1)
    for mesh, state, handling in ((BALL, "closed", "strict"), (holed, "holes", "cap"),
                                  (shelled, "closed", "terminate")):  # fmt: skip
        (plan,) = select(ball_at(5, mesh=mesh))
        assert (plan.state, plan.hole_handling) == (state, handling)
    (plan,) = select(ball_at(5, mesh=holed, hole_handling="strict"))
    assert plan.hole_handling == "strict" and "hole handling asked for" in plan.reason
    (plan,) = select(ball_at(5, mesh=holed, hole_handling="terminate"))
    assert plan.hole_handling == "terminate"
    (plan,) = select(ball_at(5, mesh=holed, hole_handling="strict"), hole_handling="surface")
    assert (plan.hole_handling, plan.shader) == ("surface", "diffuse")


@pytest.mark.parametrize("wanted", ["path", "plumb", "scalar"])
def test_an_open_mesh_has_no_inside_whatever_is_asked_for(wanted):
    saucer = shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 1.85)
    (plan,) = select(ball_at(5, mesh=saucer), 1.0, wanted)
    assert (plan.state, plan.hole_handling, plan.shader) == ("open", "surface", "diffuse")
    assert plan.warning is not None and wanted in plan.warning and plan.predicted_error is None
    assert select(ball_at(5, mesh=saucer), 1.0)[0].warning is None


def test_opaque_objects_are_what_they_are():
    of = scene([placed(BALL, diffuse(0.5), name="a"), placed(BALL, mirror(0.5), name="b")], [WHITE_SKY],
               camera((0, 0, 9)))  # fmt: skip
    plans = select(of, shader="path")
    assert [plan.shader for plan in plans] == ["opaque", "mirror"]
    assert all(plan.state is None and plan.mean_free_path_px is None for plan in plans)


def test_each_object_is_judged_where_it_stands():
    things = [placed(shapes.moved(BALL, (0, 0, -z)), translucent(0.8, 2.0), name=str(z)) for z in (0, 40, 2000)]
    of, _ = admit(scene(things, [SIDE_LIGHT], camera((0, 0, 4), resolution=(160, 160))))
    ranks = [rank(plan.shader) for plan in select(of, 0.7)]
    assert ranks[0] > ranks[1] > ranks[2]
