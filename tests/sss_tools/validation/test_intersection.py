"""SSS302, SSS304 and SSS503: what triggers them, what just does not, and what is reported."""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET
from sss_tools.validation.outcome import Outcome, Severity
from sss_tools.validation.rule import Context, Neighbour
from sss_tools.validation.run import check_mesh


def result_of(code, mesh, context=None):
    (result,) = (rule for rule in check_mesh(mesh, context).rules if rule.code == code)
    return result


def two_boxes(gap):
    """Unit boxes side by side in x, ``gap`` apart and shifted so that no corners coincide."""
    return shapes.joined(shapes.box(), shapes.moved(shapes.box(), [1 + gap, 0.25, 0.25]))


def test_boxes_through_each_other_are_reported_with_their_pairs_of_faces():
    mesh = two_boxes(-0.5)
    result = result_of("SSS302", mesh)
    assert (result.outcome, result.severity, result.fix) == (Outcome.FAIL, Severity.ERROR, "unsafe")
    assert result.count == len(result.face_pairs) > 0
    assert result.faces == sorted({face for pair in result.face_pairs for face in pair})
    # each pair names a face of either box
    assert all(first < 12 <= second for first, second in result.face_pairs)
    assert f"{result.count} pairs of faces" in result.message and "exact" in result.message
    assert result.bbox is not None and check_mesh(mesh).closedness["self_intersecting"] is True


def test_boxes_that_touch_are_reported_and_boxes_a_hair_apart_are_not():
    assert result_of("SSS302", two_boxes(0.0)).outcome == Outcome.FAIL
    apart = two_boxes(2.0**-52)
    assert result_of("SSS302", apart).outcome == Outcome.PASS
    assert check_mesh(apart).closedness["self_intersecting"] is False


def test_a_flap_folded_back_into_its_own_plane_is_reported():
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, 0]])
    assert result_of("SSS302", Mesh(points, [[0, 1, 2], [1, 0, 3]])).face_pairs == [[0, 1]]
    points[3] = [0.5, 0.5, 1e-12]
    assert result_of("SSS302", Mesh(points, [[0, 1, 2], [1, 0, 3]])).outcome == Outcome.PASS


def beside(gap, name="other"):
    return Neighbour(name, shapes.moved(shapes.box(), [1 + gap, 0.25, 0.25]))


def in_scene(*neighbours, extent=None):
    return Context(neighbours=neighbours, extent=extent)


@pytest.mark.parametrize("code", ["SSS304", "SSS503"])
def test_without_a_scene_nothing_is_said_of_neighbours(code):
    result = result_of(code, shapes.box())
    assert (result.outcome, result.reason) == (Outcome.NOT_RUN, "no scene")
    assert result_of(code, shapes.box(), in_scene()).outcome == Outcome.PASS


def test_solids_that_interpenetrate_touch_or_contain_each_other_overlap_and_others_do_not():
    middle = shapes.box().bounds.mean(axis=0)
    for gap in (-0.5, 0.0):
        result = result_of("SSS304", shapes.box(), in_scene(beside(gap), beside(3.0, "far")))
        assert (result.outcome, result.severity, result.count) == (Outcome.FAIL, Severity.ERROR, 1)
        assert "overlaps or touches other" in result.message and result.faces
    inner = Neighbour("seed", shapes.moved(shapes.icosphere(0.2), middle))
    assert result_of("SSS304", shapes.box(), in_scene(inner)).count == 1
    assert result_of("SSS304", inner.mesh, in_scene(Neighbour("fruit", shapes.box()))).count == 1
    assert result_of("SSS304", shapes.box(), in_scene(beside(1e-9))).outcome == Outcome.PASS


def test_near_contact_is_a_gap_below_twice_the_ray_offset():
    # two boxes side by side with a gap next to nothing are two units long
    least = 2 * float(RAY_OFFSET) * 2
    result = result_of("SSS503", shapes.box(), in_scene(beside(0.9 * least)))
    assert (result.outcome, result.severity, result.count) == (Outcome.FAIL, Severity.WARNING, 1)
    assert "gaps of 3.6e-06 to other" in result.message and "rays need 4e-06" in result.message
    right = np.flatnonzero(shapes.box().face_normals[:, 0] > 0.5)
    assert set(right) <= set(result.faces)
    assert result_of("SSS503", shapes.box(), in_scene(beside(1.1 * least))).outcome == Outcome.PASS
    # in a larger scene the same gap is too narrow
    assert result_of("SSS503", shapes.box(), in_scene(beside(1.1 * least), extent=4.0)).outcome == Outcome.FAIL
    # what touches is an overlap
    assert result_of("SSS503", shapes.box(), in_scene(beside(0.0))).outcome == Outcome.PASS


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1, 1])
def test_neighbours_on_any_side_count(axis, side):
    def at(gap):
        offset = np.full(3, 0.25)
        offset[axis] = side * (1 + gap)
        return Neighbour("other", shapes.moved(shapes.box(), offset))

    assert result_of("SSS304", shapes.box(), in_scene(at(0.0))).outcome == Outcome.FAIL
    assert result_of("SSS503", shapes.box(), in_scene(at(2e-6))).outcome == Outcome.FAIL


@pytest.mark.parametrize("code", ["SSS304", "SSS503"])
def test_opaque_neighbours_do_not_count(code):
    """Light ends at their surface: there is no second medium, and nothing behind that a ray could miss."""
    gap = 0.0 if code == "SSS304" else 2e-6
    floor = Neighbour("floor", beside(gap).mesh, translucent=False)
    assert result_of(code, shapes.box(), in_scene(beside(gap))).outcome == Outcome.FAIL
    assert result_of(code, shapes.box(), in_scene(floor)).outcome == Outcome.PASS


def test_what_encloses_nothing_overlaps_nothing():
    box = shapes.box()
    result = result_of("SSS304", Mesh(box.vertices, box.faces[:2]), in_scene(beside(0.0)))
    assert (result.outcome, result.reason) == (Outcome.NOT_RUN, "the mesh encloses no volume")
