"""Lights connected to where paths scatter: next-event estimation.

Where the boundary is invisible they are connected to collisions, at rough boundaries to the boundary, both without
bias. Lights without extent, points and parallel beams, no path can meet by chance. The others are found both ways,
and share (``direct_light.worthwhile``). Behind rough boundaries lights without extent are connected to collisions, too,
see ``rough_light``, behind smooth ones through the facets, see ``refracted_light``, and the others met by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from ..optics.microfacet import turning, unmasked
from ..optics.phase import henyey_greenstein
from ..scene.lights import Illumination
from ..tracing.depth_roulette import drawn_depth
from ..tracing.paths import REFLECTS, REFRACTS, Paths
from ..tracing.shadow import transmittance as shadow_transmittance
from ..tracing.transport import Transport
from .crossings import Crossings
from .direct_light import arriving, pick, received, worthwhile
from .local_frame import LocalFrame

Float32 = NDArray[np.float32]


def light_collisions(
    transport: Transport,
    index: NDArray[np.intp],
    slot: int,
    drawn: Callable[[NDArray[np.intp], Float32], Float32],
) -> None:
    """Light the collisions of the paths ``index`` in the medium ``slot``, from where light comes straight on.

        w p(mu) E0 exp(-optical depth) / ior^2, w with this collision's albedo

    That is through invisible boundaries, or from a light without extent in the same medium.
    ``paths.direction`` must still be the one before the collision.

    drawn  density with which the paths of the given columns draw the directions (3, m)
    """
    if not len(index):
        return
    scene, paths = transport.scene, transport.paths
    media = scene.media
    position = paths.origin[:, index]
    ior = float(media.ior[slot])
    if ior == 1:
        lights = arriving(transport, index, position, skies=True)
    else:
        held = zip(scene.lights.points, scene.holds_light[:, slot], strict=True)
        lights = (source.illuminate(position) for source, holds in held if holds)
    for light in lights:
        phase = henyey_greenstein(np.einsum("ij,ij->j", paths.direction[:, index], light.direction), media.g[slot])
        density = None if light.density is None else drawn(index, light.direction)
        some, weight = worthwhile(transport, index, light, phase, density)
        if not len(some):
            continue
        who, light = index[some], pick(light, some)
        u, _ = transport.draw(who)
        visible = shadow_transmittance(
            scene, position[:, some], light, paths.inside[:, who], paths.owner[who], transport.tally, drawn_depth(u)
        )
        transport.add(who, light.irradiance * (weight * visible / (ior * ior)))


def light_rough(
    transport: Transport, at: Crossings, frame: LocalFrame, view: Float32, lights: Iterable[Illumination]
) -> None:
    """Light rough boundary points by reflection or transmission, whichever side the light is on.

    lights       what arrives from each of some lights
    frame, view  axes around the shading normal on the viewer's side, and the direction back along the path in them
    """
    scene, paths = transport.scene, transport.paths
    alpha = scene.translucent[int(at.slot[0])].roughness
    for light in lights:
        to_light = frame.to_local(light.direction)
        drawn, share = turned_density(paths, at, view, to_light, alpha)
        value = drawn * share * unmasked(to_light[2], alpha)
        height = np.einsum("ij,ij->j", at.near_normal, light.direction)
        same_side = height > 0
        owner = np.where(same_side, at.before, at.beyond)
        # straight rays lead to the light from where the index is 1; shading and true normal must agree on the side
        value[(scene.media.ior[owner] != 1) | (height * to_light[2] <= 0)] = 0
        useful, weight = worthwhile(transport, at.index, light, value, drawn)
        if len(useful):
            some = at.take(useful)
            side = np.where(same_side[useful], np.float32(1), np.float32(-1))
            inside = np.where(same_side[useful], some.inside_before, some.inside_beyond)
            arrived = received(
                transport, some.position, some.near_normal * side, pick(light, useful), inside, owner[useful]
            )
            transport.add(some.index, arrived, weight)


def turned_density(
    paths: Paths, at: Crossings, view: Float32, turned: Float32, alpha: float
) -> tuple[Float32, Float32]:
    """(n,) density with which the paths at a rough boundary are turned to the local directions ``turned`` (3, n), and
    (n,) the share of light by which they are weighed there: chance has taken it from all but split paths."""
    density, share = turning(view, turned, at.eta, alpha)
    branch = paths.branch[at.index]
    split = (branch == REFLECTS) | (branch == REFRACTS)
    return np.where(split, density, density * share), np.where(split, share, np.float32(1))
