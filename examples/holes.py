"""What happens to the light where surface is missing?

    python examples/holes.py [FOLDER]

The same elephant whole, and with three holes. Handled by "cap", which is what "auto" does, each hole is closed for the
tracer alone, and next to nothing is left to see. Handled by "terminate", paths that leave through a hole, or see inside
through one, take the material's colour: the solid stays a solid, and the holes show as patches. Handled by "surface",
nothing is inside: the diffuse fallback lights the skin alone, and thin parts no longer glow.
"""

from _common import on_plinth, output_folder, rendered, save_strip, sun
from make_meshes import elephant, elephant_with_holes

PASSES = 24


def main() -> None:
    """Make the picture."""
    panels = []
    for title, mesh, handling in (
        ("closed", elephant(), "strict"),
        ("three holes, cap", elephant_with_holes(), "cap"),
        ("three holes, terminate", elephant_with_holes(), "terminate"),
        ("three holes, surface", elephant_with_holes(), "surface"),
    ):
        shader = "auto" if handling == "surface" else "path"
        renderer = rendered(on_plinth(mesh, light=sun(120, 35)), shader, PASSES, handling)
        plan, tally = renderer.plans[0], renderer.tally
        share = 100 * tally.terminated / tally.samples
        panels.append(
            (renderer.film.mean(), f"{title}\nshader {plan.shader}\n{share:.2g} % of the paths ended at a hole")
        )
    save_strip(panels, output_folder() / "holes.png")


if __name__ == "__main__":
    main()
