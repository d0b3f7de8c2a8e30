"""The terminator, as pictures show it: on a smooth sphere there is no seam, and noise shows no more than by Lambert."""

import numpy as np
import pytest

from renderer.shaders import diffuse, plumb, scalar
from renderer.shaders.surface import BodyOptics, SurfacePoints
from sss_tools.curvature import mean_curvature
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import RayCaster
from sss_tools.shapes import icosphere

SIZE = 500
LIGHT = np.array([1.0, 0.2, 0.1]) / np.linalg.norm([1.0, 0.2, 0.1])
VIEW = np.array([0.0, 0.0, 1.0])
"""Light from the right, and a little from the side of the viewer, so that the terminator crosses the picture."""


class Ball(RayCaster):
    """A fine ball, or a noisy one, and what the shaders ask of a scene."""

    def __init__(self, mesh):
        super().__init__(mesh.vertices, mesh.faces)
        self.triangle_normal = mesh.face_normals.T.astype(np.float32)
        self.triangle_object = np.zeros(len(mesh.faces), np.int16)


class Sun:
    """Parallel light of irradiance 1."""

    ambient, radiance, axes = False, None, None

    def at(self, position):
        n = position.shape[1]
        way = np.repeat(LIGHT[:, None].astype(np.float32), n, axis=1)
        return way, np.full(n, np.inf, np.float32), np.ones_like(position)


def body(mean_free_path, ior=1.0):
    medium = Medium.from_albedo((0.9, 0.99, 0.999), 1 / mean_free_path, ior=ior)
    return BodyOptics.prepare(0, medium, np.sqrt(3))


def picture_of_the_sphere(caster, shader, optics):
    """(3, 500, 500) what a viewer far away sees of the unit sphere; NaN beside it. Normals are the sphere's."""
    axis = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * 2.1
    across, up = np.meshgrid(axis, -axis)
    inside = across**2 + up**2 < 0.99
    x, y = across[inside], up[inside]
    normal = np.stack([x, y, np.sqrt(1 - x * x - y * y)]).astype(np.float32)
    distance, _ = caster.closest(1.2 * normal, -normal)
    position = (1.2 - distance) * normal
    viewer = np.repeat(VIEW[:, None].astype(np.float32), len(x), axis=1)
    points = SurfacePoints(position, normal, np.ones(len(x), np.float32), viewer)
    picture = np.full((3, SIZE, SIZE), np.nan, np.float32)
    picture[:, inside] = shader.exitance(caster, points, optics, [Sun()])
    return picture, (normal.T @ LIGHT, inside)


def largest_jump(picture, cosine, inside, width=0.1):
    """Between neighbours within ``width`` of the terminator, beyond the mean of the steps on both sides of it: what a
    smooth slope climbs is no jump. Relative to the maximum; of all channels."""
    near = np.zeros((SIZE, SIZE), bool)
    near[inside] = np.abs(cosine) < width
    worst = 0.0
    for axis in (1, 2):
        step = np.diff(picture, axis=axis)
        before, at, after = (np.take(step, range(k, step.shape[axis] - 2 + k), axis) for k in range(3))
        close = np.take(near, range(1, SIZE - 2), axis - 1)
        jump = np.abs(at - (before + after) / 2)[:, close]
        worst = max(worst, float(np.nanmax(jump / np.nanmax(picture, axis=(1, 2))[:, None])))
    return worst


@pytest.fixture(scope="module")
def sphere():
    return Ball(icosphere(1.0, 6))


@pytest.mark.parametrize("shader", [plumb, scalar])
@pytest.mark.parametrize(("mean_free_path", "ior"), [(0.3, 1.0), (0.05, 1.0), (0.05, 1.4)])
def test_no_jump_at_the_terminator_of_a_smooth_sphere(sphere, shader, mean_free_path, ior):
    picture, where = picture_of_the_sphere(sphere, shader, body(mean_free_path, ior))
    assert largest_jump(picture, *where) < 0.01


def test_a_jump_would_be_found(sphere):
    """A seam of 2 % of the maximum, planted where unlit parts begin."""

    class Seamed:
        @staticmethod
        def exitance(caster, points, optics, beams):
            found = scalar.exitance(caster, points, optics, beams)
            return found + np.where(LIGHT @ points.normal < 0, 0.02 * found.max(axis=1, keepdims=True), 0)

    picture, where = picture_of_the_sphere(sphere, Seamed, body(0.05))
    assert largest_jump(picture, *where) > 0.01


def test_noise_shows_little_more_than_by_lambert():
    """Steps between neighbouring faces near the terminator, by their own flat normals, on a ball with noise of 2 % of
    an edge: root mean square, relative to the maximum. Where light grazes, more of it comes back than by Lambert's
    law, so the shading of a dense body is steeper at the terminator, and steps are: under a matched boundary by
    A(0)/A(1) for the albedo A(mu) = 1 - H(mu) sqrt(1 - a) of a half-space (Chandrasekhar 1960, Radiative Transfer,
    chapter V), which is 1.62 for a = 0.9. A shader with lesser steps would be wrong on smooth bodies."""
    ball = icosphere(1.0, 5)
    edge = 1.1 * np.sqrt(4 * np.pi / len(ball.vertices))
    noise = np.random.Generator(np.random.PCG64(7)).standard_normal(len(ball.vertices))
    mesh = Mesh(ball.vertices * (1 + 0.02 * edge * noise)[:, None], ball.faces)
    corners = mean_curvature(mesh)[mesh.faces].mean(axis=1)
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    points = SurfacePoints(
        centres.T.astype(np.float32), mesh.face_normals.T.astype(np.float32), corners.astype(np.float32)
    )
    pairs = np.argsort(mesh.topology.face_edges.ravel(), kind="stable").reshape(-1, 2) // 3
    near = pairs[np.abs(mesh.face_normals @ LIGHT)[pairs].max(axis=1) < 0.2]

    def steps(shader, optics):
        found = shader.exitance(Ball(mesh), points, optics, [Sun()])
        return (np.sqrt(((found[:, near[:, 0]] - found[:, near[:, 1]]) ** 2).mean(axis=1)) / found.max(axis=1)).max()

    for mean_free_path in (0.3, 0.05):
        optics = body(mean_free_path)
        for shader in (scalar, plumb):
            assert steps(shader, optics) <= 1.7 * steps(diffuse, optics)
