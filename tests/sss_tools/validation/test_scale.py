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


@pytest.mark.parametrize("code", ["SSS501", "SSS502"])
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
    # 360/9 = 40 degrees are meant to be round, 360/7 = 51 to be edges
    assert result_of("SSS404", shapes.cylinder(1.0, 2.0, 9), medium(0.1)).outcome == Outcome.FAIL
    assert result_of("SSS404", shapes.cylinder(1.0, 2.0, 7), medium(0.1)).outcome == Outcome.PASS


def in_view(pixel, medium=None, unit="cm"):
    return Context(medium, unit, neighbours=(), pixel_footprint=pixel)


def coarseness(mesh, context):
    (result,) = (rule for rule in check_mesh(mesh, context).rules if rule.code == "SSS404")
    return result


def test_coarse_tessellation_needs_a_material_or_a_scene():
    result = coarseness(shapes.cylinder(1.0, 2.0, 12), Context())
    assert (result.outcome, result.reason) == (Outcome.NOT_RUN, "no scene and no material")
    # a camera that sees nothing of the mesh has no pixel to measure it by
    assert coarseness(shapes.cylinder(1.0, 2.0, 12), in_view(None)).outcome == Outcome.NOT_RUN


def test_coarse_tessellation_is_measured_in_pixels_where_a_scene_says_how_wide_they_are():
    # the longest sides are the diagonals of strips 2 high and 2 sin 15 degrees wide
    rough, longest = shapes.cylinder(1.0, 2.0, 12), np.hypot(2, 2 * np.sin(np.radians(15)))
    seen = coarseness(rough, in_view(0.999 * longest))
    assert (seen.outcome, seen.count) == (Outcome.FAIL, 24) and "a pixel of 2.06 cm" in seen.message
    assert "mean free path" not in seen.message
    assert coarseness(rough, in_view(1.001 * longest)).outcome == Outcome.PASS
    # smooth enough, whatever the pixel
    assert coarseness(shapes.cylinder(1.0, 2.0, 20), in_view(0.01)).outcome == Outcome.PASS


def test_coarse_tessellation_names_what_facets_exceed():
    rough = shapes.cylinder(1.0, 2.0, 12)
    both = coarseness(rough, in_view(0.5, medium(0.1)))
    assert "transport mean free path of 0.1 cm and a pixel of 0.5 cm" in both.message
    scattered = coarseness(rough, in_view(5.0, medium(0.1)))
    assert scattered.outcome == Outcome.FAIL and "a pixel" not in scattered.message
    seen = coarseness(rough, in_view(0.5, medium(5.0)))
    assert seen.outcome == Outcome.FAIL and "mean free path" not in seen.message
    assert coarseness(rough, in_view(5.0, medium(5.0))).outcome == Outcome.PASS


def test_the_worst_turn_is_that_of_the_facets_reported():
    """A tiny cylinder of sharper turns beside a large one is not what the message is about."""
    tiny = shapes.moved(shapes.cylinder(0.01, 0.02, 9), [5, 0, 0])
    mixed = coarseness(shapes.joined(shapes.cylinder(1.0, 2.0, 12), tiny), Context(medium(0.1), "cm"))
    assert mixed.count == 24 and "20 to 30 degrees" in mixed.message


def test_lengths_of_a_mesh_that_its_scene_scales_have_no_named_unit():
    assert "a pixel of 0.5 mesh units" in coarseness(shapes.cylinder(1.0, 2.0, 12), in_view(0.5, unit=None)).message


def test_walls_that_rays_cross_aslant_are_found_by_balls_as_many_as_are_sampled(monkeypatch):
    """At a distance l from the edge of a wedge of 50 degrees a ray is l tan 50 long and a ball 2 l tan 25 wide."""
    from sss_tools.validation import scale

    x, z = 2 * np.cos(np.radians(25)), 2 * np.sin(np.radians(25))
    points = [[0, 0, 0], [x, 0, -z], [x, 3, -z], [0, 3, 0], [x, 0, z], [x, 3, z]]
    wedge = Mesh(points, [[0, 2, 1], [0, 3, 2], [1, 2, 5], [1, 5, 4], [0, 1, 4], [3, 5, 2], [0, 4, 5], [0, 5, 3]])
    # the middles of faces 1 and 7 are 2/3 from the edge: 0.795 by ray, 0.622 by ball
    found = result_of("SSS501", wedge, medium(0.7), "cm")
    assert found.faces == [1, 7] and "the thinnest is 0.62" in found.message and "by ball" not in found.message
    assert result_of("SSS501", wedge, medium(0.61), "cm").outcome == Outcome.PASS
    monkeypatch.setattr(scale, "BALLS", 7)
    sampled = result_of("SSS501", wedge, medium(0.85), "cm")
    assert sampled.faces == [1, 7] and "(measured by ray at every face, by ball at " in sampled.message


def test_where_the_ray_offset_is_the_limit_the_message_says_so():
    result = result_of("SSS501", shapes.slab(1.0, 0.5 * float(RAY_OFFSET)), medium(1e-9), "cm")
    assert "thinner than 1e-06 cm, the ray offset" in result.message


def test_of_three_channels_the_least_mean_free_path_counts():
    """Light of a channel that is scattered within the wall still is where others go straight through."""

    def coloured(*paths):
        return Medium.from_albedo([0.9] * 3, [1 / path for path in paths])

    assert result_of("SSS501", shapes.slab(1.0, 0.07), coloured(0.2, 0.06, 0.1)).outcome == Outcome.PASS
    assert result_of("SSS501", shapes.slab(1.0, 0.07), coloured(0.2, 0.08, 0.1)).outcome == Outcome.FAIL
    assert result_of("SSS502", shapes.icosphere(), coloured(3.0, 1.2, 2.0)).outcome == Outcome.PASS
    assert result_of("SSS502", shapes.icosphere(), coloured(3.0, 1.4, 2.0)).outcome == Outcome.FAIL
    rough = shapes.cylinder(1.0, 2.0, 12)
    assert result_of("SSS404", rough, coloured(5.0, 2.0, 4.0)).outcome == Outcome.FAIL
    assert result_of("SSS404", rough, coloured(5.0, 2.1, 4.0)).outcome == Outcome.PASS


def test_walls_are_judged_by_the_mean_free_path_and_facets_by_the_transport_one():
    forward = Medium([0.0] * 3, [10.0] * 3, 0.9)  # 0.1 and 1 long
    assert result_of("SSS501", shapes.slab(1.0, 0.11), forward).outcome == Outcome.PASS
    assert result_of("SSS501", shapes.slab(1.0, 0.09), forward).outcome == Outcome.FAIL
    rough = shapes.cylinder(0.45, 0.9, 12)  # facets 0.93 long
    assert result_of("SSS404", rough, forward).outcome == Outcome.PASS


@pytest.mark.parametrize(("sigma_a", "outcome"), [(20, Outcome.PASS), (22, Outcome.FAIL)])
def test_a_body_is_opaque_where_light_diffuses_less_than_a_thousandth_of_its_length(sigma_a, outcome):
    # the diffusion length sqrt(1 / (3 sigma_a sigma_t')) is 1/980 and 1/1028 of a box of 4; the mean free path 1/4000
    dense = Medium([sigma_a] * 3, [1000.0 - sigma_a] * 3)
    result = result_of("SSS502", shapes.box(4.0), dense, "cm")
    assert result.outcome == outcome
    if outcome == Outcome.FAIL:
        assert "0.00389 cm at most" in result.message


def test_the_size_of_a_body_without_a_volume_is_that_of_its_box():
    # 4 V / S of the box round a ball of radius 1 is 4/3, too
    bowl = shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1]], 0.1)
    assert result_of("SSS502", bowl, medium(1.25)).outcome == Outcome.PASS
    assert result_of("SSS502", bowl, medium(1.4)).outcome == Outcome.FAIL
    inverted = shapes.inverted(shapes.icosphere(1.0, 4))
    assert result_of("SSS502", inverted, medium(1.25)).outcome == Outcome.PASS


def test_the_scale_of_two_solids_is_judged_alike_when_one_is_inside_out():
    """Their signed volumes cancel: nothing is left of the mean chord, but all of the matter is there."""
    ball = shapes.icosphere(1.0, 2)
    both = shapes.joined(shapes.inverted(ball), shapes.moved(ball, [3, 0, 0]))
    assert result_of("SSS502", both, medium(0.1)).outcome == Outcome.PASS
    assert result_of("SSS502", both, medium(2.0)).outcome == Outcome.FAIL
