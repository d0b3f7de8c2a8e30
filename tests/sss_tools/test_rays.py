"""The ray caster: hits, limits, occlusion, and the offset that keeps rays off their own face."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET, RayCaster, UnitFrame
from sss_tools.shapes import box, icosphere, moved, torus

NOTHING = -1


def directions(n: int, seed: int):
    drawn = np.random.default_rng(seed).normal(size=(3, n))
    return (drawn / np.linalg.norm(drawn, axis=0)).astype(np.float32)


def caster_of(mesh: Mesh) -> tuple[RayCaster, np.ndarray]:
    """A caster of the mesh in its unit frame, and the float32 corners (m, 3, 3) that Embree sees."""
    frame = UnitFrame.around(*mesh.bounds)
    vertices = frame.points_in(mesh.vertices).astype(np.float32)
    return RayCaster(vertices, mesh.faces), vertices[mesh.faces]


def crossings(corners, origin, direction):
    """Per ray the ascending distances to all triangles, by Moeller & Trumbore 1997 in double precision."""
    corners, found = corners.astype(float), []
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    for o, d in zip(origin.T.astype(float), direction.T.astype(float), strict=True):
        p = np.cross(d, second)
        determinant = np.einsum("ij,ij->i", first, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = o - corners[:, 0]
            u = np.einsum("ij,ij->i", offset, p) / determinant
            q = np.cross(offset, first)
            v, t = q @ d / determinant, np.einsum("ij,ij->i", second, q) / determinant
        found.append(np.sort(t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)]))
    return found


@pytest.fixture(scope="module")
def ring():
    return caster_of(torus(around=24, across=12))


@pytest.fixture(scope="module")
def rays():
    """(origin, direction) of 300 rays from in and around a unit box."""
    origin = (np.random.default_rng(1).random((3, 300)) - 0.5).astype(np.float32)
    return origin, directions(300, 2)


def test_closest_hits_agree_with_all_triangles_tried(ring, rays):
    caster, corners = ring
    distance, triangle = caster.closest(*rays)
    expected = crossings(corners, *rays)
    hit = np.array([len(found) > 0 for found in expected])
    assert_array_equal(triangle != NOTHING, hit)
    assert 60 < hit.sum() < 290
    assert_allclose(distance[hit], [found[0] for found in expected if len(found)], rtol=2e-5, atol=1e-6)
    assert (distance[~hit] > 1e36).all()


def test_bounded_rays_agree_with_unbounded(ring, rays):
    caster, _ = ring
    distance, triangle = caster.closest(*rays)
    limit = np.random.default_rng(3).random(300).astype(np.float32)
    bounded, met = caster.closest(*rays, limit)
    within = (triangle != NOTHING) & (distance < limit)
    assert 20 < within.sum() < 280
    assert_array_equal(met, np.where(within, triangle, NOTHING))
    assert_array_equal(bounded, np.where(within, distance, limit))


def test_callers_limits_are_not_changed(ring, rays):
    caster, _ = ring
    limit = np.full(300, 2, np.float32)
    caster.closest(*rays, limit)
    caster.occluded(*rays, limit)
    assert_array_equal(limit, np.full(300, 2, np.float32))


@pytest.mark.parametrize("reach", [None, 0.1, 0.5, 1e37, np.inf])
def test_occlusion_is_a_hit_within_the_limit(ring, rays, reach):
    caster, _ = ring
    distance, triangle = caster.closest(*rays)
    limit = None if reach is None else np.full(300, reach, np.float32)
    expected = (triangle != NOTHING) & (distance < (np.inf if reach is None else reach))
    assert_array_equal(caster.occluded(*rays, limit), expected)


def test_rays_in_any_memory_layout_mean_the_same(ring, rays):
    caster, _ = ring
    expected = caster.closest(*rays)
    wide = np.zeros((2, 3, 500), np.float32)
    wide[:, :, :300] = rays
    by_ray = [np.ascontiguousarray(part.T).T for part in rays]
    for given in (wide[:, :, :300], by_ray):
        for got, wanted in zip(caster.closest(*given), expected, strict=True):
            assert_array_equal(got, wanted)


@pytest.mark.parametrize(
    ("vertices", "triangles", "said"),
    [
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.zeros((0, 3)), "at least one triangle"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], "finite"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]], "indices"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, -1]], "indices"),
    ],
)
def test_what_would_crash_the_library_is_refused(vertices, triangles, said):
    with pytest.raises(ValueError, match=said):
        RayCaster(vertices, triangles)


def test_frame_centres_a_box_and_makes_its_longest_side_one():
    frame = UnitFrame.around([1, 2, 3], [3, 6, 4])
    assert_allclose(frame.points_in([[1, 2, 3], [3, 6, 4]]), [[-0.25, -0.5, -0.125], [0.25, 0.5, 0.125]])
    points = np.random.default_rng(4).random((20, 3))
    assert_allclose(frame.points_out(frame.points_in(points)), points, atol=1e-15)
    assert UnitFrame.around([1, 1, 1], [1, 1, 1]).scale == 1


SOLIDS = {"ball of 20480 faces": lambda: icosphere(1.0, 5), "box": box, "ring": torus}


def rehits(mesh: Mesh, offset) -> tuple[float, int]:
    """Share of rays, leaving hit points to either side, that meet the face they start from; and rays tried.

    As in the tracer: the hit point goes back onto its triangle's plane, then off it along the normal.
    """
    caster, corners = caster_of(mesh)
    n = 20_000
    lower, upper = corners.min((0, 1)), corners.max((0, 1))
    origin = (lower + (upper - lower) * np.random.default_rng(5).random((n, 3))).astype(np.float32).T.copy()
    direction = directions(n, 6)
    distance, triangle = caster.closest(origin, direction)
    hit = triangle != NOTHING
    triangle = triangle[hit]
    point = (origin + distance * direction)[:, hit]
    exact = corners.astype(float)
    normal = np.cross(exact[:, 1] - exact[:, 0], exact[:, 2] - exact[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    plane = np.einsum("ij,ij->i", normal, exact.mean(1)).astype(np.float32)[triangle]
    normal = normal.astype(np.float32)[triangle].T
    point = point - (np.einsum("ij,ij->j", normal, point) - plane) * normal
    # a new direction on either side, as reflection and refraction give
    new = directions(len(triangle), 7)
    side = np.copysign(np.float32(1), np.einsum("ij,ij->j", new, normal))
    _, again = caster.closest(point + np.float32(offset) * side * normal, new)
    return float((again == triangle).mean()), len(triangle)


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("distance", [0.0, 1.0, 1000.0])
def test_rays_off_a_face_do_not_meet_it_again(name, scale, distance):
    """At any size and up to a thousand sizes from the origin: the frame takes both away."""
    mesh = SOLIDS[name]()
    mesh = moved(Mesh(mesh.vertices * scale, mesh.faces), np.array([0.3, -1, 0.7]) * distance * scale)
    share, tried = rehits(mesh, RAY_OFFSET)
    assert tried > 3000
    assert share == 0


def test_rays_without_offset_meet_their_face_again():
    """The companion: why there is an offset at all."""
    assert rehits(icosphere(1.0, 5), 0.0)[0] > 0.05


def test_offset_keeps_walls_of_a_hundred_thousandth_solid():
    """Off the upper side of the wall, within it: both sides are still met where they are."""
    thickness = 1e-5
    caster, _ = caster_of(box((1, 1, thickness)))
    origin = np.float32([[0.1], [0.2], [thickness / 2 - RAY_OFFSET]])
    for z, expected in ((-1, thickness - RAY_OFFSET), (1, RAY_OFFSET)):
        distance, triangle = caster.closest(origin, np.float32([[0], [0], [z]]))
        assert triangle[0] != NOTHING
        assert distance[0] == pytest.approx(expected, rel=1e-3)
