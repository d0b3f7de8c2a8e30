"""Light straight from its source: attenuated in matched media, stopped by all other surfaces."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.description import PointLight, RectangleLight, SphereLight
from renderer.scene.lights import Illumination
from renderer.tracing.depth_roulette import FREE_DEPTH
from renderer.tracing.paths import OUTSIDE
from renderer.tracing.shadow import cross, transmittance
from renderer.tracing.tally import Tally
from renderer.tracing.traced_scene import TracedScene
from sss_tools.shapes import box, hollow_ball, icosphere, moved
from tests.renderer.scenes import WHITE_SKY, bumpy_ball, camera, diffuse, placed, scene, translucent

CLEAR_AIR = translucent(0.9, [1.0, 2.0, 0.5], ior=1.0)


def traced(*objects, lights=(WHITE_SKY,), shaders=None) -> TracedScene:
    shaders = shaders or ["path"] * len(objects)
    return TracedScene(scene(objects, lights, camera((0, 0, 5))), shaders, ["strict"] * len(objects))


def through(world: TracedScene, start, end, inside=None, deepest=None):
    """(3,) transmittance between two points in scene units; ``inside`` how often inside each object at the start."""
    start, end = (world.frame.points_in(point).astype(np.float32).reshape(3, 1) for point in (start, end))
    distance = np.linalg.norm(end - start, axis=0).astype(np.float32)
    light = Illumination((end - start) / distance, distance, np.ones((3, 1), np.float32))
    counts = np.zeros((max(world.media.count, 1), 1), np.int8)
    if inside is not None:
        counts[:, 0] = inside
    within = counts[:, 0] > 0
    owner = np.int16([within.argmax() if within.any() else OUTSIDE])
    return transmittance(world, start, light, counts, owner, Tally(), deepest)[:, 0]


def attenuation(length: float):
    return np.exp(-np.array([1.0, 2.0, 0.5]) * length)


def test_empty_space_lets_all_through():
    world = traced(placed(box(1), CLEAR_AIR))
    assert_array_equal(through(world, (2, 2, 2), (-2, 2, 2)), [1, 1, 1])


def test_matched_box_attenuates_by_its_chord():
    world = traced(placed(box((2, 1, 3)), CLEAR_AIR))
    assert_allclose(through(world, (-5, 0.1, 0.2), (5, 0.1, 0.2)), attenuation(2), rtol=1e-5)


def test_beams_that_start_or_end_inside_are_attenuated_from_there():
    world = traced(placed(box(2), CLEAR_AIR))
    assert_allclose(through(world, (0.1, 0.3, 0), (5, 0.3, 0), inside=1), attenuation(0.9), rtol=1e-5)
    # beams end a hundred-thousandth of their length short of the light
    assert_allclose(through(world, (-5, 0.3, 0), (0.1, 0.3, 0)), attenuation(1.1), rtol=2e-4)
    assert_allclose(through(world, (-0.5, 0.3, 0), (0.1, 0.3, 0), inside=1), attenuation(0.6), rtol=2e-4)


def test_matched_balls_in_line_multiply():
    """Chords of the very facets: of the ball alone, three times over."""
    ball = icosphere(1, 2)
    three = [placed(moved(ball, (3 * k, 0, 0)), CLEAR_AIR) for k in range(3)]
    start, end = (-5, 0.3, 0.2), (11, 0.3, 0.2)
    alone = through(traced(three[0]), start, end)
    assert alone[0] == pytest.approx(np.exp(-2 * np.sqrt(1 - 0.13)), rel=0.05)
    assert_allclose(through(traced(*three), start, end), alone**3, rtol=1e-4)


def test_overlapping_matched_solids_count_once_and_the_first_owns_the_overlap():
    first, second = placed(box(2), CLEAR_AIR), placed(moved(box(2), (1, 0, 0)), translucent(0.9, 5.0, ior=1.0))
    start, end = (-5, 0.1, 0.2), (5, 0.1, 0.2)
    assert_allclose(through(traced(first, second), start, end), attenuation(2) * np.exp(-5), rtol=1e-4)
    assert_allclose(through(traced(second, first), start, end), attenuation(1) * np.exp(-10), rtol=1e-4)


def test_cavities_do_not_attenuate():
    world = traced(placed(hollow_ball(1, 0.5, 4), CLEAR_AIR))
    # facets lie inside the spheres by 3e-4 of the radius
    assert_allclose(through(world, (-5, 0.01, 0.02), (5, 0.01, 0.02)), attenuation(1), rtol=3e-3)


def test_beams_agree_with_all_crossings_tried():
    """Bumpy ball, beams from inside and outside; the twin sums lengths over all triangles in double precision."""
    world = traced(placed(bumpy_ball(3), CLEAR_AIR))
    corners = world.frame.points_in(world.scene.objects[0].mesh.vertices)[world.scene.objects[0].mesh.faces]
    draw = np.random.default_rng(1)
    start, end = draw.random((2, 3, 400)) - 0.5
    end = start + 3 * (end - start) / np.linalg.norm(end - start, axis=0)
    lengths, inside = [], []
    for o, e in zip(start.T.astype(np.float32).astype(float), end.T, strict=True):
        d = (e - o) / np.linalg.norm(e - o)
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        p = np.cross(d, second)
        with np.errstate(divide="ignore", invalid="ignore"):
            determinant = np.einsum("ij,ij->i", first, p)
            u = np.einsum("ij,ij->i", o - corners[:, 0], p) / determinant
            q = np.cross(o - corners[:, 0], first)
            v, t = q @ d / determinant, np.einsum("ij,ij->i", second, q) / determinant
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        # leaving counts plus, entering minus: what is left over is the stretch from a start inside
        leaving = np.einsum("ij,j->i", np.cross(first, second), d) > 0
        lengths.append(np.sum(np.where(leaving, t, -t)[met]))
        inside.append(np.sum(np.where(leaving, 1, -1)[met]))
    inside = np.array(inside)
    assert set(inside) == {0, 1}
    distance = np.full(400, 3, np.float32)
    light = Illumination(((end - start) / 3).astype(np.float32), distance, np.ones((3, 1), np.float32))
    got = transmittance(world, start.astype(np.float32), light, inside[None].astype(np.int8),
                        np.where(inside, 0, -1).astype(np.int16), Tally())  # fmt: skip
    expected = np.exp(-np.array(lengths) * world.media.sigma_t[:, :1])
    # a few offsets of 1e-6, over the cosine of glancing beams, times sigma_t of 4.6
    assert_allclose(got, expected, rtol=0, atol=5e-4)


@pytest.mark.parametrize(("material", "shader"), [(diffuse(1.0), "opaque"), (translucent(ior=1.5), "path"),
                                                  (translucent(ior=1.5, roughness=0.3), "path"),
                                                  (CLEAR_AIR, "plumb")])  # fmt: skip
def test_every_other_surface_blocks(material, shader):
    world = traced(placed(box(1), CLEAR_AIR), placed(moved(box(1), (2, 0, 0)), material), shaders=["path", shader])
    assert_array_equal(through(world, (-5, 0, 0.1), (5, 0, 0.1)), [0, 0, 0])
    assert_allclose(through(world, (-5, 0, 0.1), (1.4, 0, 0.1)), attenuation(1), rtol=1e-5)


@pytest.mark.parametrize("light", [
    SphereLight(np.array([3.0, 0, 0]), 0.5, np.ones(3)),
    RectangleLight(np.array([3.0, 0, 0]), np.array([9.0, 0, 0]), np.array([0, 1.0, 0]), (0.5, 0.5), np.ones(3)),
])  # fmt: skip
def test_lights_in_the_way_block(light):
    world = traced(placed(box(1), CLEAR_AIR), lights=(light,))
    assert_array_equal(through(world, (-5, 0.1, 0.1), (5, 0.1, 0.1)), [0, 0, 0])
    assert_allclose(through(world, (-5, 0.1, 0.1), (2, 0.1, 0.1)), attenuation(1), rtol=1e-5)
    assert_array_equal(through(world, (-5, 0.9, 0.1), (5, 0.9, 0.1)), [1, 1, 1])


def test_beams_are_independent_of_their_neighbours():
    """One batch of beams that end after different numbers of surfaces, against each alone."""
    world = traced(*(placed(moved(box(1), (2 * k, 0, 0)), CLEAR_AIR) for k in range(3)),
                   placed(moved(box(1), (2, 3, 0)), diffuse(1.0)), shaders=["path"] * 3 + ["opaque"])  # fmt: skip
    n = 200
    draw = np.random.default_rng(2)
    start = np.stack([np.full(n, -0.5), *(draw.random((2, n)) - 0.5)]).astype(np.float32)
    end = np.stack([np.full(n, 0.5), *(draw.random((2, n)) - 0.5)]).astype(np.float32)
    distance = np.linalg.norm(end - start, axis=0).astype(np.float32)
    light = Illumination((end - start) / distance, distance, np.ones((3, 1), np.float32))
    outside = np.zeros((3, n), np.int8), np.full(n, OUTSIDE)
    together = transmittance(world, start, light, *outside, Tally())
    assert len(np.unique(together[0].round(3))) > 10
    for k in range(n):
        only = slice(k, k + 1)
        beam = Illumination(light.direction[:, only], distance[only], light.irradiance)
        alone = transmittance(world, start[:, only], beam, *(part[..., only] for part in outside), Tally())
        assert_array_equal(alone[:, 0], together[:, k])
    assert not outside[0].any()  # the caller's counts are not changed


def test_point_light_is_not_hidden_by_what_stands_behind_it():
    world = traced(placed(box(1), diffuse(1.0)), lights=(PointLight(np.array([0, 2.0, 0]), np.ones(3)),),
                   shaders=["opaque"])  # fmt: skip
    assert_array_equal(through(world, (0, 4, 0), (0, 2, 0)), [1, 1, 1])
    assert_array_equal(through(world, (0, 4, 0), (0, 0.4, 0)), [0, 0, 0])


def test_surface_within_the_first_objects_overlap_is_not_there():
    """The first object owns the overlap: a glass box listed after the matched one that encloses it has no effect."""
    outer, inner = placed(box(2), CLEAR_AIR), placed(box(1), translucent(ior=1.5))
    start, end = (-5, 0.1, 0.2), (5, 0.1, 0.2)
    assert_allclose(through(traced(outer, inner), start, end), attenuation(2), rtol=1e-4)


def test_counts_and_owners_follow_the_crossings():
    inside = np.int8([[0, 1, 1, 0], [0, 0, 1, 1]])
    owner = cross(inside, np.array([1, 0, 0, 1]), np.array([True, False, False, True]))
    assert_array_equal(inside, [[0, 0, 0, 0], [1, 0, 1, 2]])
    assert_array_equal(owner, [1, -1, 1, 1])


def test_light_given_up_in_the_depth_is_made_up_for():
    """2.9 and 0.6 optical depths in the clearest channel, given up at depths beyond 2: the mean over those."""
    world = traced(placed(box(8), CLEAR_AIR))
    depths = np.linspace(0, 12, 481, dtype=np.float32)  # midpoints of exponential shares
    weights = np.exp(-depths[:-1]) - np.exp(-depths[1:])
    for x, length in ((-1.8, 5.8), (2.8, 1.2)):
        found = [
            through(world, (x, 0.3, 0), (9, 0.3, 0), 1, FREE_DEPTH + np.float32([d + 0.0125])) for d in depths[:-1]
        ]
        assert_allclose(weights @ np.array(found), attenuation(length), rtol=0.02)
        assert (found[0] == 0).all() == (length > 4)
    outside = through(world, (9, 0.3, 0), (5, 0.3, 0), None, np.float32([1.0]))
    assert_array_equal(outside, [1, 1, 1])
