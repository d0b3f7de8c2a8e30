"""What makes walks in media shorter or cheaper, and leaves the expected picture alone.

Chosen from the scene alone: samples must not depend on how many passes are asked for, or parts that are rendered apart
would not add up bit for bit. How much each measure brings is measured by ``benchmarks/walks.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..optics.ball_jump import BallJumps, ball_jumps
from ..optics.guided_flight import Guide
from .distance_grid import DistanceGrid, Walks, choose_resolution
from .traced_scene import TracedObject, TracedScene

_TYPICAL_PASSES, _TYPICAL_SHARE = 16, 0.3
"""How often a picture is sampled, and the share of it that shows an object, where set-up must be weighed against
time saved."""
JUMP_ALBEDO, JUMP_INRADIUS = 0.97, 10.0
"""Least albedo and mean inradius (mean free paths) of bodies in which ball jumps pay."""
LEAST_GUIDE_ALBEDO = 0.2
"""Below, the guide's nu0 = 1 + 2 exp(-2 / albedo) is 1 in float32: 4e-9 above it at 0.1."""
GUIDE_ALBEDO, STRONG_GUIDE_ALBEDO, STRONG_GUIDE_SIZE = 0.995, 0.98, 16.0
"""Guided flights save most at low albedo, and nothing at 0.998. Three of four flights are guided, and not two,
where no light that goes deep (bodies of many mean free paths) comes back (albedo), and where no lamp makes some of what
comes out brighter than the rest."""
LEAST_LEAD_ALBEDO, LEAD_ALBEDO = 0.9, 0.999
"""Of bodies as large as that, in which flights from the dark side are led towards the only light."""


@dataclass(frozen=True)
class Acceleration:
    """Of the media of a scene, by slot.

    grid    distances to the surface, None where looking them up does not pay
    jumps   ball jumps, for media with many collisions
    guides  flights guided out of the medium, or to the only light
    """

    grid: DistanceGrid | None
    jumps: tuple[BallJumps | None, ...]
    guides: tuple[Guide | None, ...]

    @classmethod
    def none(cls, media: int) -> Acceleration:
        """Plain walks."""
        return cls(None, (None,) * media, (None,) * media)

    @classmethod
    def chosen(cls, scene: TracedScene, pixels: int) -> Acceleration:
        """What pays in this scene, for pictures of so many pixels."""
        dense = [_jumps_pay(scene, slot) for slot in range(scene.media.count)]
        grid = _grid(scene, [thing for thing, jumps in zip(scene.translucent, dense, strict=True) if jumps], pixels)
        jumps = [
            ball_jumps(thing.medium.sigma_t, thing.medium.single_scattering_albedo)
            if grid is not None and jumps and thing.medium is not None
            else None
            for thing, jumps in zip(scene.translucent, dense, strict=True)
        ]
        return cls(grid, tuple(jumps), tuple(_guide(scene, slot) for slot in range(scene.media.count)))


def _jumps_pay(scene: TracedScene, slot: int) -> bool:
    """Whether a body has many collisions, and none of them is connected to a light."""
    thing, lit = scene.translucent[slot], scene.lit_collisions[slot]
    medium = thing.medium
    assert medium is not None
    if medium.g != 0 or not medium.is_achromatic or lit.inside or lit.facets:
        return False
    mesh = scene.scene.objects[thing.index].mesh
    inradius = mesh.mean_inradius / scene.frame.scale
    return bool(medium.single_scattering_albedo.max() >= JUMP_ALBEDO and inradius * medium.sigma_t[0] >= JUMP_INRADIUS)


def _grid(scene: TracedScene, dense: list[TracedObject], pixels: int) -> DistanceGrid | None:
    """The grid around the dense bodies; any surface of the scene may be the nearest."""
    # the grid does not know sphere lights
    if not dense or scene.holds_sphere.any():
        return None
    walks, solids = [], []
    for thing in dense:
        mesh, medium = scene.scene.objects[thing.index].mesh, thing.medium
        assert medium is not None
        walks.append(
            Walks(
                count=_TYPICAL_PASSES * _TYPICAL_SHARE * pixels / len(dense),
                area=mesh.area / scene.frame.scale**2,
                volume=mesh.volume / scene.frame.scale**3,
                mean_free_path=1 / float(medium.sigma_t[0]),
                albedo=float(medium.single_scattering_albedo.max()),
                ior=float(medium.ior),
            )
        )
        solids.append(slice(thing.first_triangle, thing.first_triangle + len(mesh.faces)))
    lower = np.min([thing.lower for thing in dense], axis=0)
    upper = np.max([thing.upper for thing in dense], axis=0)
    resolution = choose_resolution(walks, (upper - lower).ravel(), jumps=True)
    return None if resolution is None else DistanceGrid(scene.vertices, scene.triangles, resolution, solids)


def _guide(scene: TracedScene, slot: int) -> Guide | None:
    """Guided flights: out of the medium, the way light came in, where lights are all around; or to the only light."""
    thing = scene.translucent[slot]
    medium = thing.medium
    assert medium is not None
    if medium.g != 0 or not medium.is_achromatic:
        return None
    # of the brightest channel: guided by a darker one, its paths multiply weights without end, and few carry most of it
    albedo = float(medium.single_scattering_albedo.max())
    sigma_t = float(medium.sigma_t[0])
    large = float((thing.upper - thing.lower).max()) * sigma_t >= STRONG_GUIDE_SIZE
    lights = scene.lights
    if lights.points:
        led = large and lights.lone is not None and not scene.holds_light[:, slot].any()
        return Guide.of(albedo, sigma_t, 0.75) if led and LEAST_LEAD_ALBEDO <= albedo <= LEAD_ALBEDO else None
    if not LEAST_GUIDE_ALBEDO <= albedo <= GUIDE_ALBEDO:
        return None
    lamps = lights.rectangles or lights.spheres
    strong = albedo < STRONG_GUIDE_ALBEDO and large and not lamps
    return Guide.of(albedo, sigma_t, 0.75 if strong else 0.5)
