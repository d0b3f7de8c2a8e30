import numpy as np
import pytest

from renderer.optics.ball import ball_profile
from renderer.shaders import scalar
from renderer.shaders.surface import BodyOptics
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, icosphere, joined, moved

RADIUS = 0.5
ALBEDOS = (0.9, 0.99, 0.999)


def ball_body(mean_free_path=0.1):
    medium = Medium.from_albedo(ALBEDOS, 1 / mean_free_path, ior=1.5)
    return BodyOptics.prepare(0, medium, RADIUS * np.sqrt(3))


@pytest.mark.parametrize("mean_free_path", [0.25, 0.025])
def test_a_ball_is_the_solved_ball(stage, mean_free_path):
    """The curvature is exact here, so only interpolation in the table is left: half a per cent of the maximum."""
    ball = icosphere(RADIUS, 4)
    light = stage.Directional([0.3, 0.5, 0.8])
    points = stage.vertex_points(ball, 1 / RADIUS)
    found = scalar.exitance(stage.Objects(ball), points, ball_body(mean_free_path), [light])
    for channel, albedo in enumerate(ALBEDOS):
        expected = ball_profile(albedo, 1.5, RADIUS / mean_free_path, light.towards @ points.normal)
        assert np.abs(found[channel] - expected).max() < 0.006 * expected.max()


def test_a_constant_environment_is_the_balls(stage):
    ball = icosphere(RADIUS, 1)
    points = stage.vertex_points(ball, 1 / RADIUS)
    found = scalar.exitance(stage.Objects(ball), points, ball_body(), [stage.Ambient([2, 2, 2])])
    for channel, albedo in enumerate(ALBEDOS):
        mean = ball_profile(albedo, 1.5, 5.0, (np.arange(2000) + 0.5) / 1000 - 1).mean()
        np.testing.assert_allclose(found[channel], 2 * 4 * np.pi * mean, rtol=5e-3)


def test_opaque_things_shade_both_sides(stage):
    ball = icosphere(RADIUS, 3)
    screen = moved(box((3.0, 3.0, 0.1)), (0, 0, 1.5))
    points, light = stage.vertex_points(ball, 1 / RADIUS), stage.Directional([0, 0, 1])
    assert not scalar.exitance(stage.Objects(ball, screen), points, ball_body(), [light]).any()
    assert scalar.exitance(stage.Objects(ball), points, ball_body(), [light]).min() > 0
    assert scalar.exitance(stage.Objects(ball, screen), points, ball_body(), [stage.Point([0, 0, 1.4])]).min() > 0


@pytest.mark.parametrize("slope", [0.0, 0.7, -2.0])
def test_a_light_of_some_extent_does_not_shade_itself(stage, slope):
    """Its own surface, oblique to the beam, stands in the scene where the feeler ends."""
    ball, light = icosphere(RADIUS, 3), stage.Point([0, 0, 1.4])
    corners = 0.3 * np.array([[-1, -1, -slope], [1, -1, slope], [1, 1, slope], [-1, 1, -slope]])
    shining = moved(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), (0, 0, 1.4))
    points, body = stage.vertex_points(ball, 1 / RADIUS), ball_body(0.25)
    alone = scalar.exitance(stage.Objects(ball), points, body, [light])
    np.testing.assert_array_equal(scalar.exitance(stage.Objects(ball, shining), points, body, [light]), alone)
    assert alone.min() > 0


def test_folds_are_dark_on_both_sides_of_the_terminator(stage):
    """A floor with a wall between it and a low light: no light just before the terminator, next to none behind."""
    solid = joined(moved(box((4.0, 4.0, 1.0)), (0, 0, -0.5)), moved(box((0.2, 4.0, 1.0)), (0.5, 0, 0.5)))
    body = BodyOptics.prepare(0, Medium.from_albedo(0.99, 1 / 0.02), 1.0)
    scene = stage.Objects(solid)
    for tilt in (0.02, -0.02):
        normal = [tilt, 0, np.sqrt(1 - tilt**2)]
        point = stage.one_point([0, 0, 1e-5], normal, 2.0)
        light = stage.Directional([1, 0, 0])
        shaded = scalar.exitance(scene, point, body, [light])
        free = scalar.exitance(stage.Objects(moved(box(0.1), (-9, 0, 0))), point, body, [light])
        assert free.min() > 0
        assert (shaded <= 0.03 * free).all()


def test_what_is_finer_than_a_transport_length_casts_no_shadow(stage):
    """A ridge half a transport length high beside the point, and one three lengths high."""
    ball = icosphere(RADIUS, 4)
    body = ball_body(0.1)
    point = stage.one_point([0, 0, RADIUS], [0, 0, 1], 1 / RADIUS)
    light = stage.Directional([1, 0, 0.05])
    shares = []
    for height in (0.05, 0.3):
        ridge = moved(box((0.02, 0.5, height)), (0.15, 0, RADIUS + height / 2))
        shares.append(scalar.exitance(stage.Objects(joined(ball, ridge)), point, body, [light]).max())
    assert shares[0] > 0
    assert shares[1] == 0


def test_radii_are_kept_between_a_quarter_path_and_the_body(stage):
    ball = icosphere(RADIUS, 1)
    scene, light = stage.Objects(ball), stage.Directional([0, 0, 1])
    body = ball_body(0.1)

    def lit(curvature):
        return scalar.exitance(scene, stage.one_point([0, 0, RADIUS], [0, 0, 1], curvature), body, [light])[1, 0]

    assert lit(1e9) == pytest.approx(lit(1 / 0.025), rel=1e-3)
    assert lit(0.0) == lit(-50.0) == pytest.approx(lit(1 / body.bounding_radius), rel=1e-5)
