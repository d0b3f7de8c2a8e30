"""Which shader for which object."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from renderer.scene.admission import admit
from renderer.scene.description import DirectionalLight, PointLight, RectangleLight, SphereLight
from renderer.shaders import prediction
from renderer.shaders.appearance import Appearance, appearance, pixel_footprint
from renderer.shaders.prediction import Error, predicted_errors
from renderer.shaders.selection import (
    ADDED,
    CHEAPEST_FIRST,
    FADE,
    LEAST_SHARE,
    MOST_PASSES,
    Demand,
    Measured,
    noise_allowed,
    passes_within,
    picture_passes,
    select,
    shares_of,
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


def test_farther_is_never_dearer_and_most_shaders_are_used():
    distances = np.geomspace(3, 5000, 60)
    ranks = [rank(chosen(ball_at(distance), 0.7)) for distance in distances]
    assert ranks == sorted(ranks, reverse=True)
    assert set(ranks) >= {0, 3} and len(set(ranks)) >= 3


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
        if len(plan.shares) > 1:
            continue  # near a threshold
        look = appearance(of, of.objects[0])
        errors, allowed = predicted_errors(look), tolerance(0.7, look.size_px)
        good = [name for name in CHEAPEST_FIRST[:-1] if errors[name].bound <= allowed]
        assert plan.shader == (good[0] if good else "path")
        if good:
            assert plan.predicted_error == errors[plan.shader].error


def test_the_reason_names_shader_error_tolerance_and_holes():
    (plan,) = select(ball_at(100), 0.3)
    assert plan.shader != "path"
    for part in ("wrong", "counted as", "tolerance", "quality 0.3", "closed, manifold and oriented"):
        assert part in plan.reason
    (near,) = select(ball_at(3), 0.9)
    assert near.reason.startswith("the best faster shader, ")


def test_the_fit_multiplies_the_start_and_the_margin_the_error(monkeypatch):
    look = Appearance(5, 0.01, 200, depth=np.e, diffusion=1.0, aspect=1.0, unlit=0.5)
    # one: ln 2; depth: ln 3, at a depth of e
    fit = prediction.Fit((np.log(2), np.log(3), *(0,) * (len(prediction.FEATURES) - 2)), 0.3, 1.5)
    monkeypatch.setattr(prediction, "fits", lambda: dict.fromkeys(("plumb", "scalar", "diffuse", "noise"), fit))
    found = predicted_errors(look)
    assert found["plumb"].error == pytest.approx(6 * prediction.START["plumb"])
    assert found["plumb"].bound == pytest.approx(1.5 * found["plumb"].error)


def test_every_feature_is_bounded_however_odd_the_object():
    odd = Appearance(0, 0, 0, depth=0, diffusion=0, aspect=1e9, unlit=1, absorbed=0, roundness=0)
    assert np.isfinite(prediction.features(odd)).all()
    assert len(prediction.features(odd)) == len(prediction.FEATURES)


def test_the_noise_of_path_is_predicted_for_the_passes_there_will_be():
    of = ball_at(3)
    noise = prediction.predicted_noise(appearance(of, of.objects[0]))
    assert select(of, shader="path", passes=100)[0].predicted_error == pytest.approx(noise.error / 10)
    (plan,) = select(of, 0.2, shader="path")
    assert plan.predicted_error == pytest.approx(noise.error / plan.passes**0.5)
    # what counts is within the tolerance; the cap on passes takes half a percent of these few
    assert noise.error < noise.bound
    assert noise.bound / plan.passes**0.5 <= 1.01 * plan.tolerance


def test_a_shader_with_hardly_a_share_is_left_out_and_the_shares_still_add_up():
    """Nothing is built for one sample in a thousand."""
    many = Demand(0.5)
    for size in np.geomspace(1, 1000, 200):
        shares = shares_of({"diffuse": 0.1, "scalar": 0.0999, "plumb": 0.06}, many, size)
        assert min(shares.values()) >= LEAST_SHARE and sum(shares.values()) == pytest.approx(1)
    near = 64 / (0.1 / tolerance(0.5, math.inf) - 1) / FADE
    assert shares_of({"diffuse": 0.1, "scalar": 1.0, "plumb": 1.0}, many, 1.01 * near) == {"diffuse": 1.0}
    assert len(shares_of({"diffuse": 0.1, "scalar": 1.0, "plumb": 1.0}, many, 1.1 * near)) == 2


def test_a_closed_mesh_whose_surface_alone_is_wanted_is_not_said_to_enclose_nothing():
    (plan,) = select(ball_at(3), shader="plumb", hole_handling="surface")
    assert plan.shader == "diffuse"
    for text in (plan.reason, plan.warning):
        assert "only its surface is lit" in text and "encloses" not in text


# ---- passes from the quality ----


def test_passes_are_those_that_the_noise_needs_and_saturate():
    # 1 / (0.1 / 1.7)^2 = 289, less two percent for the cap
    assert passes_within(1.7, 0.1) == pytest.approx(289, rel=0.02)
    assert passes_within(1.7, 10) == 1
    assert 0.99 * MOST_PASSES < passes_within(1.7, 1e-6) <= MOST_PASSES


def test_more_quality_is_never_fewer_passes_of_path_and_always_more_cost():
    of = ball_at(4)
    plans = [select(of, quality, shader="path")[0] for quality in np.linspace(0, 1, 21)]
    passes = [plan.passes for plan in plans]
    assert all(b > a for a, b in pairwise(passes))
    errors = [plan.predicted_error for plan in plans]
    assert all(b < a for a, b in pairwise(errors))


def test_path_is_not_chosen_to_be_noisier_than_others_are_wrong():
    """20 % are allowed, scalar may be more wrong than that but hardly is: noise of as much would be a worse picture."""
    errors = {name: Error(0.05, 0.5) for name in CHEAPEST_FIRST[:-1]}
    found = {"thing": Measured(errors, Error(1.0, 1.0))}
    (plan,) = select(ball_at(3), target_error=0.2, measured=found)
    assert plan.shader == "path" and plan.noise_allowed < 0.05
    assert plan.predicted_error == pytest.approx(plan.noise_allowed, rel=0.02)
    (asked,) = select(ball_at(3), shader="path", target_error=0.2, measured=found)
    assert asked.noise_allowed == pytest.approx(0.2) and asked.passes < plan.passes / 10


def test_noise_is_outweighed_by_the_error_that_path_takes_away():
    """Scalar is 5 % wrong; what is told falls to that of path, rising at most by a twentieth at the beginning."""
    told = [math.hypot((1 - share) * 0.05, noise_allowed(0.2, [0.3, 0.05], share)) for share in np.linspace(0, 1, 11)]
    assert all(b <= a for a, b in pairwise(told))
    assert told[0] < 0.05 * math.sqrt(1 + ADDED) and 0.04 < told[-1] < 0.05
    assert 0.018 < noise_allowed(0.02, [0.3, 0.05]) < 0.02


def test_more_quality_is_told_to_be_less_wrong_and_never_takes_fewer_passes():
    for distance in (4, 40):
        of = ball_at(distance)
        plans = [select(of, quality)[0] for quality in np.linspace(0, 1, 101)]
        assert {name for plan in plans for name in plan.shares} >= {"scalar", "path"}
        assert all(b.passes >= a.passes for a, b in pairwise(plans))
        errors = [plan.predicted_error for plan in plans]
        assert all(b <= 1.05 * a for a, b in pairwise(errors)) and errors[-1] < errors[0] / 5


def test_the_picture_has_the_passes_of_its_most_demanding_object():
    near, far = placed(BALL, translucent(0.8, 2.0), name="near"), placed(
        shapes.moved(BALL, (0, 0, -400)), translucent(0.8, 2.0), name="far")  # fmt: skip
    of, _ = admit(scene([near, far], [SIDE_LIGHT], camera((0, 0, 4), resolution=(160, 160))))
    plans = select(of, 0.8)
    assert plans[0].passes > plans[1].passes >= 1
    assert picture_passes(plans) == plans[0].passes
    assert [plan.passes for plan in select(of, 0.8, passes=7)] == [7, 7]


# ---- candidates and a target error ----


def test_every_candidate_has_an_error_a_bound_and_seconds():
    (plan,) = select(ball_at(4), 0.7, threads=1)
    assert [one.shader for one in plan.candidates] == list(CHEAPEST_FIRST)
    for one in plan.candidates:
        assert 0 < one.predicted_error <= one.error_bound and one.predicted_seconds > 0 and one.passes >= 1
    (twice,) = select(ball_at(4), 0.7, threads=2)
    assert twice.candidates[3].predicted_seconds == pytest.approx(plan.candidates[3].predicted_seconds / 2)


def test_dense_bright_media_cost_path_more_and_others_as_much():
    grey, white = (select(ball_at(4, material=translucent(*medium)), passes=10, threads=1)[0].candidates
                   for medium in ((0.5, 2.0), (0.999, 50.0)))  # fmt: skip
    assert white[3].predicted_seconds > 5 * grey[3].predicted_seconds
    assert white[2].predicted_seconds == grey[2].predicted_seconds


def test_a_target_error_excludes_shaders_that_may_exceed_it_at_any_distance():
    for distance in (3, 30, 300, 3000):
        for target in (0.5, 0.2, 0.05, 0.01):
            (plan,) = select(ball_at(distance), target_error=target)
            assert plan.tolerance == target
            by_name = {one.shader: one for one in plan.candidates}
            for name in plan.shares:
                assert name == "path" or by_name[name].error_bound <= target
    assert "target error 1 %" in plan.reason


def test_a_wide_target_takes_the_cheapest_and_a_wish_outranks_it():
    assert chosen(ball_at(4), target_error=10.0) == "diffuse"
    assert chosen(ball_at(4), shader="plumb", target_error=0.001) == "plumb"


def test_what_a_pilot_measured_replaces_the_prediction():
    errors = {"diffuse": Error(0.5, 0.6), "scalar": Error(0.001, 0.002), "plumb": Error(0.001, 0.002)}
    found = {"thing": Measured(errors, Error(0.4, 0.5))}
    (plan,) = select(ball_at(3), 0.7, measured=found, passes=100)
    assert plan.shader == "scalar" and plan.predicted_error == 0.001 and all(one.measured for one in plan.candidates)
    assert plan.candidates[3].predicted_error == pytest.approx(0.04)
    (other,) = select(ball_at(3), 0.7, measured={"somebody else": found["thing"]}, passes=100)
    assert not other.candidates[0].measured


# ---- cross-fades ----


def test_a_share_is_half_at_the_threshold_and_whole_beyond_the_fade():
    demand = Demand(0.5)
    threshold = 64 / (0.06 / 0.03 - 1)
    assert demand.tolerance(threshold) == pytest.approx(0.06)
    assert demand.share(0.06, threshold) == pytest.approx(0.5)
    assert demand.share(0.06, threshold / FADE) == 1 and demand.share(0.06, threshold * FADE) == 0
    assert 0 < demand.share(0.06, threshold * FADE**0.9) < 0.1
    assert demand.share(0.02, 1e9) == 1  # right enough at any size
    assert [demand.share(0.06, threshold * k, fade=False) for k in (0.99, 1.01)] == [1, 0]


def test_shares_add_up_and_change_little_from_frame_to_frame():
    """1 % a frame, as a dolly goes: where the error stays, a smoothstep over 30 % in n rises by at most 1.5 / 30 a
    percent; where it falls with the distance as well, by some times that. A switch would be 1."""
    before, of = None, ball_at(20)
    mixed = 0
    for distance in np.geomspace(20, 2000, 465):
        at = replace(of, camera=camera((0, 0, distance), resolution=(160, 160)))
        (plan,) = select(at, 0.7)
        assert sum(plan.shares.values()) == pytest.approx(1)
        assert plan.shader == max(plan.shares, key=plan.shares.__getitem__)
        shares = np.array([plan.shares.get(name, 0.0) for name in CHEAPEST_FIRST])
        if before is not None:
            assert np.abs(shares - before).max() < 0.15
        before = shares
        mixed += len(plan.shares) > 1
    assert mixed > 20


def test_a_matched_body_is_one_or_the_other():
    """Shadow rays pass it where path lights it, and only there."""
    matched = translucent(0.8, 2.0, ior=1.0)
    for distance in np.geomspace(3, 5000, 200):
        assert len(select(ball_at(distance, material=matched), 0.7)[0].shares) == 1


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
    things = [placed(shapes.moved(BALL, (0, 0, -z)), translucent(0.8, 2.0), name=str(z)) for z in (0, 96, 4000)]
    of, _ = admit(scene(things, [SIDE_LIGHT], camera((0, 0, 4), resolution=(160, 160))))
    ranks = [rank(plan.shader) for plan in select(of, 0.3)]
    assert ranks[0] > ranks[1] > ranks[2]
