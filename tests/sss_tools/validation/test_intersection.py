"""SSS302, SSS304 and SSS503: what triggers them, what just does not, and what is reported."""

import numpy as np

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.validation.outcome import Outcome, Severity
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
