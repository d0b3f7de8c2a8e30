"""SSS404, SSS501 and SSS502: what triggers them, what just does not, and what is reported."""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET
from sss_tools.validation.outcome import FixSafety, Outcome, Severity
from sss_tools.validation.rule import Context
from sss_tools.validation.run import check_mesh


def medium(mean_free_path, albedo=0.9):
    return Medium.from_albedo(albedo, 1 / mean_free_path)


def result_of(code, mesh, medium=None, unit=None):
    (result,) = (rule for rule in check_mesh(mesh, Context(medium, unit)).rules if rule.code == code)
    return result


@pytest.mark.parametrize("code", ["SSS404", "SSS501", "SSS502"])
def test_without_a_material_nothing_is_said(code):
    result = result_of(code, shapes.box())
    assert (result.outcome, result.reason) == (Outcome.NOT_RUN, "no material")


def test_thin_wall_is_one_thinner_than_a_mean_free_path():
    slab = shapes.slab(1.0, 0.1)
    thin = result_of("SSS501", slab, medium(0.101), "cm")
    assert (thin.outcome, thin.severity, thin.fix) == (Outcome.FAIL, Severity.WARNING, FixSafety.NONE)
    # the two large sides, of two faces each; the rim is as wide as the slab
    assert thin.count == 4 and {int(face) for face in thin.faces} == set(
        np.flatnonzero(np.abs(slab.face_normals[:, 2]) > 0.5)
    )
    assert "thinner than 0.101 cm" in thin.message and "the thinnest is 0.1 cm" in thin.message
    assert "0 below the ray offset" in thin.message
    assert result_of("SSS501", slab, medium(0.099)).outcome == Outcome.PASS


def test_walls_below_the_ray_offset_are_seen_whatever_the_material():
    # the thinnest that single precision still tells from nothing in a unit-size frame
    slab = shapes.slab(1.0, 0.5 * float(RAY_OFFSET))
    result = result_of("SSS501", slab, medium(1e-9))
    assert result.outcome == Outcome.FAIL and "4 below the ray offset" in result.message


def test_the_thin_rod_is_found_by_rays_and_the_tip_of_a_wedge_is_no_wall():
    rod = shapes.cylinder(0.05, 2.0, 24)
    assert result_of("SSS501", rod, medium(0.2)).count >= 48
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 2], [1, 1, 2.0]])
    wedge = Mesh(points, [[0, 2, 1], [0, 3, 2], [1, 2, 5], [1, 5, 4], [0, 1, 4], [3, 5, 2], [0, 4, 5], [0, 5, 3]])
    assert wedge.volume > 0
    assert result_of("SSS501", wedge, medium(0.3)).outcome == Outcome.PASS


def test_thin_wall_is_not_looked_for_where_nothing_is_enclosed():
    box = shapes.box()
    result = result_of("SSS501", Mesh(box.vertices, box.faces[:2]), medium(1.0))
    assert (result.outcome, result.reason) == (Outcome.NOT_RUN, "the mesh encloses no volume")


def test_scale_mismatch_names_glass_and_the_units_that_would_fit():
    ball = shapes.icosphere(0.05)
    marble = Medium.preset("marble", "mm")
    result = result_of("SSS502", ball, marble, "mm")
    assert (result.outcome, result.severity, result.count) == (Outcome.FAIL, Severity.WARNING, 1)
    # the mean chord of a ball is 4/3 of its radius
    assert "like glass: light crosses 0.06" in result.message and "mm" in result.message
    assert "it would fit if a mesh unit were 1 cm or 1 m or 1 inch" in result.message
    assert result_of("SSS502", ball, Medium.preset("marble", "cm"), "cm").outcome == Outcome.PASS


def test_scale_mismatch_names_a_body_as_opaque():
    ball = shapes.icosphere(20.0)
    result = result_of("SSS502", ball, Medium.preset("ketchup", "m"), "m")
    assert result.outcome == Outcome.FAIL and "as if opaque" in result.message and "1/1000" in result.message
    assert result_of("SSS502", ball, Medium.preset("ketchup", "mm"), "mm").outcome == Outcome.PASS


@pytest.mark.parametrize(("path", "outcome"), [(1.33, Outcome.PASS), (1.35, Outcome.FAIL)])
def test_glass_begins_where_the_mean_free_path_exceeds_the_mean_chord(path, outcome):
    # 4/3 for a ball of radius 1, less what the facets of the fine mesh cut off (0.2 %)
    assert result_of("SSS502", shapes.icosphere(1.0, 5), medium(path)).outcome == outcome


def test_coarse_tessellation_is_a_round_body_of_facets_longer_than_light_is_scattered():
    # neighbours turn by 360/12 = 30 degrees
    rough = shapes.cylinder(1.0, 2.0, 12)
    result = result_of("SSS404", rough, medium(0.1))
    assert (result.outcome, result.severity) == (Outcome.FAIL, Severity.INFO)
    assert result.count == 24 and "30 degrees" in result.message and "mm (assumed)" in result.message
    # light is scattered further than any facet is long
    assert result_of("SSS404", rough, medium(5.0)).outcome == Outcome.PASS
    # facets turn by 360/20 = 18 degrees: smooth enough; by 90 degrees: meant
    assert result_of("SSS404", shapes.cylinder(1.0, 2.0, 20), medium(0.1)).outcome == Outcome.PASS
    assert result_of("SSS404", shapes.box(), medium(0.1)).outcome == Outcome.PASS


def test_the_scale_of_two_solids_is_judged_alike_when_one_is_inside_out():
    """Their signed volumes cancel: nothing is left of the mean chord, but all of the matter is there."""
    ball = shapes.icosphere(1.0, 2)
    both = shapes.joined(shapes.inverted(ball), shapes.moved(ball, [3, 0, 0]))
    assert result_of("SSS502", both, medium(0.1)).outcome == Outcome.PASS
    assert result_of("SSS502", both, medium(2.0)).outcome == Outcome.FAIL
