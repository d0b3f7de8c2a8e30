"""How does a lit body change as one walks round it? Frames of a camera path, here or on a cluster.

    python examples/orbit.py [FOLDER [FRAMES [PASSES [SCHEDULER]]]]

The sun stays where it is: in front the elephant is lit, from behind its ears glow. Each frame is written as soon as it
is done, and one that is there is not rendered again. With the address of a Dask scheduler (tcp://HOST:8786) frames are
tasks: workers build the scene once, and the pictures are the same.
"""

import sys
from collections.abc import Iterator

import numpy as np
from _common import MIDDLE, UP, on_plinth, output_folder, save_strip, sun
from PIL import Image

from renderer.cluster.renderer import ClusterRenderer
from renderer.output.film import Film
from renderer.output.image import film_png
from renderer.render import Renderer, Settings
from renderer.scene.description import Camera, Scene
from sss_tools.elephant import elephant
from sss_tools.files import write_atomically
from sss_tools.medium import Medium
from sss_tools.scheduler import connected

ROSE = Medium.from_albedo([0.99, 0.9, 0.82], 40.0, ior=1.5)
SIZE = 240


def orbit(frames: int) -> list[Camera]:
    """Once round the elephant, a little above it."""
    return [
        Camera(MIDDLE + 3.15 * np.array([np.sin(angle), 0.24, np.cos(angle)]), MIDDLE, UP, 23.0, (SIZE, SIZE))
        for angle in np.linspace(0, 2 * np.pi, frames, endpoint=False)
    ]


def films(scene: Scene, cameras: list[Camera], passes: int, scheduler: str | None) -> Iterator[Film]:
    """The scene from each camera, one after the other."""
    settings = Settings(shader="plumb")
    if scheduler is not None:
        with connected(scheduler) as client:
            yield from ClusterRenderer(client, scene, settings, passes).films(cameras, passes)
        return
    renderer = Renderer(scene, settings, passes)
    for camera in cameras:
        renderer.look_from(camera)
        renderer.run(range(passes))
        yield renderer.film


def main() -> None:
    """Make the frames, a moving picture of them, and a strip of six."""
    frames, passes = (int(text) for text in (sys.argv[2:4] + ["24", "8"][len(sys.argv[2:4]) :]))
    scheduler = sys.argv[4] if len(sys.argv) > 4 else None
    folder = output_folder()
    (folder / "orbit").mkdir(exist_ok=True)
    files = [folder / "orbit" / f"{number:03}.png" for number in range(frames)]
    missing = [number for number, file in enumerate(files) if not file.exists()]
    cameras = orbit(frames)
    scene = on_plinth(elephant(), ROSE, sun(160, 40), SIZE)
    for number, film in zip(missing, films(scene, [cameras[k] for k in missing], passes, scheduler), strict=True):
        write_atomically(files[number], film_png(film))
        print(files[number])
    pictures = [Image.open(file).convert("RGB") for file in files]
    pictures[0].save(folder / "orbit.gif", save_all=True, append_images=pictures[1:], duration=80, loop=0)
    shown = range(0, frames, max(frames // 6, 1))
    linear = [(np.asarray(pictures[k]) / 255.0) ** 2.2 for k in shown]
    save_strip(
        [(one, f"{360 * k // frames}°\nplumb, {passes} passes") for one, k in zip(linear, shown, strict=True)],
        folder / "orbit.png",
    )


if __name__ == "__main__":
    main()
