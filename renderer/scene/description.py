"""What a scene is made of: objects, materials, camera, lights. Plain data, in scene units.

Colours are linear RGB, (3,) float64. Lengths are scene units; the mesh of an object is already transformed
into scene coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sss_tools.closedness import Closedness
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh

Vector = NDArray[np.float64]
ShaderChoice = Literal["auto", "path", "plumb", "scalar"]
HoleHandling = Literal["auto", "strict", "cap", "terminate", "surface"]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera. ``fov`` is the full vertical angle in degrees; row 0 of the image is its top."""

    position: Vector
    target: Vector
    up: Vector
    fov: float
    resolution: tuple[int, int]


@dataclass(frozen=True)
class EnvironmentLight:
    """Light from infinitely far away in every direction, and the background.

    radiance  (3,) constant, or None where ``image`` is given
    image     (h, w, 3) float32 equirectangular radiance: row 0 is +y, the centre column looks along -z,
              columns grow towards +x
    rotation  degrees about y, counter-clockwise seen from above
    """

    radiance: Vector | None = None
    image: NDArray[np.float32] | None = None
    rotation: float = 0.0


@dataclass(frozen=True)
class PointLight:
    """``intensity`` in W/sr per channel, at ``position``."""

    position: Vector
    intensity: Vector


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light travelling along ``direction``; ``irradiance`` on a plane across the beam."""

    direction: Vector
    irradiance: Vector


@dataclass(frozen=True)
class RectangleLight:
    """A rectangle that emits ``radiance`` from its front, which faces ``target``; visible, reflects nothing.

    ``half`` are half its width (across ``up``) and half its height.
    """

    center: Vector
    target: Vector
    up: Vector
    half: tuple[float, float]
    radiance: Vector


@dataclass(frozen=True)
class SphereLight:
    """A ball that emits ``radiance`` outwards; visible, reflects nothing."""

    center: Vector
    radius: float
    radiance: Vector


Light = EnvironmentLight | PointLight | DirectionalLight | RectangleLight | SphereLight


@dataclass(frozen=True)
class Translucent:
    """A medium (coefficients per scene unit, with its ior) behind a dielectric boundary.

    roughness  GGX alpha of the boundary; 0 is smooth
    """

    medium: Medium
    roughness: float = 0.0


@dataclass(frozen=True)
class Diffuse:
    """An opaque Lambertian surface."""

    reflectance: Vector


@dataclass(frozen=True)
class Mirror:
    """An opaque perfect mirror."""

    reflectance: Vector


Material = Translucent | Diffuse | Mirror


@dataclass(frozen=True)
class SceneObject:
    """A mesh in scene coordinates with its material.

    mesh_path   the file it came from
    normals     "flat" or "smooth" shading normals
    shader      what the scene asks for; "auto" leaves it to the selection
    closedness  what the check found; None until it ran
    reflected_share  probability with which a path at the boundary follows the reflection, from the second boundary on
                (a path's first is split), weighed so that the mean stays; None: the Fresnel reflectance
    source      the mesh as its file has it, before the transform: records beside the file are about this one
    """

    name: str
    mesh: Mesh
    material: Material
    mesh_path: Path | None = None
    normals: Literal["flat", "smooth"] = "flat"
    shader: ShaderChoice = "auto"
    hole_handling: HoleHandling = "auto"
    reflected_share: float | None = None
    closedness: Closedness | None = None
    source: Mesh | None = None


@dataclass(frozen=True)
class Scene:
    """Everything a picture depends on but the seed and the number of passes.

    unit   "mm", "cm", "m" or "inch": what one scene unit is
    hash   hexadecimal digest of the description and the geometry
    """

    unit: str
    camera: Camera
    lights: tuple[Light, ...]
    objects: tuple[SceneObject, ...]
    hash: str = field(default="", compare=False)
    path: Path | None = None

    def _repr_png_(self) -> bytes | None:
        """How notebooks show it: the objects as the camera sees them, without light."""
        from sss_tools.thumbnail import Eye, thumbnail

        from .camera import view_basis

        forward, left, up = view_basis(self.camera)
        slope = float(np.tan(np.radians(self.camera.fov) / 2))
        width, height = self.camera.resolution
        smaller = max(width, height) / 400
        size = (max(round(width / smaller), 1), max(round(height / smaller), 1))
        position = np.asarray(self.camera.position, float)
        return thumbnail([thing.mesh for thing in self.objects], size, Eye(position, -left, up, forward, slope))

    def _repr_html_(self) -> str:
        """The same picture, and a table of the objects."""
        import base64
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(thing.name)}</td><td>{type(thing.material).__name__.lower()}</td>"
            f"<td>{len(thing.mesh.faces):,} faces</td></tr>"
            for thing in self.objects
        )
        picture = base64.b64encode(self._repr_png_() or b"").decode()
        lights = f"{len(self.lights)} light{'' if len(self.lights) == 1 else 's'}"
        return f'<img src="data:image/png;base64,{picture}"><table>{rows}</table><p>{lights}; unit {self.unit}</p>'
