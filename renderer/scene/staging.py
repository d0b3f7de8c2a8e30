"""A scene for a bare mesh: a material, a camera that frames it, soft light from above and beside."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError
from sss_tools.keys import did_you_mean
from sss_tools.medium import PRESETS, Medium
from sss_tools.mesh import Mesh

from .camera import view_basis
from .description import Camera, EnvironmentLight, Light, RectangleLight, Scene, SceneObject, Translucent
from .fingerprint import with_hash

MEAN_FREE_PATH = 0.02
"""Of the default medium, as a share of the mesh's longest side."""
MARGIN = 0.1
"""Share of the picture's width or height, whichever is tighter, left free: half of it on each side."""
FOV = 26.0
"""Vertical angle of view, degrees: a long lens, so that solids keep their proportions."""
ELEVATION, AZIMUTH = 12.0, 18.0
"""Of the camera, degrees: above the horizon, and from +z towards +x."""

_AMBIENT = np.array([0.10, 0.115, 0.14])
_KEY_LIGHT = np.array([1.85, 1.68, 1.44])
_KEY_DIRECTION = np.array([0.95, 1.0, 0.4])  # to the right, up and backwards in the picture
_KEY_DISTANCE, _KEY_HALF = 2.1, 1.9  # in longest sides: it fills 1.9 sr, for soft shadows and little noise
_UPWARD = np.array([0.0, 1.0, 0.0])


def stage_mesh(
    mesh: Mesh, material: Medium | str | None = None, size: tuple[int, int] = (500, 500), unit: str = "mm"
) -> Scene:
    """The mesh alone in soft light, filling the picture.

    material  a medium with coefficients per mesh unit, or the name of a preset, converted by ``unit``; None: marble's
              albedo, ior 1.5, at a mean free path of ``MEAN_FREE_PATH`` times the longest side, which looks the same
              at any scale
    size      width and height of the picture, pixels
    unit      what one mesh unit is

    +y is up. The camera looks from slightly above and from the right; a large warm rectangle shines from above
    and beside it, and a dim bluish environment from everywhere.

    Raises InputError for an unknown preset, and for a mesh without faces or extent or with coordinates that are
    not finite.
    """
    subject = mesh.path or "the mesh"
    if len(mesh.faces) == 0:
        raise InputError(subject, "has no faces", "give a mesh with triangles")
    if not np.isfinite(mesh.vertices).all():
        raise InputError(subject, "has vertices that are not finite", "repair it")
    if not 0 < mesh.longest_side < math.inf:
        raise InputError(subject, "has no extent: all its vertices coincide", "give a mesh with a size")
    translucent = Translucent(_medium(mesh, material, unit))
    camera = frame_camera(mesh, size)
    lights: tuple[Light, ...] = (EnvironmentLight(radiance=_AMBIENT), _key_light(mesh, camera))
    name = mesh.path.stem if mesh.path else "mesh"
    thing = SceneObject(name, mesh, translucent, mesh_path=mesh.path, source=mesh)
    return with_hash(Scene(unit, camera, lights, (thing,)))


def _medium(mesh: Mesh, material: Medium | str | None, unit: str) -> Medium:
    if isinstance(material, Medium):
        return material
    if material is None:
        marble = Medium.preset("marble", "mm")
        sigma_t = np.full(3, 1 / (MEAN_FREE_PATH * mesh.longest_side))
        return Medium.from_albedo(marble.single_scattering_albedo, sigma_t, ior=marble.ior)
    if material not in PRESETS:
        raise InputError(f'material "{material}"', "there is no such preset", did_you_mean(material, PRESETS))
    return Medium.preset(material, unit)


def frame_camera(mesh: Mesh, size: tuple[int, int]) -> Camera:
    """The nearest camera on the chosen side that keeps ``MARGIN`` free around the mesh, which is in the middle.

    With x to the right, y up and b backwards, a vertex is in the (narrowed) pyramid of sight of a camera at c
    where |x - cx| <= k (cb - b), k the slope of the pyramid's sides. Both sides touch the mesh at

        cb = (max(x + k b) + max(-x + k b)) / 2k,   cx = (max(x + k b) - max(-x + k b)) / 2,

    likewise for y, and the farther of the two cb holds both.
    """
    elevation, azimuth = math.radians(ELEVATION), math.radians(AZIMUTH)
    horizontal = math.cos(elevation)
    back = np.array([horizontal * math.sin(azimuth), math.sin(elevation), horizontal * math.cos(azimuth)])
    middle = mesh.bounds.mean(axis=0)
    axes = _axes(Camera(middle + mesh.longest_side * back, middle, _UPWARD, FOV, size))
    x, y, b = axes @ (mesh.vertices[np.unique(mesh.faces)] - middle).T
    width, height = size
    slope = (1 - MARGIN) * math.tan(math.radians(FOV) / 2)
    centre, distance = zip(_touching(x, b, slope * width / height), _touching(y, b, slope), strict=True)
    target = middle + np.array([*centre, 0.0]) @ axes
    return Camera(target + max(distance) * axes[2], target, _UPWARD, FOV, size)


def _touching(x: NDArray, back: NDArray, slope: float) -> tuple[float, float]:
    right, left = (x + slope * back).max(), (-x + slope * back).max()
    return (right - left) / 2, (right + left) / (2 * slope)


def _axes(camera: Camera) -> NDArray[np.float64]:
    """(3, 3) rows: unit vectors to the right, up and backwards in the picture."""
    forward, left, upward = view_basis(camera)
    return np.stack([-left, upward, -forward])


def _key_light(mesh: Mesh, camera: Camera) -> RectangleLight:
    """The rectangle above and beside the camera; out of any picture that is not four times as high as wide."""
    axes, size = _axes(camera), mesh.longest_side
    direction = _KEY_DIRECTION / np.linalg.norm(_KEY_DIRECTION)
    return RectangleLight(
        center=camera.target + _KEY_DISTANCE * size * direction @ axes,
        target=camera.target,
        up=axes[1],
        half=(_KEY_HALF * size, _KEY_HALF * size),
        radiance=_KEY_LIGHT,
    )
