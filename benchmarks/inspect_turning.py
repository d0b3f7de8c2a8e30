"""How many pictures a second does the window of sss-inspect show while it turns? Needs a display (Xvfb will do).

    python benchmarks/inspect_turning.py [SUBDIVISIONS]

prints, for a ball of 20 x 4^SUBDIVISIONS faces (default 8: 1.3 million), seconds a picture while it turns and at rest.
"""

import sys
import time

from renderer.inspection.exhibit import put_together
from renderer.inspection.specimen import Inspection, Specimen
from renderer.inspection.window import Window
from sss_tools import shapes
from sss_tools.validation.outcome import MeshReport

PICTURES = 9


def main(subdivisions: int = 8) -> None:
    """Print the table."""
    mesh = shapes.icosphere(1.0, subdivisions)
    window = Window(put_together(Inspection("ball", (Specimen("ball", mesh, MeshReport("ball")),))))
    window.plotter.show(auto_close=False, interactive=False)
    print(f"{len(mesh.faces)} faces, {window.plotter.render_window.GetClassName()}")
    for words, fine in (("turning", False), ("at rest", True)):
        window.show_fine(fine)
        window.plotter.render()
        seconds = []
        for _ in range(PICTURES):
            window.plotter.camera.azimuth += 5
            begun = time.perf_counter()
            window.plotter.render()
            seconds.append(time.perf_counter() - begun)
        seconds.sort()
        print(f"{words}: {seconds[PICTURES // 2]:.3f} s a picture ({seconds[0]:.3f} - {seconds[-1]:.3f})")
    window.close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
