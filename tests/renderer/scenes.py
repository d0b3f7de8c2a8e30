"""Small scenes built in memory, and all samples of their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.camera import CameraRays
from renderer.scene.description import (
    Camera,
    Diffuse,
    EnvironmentLight,
    Light,
    Mirror,
    Scene,
    SceneObject,
    Translucent,
)
from renderer.strips import traced_passes
from renderer.tracing.tally import Tally
from renderer.tracing.traced_scene import TracedScene
from renderer.wavefront import BLOCK, Wavefront
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.shapes import icosphere

WHITE_SKY = EnvironmentLight(radiance=np.ones(3))


def translucent(albedo=0.9, sigma_t=1.0, g: float = 0.0, ior: float = 1.5, roughness: float = 0.0) -> Translucent:
    return Translucent(Medium.from_albedo(albedo, sigma_t, g, ior), roughness)


def diffuse(reflectance) -> Diffuse:
    return Diffuse(np.broadcast_to(np.asarray(reflectance, float), 3))


def mirror(reflectance) -> Mirror:
    return Mirror(np.broadcast_to(np.asarray(reflectance, float), 3))


def placed(mesh: Mesh, material, **more) -> SceneObject:
    return SceneObject(more.pop("name", "thing"), mesh, material, **more)


def camera(position, target=(0, 0, 0), up=(0, 1, 0), fov: float = 30.0, resolution=(16, 16)) -> Camera:
    return Camera(np.array(position, float), np.array(target, float), np.array(up, float), fov, tuple(resolution))


def scene(objects: Sequence[SceneObject], lights: Sequence[Light], view: Camera) -> Scene:
    return Scene("mm", view, tuple(lights), tuple(objects))


def half_white_sky() -> EnvironmentLight:
    """Radiance 1 from above the horizon, 0 from below.

    Interpolation blurs the horizon by a row of 512 to either side; the flux through a level plane that is lost
    above and gained below is 1e-5 of the whole.
    """
    image = np.zeros((512, 4, 3), np.float32)
    image[:256] = 1
    return EnvironmentLight(image=image)


def bumpy_ball(subdivisions: int = 4, depth: float = 0.15, waves: float = 4.0) -> Mesh:
    """An organic closed solid, not convex: an icosphere with bumps."""
    ball = icosphere(1.0, subdivisions)
    x, y, z = ball.vertices.T
    height = 1 + depth * np.sin(waves * x + 1) * np.sin(waves * y + 2) * np.sin(waves * z + 3)
    return Mesh(ball.vertices * height[:, None], ball.faces)


@dataclass
class Picture:
    """All samples of a picture.

    samples       (passes, 3, pixels) float64 radiance
    first_object  (passes, pixels)
    """

    samples: NDArray[np.float64]
    first_object: NDArray[np.int16]
    tally: Tally

    def channel(self, k: int = 0) -> NDArray[np.float64]:
        """(n,) all samples of a channel: independent, and alike where all pixels look at the same thing."""
        return self.samples[:, k].ravel()

    def pass_means(self, k: int = 0, pixels=slice(None)) -> NDArray[np.float64]:
        """(passes,) means over the pixels: independent and alike whatever the pixels show."""
        return self.samples[:, k][:, pixels].mean(axis=1)


def wavefront(
    of: Scene, *, seed: int = 1, block: int = BLOCK, shaders=None, handling=None, acceleration=None
) -> Wavefront:
    opaque = {Diffuse: "opaque", Mirror: "mirror"}
    shaders = shaders or [opaque.get(type(thing.material), "path") for thing in of.objects]
    traced = TracedScene(of, shaders, handling or ["strict"] * len(of.objects))
    return Wavefront(traced, CameraRays(of.camera, traced.frame), {}, seed, block, acceleration)


@dataclass
class Samples:
    """What a tracer made of some passes: radiance (passes, 3, pixels), first_object (passes, pixels)."""

    radiance: NDArray[np.float32]
    first_object: NDArray[np.int16]
    tally: Tally


def traced(tracer, pixels, first_pass: int = 0, passes: int = 1, longest: int = 2**13) -> Samples:
    """All samples of ``pixels``, a number of them or (n,) which, in some passes."""
    pixels = np.arange(pixels) if isinstance(pixels, int) else pixels
    numbers = range(first_pass, first_pass + passes)
    done, tally = traced_passes(tracer, numbers, pixels, longest)
    assert [index for index, _, _ in done] == list(numbers)
    radiance, first_object = np.stack([each.T for _, each, _ in done]), np.stack([first for _, _, first in done])
    return Samples(radiance, first_object, tally)


def picture(of: Scene, passes: int, **how) -> Picture:
    """Render with ``wavefront(of, **how)``."""
    width, height = of.camera.resolution
    made = traced(wavefront(of, **how), width * height, 0, passes)
    return Picture(made.radiance.astype(float), made.first_object, made.tally)
