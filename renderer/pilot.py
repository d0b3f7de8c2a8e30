"""Pilots: small pictures that measure how wrong each shader is, where predictions are not to be trusted.

Of an object's ``SIDE`` x ``SIDE`` pixels (fewer where it is smaller in the picture) path makes two halves M1, M2 and
each candidate two of its own, S1, S2. All four are independent, so that the mean over pixels and channels of

    (M1 - S1) (M2 - S2)

is the squared bias of the candidate without bias, the noise of either having no part in it. What it cannot tell from
noise, its own standard error, is taken for bias: a pilot never says better than it knows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from .output.film import Film
from .render import Renderer, Settings
from .scene.description import Camera, Scene, SceneObject, ShaderChoice, Translucent
from .shaders.appearance import appearance
from .shaders.prediction import SURE, Error
from .shaders.selection import CHEAPEST_FIRST, Measured

SIDE, LEAST_SIDE = 64, 8
PASSES, FAST_PASSES = 32, 4
"""Of each half, at ``SIDE``: smaller pilots have as many samples."""
MOST_PASSES = 512
FRAME = 1.15
"""Height of the pilot over the diameter of the object's bounding ball."""
_FEW_PIXELS = 8
_SEED = 0x5EED


def measure(scene: Scene, settings: Settings, progress: Callable[[float], None] | None = None) -> dict[str, Measured]:
    """Errors and noise, by name, of the translucent objects whose shader is not asked for.

    scene     checked (see ``admission``); its other objects take part as diffuse ones
    progress  is told each object's share of the work when it is done
    """
    wanted = [
        index
        for index, thing in enumerate(scene.objects)
        if isinstance(thing.material, Translucent)
        and settings.shader == "auto"
        and thing.shader == "auto"
        and settings.hole_handling != "surface"
        and thing.hole_handling != "surface"
        and thing.closedness is not None
        and thing.closedness.hole_handling != "surface"
    ]
    found = {}
    for index in wanted:
        measured = pilot(scene, index, settings)
        if measured is not None:
            found[scene.objects[index].name] = measured
        if progress is not None:
            progress(1 / len(wanted))
    return found


def pilot(scene: Scene, index: int, settings: Settings, passes: float | None = None) -> Measured | None:
    """What small pictures of the object ``index`` tell, of so many passes of path in each half (None:
    ``PASSES``). None where no pixel shows it."""
    thing = scene.objects[index]
    side = int(np.clip(np.ceil(appearance(scene, thing).size_px * FRAME), LEAST_SIDE, SIDE))
    view = replace(scene, camera=_looking_at(scene.camera, thing, side), hash="")
    more = min((SIDE / side) ** 2, MOST_PASSES / PASSES)
    exact = _halves(view, index, "path", settings, max(int((passes or PASSES) * more), 2))
    where = exact.where
    if where.sum() < 2:
        return None
    mean = max(float((exact.first[where].mean() + exact.second[where].mean()) / 2), 1e-12)
    errors = {}
    for name in CHEAPEST_FIRST[:-1]:
        fast = _halves(view, index, name, settings, int(FAST_PASSES * more))
        products = ((exact.first - fast.first) * (exact.second - fast.second))[where]
        errors[name] = _relative(products, mean)
    noise = exact.noise / mean
    return Measured(errors, Error(noise, noise))


def _relative(products: NDArray[np.float64], mean: float) -> Error:
    """The bias and what it hardly exceeds, of products (pixels, 3) whose mean is its square."""
    squared = float(products.mean())
    # neighbouring channels share their paths, pixels do not
    doubt = float(products.mean(axis=1).std(ddof=1) / len(products) ** 0.5) if len(products) > 1 else abs(squared)
    bias, bound = (max(squared + more * doubt, doubt) ** 0.5 / mean for more in (0, SURE))
    return Error(bias, max(bound, bias), doubt / mean**2)


@dataclass(frozen=True, eq=False)
class _Halves:
    """Two independent pictures of one shader.

    first, second  (h, w, 3) means
    where          (h, w) pixels that show nothing but the object, or if there are few, those whose middle shows it
    noise          standard deviation of a sample there, root mean square
    """

    first: NDArray[np.float64]
    second: NDArray[np.float64]
    where: NDArray[np.bool_]
    noise: float


def _halves(scene: Scene, index: int, shader: str, settings: Settings, passes: int) -> _Halves:
    """The pictures, of so many passes each."""
    # diffuse is no wish of users
    lit = replace(scene.objects[index], shader=cast(ShaderChoice, shader))
    objects = tuple(lit if k == index else _out_of_the_way(thing) for k, thing in enumerate(scene.objects))
    own = replace(settings, seed=settings.seed ^ _SEED ^ CHEAPEST_FIRST.index(shader) << 8, shader="auto")
    renderer = Renderer(replace(scene, objects=objects), own, passes)
    films = []
    for half in range(2):
        renderer.film = Film.blank(renderer.film.resolution, renderer.film.scene_hash, own.seed)
        renderer.run(range(half * passes, (half + 1) * passes))
        films.append(renderer.film)
    where = films[0].object_pixels() & films[1].object_pixels() & (renderer.object_id == index)
    if where.sum() < _FEW_PIXELS:
        where = renderer.object_id == index
    variance = np.mean([film.stderr()[where] ** 2 for film in films], axis=0) * passes
    noise = float(np.sqrt(variance.mean())) if variance.size else 0.0
    return _Halves(films[0].mean(), films[1].mean(), where, noise)


def _out_of_the_way(thing: SceneObject) -> SceneObject:
    return replace(thing, hole_handling="surface", shader="auto") if isinstance(thing.material, Translucent) else thing


def _looking_at(camera: Camera, thing: SceneObject, side: int) -> Camera:
    """From the same place at the object, which fills the picture."""
    centre = thing.mesh.bounds.mean(axis=0)
    distance = float(np.linalg.norm(centre - camera.position))
    sine = min(FRAME * thing.mesh.diagonal / 2 / distance, 0.9)
    fov = float(np.degrees(2 * np.arcsin(sine)))
    return Camera(camera.position, centre, _across(camera, centre), fov, (side, side))


def _across(camera: Camera, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """The camera's up, or another direction where that is the line of sight."""
    line = centre - camera.position
    up = np.asarray(camera.up, float)
    if np.linalg.norm(np.cross(line, up)) > 1e-6 * np.linalg.norm(line) * np.linalg.norm(up):
        return up
    return np.eye(3)[np.argmin(np.abs(line))]
