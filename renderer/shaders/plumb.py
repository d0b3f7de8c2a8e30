"""Light plumb: the lit ball that fits one chord through the body along the light's line.

The chord of length d runs into the body on the light's line, towards the light where the surface faces away from
it (x = N.L < 0) and away from the light where it faces it, and fits a ball of radius R_e = d/(2|x|). For a ball this
is exact on both sides of the terminator, where R_e tends to the radius of the normal section, so there is no seam.
What the fitted ball sends out is looked up with its directions (``optics.emergence``) and bent towards the slab where
the surface is flatter than the ball (``solved_body``).

Good when: the body is round; errors by body and medium are in docs/fast_shaders.md.
Wrong when: the body is long or flat, on its unlit side: a single length cannot tell a ball from a slab, whose light
differs by 2 to 5 times. Light that leaves the body and enters it again is left out, and so is light that crosses it
unscattered, which a parallel beam sends to no viewer outside itself.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RAY_OFFSET

from ..optics.lookup import Places
from .light_line import LightLine, follow
from .surface import Beam, BodyOptics, Caster, SurfacePoints, cosine_to, sum_in_blocks

NAME = "plumb"

Float32 = NDArray[np.float32]

_SHORTEST_CHORD = 100 * RAY_OFFSET
"""Chords below this are those of rays that leave through the face they started from, whose own normal differs from
the shading normal."""

CHORD_COUNTS = 0.05, 0.15
"""|x| below which the curvature radius alone is used, chords being noisy there, and above which the chord alone."""

_UNCOUNTED = np.float32(0.25)
"""Depth before the body, in transport mean free paths, that is taken for corners of its own faces."""

_FAR_SIDE_COUNTS = np.float32(0.01)
"""What comes through the body from the far end of an axis is not followed there below this share of the near end's."""


def exitance(caster: Caster, points: SurfacePoints, body: BodyOptics, beams: Iterable[Beam]) -> Float32:
    """(3, n) float32 exitance of scattered light at ``points`` of ``body`` under ``beams``."""
    return sum_in_blocks(points, beams, lambda block, beam: _shade(caster, block, body, beam))


def _shade(caster: Caster, points: SurfacePoints, body: BodyOptics, beam: Beam) -> Float32:
    if beam.ambient:
        axes = beam.axes
        assert axes is not None
        exitance = points.under_even_light(lambda some: ambient(caster, some, body, axes))
        return exitance * np.asarray(beam.radiance, np.float32)[:, None]
    direction, distance, irradiance = beam.at(points.position)
    x = cosine_to(points.normal, direction)
    towards = _towards(caster, points, body, direction, distance, x)
    chord = towards.chord
    lit = np.flatnonzero(x >= 0)
    if len(lit):
        chord[lit] = _chord_behind(caster, _below(points).take(lit, axis=1), body, -direction.take(lit, axis=1))
    radius = ball_radius(body, points.curvature, x, chord)
    at = body.places(x, radius)
    found = solved_body(body, x, radius, points.curvature, at)
    body.seen(found, x, radius, points, direction, at)
    found *= _arriving(towards, x, body)
    return found * irradiance


def _towards(caster, points: SurfacePoints, body: BodyOptics, direction, distance, x) -> LightLine:
    """The line from each point to the light, through the body where the surface faces away."""
    dark = x < 0
    origin = points.position + points.normal * np.where(dark, -RAY_OFFSET, RAY_OFFSET)
    return follow(caster, body, origin, direction, distance, dark)


def _below(points: SurfacePoints) -> Float32:
    """(3, n) the points, off their faces into the body."""
    return points.position - points.normal * RAY_OFFSET


def _chord_behind(caster, origin: Float32, body: BodyOptics, inward: Float32) -> Float32:
    """(n,) length of the first stretch inside along ``inward``, which points into the body."""
    n = origin.shape[1]
    everywhere = np.full(n, np.inf, np.float32)
    return follow(caster, body, origin, inward, everywhere, np.ones(n, bool), chord_only=True).chord


def _arriving(line: LightLine, x: Float32, body: BodyOptics) -> Float32:
    """(channels, n) or (1, n) share of the beam left by what stands before the body.

    Opaque things let nothing through. Translucent ones, folds of the same body among them, add their depth to
    the way already inside, which begins at nothing on either side of the terminator. A quarter of a transport mean
    free path is not counted: lines that leave a body at grazing angles cut the corners of its faces, and a seam of the
    width of a face would show where they do.
    """
    left = np.where(line.blocked, np.float32(0), np.float32(1))[None]
    depth = line.depth - _UNCOUNTED * body.transport_length.mean()
    behind = np.flatnonzero((depth > 0) & ~line.blocked)
    if len(behind) == 0:
        return left
    left = np.repeat(left, body.channels, axis=0)
    before = np.where(x[behind] < 0, np.nan_to_num(line.chord[behind]), np.float32(0))
    left[:, behind] = body.passed_on(before, depth[behind])
    return left


def ball_radius(body: BodyOptics, curvature: Float32, x: Float32, chord: Float32) -> Float32:
    """(n,) R_e = d/(2|x|) from chords, gliding into the curvature radius at the terminator.

    The glide is a smoothstep in log R, so that neither a long nor a short chord outweighs the curved surface. Where
    the chord is unknown (NaN, a hole) or next to nothing, the curvature radius is used.
    """
    steep = np.abs(x)
    known = chord > _SHORTEST_CHORD
    none, all_ = CHORD_COUNTS
    share = np.clip((steep - none) * np.float32(1 / (all_ - none)), 0, 1)
    share = np.where(known, share * share * (3 - 2 * share), np.float32(0))
    radius = body.curvature_radius(curvature)
    from_chord = np.where(share > 0, chord / np.maximum(2 * steep, np.float32(none)), radius)
    return np.multiply(radius, np.power(from_chord / radius, share), dtype=np.float32)


def solved_body(
    body: BodyOptics, x: Float32, radius: Float32, curvature: Float32, at: list[Places] | None = None
) -> Float32:
    """(channels, n) exitance per irradiance: the ball's, bent towards the slab's where the surface is flatter than it.

        B + w (S - B) for w = (1 - R_e H) x^2 > 0,   B (S/B)^w, R_e H at most 2, else

    with S the slab's at the thickness d |x| = 2 R_e x^2 that it has if the chord crosses it. A plane lit straight on is
    the slab, and what is rounder than the ball is as far from the slab on the other side, but between the ball of the
    chord and that of the curvature: a thick slab is so dark that nothing is as far from it. x^2 fades the slab out
    towards the terminator, where its thickness and its light tend to nothing.

    at  the places of x and radius in the tables, where they are known
    """
    ball = body.ball_exitance(x, radius, at)
    square = x * x
    slab = body.slab_exitance(x, 2 * radius * square)
    weight = 1 - np.clip(radius * curvature, 0, 2)
    weight *= square
    long = np.flatnonzero(weight < 0)
    if len(long):
        floor = np.float32(1e-9)
        apart = np.maximum(slab[:, long], floor) / np.maximum(ball[:, long], floor)
        bent = ball[:, long] * np.power(apart, weight[long])
        round_ = body.ball_exitance(x[long], body.curvature_radius(curvature[long]))
        np.clip(bent, np.minimum(ball[:, long], round_), np.maximum(ball[:, long], round_), out=bent)
    slab -= ball
    slab *= weight
    slab += ball
    if len(long):
        slab[:, long] = bent
    return slab


def ambient(caster: Caster, points: SurfacePoints, body: BodyOptics, axes: Float32) -> Float32:
    """(channels, n) exitance under radiance 1 from everywhere.

    A few directions k tell how the body differs from one ball and what stands before it; what the ball itself
    would send out is known exactly,

        U(R) sum_k B_k arriving_k / sum_k B(x_k; R),

    so that a free ball is exact whatever the number of directions. Both directions of an axis share one chord. Four
    axes are within 7 to 11 % (root mean square) of two hundred on the Stanford bunny, three within 8 to 14 %; they
    differ from pass to pass, so that passes converge.

    axes  (3, k) unit columns
    """
    n = len(points)
    found, cosines, radii = np.zeros((body.channels, n), np.float32), [], []
    for axis in axes.T:
        x = np.einsum("i,ij->j", axis, points.normal)
        outward = axis[:, None] * np.where(x < 0, np.float32(-1), np.float32(1))
        np.abs(x, out=x)
        chord = _chord_behind(caster, _below(points), body, -outward)
        radius = ball_radius(body, points.curvature, x, chord)
        near = solved_body(body, x, radius, points.curvature)
        far = solved_body(body, -x, radius, points.curvature)
        counts = np.flatnonzero((far > _FAR_SIDE_COUNTS * near).any(axis=0) & (chord > _SHORTEST_CHORD))
        if len(counts):
            far[:, counts] *= _beyond(caster, points.take(counts), body, -outward.take(counts, axis=1), chord[counts])
        everywhere = np.full(n, np.inf, np.float32)
        near *= _arriving(_towards(caster, points, body, outward, everywhere, x), x, body)
        found += near
        found += far
        cosines.append(x)
        radii.append(radius)
    # the one ball is the mean of the fitted ones, in the logarithm
    common = np.exp(np.mean(np.log(radii), axis=0, dtype=np.float32))
    plain = np.full((body.channels, n), 1e-12, np.float32)
    for x in cosines:
        plain += body.ball_exitance(x, common)
        plain += body.ball_exitance(-x, common)
    found /= plain
    found *= body.uniform_exitance(common)
    return found


def _beyond(caster, points: SurfacePoints, body: BodyOptics, inward, chord) -> Float32:
    """(channels, n) or (1, n) share of the light from ``inward`` that reaches the far end of the chords."""
    origin = points.position + (chord + 4 * RAY_OFFSET) * inward
    outside = np.zeros(len(points), bool)
    line = follow(caster, body, origin, inward, np.full(len(points), np.inf, np.float32), outside)
    return _arriving(LightLine(chord, line.depth, line.blocked), np.full(len(points), -1, np.float32), body)
