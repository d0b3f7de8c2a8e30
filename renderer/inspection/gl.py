"""Is there an OpenGL that VTK can draw with? Asked in a process of its own: without one, VTK ends the process."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
"""Environment variable that tells VTK which kind of window to make."""
PATIENCE = 60.0
"""Seconds the question may take: a library may hang, too."""

MISSING = (
    "no OpenGL library that works was found: install libegl1 and libgl1-mesa-dri (Debian), mesa-libEGL and "
    "mesa-dri-drivers (Fedora) or mesalib (conda-forge)"
)
OFF_SCREEN = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
"""VTK's windows that no screen shows."""

_QUESTION = """
import sys
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkCommonCore import vtkLogger, vtkObject, vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
vtkObject.GlobalWarningDisplayOff()
vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
window = vtkRenderWindow()
window.SetShowWindow(False)
window.SetOffScreenRendering(1)
window.SetSize(16, 16)
renderer = vtkRenderer()
renderer.SetBackground(0.2, 0.4, 0.6)
window.AddRenderer(renderer)
window.Render()
pixels = vtkUnsignedCharArray()
window.GetPixelData(4, 4, 4, 4, 0, pixels, 0)
if [pixels.GetValue(k) for k in range(3)] != [51, 102, 153]:
    sys.exit("it draws wrong colours")
print("drawn by", window.GetClassName())
"""


@dataclass(frozen=True)
class Drawable:
    """What a preflight found.

    window   the class of VTK's window that works here; None where none does
    problem  why not, in one line; "" where one does
    """

    window: str | None
    problem: str = ""

    @property
    def on_screen(self) -> bool:
        """Whether there is a screen to open windows on."""
        return self.window is not None and self.window not in OFF_SCREEN


def preflight(question: str = _QUESTION) -> Drawable:
    """Draw one picture in another process and see whether it comes back.

    What works is remembered in the environment, so that VTK here does not try what does not.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-c", question], capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return Drawable(None, f"OpenGL did not answer within {PATIENCE:g} s; {MISSING}")
    if "ModuleNotFoundError" in done.stderr:
        return Drawable(None, "pyvista is not installed: pip install 'sss-tools[inspect]'")
    answer = [line for line in done.stdout.splitlines() if line.startswith("drawn by ")]
    if done.returncode < 0 or (done.returncode == 0 and not answer):
        return Drawable(None, MISSING)  # a signal: VTK found nothing to draw with, and used it
    if done.returncode > 0:
        return Drawable(None, f"OpenGL is there, but useless ({done.stderr.strip().splitlines()[-1]}); {MISSING}")
    window = answer[-1].removeprefix("drawn by ")
    os.environ.setdefault(WINDOW, window)
    return Drawable(window)
