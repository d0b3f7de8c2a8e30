"""Pixels that need rays."""

import numpy as np
import pytest

from renderer.scene import coverage
from renderer.scene.camera import CameraRays
from renderer.scene.coverage import covered_pixels
from sss_tools.rays import RayCaster, UnitFrame
from sss_tools.shapes import box, icosphere, moved
from tests.renderer.scenes import camera

FRAME = UnitFrame(np.zeros(3), 1.0)
SOLIDS = {
    "a ball of small triangles": icosphere(0.4, 4),
    "a box of large ones": box((0.8, 0.3, 0.5)),
    "a floor that reaches behind the camera": moved(box((40, 0.1, 40)), (0, -1, 0)),
    "a wall behind the camera": moved(box((9, 9, 0.1)), (0, 0, 5)),
    "a box around the camera": box(8),
    "a ball half out of the picture": moved(icosphere(0.4, 4), (0.5, 0, 0)),
}


def seen(rays: CameraRays, mesh, jitters: int) -> np.ndarray:
    """Pixels in which any of some rays meets the mesh."""
    caster = RayCaster(mesh.vertices, mesh.faces)
    width, height = rays.resolution
    found = np.zeros(width * height, bool)
    for k in range(jitters):
        jitter = np.random.default_rng(k).random((2, width * height), np.float32)
        direction = rays.directions(np.arange(width * height), jitter)
        origin = np.repeat(rays.origin[:, None], width * height, axis=1)
        found |= caster.closest(origin, direction)[1] >= 0
    return found


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("resolution", [(64, 48), (31, 80)])
def test_all_that_is_seen_is_covered_and_little_else(name, resolution):
    mesh = SOLIDS[name]
    rays = CameraRays(camera((0.3, 0.4, 2.5), fov=26, resolution=resolution), FRAME)
    covered, met = covered_pixels(rays, mesh.vertices, mesh.faces), seen(rays, mesh, 8)
    assert not (met & ~covered).any()
    # a margin of a pixel and a half around: three pixels of each row and column, and more at pointed corners
    assert (covered & ~met).sum() <= 4 * sum(resolution)


def test_too_many_large_triangles_are_taken_by_their_boxes(monkeypatch):
    monkeypatch.setattr(coverage, "_MOST_LARGE", 0)
    rays = CameraRays(camera((0.3, 0.4, 2.5), fov=26, resolution=(64, 48)), FRAME)
    for mesh in SOLIDS.values():
        covered = covered_pixels(rays, mesh.vertices, mesh.faces)
        assert not (seen(rays, mesh, 2) & ~covered).any()


def test_a_triangle_seen_from_its_side_covers_all():
    rays = CameraRays(camera((0, 0, 2), fov=26, resolution=(8, 8)), FRAME)
    flat = np.array([[0, -1, 0], [0, 1, 0], [0, 0, 5.0]])
    assert covered_pixels(rays, flat, np.array([[0, 1, 2]])).all()
