"""The studies of stability: what is swept, and the scene that each value makes. One declaration a study.

Objects are of size 1 and of one medium (``case.MEDIUM``: mean free path 0.05, albedo 0.95 to 0.8), under a parallel
light and a dim even sky, unless it is these that are swept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sss_tools.mesh import Mesh
from sss_tools.shapes import ellipsoid, icosphere, moved, punctured, slab

from .case import CAMERA, MEDIUM, SKY, SUN, Case


@dataclass(frozen=True)
class Study:
    """A sweep.

    name     on the command line and of its files
    title    what is asked
    axis     what is swept, with its unit
    values   from harmless to harmful or the other way round
    scene    the scene of a value
    truth    the scene whose exact picture is right for all values; None: the exact picture of each value's own scene
    log      whether the axis is logarithmic
    blind_to what this study cannot see
    """

    name: str
    title: str
    axis: str
    values: tuple[float, ...]
    scene: Callable[[float], Case]
    truth: Callable[[], Case] | None = None
    log: bool = True
    blind_to: str = ""


def ball(subdivisions: int = 3, radius: float = 0.5) -> Mesh:
    """The round solid that most studies look at."""
    return icosphere(radius, subdivisions)


def _medium(**changed: object) -> Case:
    return Case([ball()], {**MEDIUM, **changed})


# ---- shape ----


def _wall(ratio: float) -> Case:
    return Case([slab(1.0, 0.05 * ratio)], camera={**CAMERA, "position": [0.8, 0.6, 2.9]})


def _aspect(ratio: float) -> Case:
    return Case([ellipsoid((0.5, 0.5 / ratio, 0.5), 4)])


def wedge(angle: float) -> Mesh:
    """A prism whose front edge, along y, has the angle ``angle`` in degrees; 0.9 wide or deep, whichever is more."""
    half = np.radians(angle) / 2
    depth = 0.9 * min(1.0, 0.5 / np.tan(half))
    width = depth * np.tan(half)
    rim = np.array([[0, depth / 2], [-width, -depth / 2], [width, -depth / 2]])
    points = np.array([[x, y, z] for y in (-0.45, 0.45) for x, z in rim])
    faces = [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]]
    mesh = Mesh(points, np.array(faces))
    return mesh if mesh.volume > 0 else Mesh(points, np.array(faces)[:, ::-1])


def _tessellated(faces: float) -> Case:
    return Case([ball(round(np.log(faces / 20) / np.log(4)))])


def _noisy(amplitude: float) -> Case:
    mesh = ball(4)
    edge = float(np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1).mean())
    shift = np.random.Generator(np.random.PCG64(1)).standard_normal(mesh.vertices.shape)
    return Case([Mesh(mesh.vertices + amplitude * edge * shift, mesh.faces)])


def _far_off(offset: float) -> Case:
    """Positions in single precision, as most files have them, so far from the origin along each axis."""
    shifted = (ball().vertices + offset).astype(np.float32).astype(float)
    camera = {key: [place + offset for place in value] if key in ("position", "target") else value
              for key, value in CAMERA.items()}  # fmt: skip
    return Case([Mesh(shifted, ball().faces)], camera=camera)


def _gap(gap: float) -> Case:
    shift = 0.25 + gap / 2
    return Case([moved(ball(3, 0.25), [-shift, 0, 0]), moved(ball(3, 0.25), [shift, 0, 0])])


def _holed(radius: float, angle: float = 75.0) -> Case:
    """A hole as wide as a cap of this radius; ``angle`` in degrees from the view to the hole, seen from the centre."""
    view = np.array(CAMERA["position"]) / np.linalg.norm(CAMERA["position"])
    down = np.array([0.0, -1.0, 0.0])
    across = down - (down @ view) * view
    centre = np.cos(np.radians(angle)) * view + np.sin(np.radians(angle)) * across / np.linalg.norm(across)
    return Case([punctured(ball(4), 0.5 * centre, radius)])


def _closed() -> Case:
    return Case([ball(4)])


# ---- light and view ----


def _viewed_from(distance: float) -> Case:
    towards = np.array([0.0, 0.5, 3.0]) / np.linalg.norm([0.0, 0.5, 3.0])
    camera = {**CAMERA, "position": [float(x) for x in distance * towards], "resolution": [48, 48]}
    return Case([ball()], camera=camera)


def _lit_from(distance: float) -> Case:
    """A point light ``distance`` radii from the centre, as bright as makes the irradiance at the nearest point alike;
    within the ball as bright as on its surface."""
    towards = np.array([0.6, 0.7, 0.5]) / np.linalg.norm([0.6, 0.7, 0.5])
    gap = 0.5 * (distance - 1)
    intensity = 2 * max(gap, 0.05) ** 2 if distance > 1 else 0.05
    light = {"type": "point", "position": [float(x) for x in 0.5 * distance * towards], "intensity": float(intensity)}
    return Case([ball()], lights=[light, {**SKY, "radiance": 0.05}])


def _lit_across(angle: float) -> Case:
    """Parallel light, ``angle`` degrees from behind the camera: 0 full, 180 from behind the object."""
    turn = np.radians(angle)
    direction = [float(-np.sin(turn)), 0.0, float(-np.cos(turn))]
    camera = {**CAMERA, "position": [0.0, 0.0, 3.0]}
    return Case([ball()], lights=[{**SUN, "direction": direction}, {**SKY, "radiance": 0.02}], camera=camera)


def _seeded(seed: float) -> Case:
    return Case([ball()], seed=int(seed))


_ALL = (
    Study("wall", "How thin may a wall be?", "wall thickness / mean free path",
          (0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0), _wall),
    Study("aspect", "How flat may an object be?", "diameter / thickness",
          (1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 32.0), _aspect),
    Study("corner", "How sharp may an edge be?", "angle of the edge towards the camera, degrees",
          (10.0, 20.0, 40.0, 60.0, 90.0, 120.0, 150.0), lambda angle: Case([wedge(angle)]), log=False),
    Study("tessellation", "How coarse may a mesh be?", "faces of the ball",
          tuple(20.0 * 4**k for k in range(6)), _tessellated, truth=lambda: Case([ball(6)]),
          blind_to="the silhouette: pixels that both balls fill are judged"),
    Study("noise", "How rough may a scan be?", "vertex noise / edge length", (0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8),
          _noisy, truth=_closed),
    Study("offset", "How far from the origin may a mesh lie?", "distance from the origin / size, single precision",
          (1.0, 1e2, 1e3, 1e4, 1e5, 1e6), _far_off, truth=lambda: Case([ball()])),
    Study("hole-size", "How large may a hole be, near the lower rim that the camera sees?",
          "radius of the hole / radius of the ball", (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2),
          lambda share: _holed(share / 2), truth=_closed),
    Study("hole-position", "Where may a hole be, a third of the ball wide?",
          "angle between the view and the hole, degrees", (0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0),
          lambda angle: _holed(0.15, angle), truth=_closed, log=False),
    Study("gap", "How near may two objects be?", "gap / diameter", (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5), _gap,
          blind_to="errors of the path shader that it makes at this gap always: only its rare events show them"),
    Study("albedo", "How little may be absorbed?", "1 - single scattering albedo",
          (0.5, 0.2, 0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5), lambda loss: _medium(albedo=1 - loss)),
    Study("mean-free-path", "How dense, how thin may a medium be?", "mean free path / size of the object",
          (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 10.0), lambda length: _medium(sigma_t=1 / length)),
    Study("g", "How far from even may scattering be?", "mean cosine g",
          (-0.9, -0.5, 0.0, 0.5, 0.8, 0.9, 0.97), lambda g: _medium(g=g), log=False),
    Study("ior", "How strongly may the surface refract?", "index of refraction",
          (1.0, 1.1, 1.3, 1.5, 1.8, 2.4, 3.0), lambda ior: _medium(ior=ior), log=False),
    Study("view-distance", "How near, how far may the camera be?", "distance of the camera / size of the object",
          (0.6, 1.0, 2.0, 4.0, 8.0, 16.0), _viewed_from),
    Study("light-distance", "How near may a light be, and may it be inside?", "distance of the light / radius",
          (0.2, 0.6, 0.9, 1.05, 1.2, 1.5, 2.0, 4.0, 16.0), _lit_from,
          blind_to="what the path shader leaves out of lights inside behind a smooth boundary, see architecture.md"),
    Study("terminator", "How far round may the light go?", "angle between the light and the view, degrees",
          (0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0), _lit_across, log=False),
    Study("seeds", "Does a seed matter?", "seed", tuple(float(seed) for seed in range(1, 9)), _seeded,
          truth=lambda: Case([ball()]), log=False),
)  # fmt: skip

STUDIES: dict[str, Study] = {study.name: study for study in _ALL}
"""By name."""
