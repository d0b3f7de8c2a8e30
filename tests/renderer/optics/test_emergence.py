import time

import numpy as np
import pytest

from renderer.optics import emergence as emerging
from renderer.optics import lookup
from renderer.optics.ball import ball_profile, ball_table
from renderer.optics.dielectric import diffuse_external_reflectance, fresnel_reflectance
from renderer.optics.emergence import emergence_table, scattered_once
from renderer.shaders.surface import BodyOptics, SurfacePoints
from sss_tools.cache import FOLDER_VARIABLE
from sss_tools.medium import Medium


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(tmp_path_factory.mktemp("cache")))
        ball_table.cache_clear()
        emergence_table.cache_clear()
        yield
        ball_table.cache_clear()
        emergence_table.cache_clear()


def once_by_sum(x, radius, mu, to_light, steps=20_000):
    """The integral of light scattered once in a matched ball, by midpoints along the way to the viewer."""
    t = (np.arange(steps) + 0.5) / steps * 2 * radius * mu
    normal = np.array([0.0, 0.0, 1.0])
    viewer = np.array([np.sqrt(1 - mu * mu), 0.0, mu])
    across = (to_light - mu * x) / viewer[0]
    light = np.array([across, np.sqrt(1 - x * x - across * across), x])
    point = radius * normal - t[:, None] * viewer
    along = point @ light
    s = np.sqrt(along**2 + radius**2 - (point**2).sum(axis=1)) - along
    return np.exp(-t - s).sum() * 2 * radius * mu / steps / (4 * np.pi)


@pytest.mark.parametrize("radius", [1.0, 5.0])
@pytest.mark.parametrize(("x", "mu", "to_light"), [(0.8, 0.6, 0.3), (0.1, 0.3, -0.7), (-0.1, 0.2, -0.9)])
def test_light_scattered_once_is_the_integral_along_the_view(radius, x, mu, to_light):
    """Four nodes: within 6 % of the largest value here, on rims seen from behind; 24 nodes within 1 %."""
    expected = once_by_sum(x, radius, mu, to_light)
    single = [np.array([value], np.float32) for value in (x, mu, to_light)]
    found = scattered_once(single[0], radius, single[1], single[2], 1.0)[0]
    assert found == pytest.approx(expected, abs=0.06 / (4 * np.pi))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emerging, "NODES", 24)
        found = scattered_once(single[0], radius, single[1], single[2], 1.0)[0]
    assert found == pytest.approx(expected, rel=0.01, abs=1e-4)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_deep_bodies_send_light_back_by_lommel_and_seeliger(eta):
    """x T/(4 pi (x' + mu')) times what the boundary lets in: a half-space, and balls of 200 paths."""
    x, mu = np.meshgrid([0.3, 0.6, 1.0], [0.3, 0.7, 1.0])
    reflectance, bent = fresnel_reflectance(x, eta)
    _, inside = fresnel_reflectance(mu, eta)
    expected = x * (1 - reflectance) / (bent + inside) / (4 * np.pi)
    # any azimuth: at right angles
    to_light = inside * x
    found = scattered_once(*(a.astype(np.float32) for a in (x,)), 200.0,
                           inside.astype(np.float32), to_light.astype(np.float32), eta)  # fmt: skip
    # the light is followed as if it ran straight to the entry, which a curved surface shifts: 1/200 and four nodes
    np.testing.assert_allclose(found, expected, rtol=0.03)


def seen_from_everywhere(body, x, radius, views=48, azimuths=64):
    """Integral over the hemisphere of the radiance, relative to the exitance, of the mean of the channels."""
    node, weight = np.polynomial.legendre.leggauss(views)
    mu, weight = (node + 1) / 2, weight / 2
    turn = (np.arange(azimuths) + 0.5) / azimuths * np.pi
    mu, turn = (a.ravel() for a in np.meshgrid(mu, turn, indexing="ij"))
    weight = np.repeat(weight, azimuths) / azimuths
    sine = np.sqrt(1 - mu * mu)
    viewer = np.stack([sine * np.cos(turn), sine * np.sin(turn), mu]).astype(np.float32)
    n = len(mu)
    normal = np.repeat(np.array([[0], [0], [1]], np.float32), n, axis=1)
    light = np.repeat(np.array([[np.sqrt(1 - x * x)], [0], [x]], np.float32), n, axis=1)
    points = SurfacePoints(np.zeros((3, n), np.float32), normal, np.zeros(n, np.float32), viewer)
    at = np.full(n, x, np.float32), np.full(n, radius, np.float32)
    exitance = body.ball_exitance(*at)
    seen = exitance.copy()
    body.seen(seen, *at, points, light)
    assert seen.min() >= 0
    # the table is exactly dark opposite large absorbing balls
    seen = np.divide(seen, exitance, out=np.ones_like(seen), where=(exitance > 0) | (seen > 0))
    through = 1 - fresnel_reflectance(mu, body.ior)[0]
    return 2 * (seen * (weight * mu * through)).sum(axis=1) / (1 - diffuse_external_reflectance(body.ior))


@pytest.mark.parametrize("ior", [1.0, 1.4])
@pytest.mark.parametrize("radius", [1.0, 5.0, 20.0])
def test_what_all_viewers_see_is_the_exitance(ior, radius):
    body = BodyOptics.prepare(0, Medium.from_albedo((0.9, 0.99, 0.999), 1.0, ior=ior), 100.0)
    for x in (-1.0, -0.5, -0.1, 0.1, 0.5, 1.0):
        # 1/(1 + g) for 1 - g adds light where the field changes much within a path: small and unlit balls
        np.testing.assert_allclose(seen_from_everywhere(body, x, radius), 1, atol=0.08)


def test_nobody_who_looks_changes_nothing():
    body = BodyOptics.prepare(0, Medium.from_albedo(0.9, 1.0), 10.0)
    one = np.ones(1, np.float32)
    normal = np.array([[0], [0], [1]], np.float32)
    exitance = np.ones((3, 1), np.float32)
    body.seen(exitance, one, one, SurfacePoints(normal, normal, one), normal)
    np.testing.assert_array_equal(exitance, 1)


def test_light_scattered_once_is_part_of_all():
    for albedo, eta in ((0.5, 1.0), (0.99, 1.3)):
        table = emergence_table(albedo, eta)
        assert table.share.min() >= 0
        assert table.share.max() <= 1
        # without much scattering most light has scattered once
    assert emergence_table(0.05, 1.0).share[10, 150] > 0.9
    # on the dark side of large balls, none
    assert emergence_table(0.99, 1.3).share[-1, 10] < 1e-3


def test_the_slope_is_that_of_the_series():
    x = np.array([-0.6, 0.3, 0.8])
    row = 24
    radius, step = lookup.RADII[row], 0.02
    ends = [np.log(ball_profile(0.99, 1.3, radius, x + side * step)) for side in (-1, 1)]
    columns = np.searchsorted(lookup.COSINES, x - 1e-9)
    found = emergence_table(0.99, 1.3).slope[row, columns]
    np.testing.assert_allclose(found, (ends[1] - ends[0]) / (2 * step), rtol=0.02)


def test_tables_are_built_in_a_moment():
    ball_table(0.97, 1.37)
    start = time.process_time()
    emerging._build(0.97, 1.37)
    # three seconds a channel with the ball's; this part takes a twentieth of a second
    assert time.process_time() - start < 1
