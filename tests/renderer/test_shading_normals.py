"""Interpolated normals neither make light nor lose it.

A body in the middle of an even white sky that absorbs nothing must vanish in it. Interpolated normals send some
reflections through the true surface (Veach 1997, section 5.3); these are mirrored back on its side, and each event of
a boundary splits light into shares that add up to 1 about whichever normal.
"""

import numpy as np
import pytest

from renderer.render import Renderer, Settings
from renderer.shaders import boundary
from sss_tools.shapes import icosphere
from tests.renderer.scenes import WHITE_SKY, bumpy_ball, camera, diffuse, mirror, picture, placed, scene, translucent

VIEW = camera((0, 0, 5), fov=26, resolution=(48, 48))
SOLIDS = {"a ball of 80 faces": icosphere(1, 1), "bumps": bumpy_ball(3, 0.3)}


def shown(solid, material, normals="smooth"):
    """(n,) radiance of all samples that show the solid."""
    found = picture(scene([placed(SOLIDS[solid], material, normals=normals)], [WHITE_SKY], VIEW), 4, seed=3)
    return found.samples[:, 0][found.first_object == 0]


@pytest.mark.parametrize("normals", ["flat", "smooth"])
@pytest.mark.parametrize("solid", SOLIDS)
def test_path_neither_loses_nor_gains_in_a_white_furnace(solid, normals):
    """Every sample: no event weighs a path by anything but 1. Single precision, some hundred events."""
    assert np.abs(shown(solid, translucent(1.0, 8.0), normals) - 1).max() < 1e-5


def test_what_would_be_lost_is_found(monkeypatch):
    """The companion: directions left on the wrong side of the true surface."""
    monkeypatch.setattr(boundary, "_keep_side", lambda turned, normal, reflected: np.empty(0, np.intp))
    assert np.abs(shown("a ball of 80 faces", translucent(1.0, 8.0)) - 1).max() > 0.01


@pytest.mark.parametrize("solid", SOLIDS)
@pytest.mark.parametrize("material", [diffuse(1.0), mirror(1.0)], ids=["diffuse", "mirror"])
def test_opaque_surfaces_gain_nothing(solid, material):
    """Diffuse ones lose what the interpolated cosine sends into the surface: 1 % here."""
    found = shown(solid, material)
    assert found.max() < 1 + 1e-5
    assert found.mean() > 0.99


@pytest.mark.parametrize("solid", SOLIDS)
def test_scalar_gains_nothing_by_interpolated_normals(solid):
    """Its balls answer an even sky with what they take in, whatever the normal: 1e-3 for the tables, and in hollows,
    which it takes for balls, 8 % that it has with flat normals too. No pixel is dark for a
    lost reflection (0.09 it would be): 6 % are missing where a normal leans away from the viewer, whom it should face.
    """
    means, greatest = {}, {}
    for normals in ("flat", "smooth"):
        of = Renderer(scene([placed(SOLIDS[solid], translucent(1.0, 8.0), normals=normals)], [WHITE_SKY], VIEW),
                      Settings(shader="scalar"))  # fmt: skip
        of.run(range(2))
        pixels = of.film.mean()[of.film.object_pixels()][:, 0]
        means[normals], greatest[normals] = pixels.mean(), pixels.max()
        assert pixels.min() > 0.9
    assert abs(means["smooth"] / means["flat"] - 1) < 2e-3
    assert greatest["smooth"] < greatest["flat"] + 1e-3
