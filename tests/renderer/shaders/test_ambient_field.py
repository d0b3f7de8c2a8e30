"""Light of a constant environment, known at the corners of faces."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from renderer import fast_bodies
from renderer.render import Renderer, Settings
from renderer.scene.description import EnvironmentLight
from renderer.scene.lights import fibonacci_directions
from renderer.shaders import plumb
from renderer.shaders.surface import SurfacePoints
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, icosphere, joined, moved
from tests.renderer.scenes import bumpy_ball, camera, placed, scene, translucent

SKY = EnvironmentLight(radiance=np.array([1.0, 0.5, 0.25]))


def renderer(mesh: Mesh, **how) -> Renderer:
    view = camera((0.5, 1.5, 6), fov=30, resolution=how.pop("resolution", (160, 120)))
    thing = placed(mesh, translucent(0.9, 3.0), normals="smooth")
    return Renderer(scene([thing], [SKY], view), Settings(shader="plumb", threads=how.pop("threads", 1)))


def test_a_ball_has_the_exact_light_everywhere():
    """Plumb is exact for a ball, whatever the number of axes: the field then is the series' own number."""
    of = renderer(icosphere(1.0, 4))
    body = of._fast_bodies[0]
    assert body.ambient is not None
    exact = body.optics.uniform_exitance(np.array([0.5], np.float32))
    # facets are 4 degrees wide: chords and curvature are a few thousandths off the ball's
    assert_allclose(body.ambient.reshape(-1, 3), np.broadcast_to(exact.T, (body.ambient.size // 3, 3)), rtol=0.02)


def test_between_corners_it_is_what_plumb_finds_there():
    """At points of the faces, against the same axes asked there: the field is smooth over a face of a fine mesh.

    5 % at nine points in ten: the rest lies where a line slips past a bump.
    """
    of = renderer(bumpy_ball(5), resolution=(200, 150))
    body, traced = of._fast_bodies[0], of.traced
    triangle = np.arange(0, len(traced.triangles), 7, dtype=np.int32)
    position = np.ascontiguousarray(traced.vertices[traced.triangles[triangle]].mean(axis=1).T)
    normal = traced.shading_normal(position, triangle)
    points = body._points(traced, position, normal, triangle, normal)
    assert points.ambient is not None
    axes = np.ascontiguousarray(fibonacci_directions(24)[:, :12])
    plain = SurfacePoints(points.position, points.normal, points.curvature)
    there = plumb.ambient(traced, plain, body.optics, axes)
    error = np.abs(points.ambient / there - 1).max(axis=0)
    assert np.quantile(error, 0.9) < 0.05


def test_it_is_nearer_to_many_axes_than_the_axes_of_a_pass():
    of = renderer(bumpy_ball(4))
    body, traced = of._fast_bodies[0], of.traced
    triangle = np.arange(len(traced.triangles), dtype=np.int32)
    position = np.ascontiguousarray(traced.vertices[traced.triangles].mean(axis=1).T)
    points = body._points(traced, position, traced.shading_normal(position, triangle), triangle, position)
    plain = SurfacePoints(points.position, points.normal, points.curvature)

    def by(axes: int):
        return plumb.ambient(traced, plain, body.optics, np.ascontiguousarray(fibonacci_directions(2 * axes)[:, :axes]))

    many = by(100)
    ours, pass_ = (np.sqrt(np.mean((each / many - 1) ** 2)) for each in (points.ambient, by(2)))
    assert ours < 0.12
    assert ours < pass_ / 2


def test_large_faces_are_left_out_and_asked_pixel_by_pixel():
    """A box beside a fine ball, one object: the picture of the box is that of a box without a field."""
    both = joined(icosphere(0.6, 4), moved(box(0.8), (1.2, 0, 0)))
    of, plain = renderer(both), renderer(both)
    ball_faces = len(icosphere(0.6, 4).faces)
    field = of._fast_bodies[0].ambient
    assert field is not None
    assert np.isnan(field[ball_faces:]).all()
    assert np.isfinite(field[:ball_faces]).all()
    plain._fast_bodies[0].ambient = None
    plain._frames.table.ambient = None
    for each in (of, plain):
        each.run([0])
    ours, theirs = of.film.sum, plain.film.sum
    _, triangle = of.traced.closest(
        np.repeat(of.camera.origin[:, None], 160 * 120, axis=1), of.camera.centre_directions()
    )
    on_box = (triangle >= ball_faces).reshape(120, 160)
    inner = on_box.copy()
    for axis in (0, 1):  # pixels at the rim may see the ball
        for step in (1, -1):
            inner &= np.roll(on_box, step, axis)
    assert inner.sum() > 500
    # reflections of the ball in the box have the field; they weigh a few percent
    assert_allclose(ours[inner], theirs[inner], rtol=0.02)
    assert np.abs(ours - theirs).max() > 1e-3


def test_small_pictures_of_meshes_with_many_faces_ask_pixel_by_pixel(monkeypatch):
    monkeypatch.setattr(fast_bodies, "_FIELD_FACES", 1000)
    assert renderer(icosphere(1.0, 4), resolution=(32, 32))._fast_bodies[0].ambient is None


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_do_not_change_it(threads):
    mesh = bumpy_ball(4)
    one, many = (renderer(mesh, threads=k)._fast_bodies[0].ambient for k in (1, threads))
    assert (one == many).all()
