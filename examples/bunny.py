"""Is the Stanford bunny closed, and how does it look in amber?

    python examples/bunny.py [FOLDER [PASSES]]

Downloads the bunny once (2.4 MB; Stanford 3D Scanning Repository, for research, with acknowledgement), checks it,
and renders it. It needs pooch: pip install "sss-tools[examples]". The scan has five holes, in its base and its chest.
"""

import sys
from pathlib import Path

import numpy as np
from _common import asked_passes, on_plinth, output_folder, rendered, save_strip

from cli.sss_check import main as sss_check
from sss_tools.loading import load_mesh
from sss_tools.mesh import Mesh

COMMIT = "8a4f8642acaf43f9cd7b67858a1502e1055ef202"
URL = f"https://raw.githubusercontent.com/alecjacobson/common-3d-test-models/{COMMIT}/data/stanford-bunny.obj"
SHA256 = "1eb35d1e21ce99e5ce911353b6be278990713448dd9e8f5c9387f9de39b32205"


def main() -> int:
    """Make the picture; 2 where the bunny cannot be had."""
    folder, passes = output_folder(), asked_passes(32)
    try:
        path = download(folder)
    except ImportError:
        print('bunny.py: error: pooch is missing; pip install "sss-tools[examples]"', file=sys.stderr)
        return 2
    except (OSError, ValueError) as error:  # no network; another file than the one we know
        reason = type(error).__name__ if isinstance(error, OSError) else "the file has another hash"
        print(f"bunny.py: error: {URL} cannot be had ({reason}); try again when online", file=sys.stderr)
        return 2
    sss_check([str(path)])
    renderer = rendered(on_plinth(standing(load_mesh(path)), size=360), "path", passes)
    plan = renderer.plans[0]
    caption = f"Stanford bunny: {plan.state}\nhole handling {plan.hole_handling}; path, {passes} passes"
    save_strip([(renderer.film.mean(), caption)], folder / "bunny.png")
    return 0


def download(folder: Path) -> Path:
    """The bunny's file, from the folder where it is there already."""
    import pooch

    pooch.get_logger().setLevel("WARNING")
    return Path(pooch.retrieve(URL, f"sha256:{SHA256}", "stanford-bunny.obj", folder))


def standing(mesh: Mesh) -> Mesh:
    """The mesh with a height of 0.95, on y = 0, in the middle of the plinth."""
    lower, upper = mesh.bounds
    foot = np.array([(lower[0] + upper[0]) / 2, lower[1], (lower[2] + upper[2]) / 2])
    return Mesh((mesh.vertices - foot) * (0.95 / (upper[1] - lower[1])), mesh.faces)


if __name__ == "__main__":
    sys.exit(main())
