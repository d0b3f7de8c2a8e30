"""What does a shell left inside a solid do to the light?

    python examples/internal_geometry.py [FOLDER]

A ball in the elephant's head faces outwards as if it stood alone. The check finds it (SSS301). Rendered as if it were
sound ("strict"), paths enter twice, which no closed solid allows, and are lost: a ghost in the glow. Handled by
"terminate", surfaces within the solid are counted and passed through, and the elephant looks as it should.
"""

from _common import on_plinth, output_folder, rendered, save_strip, sun
from make_meshes import elephant, elephant_with_shell

from sss_tools.medium import Medium

CLEAR = Medium.from_albedo([0.97, 0.9, 0.7], 9.0, ior=1.5)
"""Three flights deep instead of fifteen: one can see what is inside."""
PASSES = 24


def main() -> None:
    """Make the picture."""
    panels = []
    for title, mesh, handling in (
        ("solid", elephant(), "strict"),
        ("shell inside, taken for sound", elephant_with_shell(), "strict"),
        ("shell inside, as the check advises", elephant_with_shell(), "auto"),
    ):
        renderer = rendered(on_plinth(mesh, CLEAR, sun(135, 35)), "path", PASSES, handling)
        share = 100 * renderer.tally.leaked / renderer.tally.samples
        handled = renderer.plans[0].hole_handling
        panels.append((renderer.film.mean(), f"{title}\nhole handling {handled}\n{share:.2g} % of the paths lost"))
    save_strip(panels, output_folder() / "internal_geometry.png")


if __name__ == "__main__":
    main()
