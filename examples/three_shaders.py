"""How do the three shaders compare, in looks, time and error?

    python examples/three_shaders.py [FOLDER [PASSES]]

One mesh, one light, three shaders. The error of a fast shader is its root mean square difference from path over
the pixels of the object, as a share of their mean; path's own noise is kept out of it by comparing with two halves
of path's samples, whose noises have nothing in common. Path's figure is that noise, its standard error.
"""

import time

import numpy as np
from _common import asked_passes, on_plinth, output_folder, save_strip

from renderer.output.film import Film
from renderer.render import Renderer, Settings
from sss_tools.elephant import elephant


def main() -> None:
    """Make the picture."""
    folder = output_folder()
    passes = asked_passes(40)
    scene = on_plinth(elephant())
    films: dict[str, Film] = {}
    captions: dict[str, str] = {}
    for shader in ("path", "plumb", "scalar"):
        renderer = Renderer(scene, Settings(shader=shader))
        # the fast shaders have no noise of their own, only what the plinth's light brings
        count = passes if shader == "path" else max(passes // 2, 16)
        start = time.perf_counter()
        if shader == "path":
            halves = [half(renderer, range(count // 2)), half(renderer, range(count // 2, count))]
            films[shader] = Film.blank(halves[0].resolution, halves[0].scene_hash, halves[0].seed)
            for film in halves:
                films[shader].merge(film)
        else:
            films[shader] = half(renderer, range(count))
        seconds = time.perf_counter() - start
        captions[shader] = f"{shader}\n{count} passes, {seconds / count:.2g} s each\n"
    pixels = films["path"].object_pixels()
    mean = films["path"].mean()[pixels].mean()
    noise = np.sqrt(np.mean(films["path"].stderr()[pixels] ** 2)) / mean
    captions["path"] += f"the reference; noise {100 * noise:.0f} %"
    for shader in ("plumb", "scalar"):
        one, two = (film.mean() - films[shader].mean() for film in halves)
        error = np.sqrt(max(np.mean((one * two)[pixels]), 0)) / mean
        captions[shader] += f"{100 * error:.0f} % from path"
    save_strip([(films[shader].mean(), captions[shader]) for shader in films], folder / "three_shaders.png")


def half(renderer: Renderer, passes: range) -> Film:
    """A film of its own with these passes."""
    renderer.film = Film.blank(renderer.film.resolution, renderer.film.scene_hash, renderer.film.seed)
    renderer.run(passes)
    return renderer.film


if __name__ == "__main__":
    main()
