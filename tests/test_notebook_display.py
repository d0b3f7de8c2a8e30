"""Meshes, scenes, films and reports show themselves in notebooks, without OpenGL."""

import io
import subprocess
import sys

import numpy as np
from PIL import Image

from renderer.output.film import Film
from renderer.scene.staging import stage_mesh
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.thumbnail import BACKGROUND
from sss_tools.validation.run import check_mesh


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png))).astype(int)


def test_a_mesh_shows_its_silhouette():
    image = pixels(shapes.icosphere(1.0, 3)._repr_png_())
    covered = (np.abs(image - BACKGROUND).max(axis=2) > 8).mean()
    # a ball across 1/1.02 of the height of 360 x 300 pixels
    assert abs(covered - np.pi / 4 * (300 / 1.02) ** 2 / (360 * 300)) < 0.02


def test_a_mesh_without_faces_shows_nothing():
    assert Mesh(np.eye(3), np.empty((0, 3)))._repr_png_() is None


def test_the_backs_of_faces_are_another_colour():
    ball = shapes.icosphere(1.0, 3)
    front, back = (pixels(mesh._repr_png_())[150, 180] for mesh in (ball, shapes.inverted(ball)))
    assert front[0] > front[2] and back[2] > back[1]


def test_a_scene_shows_what_its_camera_sees():
    image = pixels(stage_mesh(shapes.box(1.0), size=(200, 100))._repr_png_())
    assert image.shape == (200, 400, 3)
    assert np.abs(image[100, 200] - BACKGROUND).max() > 20 and np.abs(image[2, 2] - BACKGROUND).max() == 0


def test_a_scene_lists_its_objects():
    assert "translucent" in stage_mesh(shapes.box(1.0))._repr_html_()


def test_a_film_shows_its_mean_and_nothing_before_the_first_pass():
    film = Film.blank((6, 4))
    assert film._repr_png_() is None
    film.add_pass(0, np.ones((4, 6, 3), np.float32), np.ones((4, 6), bool))
    assert (pixels(film._repr_png_()) == 255).all()


def test_a_report_lists_its_findings_and_escapes_names():
    report = check_mesh(shapes.punctured(shapes.icosphere(1.0, 3), [[0, 0, 1]], 0.3), path="<b>.ply")
    text = report._repr_html_()
    assert "SSS101 open-boundary" in text and "Fresnel" in text and "<b>.ply" not in text


def test_showing_a_mesh_needs_neither_pyvista_nor_vtk():
    code = (
        "import sys; from sss_tools import shapes; assert shapes.box(1.0)._repr_png_();"
        "sys.exit(bool({'pyvista', 'vtkmodules', 'vtk'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
