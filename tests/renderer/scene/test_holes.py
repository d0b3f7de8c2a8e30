from dataclasses import replace

import numpy as np
import pytest

from renderer.scene.admission import admit
from renderer.scene.holes import close_holes, expected_error, in_mesh_units
from renderer.scene.transform import transformed
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.sealing import Loop
from tests.renderer.scenes import WHITE_SKY, camera, diffuse, placed, scene, translucent
from tests.sss_tools.test_sealing import punctured, spiked

BALL = shapes.icosphere(1.0, 3)


def closed(mesh, handling="cap", shader="path", material=None):
    """Object and report after ``close_holes``, and the object before."""
    of = scene([placed(mesh, material or translucent())], [WHITE_SKY], camera((0, 0, 8)))
    checked, _ = admit(of)
    tracing, (report,) = close_holes(checked, [shader], [handling], ["because"])
    return tracing.objects[0], report, checked.objects[0]


def test_a_capped_body_is_closed_for_the_tracer_alone():
    thing, report, before = closed(punctured(20))
    assert (report.handling, report.loops, report.capped, report.reason) == ("cap", 1, 1, "because")
    assert report.half_angle == pytest.approx(20, abs=2.5) and 0.005 < report.expected_error < 0.01
    assert thing.closedness.state == "closed" and before.closedness.state == "holes"
    assert len(thing.mesh.faces) > len(before.mesh.faces)


@pytest.mark.parametrize("handling", ["strict", "surface"])
def test_nothing_is_built_where_nothing_is_asked_for(handling):
    thing, report, before = closed(punctured(20), handling)
    assert thing is before and (report.handling, report.capped) == (handling, 0)


@pytest.mark.parametrize(("shader", "built"), [("path", True), ("plumb", True), ("scalar", True), ("diffuse", False)])
def test_caps_are_built_for_shaders_that_need_them(shader, built):
    thing, report, before = closed(punctured(20), shader=shader)
    assert (thing is not before) == built and report.capped == built


def test_opaque_things_are_left_alone():
    thing, _, before = closed(punctured(20), "surface", "opaque", diffuse(0.5))
    assert thing is before


def test_the_thesis_rule_expects_a_larger_error():
    _, cap, _ = closed(punctured(20))
    thing, rule, before = closed(punctured(20), "terminate")
    assert thing is before and rule.expected_error > 10 * cap.expected_error


def test_where_no_cap_fits_the_thesis_rule_is_left_and_the_place_named():
    thing, report, before = closed(spiked())
    assert thing is before and report.handling == "terminate"
    assert report.reason.startswith("because; but its cap would pass through the surface that it closes, around (")
    both = shapes.joined(spiked(), shapes.moved(punctured(20), (3, 0, 0)))
    thing, report, _ = closed(both)
    assert (report.handling, report.loops, report.capped) == ("cap", 2, 1)
    assert "; but 1 of 2 caps would pass through the surface that it closes, around (" in report.reason
    assert thing.closedness.state == "holes"
    neither = shapes.joined(spiked(), shapes.moved(spiked(), (3, 0, 0)))
    _, report, _ = closed(neither)
    assert (report.handling, report.loops, report.capped) == ("terminate", 2, 0)
    assert "; but all 2 caps would pass through the surface that they close, around (" in report.reason


@pytest.mark.parametrize("handling", ["cap", "terminate"])
def test_bodies_inside_out_are_turned(handling):
    thing, report, _ = closed(shapes.inverted(BALL), handling)
    assert report.turned == len(BALL.faces) and thing.mesh.volume == pytest.approx(BALL.volume)
    assert report.reason == f"because; {report.turned} faces turned outwards"
    _, report, _ = closed(Mesh(BALL.vertices, np.concatenate([BALL.faces[:1, ::-1], BALL.faces[1:]])), handling)
    assert report.reason == "because; 1 face turned outwards"


def test_expected_errors_are_those_of_the_table_on_a_ball_and_less_on_what_is_larger():
    """PHYSICS section 7: worse of two lights."""
    for angle, capped, rule in ((5, 0.005, 0.03), (15, 0.006, 0.16), (30, 0.012, 0.39)):
        for made, error in ((True, capped), (False, rule)):
            loop = Loop(9, np.zeros(3), angle, 1.0, 0.5, made)
            assert expected_error([loop], 4 * np.pi) == pytest.approx(error)
            assert expected_error([loop], 40 * np.pi) == pytest.approx(error / 10)
            assert expected_error([loop, loop], 40 * np.pi) == pytest.approx(error / 5)
    # a loop wider than the room behind it spoils more
    assert expected_error([Loop(9, np.zeros(3), 30, 1.0, 4.0, True)], 40 * np.pi) == pytest.approx(0.012 * 4 / 10)
    assert expected_error([Loop(9, np.zeros(3), np.nan, 1.0, 0.5, False)], 1.0) is None
    assert expected_error([], 1.0) == 0


def test_places_are_told_in_the_frame_of_the_file():
    source = shapes.moved(BALL, (5, 0, 1))
    matrix = np.eye(4)
    matrix[:3] = [[0, -2, 0, 7], [2, 0, 0, -1], [0, 0, 2, 3]]
    thing = replace(placed(transformed(source, matrix), translucent()), source=source)
    wanted = np.array([[5.5, 0.25, 1.0], [0, 0, 0]])
    there = wanted @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(in_mesh_units(thing, there), wanted, atol=1e-9)
    np.testing.assert_array_equal(in_mesh_units(placed(BALL, translucent()), wanted), wanted)
