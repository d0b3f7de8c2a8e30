"""Which meshes do the other examples use, and what is wrong with them?

    python examples/make_meshes.py [FOLDER]

writes five PLY files, made from nothing; ``sss-check FOLDER`` tells what is wrong.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from _common import output_folder

from sss_tools.elephant import elephant
from sss_tools.mesh import Mesh
from sss_tools.shapes import box, moved, punctured, with_internal
from sss_tools.writing import write_mesh

HOLES = [[0.239, 0.847, 0.427], [-0.087, 0.421, 0.267], [-0.116, 0.785, 0.350]]
"""Centres on the elephant where the camera sees them: forehead, shoulder and ear."""
HOLE_RADIUS = 0.035
SHELL = ([0.19, 0.80, 0.24], 0.12)
"""Centre and radius of a ball in the head, well inside."""


def elephant_with_holes() -> Mesh:
    """The elephant with three holes in its skin."""
    return punctured(elephant(), HOLES, HOLE_RADIUS)


def elephant_with_shell() -> Mesh:
    """The elephant with a ball inside that faces outwards, as modellers leave them behind."""
    return with_internal(elephant(), *SHELL)


def sheet(cells: int = 64) -> Mesh:
    """A waving sheet without thickness: it has no inside."""
    u, v = (index.ravel() / cells for index in np.indices((cells + 1, cells + 1)))
    points = np.stack([u - 0.5, 0.06 * np.sin(9 * u) * np.cos(7 * v), 0.5 - v], axis=1)
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return Mesh(points, np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]))


def ground() -> Mesh:
    """A wide flat box to stand on."""
    return moved(box((120, 0.1, 120)), (0, -0.0505, 0))


MESHES = {
    "elephant": elephant,
    "elephant_with_holes": elephant_with_holes,
    "elephant_with_shell": elephant_with_shell,
    "sheet": sheet,
    "ground": ground,
}


def make(folder: Path, names: Iterable[str] = MESHES) -> None:
    """Write the meshes ``names`` into ``folder``."""
    for name in names:
        mesh = MESHES[name]()
        write_mesh(mesh, folder / f"{name}.ply")
        print(f"{folder / name}.ply: {len(mesh.faces)} faces")


if __name__ == "__main__":
    make(output_folder())
