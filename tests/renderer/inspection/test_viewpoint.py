"""Views hold what they should, and show what can be shown."""

import numpy as np
import pytest

from renderer.inspection.viewpoint import MARGIN, Viewpoint, directions, framing
from sss_tools import shapes
from tests.renderer.inspection.exhibits import ball_in_ball, exhibit, punctured_ball


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_framing_holds_all_points_and_touches_two_sides(aspect):
    points = np.random.default_rng(5).normal(size=(500, 3)) * [3, 1, 0.2]
    size = (round(400 * aspect), 400)
    for direction in directions():
        x, y, depth = framing(direction, points, aspect).project(points, size).T
        across = np.abs(x / size[0] * 2 - 1).max(), np.abs(y / size[1] * 2 - 1).max()
        assert depth.min() > 0
        # it touches exactly; roundings are far smaller
        assert max(across) == pytest.approx(MARGIN, abs=1e-6)


def test_projection_and_rays_agree():
    view = Viewpoint(np.array([1.0, 2.0, 3.0]), np.zeros(3), np.array([0.0, 1.0, 0.0]))
    size = (40, 30)
    rays = view.rays(size).T.astype(float)
    x, y, _ = view.project(view.position + 2 * rays, size).T
    column, row = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    # rays are single precision: 1e-7 of a slope is 1e-5 pixels here
    assert np.abs(x - column.ravel()).max() < 1e-3 and np.abs(y - row.ravel()).max() < 1e-3


def test_what_is_inside_cannot_be_seen_and_a_hole_can():
    inner = exhibit(ball_in_ball())
    assert [inner.inside[k] for k, spot in enumerate(inner.spots) if spot.code == "SSS301"] == [True]
    assert not exhibit(punctured_ball()).inside.any()


def test_the_overview_turns_to_where_the_findings_are():
    behind = exhibit(shapes.punctured(shapes.icosphere(1.0, 4), [[-0.5, 0, -0.85]], 0.2)).overview(1.0)
    assert (behind.position - behind.target)[2] < 0
    before = exhibit(shapes.punctured(shapes.icosphere(1.0, 4), [[0.3, 0.2, 0.9]], 0.2)).overview(1.0)
    assert np.allclose(
        (before.position - before.target) / np.linalg.norm(before.position - before.target), directions()[0]
    )
