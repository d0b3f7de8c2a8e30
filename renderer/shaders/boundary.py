"""The dielectric boundary of translucent objects: smooth, rough, or invisible where the index does not change."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from ..optics.dielectric import fresnel_reflectance
from ..optics.microfacet import sample_visible_facet, unmasked
from ..scene.lights import Illumination
from ..tracing.paths import CHANCE, OUTSIDE, REFLECTS, REFRACTS, WHOLE, Paths
from ..tracing.streams import branch_streams
from ..tracing.traced_scene import TracedScene, offset_from
from ..tracing.transport import Transport
from .blend import Choices
from .crossings import Crossings
from .direct_light import arriving, arriving_from_areas
from .local_frame import LocalFrame
from .lost_paths import lose
from .point_light import light_rough, turned_density

Float32 = NDArray[np.float32]
Arriving = Callable[..., Iterable[Illumination]]


def split(scene: TracedScene, paths: Paths, samples: int, choices: Choices | None = None) -> None:
    """Split the whole paths that are about to enter a body: each will refract, a copy of it reflect.

    What the first boundary reflects and what comes from inside are so different that leaving the choice to chance is
    most of the noise of a dark body. Copies add to the radiance ``samples`` columns on, so that a sum does not
    depend on which branch ends first.
    """
    whole = np.flatnonzero((paths.branch == WHOLE) & (paths.owner == OUTSIDE) & (paths.triangle >= 0))
    triangle = paths.triangle[whole]
    slot = scene.slot_of_triangle[triangle]
    entering = np.einsum("ij,ij->j", paths.direction[:, whole], scene.triangle_normal[:, triangle]) < 0
    bends = (slot >= 0) & (scene.media.ior[slot] != 1) & (paths.inside[slot, whole] == 0)
    whole = whole[bends & entering]
    if choices is not None:
        whole = whole[~choices.stay_outside(scene.triangle_object[paths.triangle[whole]], paths.sample[whole])]
    if len(whole):
        paths.branch[whole] = REFRACTS
        copies = paths.append(paths, whole)
        paths.branch[copies] = REFLECTS
        paths.sample[copies] += np.int32(samples)


def meet_boundary(transport: Transport, index: NDArray[np.intp], triangle: NDArray[np.int32]) -> None:
    """Reflect or refract the paths ``index`` where they meet ``triangle`` (m,); their origins are the hit points.

    Paths whose crossing contradicts a closed surface end.
    """
    scene, paths = transport.scene, transport.paths
    at = Crossings.of(scene, paths, index, triangle)
    lost = at.contradictory(scene)
    if lost.any():
        for slot in np.unique(at.slot[lost]):
            mine = index[lost & (at.slot == slot)]
            lose(transport, mine, int(slot))
            if scene.translucent[slot].taken_for_closed:
                transport.tally.contradicted += len(mine)
        at = at.take(np.flatnonzero(~lost))
    if not len(at.index):
        return
    choice, u1 = transport.draw(at.index)
    straight = at.eta == 1
    roughness = np.array([thing.roughness for thing in scene.translucent], np.float32)[at.slot]
    rough = ~straight & (roughness > 0)
    turned, reflected = at.direction.copy(), np.zeros(len(at.index), bool)
    density = np.where(straight, paths.density[at.index], np.float32(np.inf))
    smooth = np.flatnonzero(~straight & ~rough)
    if len(smooth):
        turned[:, smooth], reflected[smooth] = _turn(
            at.direction[:, smooth],
            at.facing[:, smooth],
            at.eta[smooth],
            choice[smooth],
            paths,
            at.index[smooth],
            _reflected_share(scene, at.slot[smooth]),
        )
    for slot, thing in enumerate(scene.translucent) if rough.any() else ():
        mine = np.flatnonzero(rough & (at.slot == slot))
        if len(mine):
            u2, _ = transport.draw(at.index[mine])
            turned[:, mine], reflected[mine], density[mine] = _scatter_rough(
                transport, at.take(mine), thing.roughness, choice[mine], u1[mine], u2
            )
    # only now: both branches of a path must have met the same facet
    copies = at.index[paths.branch[at.index] == REFLECTS]
    paths.stream[copies] = branch_streams(paths.stream[copies])
    paths.branch[at.index[~straight]] = CHANCE
    density[_keep_side(turned, at.near_normal, reflected)] = np.inf
    crossed = at.index[~reflected]
    paths.inside[:, crossed] = at.inside_beyond[:, ~reflected]
    paths.owner[crossed] = at.beyond[~reflected]
    paths.density[at.index] = density
    paths.flown[at.index[~straight]] = 0
    paths.direction[:, at.index] = turned
    side = np.where(reflected, np.float32(1), np.float32(-1))
    paths.origin[:, at.index] = offset_from(at.position, at.near_normal, side)


def _reflected_share(scene: TracedScene, slot: NDArray[np.integer]) -> Float32 | None:
    """(n,) what the objects ask for, NaN for nothing; None where none of the scene asks."""
    shares = np.array([thing.reflected_share for thing in scene.translucent], np.float32)
    return None if np.isnan(shares).all() else shares[slot]


def _turn(
    direction: Float32,
    normal: Float32,
    eta: Float32,
    u: Float32,
    paths: Paths,
    index: NDArray[np.intp],
    reflected_share: Float32 | None = None,
) -> tuple[Float32, NDArray[np.bool_]]:
    """Snell's law and Fresnel's choice: new directions (3, n), and whether they are reflected.

    direction  (3, n) unit, of travel; normal (3, n) unit, against it
    eta        (n,) index beyond over before
    u          (n,) uniforms: reflected where they are below the reflectance. The two branches of a split path have
               no choice, and are weighed by their share instead
    reflected_share  (n,) probability of reflection in place of the reflectance, with the weight that keeps the mean;
               NaN for none
    """
    cos_in = np.clip(-np.einsum("ij,ij->j", direction, normal), 0, 1)
    reflectance, cos_out = fresnel_reflectance(cos_in, eta)
    branch = paths.branch[index]
    chance = reflectance
    if reflected_share is not None:
        asked = ~np.isnan(reflected_share) & (branch == CHANCE) & (reflectance < 1)
        chance = np.where(asked, reflected_share, reflectance)
    reflected = u < chance
    if chance is not reflectance:
        _weigh(paths, index[asked], reflectance[asked], chance[asked], reflected[asked])
    split = np.flatnonzero((branch == REFLECTS) | (branch == REFRACTS))
    if len(split):
        reflected[split] = branch[split] == REFLECTS
        share = np.where(reflected[split], reflectance[split], 1 - reflectance[split])
        paths.throughput[:, index[split]] *= share
        # roulette must not take a branch for faint because its share is: the branches of a white body add up to 1
        paths.faint[index[split]] *= share
        paths.alive[index[split]] &= share > 0
    inverse = 1 / eta
    along = np.where(reflected, 2 * cos_in, cos_in * inverse - cos_out)
    turned = np.where(reflected, 1, inverse) * direction + along * normal
    turned /= np.sqrt(np.einsum("ij,ij->j", turned, turned))
    return turned, reflected


def _weigh(paths: Paths, index, reflectance: Float32, chance: Float32, reflected: NDArray[np.bool_]) -> None:
    """Weigh the paths ``index`` whose choice was made with other probabilities than the reflectance."""
    weight = np.where(reflected, reflectance / chance, (1 - reflectance) / (1 - chance))
    paths.throughput[:, index] *= weight
    # as above: roulette would undo what was asked for
    paths.faint[index] *= weight
    paths.alive[index] &= weight > 0


def _scatter_rough(
    transport: Transport, at: Crossings, alpha: float, choice: Float32, u1: Float32, u2: Float32
) -> tuple[Float32, NDArray[np.bool_], Float32]:
    """GGX reflection or refraction, after lights were connected; weighs the throughputs.

    Returns directions (3, n), whether they are reflected, and ``Paths.density``.

    With visible facets drawn, the weight of the scattered direction is its own masking G1 (Heitz 2018, eq. 19).
    """
    scene, paths = transport.scene, transport.paths
    frame = LocalFrame(at.facing)
    view = frame.to_local(-at.direction)
    if scene.lights.points or scene.lights.sampled:
        # of a path that was split, one branch speaks for both
        speaks = paths.branch[at.index] != REFLECTS
        before = _lit_before(transport, at)
        _light(transport, at, frame, view, speaks & ~before, arriving)
        if scene.lights.sampled:
            _light(transport, at, frame, view, speaks & before, arriving_from_areas)
    facet = sample_visible_facet(view, alpha, u1, u2)
    share = _reflected_share(scene, at.slot)
    turned, reflected = _turn(-view, facet, at.eta, choice, paths, at.index, share)
    # single scattering: what ends on the wrong side would meet a second facet, and is lost
    valid = np.where(reflected, turned[2] > 0, turned[2] < 0)
    paths.throughput[:, at.index] *= np.where(valid, unmasked(turned[2], alpha), 0)
    paths.alive[at.index] &= valid
    density = np.full(len(at.index), np.inf, np.float32)
    if scene.lights.sampled:
        drawn, _ = turned_density(paths, at, view, turned, alpha)
        # where lights were connected: on the side from which straight rays lead to them
        straight = scene.media.ior[np.where(reflected, at.before, at.beyond)] == 1
        np.copyto(density, drawn, where=straight & (drawn > 0))
    return frame.to_world(turned), reflected, density


def _lit_before(transport: Transport, at: Crossings) -> NDArray[np.bool_]:
    """(n,) whether paths come straight from a collision that lights without extent were connected to through a rough
    boundary."""
    rough = np.array([*(lit.rough for lit in transport.scene.lit_collisions), False])
    return rough[at.before] & ~transport.paths.flies_on[at.index]


def _light(
    transport: Transport, at: Crossings, frame: LocalFrame, view: Float32, some: NDArray[np.bool_], lights: Arriving
) -> None:
    """Connect ``lights`` to those rough boundary points that ``some`` (n,) marks."""
    which = np.flatnonzero(some)
    if len(which):
        here = at.take(which)
        beams = lights(transport, here.index, here.position, skies=True)
        light_rough(transport, here, frame.take(which), view[:, which], beams)


def _keep_side(turned: Float32, near_normal: Float32, reflected: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Mirror directions, in place, that a shading normal sent to the wrong side of the true surface; which they are."""
    height = np.einsum("ij,ij->j", turned, near_normal)
    wrong = np.flatnonzero(np.where(reflected, height <= 0, height >= 0))
    if len(wrong):
        turned[:, wrong] -= 2 * height[wrong] * near_normal[:, wrong]
    return wrong
