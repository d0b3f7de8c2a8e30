"""Light without extent, which no path can meet by chance: points and parallel beams.

Where the boundary is invisible it is connected to collisions, at rough boundaries to the boundary, both without
bias. Behind smooth boundaries it is connected through their facets, see ``refracted_light``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.microfacet import scatter
from ..optics.phase import henyey_greenstein
from ..tracing.paths import Paths
from ..tracing.shadow import transmittance as shadow_transmittance
from ..tracing.tally import Tally
from ..tracing.traced_scene import TracedScene
from .crossings import Crossings
from .direct_light import pick, received
from .local_frame import LocalFrame

Float32 = NDArray[np.float32]


def light_collisions(
    scene: TracedScene, paths: Paths, index: NDArray[np.intp], slot: int, tally: Tally, radiance: Float32
) -> None:
    """Light the collisions of the paths ``index`` in the medium ``slot``, from where light comes straight on.

        w p(mu) E0 exp(-optical depth) / ior^2, w with this collision's albedo

    That is through invisible boundaries, or from a light in the same medium.
    ``paths.direction`` must still be the one before the collision.
    """
    if not len(index):
        return
    media = scene.media
    position, direction, sample = paths.origin[:, index], paths.direction[:, index], paths.sample[index]
    ior = float(media.ior[slot])
    for number, source in enumerate(scene.lights.points):
        if ior != 1 and not scene.holds_light[number, slot]:
            continue
        light = source.illuminate(position)
        phase = henyey_greenstein(np.einsum("ij,ij->j", direction, light.direction), media.g[slot])
        visible = shadow_transmittance(scene, media, position, light, paths.inside[:, index], paths.owner[index], tally)
        radiance[:, sample] += paths.throughput[:, index] * light.irradiance * (phase * visible / (ior * ior))


def light_rough(
    scene: TracedScene, paths: Paths, at: Crossings, frame: LocalFrame, view: Float32, tally: Tally, radiance: Float32
) -> None:
    """Light rough boundary points by reflection or transmission, whichever side the light is on.

    frame, view  axes around the shading normal on the viewer's side, and the direction back along the path in them
    """
    alpha = scene.translucent[int(at.slot[0])].roughness
    for source in scene.lights.points:
        light = source.illuminate(at.position)
        to_light = frame.to_local(light.direction)
        value = scatter(view, to_light, at.eta, alpha)
        height = np.einsum("ij,ij->j", at.near_normal, light.direction)
        same_side = height > 0
        owner = np.where(same_side, at.before, at.beyond)
        # straight rays lead to the light from where the index is 1; shading and true normal must agree on the side
        useful = np.flatnonzero((value > 0) & (scene.media.ior[owner] == 1) & (height * to_light[2] > 0))
        if len(useful):
            some = at.take(useful)
            side = np.where(same_side[useful], np.float32(1), np.float32(-1))
            inside = np.where(same_side[useful], some.inside_before, some.inside_beyond)
            arrived = received(
                scene, some.position, some.near_normal * side, pick(light, useful), inside, owner[useful], tally
            )
            radiance[:, paths.sample[some.index]] += paths.throughput[:, some.index] * arrived * value[useful]
