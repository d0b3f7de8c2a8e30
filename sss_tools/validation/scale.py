"""Size against the light: SSS404 coarse-tessellation, SSS501 thin-wall, SSS502 scale-mismatch."""

from __future__ import annotations

import numpy as np

from ..medium import UNITS, Medium
from ..rays import RAY_OFFSET
from ..thickness import inscribed_balls, wall_thickness
from ..winding import spread_by_area
from .outcome import FixSafety, Severity
from .rule import Finding, NotRun, Rule, Subject, plural

BALLS = 5000
"""Faces at which balls are inscribed, spread by area."""

COARSE, FEATURE = np.radians(20.0), np.radians(45.0)
"""Neighbours that turn by more than the first were meant to be round, by more than the second to be an edge."""

GLASS = 1.0
"""Mean chord over transport mean free path below which light mostly crosses without scattering."""

OPAQUE = 1000.0
"""Longest side over the distance light spreads beyond which that is less than half a pixel of 500."""


def find_thin_walls(subject: Subject) -> Finding | None:
    """Faces behind which the solid ends within a mean free path, or within the ray offset."""
    medium, mesh = _medium(subject), subject.mesh
    if subject.assessment.closedness.state == "open":
        raise NotRun("the mesh encloses no volume")
    mean_free_path = float(medium.mean_free_path.min())
    offset = float(RAY_OFFSET) * mesh.longest_side
    limit = max(mean_free_path, offset)
    thickness = wall_thickness(mesh, limit)
    thin = thickness < limit
    chosen = spread_by_area(mesh.face_areas, BALLS)
    diameter, wall = inscribed_balls(mesh, chosen, np.minimum(thickness[chosen], limit))
    held = chosen[wall & (diameter < limit)]
    thin[held] = True
    thickness[held] = np.minimum(thickness[held], diameter[wall & (diameter < limit)])
    faces = np.flatnonzero(thin)
    if len(faces) == 0:
        return None
    lost = int((thickness < offset).sum())
    unit = _unit(subject)
    measured = "" if len(chosen) == len(mesh.faces) else f" (measured by ray at every face, by ball at {len(chosen)})"
    what = "the least mean free path" if mean_free_path >= offset else "the ray offset"
    return Finding(
        count=len(faces),
        message=f"{plural(len(faces), 'face')} ({mesh.face_areas[faces].sum() / mesh.area:.1%} of the area) on walls "
        f"thinner than {limit:.3g} {unit}, {what}; the thinnest is {thickness.min():.3g} {unit}; "
        f"{lost} below the ray offset of {offset:.3g} {unit}{measured}",
        faces=faces,
    )


def find_scale_mismatch(subject: Subject) -> Finding | None:
    """A body that light crosses unscattered, or one that it does not enter visibly."""
    medium, mesh = _medium(subject), subject.mesh
    verdict = _scale_verdict(subject, medium)
    if verdict is None:
        return None
    per_mm = medium.scaled(1 / UNITS[subject.context.unit or "mm"])
    fitting = [unit for unit in UNITS if _scale_verdict(subject, per_mm.scaled(UNITS[unit])) is None]
    hint = f"; it would fit if a mesh unit were 1 {' or 1 '.join(fitting)}" if fitting else ""
    return Finding(count=1, message=verdict + hint, faces=np.arange(len(mesh.faces)))


def find_coarse_tessellation(subject: Subject) -> Finding | None:
    """Facets of a round surface that are longer than light is scattered, or than a pixel is wide."""
    medium, pixel = subject.context.medium, subject.context.pixel_footprint
    unit = _unit(subject)
    limits = {}
    if medium is not None:
        limits["the least transport mean free path"] = float(medium.transport_mean_free_path.min())
    if pixel is not None:
        limits["a pixel"] = pixel
    if not limits:
        raise NotRun("no scene and no material")
    mesh, topology = subject.mesh, subject.topology
    left, right = (side // 3 for side in topology.side_pairs)
    normals = mesh.face_normals
    cosine = np.einsum("ij,ij->i", normals[left], normals[right])
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    # a face without area has no normal: its cosines are 0
    bent = (cosine < np.cos(COARSE)) & (cosine > np.cos(FEATURE))
    long = longest > min(limits.values())
    bent &= long[left] | long[right]
    faces = np.unique(np.concatenate([left[bent], right[bent]]))
    faces = faces[long[faces]]
    if len(faces) == 0:
        return None
    worst = float(np.degrees(np.arccos(cosine[bent].min())))
    exceeded = [f"{what} of {limit:.3g} {unit}" for what, limit in limits.items() if longest[faces].max() > limit]
    return Finding(
        count=len(faces),
        message=f"{plural(len(faces), 'facet')} turn by {np.degrees(COARSE):.0f} to {worst:.0f} degrees to a neighbour "
        f"(more than {np.degrees(FEATURE):.0f} would be an edge) and are up to {longest[faces].max():.3g} {unit} long, "
        f"more than {' and '.join(exceeded)}",
        faces=faces,
    )


def _medium(subject: Subject) -> Medium:
    if subject.context.medium is None:
        raise NotRun("no material")
    return subject.context.medium


def _unit(subject: Subject) -> str:
    """What a mesh unit is called; presets take it for a millimetre where nobody said."""
    if subject.context.unit is None and subject.context.neighbours is not None:
        return "mesh units"  # of an object that its scene scales: they have no name
    return subject.context.unit or "mm (assumed)"


def _scale_verdict(subject: Subject, medium: Medium) -> str | None:
    """What is wrong with the size of the mesh in this medium, coefficients per mesh unit; None if nothing is."""
    mesh, volume = subject.mesh, subject.assessment.matter
    unit = _unit(subject)
    path = medium.transport_mean_free_path
    # the mean chord of a body, 4 V / S (Cauchy); of an unclosed one, what its box would have
    sides = np.ptp(mesh.bounds, axis=0)
    box = 2 * sides.prod() / (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0]) if sides.all() else 0.0
    chord = 4 * abs(volume) / mesh.area if volume else float(box)
    if chord < GLASS * path.min():
        return (
            f"like glass: light crosses {chord:.3g} {unit} on average, "
            f"the least transport mean free path is {path.min():.3g} {unit}"
        )
    # how far light gets sideways: a diffusion length, sqrt(D / sigma_a) with D = 1 / (3 sigma_t')
    with np.errstate(divide="ignore"):
        spread = np.maximum(path, np.sqrt(path / (3 * medium.sigma_a))).max()
    if mesh.longest_side > OPAQUE * spread:
        return (
            f"as if opaque: light spreads over {spread:.3g} {unit} at most, "
            f"less than 1/{OPAQUE:g} of the longest side of {mesh.longest_side:.3g} {unit}"
        )
    return None


COARSE_TESSELLATION = Rule(
    code="SSS404",
    name="coarse-tessellation",
    severity=Severity.INFO,
    finds="facets large against the curvature, the scattering length or the pixel",
    why="Light scatters between the facets' edges as in the faceted solid it is: corners glow, planes do not. Facets "
    "wider than a pixel show in the outline and in what the surface reflects, too.",
    fix="subdivide",
    fix_safety=FixSafety.NONE,
    check=find_coarse_tessellation,
)

THIN_WALL = Rule(
    code="SSS501",
    name="thin-wall",
    severity=Severity.WARNING,
    finds="walls thinner than the mean free path, or than the ray offset",
    why="Light goes straight through: the wall looks like glass, and below the ray offset rays miss it altogether.",
    fix="thicken the wall, or use a denser medium",
    fix_safety=FixSafety.NONE,
    check=find_thin_walls,
)

SCALE_MISMATCH = Rule(
    code="SSS502",
    name="scale-mismatch",
    severity=Severity.WARNING,
    finds="object size against the mean free path: glass-like, or so dense that scattering is invisible",
    why="Most likely the units are wrong: a bunny of metres in marble is opaque, one of micrometres is glass.",
    fix="say what a mesh unit is with --unit, or scale the mesh",
    fix_safety=FixSafety.NONE,
    check=find_scale_mismatch,
)
