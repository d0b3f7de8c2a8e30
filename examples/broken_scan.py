"""What does a broken scan look like, to try the tools on?

    python examples/broken_scan.py [FOLDER]

writes ``scan.ply``: an elephant with three holes in its skin, and a ball that somebody left behind in its head.
docs/tutorial.md goes on from here.
"""

from _common import output_folder
from make_meshes import SHELL, elephant_with_holes

from sss_tools.mesh import Mesh
from sss_tools.shapes import with_internal
from sss_tools.writing import write_mesh


def broken_scan() -> Mesh:
    """The elephant with both faults."""
    return with_internal(elephant_with_holes(), *SHELL)


if __name__ == "__main__":
    path = output_folder() / "scan.ply"
    write_mesh(broken_scan(), path)
    print(path)
