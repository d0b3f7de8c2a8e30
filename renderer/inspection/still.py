"""A still: the whole with its findings pointed at, what they mean, and close-ups of what is small or hidden."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from sss_tools.validation.outcome import Severity

from . import palette
from .exhibit import Exhibit
from .layer import Artist, Clip, seen_through
from .lettering import Line, Pointer, panel, point_at, titled
from .spots import Spot
from .viewpoint import Viewpoint, centred, directions

SIZE = (1400, 1000)
PANEL = 330
"""Width of the panel with words, pixels."""
CLOSE_UPS = 4
SMALL = 28
"""Radius in pixels below which a finding gets a close-up."""
POINTERS = 150
"""Rings drawn, at most."""

_FAINT = palette.mixed(palette.INK, palette.BACKGROUND, 0.35)


def compose(exhibit: Exhibit, artist: Artist, size: tuple[int, int] = SIZE, clip: Clip | None = None,
            view: Viewpoint | None = None) -> NDArray[np.uint8]:  # fmt: skip
    """(h, w, 3) uint8: the still.

    size  width and height, pixels, from 500 x 400
    view  None: the one that shows most of the findings
    """
    width, height = size
    side = min(PANEL, width // 3)
    main = width - side
    foot = min(main // CLOSE_UPS, height // 4)
    given, tall = view, height - foot
    view = given or exhibit.overview(main / tall)
    chosen = _close_up_choice(exhibit, view, (main, tall), clip)
    if not chosen:
        tall = height
        view = given or exhibit.overview(main / tall)
    layer = seen_through(artist, view, (main, tall))
    pointers = _pointers(exhibit, view, (main, tall), layer.depth, chosen, clip)
    picture = point_at(layer.image, pointers)
    if chosen:
        strip = np.tile(np.array(palette.BACKGROUND, np.uint8), (foot, main, 1))
        across = main // CLOSE_UPS
        for k, number in enumerate(chosen):
            inset = _close_up(exhibit, artist, view, number, (across - 4, foot - 4), _letter(k))
            strip[2 : foot - 2, k * across + 2 : (k + 1) * across - 2] = inset
        picture = np.concatenate([picture, strip])
    words = panel(_words(exhibit), side, height, exhibit.legend.scale)
    return np.concatenate([picture, words], axis=1)


def png(image: NDArray[np.uint8]) -> bytes:
    """A PNG file of a picture (h, w, 3)."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return file.getvalue()


def _letter(k: int) -> str:
    return "ABCDEFGH"[k]


def _screen_radius(view: Viewpoint, spot: Spot, size: tuple[int, int]) -> tuple[float, float, float, float]:
    x, y, depth = view.project(spot.centre, size)
    edge = view.project(spot.centre + spot.radius * view.axes[0], size)
    return float(x), float(y), float(depth), float(abs(edge[0] - x))


def _pointers(exhibit, view, size, depth, chosen, clip) -> list[Pointer]:
    width, height = size
    pointers = []
    several = len({spot.code for spot in exhibit.spots}) > 1
    order = [*chosen, *(k for k in range(len(exhibit.spots)) if k not in chosen)]
    for k in order[:POINTERS]:
        spot = exhibit.spots[k]
        x, y, away, radius = _screen_radius(view, spot, size)
        if away <= 0 or not (0 <= x < width and 0 <= y < height) or _cut(exhibit, spot, clip):
            continue
        pointers.append(
            Pointer(
                x, y, radius, spot.code, spot.colour, _is_hidden(exhibit, k, away, depth[int(y), int(x)]),
                spot.places, _letter(chosen.index(k)) if k in chosen else "",
                quiet=several and (spot.waived or (spot.severity == Severity.INFO and not exhibit.inside[k])),
            )
        )  # fmt: skip
    for place, text, colour in exhibit.labels:
        x, y, away = view.project(place, size)
        if away > 0 and 0 <= x < width and 0 <= y < height:
            pointers.append(Pointer(float(x), float(y), 3, text, colour, ring=False))
    return pointers


def _is_hidden(exhibit: Exhibit, k: int, away: float, depth: float) -> bool:
    return bool(exhibit.inside[k]) or away > depth + exhibit.spots[k].radius + 0.01


def _cut(exhibit: Exhibit, spot: Spot, clip: Clip | None) -> bool:
    return clip is not None and not clip.keeps(exhibit, spot.centre)


def _close_up_choice(exhibit: Exhibit, view: Viewpoint, size, clip) -> list[int]:
    """Numbers of spots that are small or hidden, one of each rule first, urgent ones first."""
    candidates = [
        k for k, spot in enumerate(exhibit.spots)
        if spot.severity != Severity.INFO and not spot.waived and not _cut(exhibit, spot, clip)
        and (exhibit.inside[k] or _screen_radius(view, spot, size)[3] < SMALL)
    ]  # fmt: skip
    first: dict[tuple[int, str], int] = {}
    for k in candidates:
        first.setdefault((exhibit.spots[k].specimen, exhibit.spots[k].code), k)
    chosen = list(first.values())[:CLOSE_UPS]
    chosen += [k for k in candidates if k not in chosen][: CLOSE_UPS - len(chosen)]
    return sorted(chosen)


def close_view(exhibit: Exhibit, number: int, aspect: float, fallback: Viewpoint | None = None) -> Viewpoint:
    """The view of one spot: from where it shows best, and most from the front."""
    spot = exhibit.spots[number]
    views = directions()
    if exhibit.inside[number]:
        direction = views[0] if fallback is None else fallback.position - fallback.target
    else:
        direction = views[int(np.argmax(exhibit.visibility.share[number] * (1.2 + views @ spot.normal)))]
    radius = _reach(exhibit, spot) / min(aspect, 1.0)
    return centred(direction, spot.centre, radius)


def _reach(exhibit: Exhibit, spot: Spot) -> float:
    """Radius of what a close-up holds: the spot and what is about it, at least some faces wide."""
    surface = exhibit.surfaces[spot.specimen]
    place = np.searchsorted(surface.source, spot.faces[:200])
    corners = surface.points[surface.faces[place[place < len(surface.faces)]]].astype(float)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    grain = 2.2 * min(float(np.median(sides.max(axis=1))), 0.2) if len(corners) else 0.04
    # long faces that fan out from a small place say little about it
    return max(1.6 * spot.radius, min(grain, 6 * spot.radius) if spot.radius > 0 else grain, 2e-5)


def _close_up(exhibit, artist, view, number, size, letter) -> NDArray[np.uint8]:
    spot = exhibit.spots[number]
    near = close_view(exhibit, number, size[0] / size[1], view)
    image = seen_through(artist, near, size).image
    where = " (inside)" if exhibit.inside[number] else ""
    mesh = exhibit.inspection.specimens[spot.specimen].mesh
    places = near.project(exhibit.frame.points_in(mesh.vertices[spot.vertices[:30]]), size)
    dots = [(x, y) for x, y, depth in places.tolist() if depth > 0 and 0 <= x < size[0] and 0 <= y < size[1]]
    return titled(image, f"{letter}  {spot.code} {spot.name}{where}", spot.colour, dots)


def _words(exhibit: Exhibit) -> list[Line]:
    """The panel: what is looked at, the verdict on it, its findings, what colours mean."""
    inspection = exhibit.inspection
    lines = [Line(inspection.title, size=18, gap=6)]
    for specimen in inspection.specimens:
        lines += _about(specimen, several=len(inspection.specimens) > 1)
    # colours that stand for findings are beside those already
    others = [entry for entry in exhibit.legend.entries if not entry[0].startswith("SSS")]
    lines += [Line(words, colour) for _, words, colour in others]
    lines.append(Line("back of a surface", palette.INSIDE))
    inside = int(exhibit.inside.sum())
    if inside:
        lines.append(Line(f"{inside} place(s) inside, which no view from outside shows, glow through", ink=_FAINT))
    lines += [Line(note, ink=_FAINT) for note in inspection.notes]
    return lines


def _about(specimen, several: bool) -> list[Line]:
    report = specimen.report
    lines = [Line(specimen.name, size=15)] if several else []
    state = report.closedness["state"] if report.closedness else "not known"
    parts = len(report.components)
    what = f"{len(specimen.mesh.faces):,} faces, {parts} component{'s' if parts != 1 else ''}"
    lines.append(Line(f"{what}; closedness: {state}", ink=_FAINT))
    if specimen.plan is not None:
        lines.append(Line(f"shader: {specimen.plan.shader}", ink=_FAINT))
    for rule in specimen.findings:
        level = "waived" if rule.reason is not None else str(rule.severity)
        lines.append(Line(f"{rule.code} {rule.name} ({level})", palette.of_rule(rule), 14, gap=0))
        lines.append(Line(f"{rule.message}", size=12, ink=_FAINT, gap=7))
    if not specimen.findings:
        lines.append(Line("nothing found", size=14))
    return lines
