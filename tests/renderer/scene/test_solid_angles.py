"""What is drawn on lights has the density that is claimed: chi-square tests, uniform in solid angle."""

import numpy as np
import pytest

from renderer.scene import lights
from renderer.scene.description import RectangleLight, SphereLight
from renderer.scene.lights import RectangleSource, SphereSource, spherical_rectangle
from sss_tools.rays import UnitFrame
from tests.assertions import assert_distribution, seed, shared_rate

HERE = UnitFrame(np.zeros(3), 1.0)
SAMPLES, BINS, FINE = 100_000, 8, 40
RATE = shared_rate(1e-3, 7)
HALF = (0.4, 0.7)


def uniforms(number: int):
    return np.random.default_rng(seed(number)).random((2, SAMPLES), dtype=np.float32)


def solid_angles(viewer, half=HALF):
    """(BINS, BINS) solid angles of equal parts of a rectangle, by the midpoint rule on FINE^2 points in each."""
    n = BINS * FINE
    x, y = (2 * half[k] * ((np.arange(n) + 0.5) / n - 0.5) for k in range(2))
    dx, dy = np.meshgrid(x - viewer[0], y - viewer[1], indexing="ij")
    density = abs(viewer[2]) / (dx**2 + dy**2 + viewer[2] ** 2) ** 1.5
    return density.reshape(BINS, FINE, BINS, FINE).sum(axis=(1, 3))


VIEWERS = {
    "before it": (0.1, -0.2, 1.0),
    "beside it": (1.5, 0.3, 0.4),
    "close": (0.2, 0.3, 0.05),
    "far": (3.0, 5.0, 90.0),
}


def check_rectangle(viewer, number: int) -> None:
    """Sees relative errors of 5 %, root mean square."""
    u1, u2 = uniforms(number)
    position = np.repeat(np.array(viewer)[:, None], SAMPLES, axis=1)
    point, solid_angle = lights.spherical_rectangle(position, HALF, u1, u2)
    counts, *_ = np.histogram2d(point[0], point[1], BINS, [[-HALF[0], HALF[0]], [-HALF[1], HALF[1]]])
    assert counts.sum() == SAMPLES
    expected = solid_angles(viewer)
    assert_distribution(counts, expected, false_alarm=RATE, detects=0.05)
    area = 4 * HALF[0] * HALF[1] / (BINS * FINE) ** 2
    np.testing.assert_allclose(solid_angle, expected.sum() * area, rtol=2e-3)


@pytest.mark.parametrize("where", VIEWERS)
def test_points_of_a_rectangle_are_uniform_in_solid_angle(where):
    check_rectangle(VIEWERS[where], 1)


def test_points_uniform_in_area_are_caught(monkeypatch):
    """The companion; from afar the two are the same."""

    def even(viewer, half, u1, u2):
        _, solid_angle = spherical_rectangle(viewer, half, u1, u2)
        return np.stack([half[0] * (2 * u1 - 1), half[1] * (2 * u2 - 1), 0 * u1]), solid_angle

    monkeypatch.setattr(lights, "spherical_rectangle", even)
    check_rectangle(VIEWERS["far"], 2)
    with pytest.raises(AssertionError, match="wrong distribution"):
        check_rectangle(VIEWERS["before it"], 2)


def test_directions_to_a_rectangle_are_those_of_its_points():
    """The whole way through the source: directions, counted in the rectangle's plane."""
    light = RectangleLight(
        np.array([0.2, 1.0, -0.1]), np.array([0.1, 0.0, 0.2]), np.array([1.0, 0.2, 0]), HALF, np.ones(3)
    )
    source = RectangleSource(light, HERE)
    a, b, _, d = source.vertices
    axes = np.stack([(b - a) / np.linalg.norm(b - a), (d - a) / np.linalg.norm(d - a), source.normal[:, 0]])
    u1, u2 = uniforms(3)
    beam = source.sample(np.zeros((3, SAMPLES), np.float32), u1, u2)
    local = axes @ (beam.direction * beam.distance - light.center[:, None])
    # the landing points are single precision
    counts, *_ = np.histogram2d(local[0], local[1], BINS, [[-h - 1e-5, h + 1e-5] for h in HALF])
    assert_distribution(counts, solid_angles(axes @ -light.center), false_alarm=RATE, detects=0.05)


@pytest.mark.parametrize("radius", [0.9, 0.01])
def test_directions_to_a_sphere_are_uniform_in_its_cone(radius):
    """In cosine to the axis and azimuth, both even; the cone's edge is that of the sphere."""
    centre = np.array([0.6, 0.0, -0.8])
    u1, u2 = uniforms(4)
    beam = SphereSource(SphereLight(centre, radius, np.ones(3)), HERE).sample(
        np.zeros((3, SAMPLES), np.float32), u1, u2
    )
    across, beside = np.array([0.0, 1.0, 0.0]), np.array([0.8, 0.0, 0.6])
    x, y = across @ beam.direction, beside @ beam.direction
    # 1 - cos from the sine, which does not cancel
    square = x.astype(float) ** 2 + y.astype(float) ** 2
    height = (square / (1 + np.sqrt(1 - square))) / (radius**2 / (1 + np.sqrt(1 - radius**2)))
    assert height.max() < 1 + 1e-3
    edges = np.linspace(0, 1, 13)
    edges[-1] += 1e-3
    counts, *_ = np.histogram2d(height, np.arctan2(y, x), (edges, np.linspace(-np.pi, np.pi, 13)))
    assert_distribution(counts, np.ones((12, 12)), false_alarm=RATE, detects=0.05)
