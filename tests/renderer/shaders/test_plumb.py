import numpy as np
import pytest

from renderer.optics.ball import ball_profile
from renderer.optics.dielectric import fresnel_reflectance
from renderer.optics.slab import slab_reflectance, slab_transmittance
from renderer.shaders import plumb
from renderer.shaders.light_line import follow
from renderer.shaders.surface import BodyOptics
from sss_tools.medium import Medium
from sss_tools.rays import RAY_OFFSET
from sss_tools.shapes import box, hollow_ball, icosphere, inverted, joined, moved, slab

RADIUS = 0.5
ALBEDOS = (0.9, 0.99, 0.999)


def ball_body(mean_free_path=0.1, **keywords):
    medium = Medium.from_albedo(ALBEDOS, 1 / mean_free_path, ior=1.5)
    return BodyOptics.prepare(0, medium, RADIUS * np.sqrt(3), **keywords)


def terminator_points(stage, scene, towards):
    """4001 points on a fine walk across the terminator, x from .2 to -.2, on the facets, with the ball's normals."""
    towards = towards / np.linalg.norm(towards)
    aside = np.cross(towards, [0.3, -0.2, 0.9])
    aside /= np.linalg.norm(aside)
    x = np.linspace(0.2, -0.2, 4001)[:, None]
    normal = x * towards + np.sqrt(1 - x * x) * aside
    above = (1.2 * RADIUS * normal).T.astype(np.float32)
    distance, _ = scene.closest(above, -normal.T.astype(np.float32))
    return stage.vertex_points(type("Points", (), {"vertices": (above - distance * normal.T).T}), 1 / RADIUS)


@pytest.mark.parametrize("mean_free_path", [0.25, 0.1, 0.025])
def test_a_ball_is_the_solved_ball_on_both_sides(stage, mean_free_path):
    """Tessellation: chords end on facets, up to R (edge/R)^2/8 = 4e-4 R inside the ball, and vertices are exact.
    Interpolation in the table adds up to half a per cent of the maximum."""
    ball = icosphere(RADIUS, 5)
    light = stage.Directional([0.3, 0.5, 0.8])
    points = stage.vertex_points(ball, 1 / RADIUS)
    found = plumb.exitance(stage.Objects(ball), points, ball_body(mean_free_path), [light])
    x = light.towards @ points.normal
    for channel, albedo in enumerate(ALBEDOS):
        expected = ball_profile(albedo, 1.5, RADIUS / mean_free_path, x)
        assert np.abs(found[channel] - expected).max() < 0.006 * expected.max()
        # rounding of the chord and interpolation hardly bias the sum
        assert found[channel].mean() == pytest.approx(expected.mean(), rel=3e-3)


def test_there_is_no_seam_at_the_terminator(stage):
    ball = icosphere(RADIUS, 5)
    scene = stage.Objects(ball)
    light = stage.Directional([0.3, 0.5, 0.8])
    points = terminator_points(stage, scene, light.towards)
    found = plumb.exitance(scene, points, ball_body(0.05), [light])
    brightest = [ball_profile(albedo, 1.5, RADIUS / 0.05, 1.0) for albedo in ALBEDOS]
    jumps = np.abs(np.diff(found, axis=1)).max(axis=1)
    # steps of 1e-4 in x: a smooth curve climbs some 1e-4 of the maximum, a seam shows as a jump. At x = 0 there is one
    # of 1.2e-3, where the light, grazing the ball, passes through the last facet before it leaves
    assert (jumps / brightest).max() < 0.002
    assert np.ptp(found, axis=1).min() > 0.05


def test_a_constant_environment_is_exact_on_a_ball(stage):
    ball = icosphere(RADIUS, 5)
    found = plumb.exitance(
        stage.Objects(ball), stage.vertex_points(ball, 1 / RADIUS), ball_body(), [stage.Ambient([1, 2, 3])]
    )
    for channel, albedo in enumerate(ALBEDOS):
        mean = ball_profile(albedo, 1.5, RADIUS / 0.1, (np.arange(2000) + 0.5) / 1000 - 1).mean()
        # interpolation between rows, chords short by the tessellation
        np.testing.assert_allclose(found[channel], 4 * np.pi * mean * (channel + 1), rtol=5e-3)


def test_without_absorption_a_ball_returns_what_entered(stage):
    """The mean of B over the ball: half the flux that enters less what crosses unscattered."""
    ball = icosphere(RADIUS, 5)
    body = BodyOptics.prepare(0, Medium.from_albedo(1.0, 1 / 0.05, ior=1.3), RADIUS * np.sqrt(3))
    found = plumb.exitance(
        stage.Objects(ball), stage.vertex_points(ball, 1 / RADIUS), body, [stage.Directional([1, 2, 3])]
    )
    x = (np.arange(5000) + 0.5) / 5000
    reflectance, refracted = fresnel_reflectance(x, 1.3)
    entered = np.mean(x * (1 - reflectance) * -np.expm1(-2 * RADIUS / 0.05 * refracted))
    # vertices of a subdivided icosahedron weigh corners a little more
    np.testing.assert_allclose(found.mean(axis=1), entered / 2, rtol=0.01)


def test_a_plate_lit_straight_on_is_the_solved_slab(stage):
    """H = 0 and x = 1: all of the shape correction."""
    plate = slab(1.0, 0.1)
    body = BodyOptics.prepare(0, Medium.from_albedo(ALBEDOS, 1 / 0.04, ior=1.5), 0.7)
    light = stage.Directional([0, 0, 1])
    front = plumb.exitance(stage.Objects(plate), stage.one_point([0.1, 0.05, 0.05], [0, 0, 1], 0), body, [light])
    back = plumb.exitance(stage.Objects(plate), stage.one_point([0.1, 0.05, -0.05], [0, 0, -1], 0), body, [light])
    for channel, albedo in enumerate(ALBEDOS):
        # linear interpolation between thicknesses 16 % apart
        assert front[channel, 0] == pytest.approx(0.96 * slab_reflectance(2.5, 1.0, albedo, 1.5), rel=0.01)
        assert back[channel, 0] == pytest.approx(0.96 * slab_transmittance(2.5, 1.0, albedo, 1.5), rel=0.02)


def test_channels_of_a_chromatic_medium_are_computed_alone(stage):
    ball = icosphere(RADIUS, 3)
    lengths = np.array([0.02, 0.1, 0.3])
    body = BodyOptics.prepare(0, Medium.from_albedo(0.99, 1 / lengths, ior=1.4), RADIUS * np.sqrt(3))
    points, light = stage.vertex_points(ball, 1 / RADIUS), stage.Directional([0, 0, 1])
    together = plumb.exitance(stage.Objects(ball), points, body, [light])
    for channel, length in enumerate(lengths):
        alone = BodyOptics.prepare(0, Medium.from_albedo(0.99, 1 / length, ior=1.4), RADIUS * np.sqrt(3))
        found = plumb.exitance(stage.Objects(ball), points, alone, [light])
        # the same table; the radius in paths is rounded differently
        np.testing.assert_allclose(together[channel], found[0], rtol=1e-3, atol=1e-6)
    assert together[2, np.argmin(points.normal[2])] > 10 * together[0, np.argmin(points.normal[2])]


def test_opaque_things_shade_and_the_lights_own_geometry_does_too(stage):
    ball = icosphere(RADIUS, 4)
    screen = moved(box((3.0, 3.0, 0.1)), (0, 0, 1.5))
    points, light = stage.vertex_points(ball, 1 / RADIUS), stage.Directional([0, 0, 1])
    free = plumb.exitance(stage.Objects(ball), points, ball_body(), [light])
    assert free.min() > 0
    for owner in (1, -1):
        assert not plumb.exitance(stage.Objects(ball, screen, owners=[0, owner]), points, ball_body(), [light]).any()
    # a light before the screen is not shaded by it
    lamp = stage.Point([0, 0, 1.4])
    assert plumb.exitance(stage.Objects(ball, screen), points, ball_body(), [lamp]).min() > 0


def test_a_translucent_screen_dims_and_colours(stage):
    ball = icosphere(RADIUS, 3)
    screen = moved(box((3.0, 3.0, 0.2)), (0, 0, 1.5))
    points, light = stage.vertex_points(ball, 1 / RADIUS), stage.Directional([0, 0, 1])
    free = plumb.exitance(stage.Objects(ball), points, ball_body(), [light])
    medium = ball_body().medium
    shares = []
    for other in (medium, medium.scaled(4.0)):
        body = ball_body(others={1: other})
        seen = plumb.exitance(stage.Objects(ball, screen), points, body, [light])
        shares.append((seen / free).mean(axis=1))
        # no kink: what stands before lit and unlit parts counts alike at the terminator
        assert (seen < free).all()
    # redder is what absorbs least: the last channel; denser is darker
    assert shares[0][0] < shares[0][1] < shares[0][2] < 1
    assert (shares[1] < shares[0]).all()


def follow_from(scene, body, origin, direction, inside):
    column = [np.asarray(values, np.float32).reshape(3, 1) for values in (origin, direction)]
    return follow(scene, body, *column, np.full(1, np.inf, np.float32), np.array([inside]))


def test_lengths_inside_several_parts_of_a_body_add_up(stage):
    parts = joined(box(0.2), moved(box(0.2), (0, 0, 0.3)), moved(box(0.2), (0, 0, 0.6)))
    line = follow_from(stage.Objects(parts), ball_body(), [0.01, 0.02, -0.1 + RAY_OFFSET], [0, 0, 1], True)
    assert line.chord[0] == pytest.approx(0.2, abs=1e-5)
    assert line.depth[0] == pytest.approx(0.4, abs=1e-5)
    assert not line.blocked[0]


def test_overlapping_shells_are_a_union(stage):
    parts = joined(box(0.2), moved(box((0.1, 0.1, 0.2)), (0, 0, 0.15)))
    line = follow_from(stage.Objects(parts), ball_body(), [0.01, 0.02, -0.1 + RAY_OFFSET], [0, 0, 1], True)
    assert line.chord[0] == pytest.approx(0.35, abs=1e-5)
    assert line.depth[0] == 0


def test_a_cavity_is_left_out(stage):
    line = follow_from(stage.Objects(hollow_ball(0.5, 0.25, 4)), ball_body(), [0, 0, -0.4], [0, 0, 1], True)
    # facets lie up to 2e-3 R inside the spheres
    assert line.chord[0] == pytest.approx(0.15, abs=2e-3)
    assert line.depth[0] == pytest.approx(0.25, abs=4e-3)


def test_a_light_inside_the_body_ends_the_chord(stage):
    ball = icosphere(RADIUS, 4)
    light = stage.Point([0, 0, 0.2])
    points = stage.one_point([0, 0, -RADIUS], [0, 0, -1], 1 / RADIUS)
    found = plumb.exitance(stage.Objects(ball), points, ball_body(), [light])
    # at most a ball of the distance's size: chord .7, R_e .35
    assert found[1, 0] > plumb.exitance(stage.Objects(ball), points, ball_body(), [stage.Directional([0, 0, 1])])[1, 0]


def test_a_surface_that_does_not_close_falls_back_on_curvature(stage):
    """Half a ball without its far side, and a shell turned inside out."""
    ball = icosphere(RADIUS, 4)
    open_ball = type(ball)(ball.vertices, ball.faces[ball.vertices[ball.faces].mean(axis=1)[:, 2] < 0])
    points = stage.one_point([0, 0, -RADIUS], [0, 0, -1], 1 / RADIUS)
    light = stage.Directional([0, 0, 1])
    whole = plumb.exitance(stage.Objects(ball), points, ball_body(), [light])
    for broken in (open_ball, inverted(ball)):
        found = plumb.exitance(stage.Objects(broken), points, ball_body(), [light])
        # the curvature radius is the ball's own
        np.testing.assert_allclose(found, whole, rtol=0.02)


def test_odd_points_give_finite_light(stage):
    ball = icosphere(RADIUS, 3)
    rim = stage.vertex_points(ball, 0.0)
    for curvature in (0.0, -1e6, 1e6, 1e-30):
        rim.curvature[:] = curvature
        found = plumb.exitance(stage.Objects(ball), rim, ball_body(), [stage.Directional([1, 0, 0]), stage.Ambient()])
        assert found.dtype == np.float32
        assert np.isfinite(found).all()
        assert found.min() >= 0


def test_blocks_and_beams_add_up(stage, monkeypatch):
    ball = icosphere(RADIUS, 3)
    points, lights = stage.vertex_points(ball, 1 / RADIUS), [stage.Directional([1, 0, 0], [1, 2, 3]), stage.Ambient()]
    whole = plumb.exitance(stage.Objects(ball), points, ball_body(), lights)
    alone = [plumb.exitance(stage.Objects(ball), points, ball_body(), [light]) for light in lights]
    np.testing.assert_array_equal(whole, alone[0] + alone[1])
    monkeypatch.setattr("renderer.shaders.surface.BLOCK", 100)
    np.testing.assert_array_equal(plumb.exitance(stage.Objects(ball), points, ball_body(), lights), whole)


def test_no_points_are_no_problem(stage):
    ball = icosphere(RADIUS, 1)
    none = stage.vertex_points(ball, 1.0).take(np.arange(0))
    assert plumb.exitance(stage.Objects(ball), none, ball_body(), [stage.Ambient()]).shape == (3, 0)


@pytest.mark.parametrize("curvature", [2.0, 20.0, 200.0])
def test_a_body_rounder_than_its_chord_is_between_the_balls_of_chord_and_curvature(curvature):
    """Opposite a thick, all but black slab nothing may be as far above the ball: thin ears had blue streaks."""
    body = BodyOptics.prepare(0, Medium.from_albedo((0.99, 0.95, 0.6), 1 / 0.01), 1.0)
    x = np.linspace(-1, 1, 201, dtype=np.float32)
    radius, bent = np.full_like(x, 2.0), np.full_like(x, curvature)
    found = plumb.solved_body(body, x, radius, bent)
    of_chord, of_curvature = body.ball_exitance(x, radius), body.ball_exitance(x, body.curvature_radius(bent))
    assert (found <= np.maximum(of_chord, of_curvature) * (1 + 1e-6)).all()
    assert (found >= np.minimum(of_chord, of_curvature) * (1 - 1e-6)).all()
