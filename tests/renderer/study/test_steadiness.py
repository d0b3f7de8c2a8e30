"""What should change no picture changes none: turned, moved, subdivided; and no surface is too odd for a number."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.render import Renderer, Settings
from renderer.scene.description import DirectionalLight, EnvironmentLight
from renderer.scene.staging import stage_mesh
from renderer.study.steadiness import change, displaced, finer, turned
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, ellipsoid, icosphere, torus
from tests.renderer.scenes import bumpy_ball, camera, placed, scene, translucent

SHADERS = ["scalar", "plumb"]
SUN = DirectionalLight(np.array([-1.0, -0.8, -0.4]), np.full(3, 3.0))
SKY = EnvironmentLight(radiance=np.full(3, 0.2))


def staged(mesh: Mesh, normals="smooth"):
    staged = stage_mesh(mesh, size=(120, 120))
    return replace(staged, objects=(replace(staged.objects[0], normals=normals),), hash="")


@pytest.mark.parametrize(
    ("shader", "mean", "pixels"),
    [
        # nothing changes but the box around the body, which bounds radii of curvature: rounding (float32, some thirty
        # operations), and the one pixel in 8000 whose ray passes an edge on the other side, 1e-4 of the mean each
        ("scalar", 2e-3, 1e-3),
        # the axes that probe the even part of the light stay where they are: that part is half of this light, and 12
        # axes are within 8 % of it (root mean square), so within 3 times that but for five pixels in a thousand
        ("plumb", 5e-3, 0.12),
    ],
)
def test_turning_the_scene_by_a_degree(shader, mean, pixels):
    of = staged(bumpy_ball(4))
    found = change(of, turned(of), shader)
    assert abs(found[0]) < mean
    assert found[1] < pixels


@pytest.mark.parametrize("shader", SHADERS)
def test_moving_the_scene_by_a_thousand_extents(shader):
    """Coordinates then end at 1e-13 of an extent, far below the single precision of what follows."""
    of = staged(bumpy_ball(4))
    found = change(of, displaced(of), shader)
    assert abs(found[0]) < 1e-4
    assert found[1] < 1e-3


@pytest.mark.parametrize(("shader", "pixels"), [("scalar", 0.12), ("plumb", 0.06)])
def test_subdividing_the_mesh_once(shader, pixels):
    """The curvature is a mean over four edges, and reaches half as far on the finer mesh. Features of this one are 25
    edges wide, of whose curvature that takes off some percent more or less at their tops; scalar has nothing else to
    go by, and plumb's chords do not change."""
    of = staged(bumpy_ball(5))
    found = change(of, finer(of), shader)
    assert abs(found[0]) < 5e-3
    assert found[1] < pixels


def test_a_change_is_found():
    """The companion: a body a hundredth larger."""
    of = staged(bumpy_ball(4))
    thing = of.objects[0]
    larger = replace(of, objects=(replace(thing, mesh=Mesh(thing.mesh.vertices * [1.01, 1, 1], thing.mesh.faces)),))
    mean, pixels = change(of, replace(larger, hash=""), "scalar")
    assert abs(mean) > 1e-4
    assert pixels > 0.01


def test_subdivision_keeps_the_surface():
    mesh = torus()
    fine = finer(staged(mesh)).objects[0].mesh
    assert len(fine.faces) == 4 * len(mesh.faces)
    assert fine.volume == pytest.approx(mesh.volume)
    assert fine.area == pytest.approx(mesh.area)
    assert (fine.topology.faces_per_edge == 2).all()


# ---- odd surfaces ----


def with_needles() -> Mesh:
    """A ball stretched to needles, a thousand times as long as wide."""
    ball = icosphere(1.0, 3)
    return Mesh(ball.vertices * [1, 1e-3, 1e-3], ball.faces)


def with_slivers() -> Mesh:
    """A box some of whose sides are cut in slivers 1e-7 wide."""
    cube = box(1.0)
    vertices, faces = list(cube.vertices), [list(face) for face in cube.faces]
    for k in range(6):
        a, b, c = faces[k]
        vertices.append(cube.vertices[a] + 1e-7 * (cube.vertices[b] - cube.vertices[a]))
        new = len(vertices) - 1
        faces[k] = [new, b, c]
        faces.append([a, new, c])
    return Mesh(np.array(vertices), np.array(faces))


def with_degenerate_faces() -> Mesh:
    """A ball with faces that have lost their area: two corners in one place, three in a line, all three the same."""
    ball = icosphere(1.0, 3)
    a, b, c = ball.faces[0]
    middle = (ball.vertices[a] + ball.vertices[b]) / 2
    vertices = np.concatenate([ball.vertices, [middle]])
    return Mesh(vertices, np.concatenate([ball.faces, [[a, a, b], [a, len(ball.vertices), b], [c, c, c]]]))


def opposed() -> Mesh:
    """Two faces back to back: the normals at their corners cancel to nothing."""
    return Mesh(np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 1]]))


ODD = {
    "needles": with_needles(),
    "slivers": with_slivers(),
    "faces without area": with_degenerate_faces(),
    "normals that cancel": opposed(),
    "a single triangle": Mesh(opposed().vertices, opposed().faces[:1]),
    "no curvature": box(1.0),
    "saddle points": torus(),
    "a plate": ellipsoid((1, 1, 1e-3), 3),
}


@pytest.mark.parametrize("shader", SHADERS)
@pytest.mark.parametrize("normals", ["flat", "smooth"])
@pytest.mark.parametrize("name", ODD)
def test_odd_surfaces_have_finite_light_of_no_less_than_nothing(name, normals, shader):
    thing = placed(ODD[name], translucent(0.9, 5.0), normals=normals)
    for direction in ((0.4, 0.3, 3.0), (0, 0, -3.0)):
        view = camera(direction, fov=45, resolution=(48, 48))
        of = Renderer(scene([thing], [SUN, SKY], view), Settings(shader=shader, hole_handling="terminate"))
        of.run([0, 1])
        assert of.film.non_finite == 0
        assert (of.film.sum >= 0).all()
        # no more than a white body sends back of the brightest light: 3 across the beam and 0.2 from everywhere, and
        # the mirror image of the sky
        assert of.film.sum.max() < 2 * (3.0 + 0.2 * np.pi)
