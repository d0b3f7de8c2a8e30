"""A live picture: a quick shader while the camera moves, passes of the reference while it rests.

After the preview and idle-time refinement of interactive renderers; nothing here opens a window.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..output.film import Film
from ..output.image import linear_to_srgb
from ..render import Renderer, Settings
from ..scene.camera import view_basis
from ..scene.description import Camera, Scene

FRAME = 0.15
"""Seconds a picture may take while the camera moves: with what it takes to show it, 5 a second."""
LEAST = 48
"""Rows of such a picture, at least."""


class Live:
    """A scene that can be turned.

    camera   where it is seen from now
    preview  "scalar" or "plumb": what draws while the camera moves
    """

    def __init__(self, scene: Scene, size: tuple[int, int], preview: str = "scalar"):
        self.camera = replace(scene.camera, resolution=size)
        scene = replace(scene, camera=self.camera, hash="")
        self._quick = Renderer(scene, Settings(shader=preview))
        self._exact = Renderer(scene, Settings(shader="path"))
        self._rows = LEAST
        self._lock = threading.Lock()
        self._worker: threading.Thread | None = None
        self._stop = threading.Event()
        self._latest: tuple[NDArray[np.uint8], str] | None = None

    def turn(self, across: float, upwards: float) -> None:
        """Move the camera round its target, radians; it never passes over the pole."""
        camera = self.camera
        back = np.asarray(camera.position, float) - camera.target
        pole = np.asarray(camera.up, float) / np.linalg.norm(camera.up)
        distance = float(np.linalg.norm(back))
        height = math.asin(np.clip(back @ pole / distance, -1, 1))
        _, left, _ = view_basis(camera)
        level = np.cross(left, pole)  # level with the target, away from the camera
        level = -level if level @ back > 0 else level
        angle = float(np.clip(height + upwards, -1.5, 1.5))
        flat = -level * math.cos(across) + np.cross(pole, -level) * math.sin(across)
        position = camera.target + distance * (math.cos(angle) * flat + math.sin(angle) * pole)
        self._move(replace(camera, position=position))

    def approach(self, share: float) -> None:
        """Multiply the distance to the target."""
        camera = self.camera
        self._move(replace(camera, position=camera.target + share * (camera.position - camera.target)))

    def moving(self) -> NDArray[np.uint8]:
        """(h, w, 3) sRGB of one sample a pixel by the quick shader, as large as ``FRAME`` allows, enlarged."""
        begun = time.perf_counter()
        width, height = self.camera.resolution
        rows = min(self._rows, height)
        self._quick.look_from(replace(self.camera, resolution=(max(round(rows * width / height), 1), rows)))
        self._quick.run(range(1))
        image = _shown(self._quick.film)
        spent = time.perf_counter() - begun
        # time grows as the square of the rows; half of the way at a time, lest it swings
        wanted = rows * math.sqrt(FRAME / max(spent, 1e-4))
        self._rows = int(np.clip((rows + wanted) / 2, LEAST, height))
        down, across = (np.arange(height) * rows // height), (np.arange(width) * image.shape[1] // width)
        return image[down][:, across]

    def resting(self) -> tuple[NDArray[np.uint8], str] | None:
        """The reference so far and words about it; None until its first pass is through. Begins it where needed."""
        if self._worker is None and self._latest is None:
            self._stop.clear()
            self._worker = threading.Thread(target=self._refine, args=(self.camera,), daemon=True)
            self._worker.start()
        elif self._worker is not None and not self._worker.is_alive():
            self._worker = None
        with self._lock:
            return self._latest

    def close(self) -> None:
        """End what is under way."""
        self._end()
        if self._worker is not None:
            self._worker.join()

    def _move(self, camera: Camera) -> None:
        self._end()
        with self._lock:
            self.camera, self._latest = camera, None

    def _end(self) -> None:
        """Drop what the reference is at, which would take the processors from the pictures of the movement."""
        self._stop.set()
        self._exact.stop()

    def _refine(self, camera: Camera) -> None:
        self._exact.look_from(camera)
        self._exact.run(range(4096), done=lambda index: self._show(camera))

    def _show(self, camera: Camera) -> bool:
        """Put the film where it is seen, after each pass; whether to end."""
        film = self._exact.film
        error = film.mean_relative_stderr()
        words = f"path, {film.passes} pass{'' if film.passes == 1 else 'es'}"
        if math.isfinite(error):
            words += f", standard error {100 * error:.2g} %"
        image = _shown(film)
        with self._lock:
            if camera is self.camera and not self._stop.is_set():
                self._latest = image, words
        return self._stop.is_set()


def _shown(film: Film) -> NDArray[np.uint8]:
    linear = np.nan_to_num(film.mean())
    return np.rint(255 * linear_to_srgb(np.clip(linear, 0, 1))).astype(np.uint8)
