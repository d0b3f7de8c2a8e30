"""Which shader for which object: the cheapest whose predicted error is within the tolerance.

One number, the quality q in [0, 1], sets the tolerance of an object n pixels across (cost-benefit level of detail:
Funkhouser & Sequin 1993, SIGGRAPH):

    e0 = 0.3 * 10^(-2 q),    e = e0 (1 + 64 / n)

so that what is small in the picture may be rougher, and objects fall from path through plumb and scalar to the
diffuse fallback as they recede. The predicted errors are shares of the object's radiance, measured on balls and
ellipsoids; their coefficients beyond those are judgements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sss_tools.medium import Medium

from ..scene.description import (
    Camera,
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    RectangleLight,
    Scene,
    SceneObject,
    SphereLight,
    Translucent,
)

DEFAULT_QUALITY = 0.5
CHEAPEST_FIRST = ("diffuse", "scalar", "plumb", "path")


@dataclass(frozen=True)
class Plan:
    """What is done with one object, and why.

    distance            of the camera from the box around the object, scene units
    mean_free_path_px   in pixels at that distance, mean of the channels; None for opaque objects
    size_px             diameter of the object in pixels
    predicted_error     relative, of the chosen shader; None where nothing is predicted
    """

    name: str
    state: str | None
    hole_handling: str
    shader: str
    reason: str
    distance: float
    mean_free_path_px: float | None
    size_px: float
    predicted_error: float | None
    warning: str | None = None


@dataclass(frozen=True)
class Appearance:
    """How an object stands in the picture and what its medium makes of its shape.

    distance   scene units
    footprint  side of a pixel at the object, scene units
    size_px    diameter in pixels
    depth      tau, inradius in transport mean free paths
    diffusion  diffusion length, scene units
    aspect     longest over shortest extent
    unlit      share of the visible surface that the lights leave unlit
    """

    distance: float
    footprint: float
    size_px: float
    depth: float
    diffusion: float
    aspect: float
    unlit: float


def tolerance(quality: float, size_px: float) -> float:
    """The relative error allowed for an object ``size_px`` pixels across."""
    return 0.3 * 10 ** (-2 * quality) * (1 + 64 / max(size_px, 1e-3))


def predicted_errors(look: Appearance) -> dict[str, float]:
    """Relative error of each shader but path, by name."""
    tau = max(look.depth, 1e-3)
    ball = float(np.interp(np.log(tau), np.log([0.5, 1, 2, 5]), [0.07, 0.045, 0.03, 0.014]))
    shape = next(error for limit, error in ((1.1, 0.03), (2, 0.15), (4, 0.25), (np.inf, 0.6)) if look.aspect <= limit)
    plumb = float(np.hypot(ball, shape))
    blur = min(1.0, 2 * look.diffusion / look.footprint)
    return {
        "diffuse": float(np.hypot(min(0.6, 1.6 * tau**-1.35) * blur, shape)) + 0.01,
        "scalar": float(np.hypot(plumb, 0.3 * look.unlit)),
        "plumb": plumb,
    }


def select(
    scene: Scene,
    quality: float = DEFAULT_QUALITY,
    shader: str = "auto",
    hole_handling: str = "auto",
    passes: int | None = None,
) -> list[Plan]:
    """A plan for each object of a scene whose translucent objects carry their closedness.

    shader, hole_handling  "auto" or what the user asks for, for all objects; the scene's own wishes come second
    passes                 of the path shader, for its predicted noise; None where it is not known beforehand
    """
    return [_plan(scene, thing, quality, shader, hole_handling, passes) for thing in scene.objects]


def _plan(scene: Scene, thing: SceneObject, quality: float, shader: str, wish: str, passes: int | None) -> Plan:
    look = appearance(scene, thing)
    if not isinstance(thing.material, Translucent):
        kind = "opaque" if type(thing.material).__name__ == "Diffuse" else "mirror"
        return Plan(thing.name, None, "surface", kind, "opaque", look.distance, None, look.size_px, None)
    assert thing.closedness is not None, "check the scene's objects first"
    state = thing.closedness.state
    handling, because = _handling(thing, wish)
    wanted = thing.shader if shader == "auto" else shader
    warning = None
    errors = predicted_errors(look)
    errors["path"] = 0.0 if passes is None else passes**-0.5
    allowed = tolerance(quality, look.size_px)
    if handling == "surface":
        chosen, reason = "diffuse", "the mesh encloses no volume, so there is no inside for light"
        if wanted != "auto":
            warning = f"{thing.name}: {wanted} needs an inside, and this mesh has none; the diffuse fallback is used"
    elif wanted != "auto":
        chosen, reason = wanted, "asked for"
    else:
        chosen = _cheapest(errors, allowed)
        reason = _reason(chosen, errors, allowed, look.size_px, quality)
    mean_free_path = float(np.mean(thing.material.medium.mean_free_path)) / look.footprint
    error = None if (chosen == "path" and passes is None) or handling == "surface" else errors[chosen]
    reason = f"{reason}; {because}"
    return Plan(
        thing.name, state, handling, chosen, reason, look.distance, mean_free_path, look.size_px, error, warning
    )


def _cheapest(errors: dict[str, float], allowed: float) -> str:
    return next(name for name in CHEAPEST_FIRST if name == "path" or errors[name] <= allowed)


def thresholds(scene: Scene, thing: SceneObject, quality: float = DEFAULT_QUALITY) -> list[tuple[float, str, str]]:
    """At which distances between the camera and the middle of ``thing`` its shader would change, nearest first.

    Each is (distance in scene units, shader nearer than that, shader farther), as if the camera moved along its line
    to the object, and to 1 %; looked for from a tenth of the object's size to 10 000 times.
    """
    look, camera = appearance(scene, thing), scene.camera
    size = _diameter(thing)
    distances = size * 10 ** np.arange(-1, 4, np.log10(1.01))
    chosen = []
    for distance in distances:
        footprint = pixel_footprint(camera, float(distance))
        there = replace(look, footprint=footprint, size_px=size / footprint)
        chosen.append(_cheapest(predicted_errors(there), tolerance(quality, there.size_px)))
    return [
        (float(distances[k]), chosen[k - 1], chosen[k]) for k in range(1, len(chosen)) if chosen[k] != chosen[k - 1]
    ]


def _handling(thing: SceneObject, wish: str) -> tuple[str, str]:
    """What is done at holes, and why."""
    assert thing.closedness is not None
    if wish == "auto":
        wish = thing.hole_handling
    if wish == "cap" and thing.closedness.state == "open":
        return "surface", "caps asked for, and the mesh encloses no volume to close"
    if wish != "auto":
        return wish, "hole handling asked for"
    recorded, state = thing.closedness.hole_handling, thing.closedness.state
    because = {
        "strict": "closed, manifold and oriented",
        "cap": f"{len(thing.closedness.holes)} hole(s), closed for light by caps",
        "terminate": f"state {state} with flaws: paths that contradict the surface take the material's colour",
        "surface": "open",
    }
    return recorded, because[recorded]


def _reason(chosen: str, errors: dict[str, float], allowed: float, size_px: float, quality: float) -> str:
    where = f"tolerance {100 * allowed:.2g} % at {size_px:.3g} pixels and quality {quality:g}"
    if chosen == "path":
        best = min(("plumb", "scalar", "diffuse"), key=errors.__getitem__)
        return f"the best faster shader, {best}, is predicted {100 * errors[best]:.2g} % wrong; {where}"
    return f"the cheapest predicted right enough: {100 * errors[chosen]:.2g} % wrong; {where}"


def appearance(scene: Scene, thing: SceneObject) -> Appearance:
    """How ``thing`` stands in the picture."""
    camera, mesh = scene.camera, thing.mesh
    lower, upper = mesh.bounds
    position = np.asarray(camera.position, float)
    nearest = np.clip(position, lower, upper)
    distance = float(np.linalg.norm(position - nearest))
    centre = mesh.bounds.mean(axis=0)
    footprint = pixel_footprint(camera, max(distance, 1e-6 * mesh.diagonal))
    depth, diffusion = 0.0, 0.0
    if isinstance(thing.material, Translucent):
        depth, diffusion = _optical_size(thing.material.medium, _inradius(thing))
    return Appearance(
        distance=distance,
        footprint=footprint,
        size_px=_diameter(thing) / pixel_footprint(camera, max(float(np.linalg.norm(position - centre)), footprint)),
        depth=depth,
        diffusion=diffusion,
        aspect=_aspect(thing),
        unlit=_unlit_share(scene.lights, centre, position),
    )


def pixel_footprint(camera: Camera, distance: float) -> float:
    """Side of the square that a pixel covers at ``distance``, in its unit."""
    return 2 * distance * float(np.tan(np.radians(camera.fov) / 2)) / camera.resolution[1]


def _diameter(thing: SceneObject) -> float:
    """The longest side of the bounding box: what the eye takes for an object's size."""
    return thing.mesh.longest_side


def _inradius(thing: SceneObject) -> float:
    """3 V / A, the radius of the ball with this ratio of volume to area."""
    return 3 * abs(thing.mesh.volume) / thing.mesh.area if thing.mesh.area > 0 else 0.0


def _aspect(thing: SceneObject) -> float:
    """Longest over shortest extent along the principal axes of the surface."""
    mesh = thing.mesh
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    weights = mesh.face_areas
    if weights.sum() == 0:
        return 1.0
    offset = centres - np.average(centres, axis=0, weights=weights)
    variances = np.maximum(np.linalg.eigvalsh((offset.T * weights) @ offset), 0)
    if variances[-1] == 0:
        return 1.0  # a single face
    return float(np.sqrt(variances[-1] / max(variances[0], 1e-12 * variances[-1])))


def _optical_size(medium: Medium, inradius: float) -> tuple[float, float]:
    """Inradius in transport mean free paths, and the diffusion length in the medium's unit; means of the channels."""
    extinction = np.asarray(medium.reduced_extinction, float)
    diffusion = (2 * medium.sigma_a + medium.reduced_scattering) / (3 * np.maximum(extinction, 1e-30) ** 2)
    # without absorption the body itself bounds how far light spreads
    length = np.sqrt(diffusion / np.maximum(medium.sigma_a, diffusion / max(inradius, 1e-30) ** 2))
    return inradius * float(extinction.mean()), float(length.mean())


def _unlit_share(lights: tuple[Light, ...], centre, viewer) -> float:
    """Share of a ball's visible disk that faces away from the lights, each weighted by its irradiance.

    Seen from V a ball lit from L shows (1 - cos(V, L))/2 of its disk unlit; environments leave nothing unlit.
    """
    shares, weights = [], []
    view = (viewer - centre) / max(float(np.linalg.norm(viewer - centre)), 1e-30)
    for light in lights:
        if isinstance(light, EnvironmentLight):
            seen = light.radiance if light.image is None else light.image
            shares.append(0.0)
            weights.append(np.pi * float(np.mean(seen)) if seen is not None else 0.0)
            continue
        offset, irradiance = _from_light(light, centre)
        shares.append((1 - float(offset @ view)) / 2)
        weights.append(irradiance)
    total = sum(weights)
    return float(np.dot(shares, weights) / total) if total > 0 else 0.0


def _from_light(
    light: PointLight | DirectionalLight | RectangleLight | SphereLight, centre
) -> tuple[np.ndarray, float]:
    """Unit direction to a light from ``centre``, and its mean irradiance there."""
    if isinstance(light, PointLight):
        offset, strength = light.position - centre, float(np.mean(light.intensity))
    elif isinstance(light, RectangleLight):
        offset, strength = light.center - centre, 4 * light.half[0] * light.half[1] * float(np.mean(light.radiance))
    elif isinstance(light, SphereLight):
        offset, strength = light.center - centre, np.pi * light.radius**2 * float(np.mean(light.radiance))
    else:
        direction = -np.asarray(light.direction, float)
        return direction / np.linalg.norm(direction), float(np.mean(light.irradiance))
    distance = max(float(np.linalg.norm(offset)), 1e-30)
    return offset / distance, strength / distance**2
