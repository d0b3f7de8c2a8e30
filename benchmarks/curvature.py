"""Mean curvature per vertex by three implementations, on a ball and a torus with noise.

    PYTHONPATH=. python benchmarks/curvature.py

Noise moves each vertex along the normal by a share of an edge (standard deviation). The table has the root mean square
error over the mean size of the curvature, percent, and CPU seconds. Ours is ``sss_tools.curvature``; libigl fits
quadrics over five rings (principal_curvature; Panozzo et al. 2010); MeshLab takes one ring (Meyer et al. 2003).
trimesh's discrete_mean_curvature_measure needs rtree and a loop over vertices, and is left out.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from sss_tools.curvature import mean_curvature
from sss_tools.mesh import Mesh
from sss_tools.shapes import icosphere, torus

NOISE = (0.0, 0.005, 0.02, 0.05)


def main() -> None:
    """The command."""
    print("| body, noise in edges | " + " | ".join(METHODS) + " | CPU s |\n|---|" + "---:|" * (len(METHODS) + 1))
    for name, (mesh, normals, expected) in bodies().items():
        for share in NOISE:
            noisy = roughened(mesh, normals, share)
            cells, seconds = [], []
            for method in METHODS.values():
                start = time.process_time()
                found = method(noisy)
                seconds.append(f"{time.process_time() - start:.2f}")
                error = np.sqrt(np.mean((found - expected) ** 2)) / np.abs(expected).mean()
                cells.append(f"{100 * error:.1f}")
            print(f"| {name}, {share:g} | " + " | ".join(cells) + " | " + " / ".join(seconds) + " |", flush=True)


def bodies() -> dict[str, tuple[Mesh, NDArray, NDArray]]:
    """Meshes with their true normals and mean curvatures."""
    ball = icosphere(1.0, 5)
    ring = torus(1.0, 0.4, 160, 64)
    from_axis = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
    outward = ring.vertices - ring.vertices * np.array([1, 1, 0]) / from_axis[:, None]
    true = (1 / 0.4 + (from_axis - 1) / 0.4 / from_axis) / 2
    return {"ball": (ball, ball.vertices, np.ones(len(ball.vertices))), "torus": (ring, outward / 0.4, true)}


def roughened(mesh: Mesh, normals: NDArray, share: float) -> Mesh:
    """The mesh with noise."""
    noise = np.random.Generator(np.random.PCG64(3)).standard_normal(len(mesh.vertices))
    return Mesh(mesh.vertices + (share * edge(mesh) * noise)[:, None] * normals, mesh.faces)


def edge(mesh: Mesh) -> float:
    """Mean length of the edges."""
    topology = mesh.topology
    a, b = topology.points[topology.edges].swapaxes(0, 1)
    return float(np.linalg.norm(b - a, axis=1).mean())


def by_libigl(mesh: Mesh) -> NDArray:
    """Quadrics over five rings; libigl's sign is that of the normal."""
    import igl

    first, second = igl.principal_curvature(mesh.vertices, np.ascontiguousarray(mesh.faces, np.int64))[2:4]
    found = (np.ravel(first) + np.ravel(second)) / 2
    return found * np.sign(np.median(found))


def by_meshlab(mesh: Mesh) -> NDArray:
    """MeshLab's discrete mean curvature (Meyer et al. 2003): the cotangent Laplacian over the area of one ring."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    meshes.compute_scalar_by_discrete_curvature_per_vertex(curvaturetype="Mean Curvature")
    return meshes.current_mesh().vertex_scalar_array()


METHODS = {"ours": mean_curvature, "libigl": by_libigl, "MeshLab": by_meshlab}

if __name__ == "__main__":
    main()
