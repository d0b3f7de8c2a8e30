"""What the examples share: where pictures go, a little studio, pictures side by side with captions."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from renderer.output.image import linear_to_srgb
from renderer.render import Renderer, Settings
from renderer.scene.description import (
    Camera,
    Diffuse,
    DirectionalLight,
    EnvironmentLight,
    Light,
    RectangleLight,
    Scene,
    SceneObject,
    Translucent,
)
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.shapes import cylinder

AMBER = Medium.from_albedo([0.985, 0.94, 0.78], 45.0, ior=1.5)
"""Honey-coloured, with a mean free path of 1/45: about half the thickness of the elephant's ears."""

MIDDLE = np.array([0.09, 0.445, 0.1])
"""Of the elephant."""
UP = np.array([0.0, 1.0, 0.0])


def output_folder() -> Path:
    """The folder named on the command line, or out/ in the repository; made where it is missing."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "out"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def asked_passes(default: int) -> int:
    """What follows the folder on the command line."""
    return int(sys.argv[2]) if len(sys.argv) > 2 else default


def window(azimuth: float = 115.0, elevation: float = 33.0) -> RectangleLight:
    """A square of light as large as the distance to it: soft shadows, broad highlights.

    azimuth, elevation  degrees; azimuth 0 is the camera's side, 90 the right, 180 behind
    """
    return RectangleLight(
        MIDDLE + 2.2 * _towards(azimuth, elevation), MIDDLE, UP, (1.9, 1.9), np.array([3.2, 2.8, 2.25])
    )


def sun(azimuth: float, elevation: float) -> DirectionalLight:
    """Parallel light: sharp shadows, no highlights on smooth surfaces, and far less noise than a window's."""
    return DirectionalLight(-_towards(azimuth, elevation), np.array([6.6, 5.9, 4.9]))


def _towards(azimuth: float, elevation: float) -> np.ndarray:
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])


def on_plinth(mesh: Mesh, medium: Medium = AMBER, light: Light | None = None, size: int = 280) -> Scene:
    """A mesh about a unit high that stands on y = 0, on a round plinth in a dim room.

    light  None: a window to the right and a little behind
    size   width and height of the picture, pixels
    """
    stand = cylinder(0.8, 0.1, 128)
    plinth = Mesh(stand.vertices[:, [1, 2, 0]] - [0, 0.0505, 0], stand.faces)
    things = (
        SceneObject("mesh", mesh, Translucent(medium), normals="smooth"),
        SceneObject("plinth", plinth, Diffuse(np.array([0.3, 0.28, 0.27]))),
    )
    room = EnvironmentLight(radiance=np.array([0.13, 0.15, 0.19]))
    return Scene("m", camera(MIDDLE, (size, size)), (light or window(), room), things)


def camera(target, size: tuple[int, int], distance: float = 3.15, fov: float = 23.0) -> Camera:
    """It looks at ``target`` from in front, a little above and to the right."""
    back = np.array([0.3, 0.22, 0.93])
    return Camera(target + distance * back / np.linalg.norm(back), np.asarray(target, float), UP, fov, size)


def rendered(scene: Scene, shader: str, passes: int, hole_handling: str = "auto", first: int = 0) -> Renderer:
    """The scene after ``passes`` passes from number ``first``; the seconds are in its ``stages``."""
    renderer = Renderer(scene, Settings(shader=shader, hole_handling=hole_handling), passes)
    renderer.run(range(first, first + passes))
    return renderer


def save_strip(panels: list[tuple[np.ndarray, str]], path: Path) -> None:
    """Pictures (h, w, 3) of linear radiance side by side, each with a caption underneath: a title, then details."""
    height, width = panels[0][0].shape[:2]
    lines = max(caption.count("\n") for _, caption in panels)
    title, text = ImageFont.load_default(18), ImageFont.load_default(13)
    gap, foot = 6, 34 + 18 * lines
    strip = Image.new("RGB", (len(panels) * (width + gap) - gap, height + foot), "white")
    draw = ImageDraw.Draw(strip)
    for k, (linear, caption) in enumerate(panels):
        x = k * (width + gap)
        srgb = np.rint(255 * linear_to_srgb(np.clip(linear, 0, 1))).astype(np.uint8)
        strip.paste(Image.fromarray(srgb), (x, 0))
        first, *rest = caption.split("\n")
        draw.text((x + 4, height + 6), first, "black", title)
        for row, line in enumerate(rest):
            draw.text((x + 4, height + 30 + 18 * row), line, "#444444", text)
    strip.save(path)
    print(path)
