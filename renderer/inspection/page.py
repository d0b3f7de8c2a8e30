"""One HTML page with everything in it: the view, the findings and why they matter, the record, a render."""

from __future__ import annotations

import base64
import html
import json
import re
import zlib
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.validation.outcome import Outcome, RuleReport, Severity

from . import palette
from .exhibit import Exhibit, Surface
from .layer import Clip
from .simplification import simplified
from .specimen import Specimen
from .spots import faces_of
from .still import close_view
from .viewpoint import Viewpoint

FACES = 400_000
"""Most faces that a page draws; larger surfaces are simplified, but for what shines through."""
ASPECT = 1.2


def render_page(exhibit: Exhibit, picture: bytes | None = None, clip: Clip | None = None) -> str:
    """The page. It needs no network and no other file.

    picture  a PNG to show beside the findings, a render perhaps
    """
    parts = {
        "@TITLE@": html.escape(exhibit.inspection.title),
        "@BODY@": "\n".join([*_verdicts(exhibit), *_picture(picture), *_records(exhibit)]),
        # inside a script element only "<" could end it
        "@DATA@": json.dumps(_data(exhibit, clip), allow_nan=False).replace("<", "\\u003c"),
        "@VIEWER@": _resource("viewer.js"),
    }
    # all at once: what was put in, a file's name perhaps, is not looked at again
    return re.sub("|".join(parts), lambda mark: parts[mark[0]], _resource("page.html"))


def _resource(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


# ---- for the viewer ----


def _data(exhibit: Exhibit, clip: Clip | None) -> dict[str, Any]:
    total = sum(len(surface.faces) for surface in exhibit.surfaces)
    bounds = exhibit.frame.points_in(exhibit.inspection.bounds)
    findings = _findings(exhibit)
    return {
        "names": [specimen.name for specimen in exhibit.inspection.specimens],
        "surfaces": [_surface(part) for surface in exhibit.surfaces for part in _lighter(surface, FACES / total)],
        "strokes": [
            {"ends": _packed(s.ends, "<f4"), "colour": list(s.colour), "width": s.width, "shining": s.shining}
            for s in exhibit.strokes
        ],
        "spots": [_spot(exhibit, number) for number in range(len(exhibit.spots))],
        "findings": findings,
        "view": _view(exhibit.overview(ASPECT)),
        "bounds": bounds.tolist(),
        "clip": None if clip is None else {"axis": clip.axis, "limits": list(clip.planes(exhibit))},
        "inside": list(palette.INSIDE),
        "wall": list(palette.WALL),
        "background": list(palette.BACKGROUND),
    }


def _packed(array: NDArray, kind: str) -> str:
    """An array as the viewer unpacks it: little-endian, deflated, in base 64."""
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).astype(kind).tobytes(), 6)).decode()


def _lighter(surface: Surface, share: float) -> list[Surface]:
    """The surface; where it is too large, a simplified one, and what shines through in full."""
    if share >= 1:
        return [surface]
    return [simplified(surface, int(share * len(surface.faces))), surface.part(surface.shining)]


def _surface(surface: Surface) -> dict[str, Any]:
    used, faces = np.unique(surface.faces, return_inverse=True)
    return {
        "number": surface.number,
        "points": _packed(surface.points[used], "<f4"),
        "faces": _packed(faces, "<u4"),
        "colours": _packed(surface.colours, "u1"),
        "shining": _packed(surface.shining, "u1"),
        "source": _packed(surface.source, "<u4"),
    }


def _view(view: Viewpoint) -> dict[str, Any]:
    back = view.position - view.target
    return {
        "target": view.target.tolist(),
        "back": back.tolist(),
        "distance": float(np.linalg.norm(back)),
        "fov": view.fov,
    }


def _spot(exhibit: Exhibit, number: int) -> dict[str, Any]:
    spot = exhibit.spots[number]
    return {
        "code": spot.code,
        "name": spot.name,
        "centre": spot.centre.tolist(),
        "radius": spot.radius,
        "colour": list(spot.colour),
        "inside": bool(exhibit.inside[number]),
        "quiet": spot.waived or spot.severity == Severity.INFO,
        "view": _view(close_view(exhibit, number, ASPECT, exhibit.overview(ASPECT))),
    }


def _findings(exhibit: Exhibit) -> list[dict[str, Any]]:
    """One entry for each row of the table, in its order."""
    return [
        {
            "specimen": number,
            "code": rule.code,
            "name": rule.name,
            "faces": _packed(faces_of(rule), "<u4"),
            "spots": [k for k, spot in enumerate(exhibit.spots) if (spot.specimen, spot.code) == (number, rule.code)],
        }
        for number, specimen in enumerate(exhibit.inspection.specimens)
        for rule in specimen.findings
    ]


# ---- for readers ----


def _verdicts(exhibit: Exhibit) -> list[str]:
    specimens = exhibit.inspection.specimens
    parts, row = [], 0
    for specimen in specimens:
        parts.append(_verdict(specimen, len(specimens) > 1))
        if specimen.findings:
            rows = [_row(rule, row + k) for k, rule in enumerate(specimen.findings)]
            parts.append(f"<table>{''.join(rows)}</table>")
            row += len(rows)
        else:
            parts.append("<p>Nothing found.</p>")
        parts.append(_not_run(specimen))
    entries = [(words, colour) for key, words, colour in exhibit.legend.entries if not key.startswith("SSS")]
    entries.append(("back of a surface", palette.INSIDE))
    legend = "".join(f"<div>{_patch(colour)}{html.escape(words)}</div>" for words, colour in entries)
    if exhibit.legend.scale is not None:
        legend = f"<p>{html.escape(', '.join(exhibit.legend.scale))} (red to blue)</p>{legend}"
    parts.append(f"<h2>Colours</h2>{legend}")
    parts += [f'<p class="faint">{html.escape(note)}</p>' for note in exhibit.inspection.notes]
    return parts


def _verdict(specimen: Specimen, several: bool) -> str:
    report, closedness = specimen.report, specimen.report.closedness
    head = f"<h2>{html.escape(specimen.name)}</h2>" if several else ""
    facts = [f"{len(specimen.mesh.faces):,} faces", f"{len(report.components)} component(s)"]
    if closedness is not None:
        facts += [f"closedness: {closedness['state']}", f"hole handling: {closedness['hole_handling']}"]
    roles = [part["role"] for part in report.components]
    facts += [f"{roles.count(role)} {role}" for role in palette.ROLES if role in roles]
    if specimen.plan is not None:
        facts.append(f"shader: {specimen.plan.shader} ({specimen.plan.reason})")
    return head + f"<p>{html.escape('; '.join(facts))}</p>"


def _row(rule: RuleReport, number: int) -> str:
    level = f"waived: {rule.reason}" if rule.outcome == Outcome.WAIVED else str(rule.severity)
    return (
        f'<tr class="finding" data-finding="{number}" tabindex="0"><td>{_patch(palette.of_rule(rule))}'
        f"<b>{rule.code}</b> {html.escape(rule.name)} <span class=level>{html.escape(level)}</span><br>"
        f"{html.escape(rule.message)}<p class=why>{html.escape(rule.why)}</p></td></tr>"
    )


def _not_run(specimen: Specimen) -> str:
    lines = [
        f"not run ({html.escape(reason)}): {' '.join(rule.code for rule in rules)}"
        for reason, rules in specimen.report.not_run.items()
    ]
    return "".join(f'<p class="faint">{line}</p>' for line in lines)


def _patch(colour: palette.Colour) -> str:
    return f'<span class="patch" style="background: rgb{colour}"></span>'


def _picture(picture: bytes | None) -> list[str]:
    if picture is None:
        return []
    data = base64.b64encode(picture).decode()
    return [f'<h2>Render</h2><img alt="the render" src="data:image/png;base64,{data}">']


def _records(exhibit: Exhibit) -> list[str]:
    parts = []
    for specimen in exhibit.inspection.specimens:
        if specimen.record is not None:
            text = html.escape(json.dumps(_brief(specimen.record), indent=1))
            name = html.escape(specimen.name)
            parts.append(f"<h2>Record</h2><details><summary>{name}.sss.json</summary><pre>{text}</pre></details>")
    return parts


def _brief(value: Any) -> Any:
    """The record with long lists of indices cut short."""
    if isinstance(value, dict):
        return {key: _brief(entry) for key, entry in value.items()}
    if isinstance(value, list):
        short = [_brief(entry) for entry in value[:12]]
        return [*short, f"... {len(value) - 12} more"] if len(value) > 12 else short
    return value
