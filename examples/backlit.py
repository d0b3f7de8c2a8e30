"""What does light from behind do in thin parts and in thick ones?

    python examples/backlit.py [FOLDER [PASSES]]

The sun stands behind the elephant. Ears, tusks and trunk are a few free flights thick: light comes through, and they
glow. The body is ten times as thick: what comes through has lost all but its red.
"""

from _common import asked_passes, on_plinth, output_folder, rendered, save_strip, sun

from sss_tools.elephant import elephant
from sss_tools.medium import Medium

ROSE = Medium.from_albedo([0.99, 0.9, 0.82], 40.0, ior=1.5)


def main() -> None:
    """Make the picture."""
    passes = asked_passes(40)
    renderer = rendered(on_plinth(elephant(), ROSE, sun(176, 48), size=400), "path", passes)
    save_strip([(renderer.film.mean(), f"sun from behind\npath, {passes} passes")], output_folder() / "backlit.png")


if __name__ == "__main__":
    main()
