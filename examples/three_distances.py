"""Which shader draws an object near, farther off and far away, and why?

    python examples/three_distances.py [FOLDER]

The same as ``sss-render examples/three_distances.toml --quality 0.05``, with the reasons under the picture. The
meshes go into out/, where the scene file looks for them.
"""

from pathlib import Path

from _common import output_folder, save_strip
from make_meshes import make

from renderer.render import Renderer, Settings
from renderer.scene.scene_file import load_scene

HERE = Path(__file__).resolve().parent
PASSES = 24


def main() -> None:
    """Make the picture."""
    meshes = HERE.parent / "out"
    meshes.mkdir(exist_ok=True)
    make(meshes, ["elephant", "ground"])
    scene = load_scene(HERE / "three_distances.toml")
    renderer = Renderer(scene, Settings(quality=0.05), PASSES)
    renderer.run(range(PASSES))
    caption = "shader auto, quality 0.05"
    for plan in renderer.plans[:3]:
        reason = plan.reason.split(";")[0]
        caption += f"\n{plan.name}, {plan.distance:.1f} m away, {plan.size_px:.0f} pixels: {plan.shader} - {reason}"
    print(caption)
    save_strip([(renderer.film.mean(), caption)], output_folder() / "three_distances.png")


if __name__ == "__main__":
    main()
