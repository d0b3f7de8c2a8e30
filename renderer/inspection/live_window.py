"""The window of ``sss-inspect --live``: drag turns, the wheel comes nearer, q ends."""

from __future__ import annotations

import time
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .live import Live

TICK = 0.02
"""Seconds between looks at what there is to do."""
REST = 0.25
"""Seconds without movement after which the reference begins."""


class LiveWindow:
    """Shows a ``Live``. ``told`` is what the title says, ``frames`` how long the latest pictures took, seconds."""

    def __init__(self, live: Live, title: str):
        import vtkmodules.vtkInteractionStyle
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
        from vtkmodules.vtkRenderingCore import vtkImageActor, vtkRenderer, vtkRenderWindow, vtkRenderWindowInteractor

        self.live, self.told = live, ""
        self.frames: list[float] = []
        self._title, self._moved, self._dirty = title, time.monotonic(), True
        self._held: tuple[int, int] | None = None
        self.window = vtkRenderWindow()
        self.window.SetMultiSamples(0)
        self.window.SetSize(*live.camera.resolution)
        self._actor = vtkImageActor()
        self._actor.InterpolateOff()
        self._renderer = vtkRenderer()
        self._renderer.AddActor(self._actor)
        self.window.AddRenderer(self._renderer)
        self._interactor: Any = cast(Any, vtkRenderWindowInteractor())
        self._interactor.SetRenderWindow(self.window)
        self._interactor.SetInteractorStyle(None)
        self.show(live.moving())
        for event, act in (
            ("LeftButtonPressEvent", self._press), ("LeftButtonReleaseEvent", self._release),
            ("MouseMoveEvent", self._drag), ("MouseWheelForwardEvent", lambda *_: self._approach(0.9)),
            ("MouseWheelBackwardEvent", lambda *_: self._approach(1 / 0.9)), ("KeyPressEvent", self._key),
        ):  # fmt: skip
            self._interactor.AddObserver(event, act)

    def run(self) -> None:
        """Show it until it is closed."""
        self._interactor.Initialize()
        self._tell("ready")
        # VTK's own loop holds Python's lock while it waits, and the passes of the reference with it
        while not self._interactor.GetDone():
            self._interactor.ProcessEvents()
            self._tick()
            time.sleep(TICK)
        self.live.close()

    def _press(self, *_: Any) -> None:
        self._held = self._interactor.GetEventPosition()

    def _release(self, *_: Any) -> None:
        self._held = None

    def _drag(self, *_: Any) -> None:
        if self._held is None:
            return
        x, y = self._interactor.GetEventPosition()
        self.live.turn(-0.008 * (x - self._held[0]), -0.008 * (y - self._held[1]))
        self._held, self._dirty, self._moved = (x, y), True, time.monotonic()

    def _approach(self, share: float) -> None:
        self.live.approach(share)
        self._dirty, self._moved = True, time.monotonic()

    def _key(self, *_: Any) -> None:
        if self._interactor.GetKeySym() in ("q", "Escape"):
            self._interactor.TerminateApp()

    def _tick(self) -> None:
        if self._dirty:
            self._dirty = False
            begun = time.perf_counter()
            self.show(self.live.moving())
            self.frames = [*self.frames[-29:], time.perf_counter() - begun]
            self._tell(f"moving, {1 / self.frames[-1]:.1f} pictures/s")
        elif time.monotonic() - self._moved > REST:
            best = self.live.resting()
            if best is not None and best[1] != self.told:
                self.show(best[0])
                self._tell(best[1])

    def _tell(self, words: str) -> None:
        self.told = words
        self.window.SetWindowName(f"{self._title}: {words}")

    def show(self, image: NDArray[np.uint8]) -> None:
        """Put (h, w, 3) sRGB into the window."""
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkImageData

        height, width = image.shape[:2]
        data = vtkImageData()
        data.SetDimensions(width, height, 1)
        pixels = np.ascontiguousarray(image[::-1]).reshape(-1, 3)  # VTK's rows begin at the bottom
        data.GetPointData().SetScalars(numpy_to_vtk(pixels, deep=True))
        self._actor.SetInputData(data)
        camera = self._renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetParallelScale(height / 2)
        camera.SetFocalPoint((width - 1) / 2, (height - 1) / 2, 0)
        camera.SetPosition((width - 1) / 2, (height - 1) / 2, 10)
        self.window.Render()
