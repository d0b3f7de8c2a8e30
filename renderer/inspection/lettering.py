"""Words on pictures: rings round findings, labels that point at them, panels with what they mean."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import palette
from .palette import BACKGROUND, INK, Colour, mixed

RING = 9
"""Least radius of a ring round a finding, pixels, however small the finding and however far."""
LARGEST = 75
"""Greatest radius of a ring, pixels."""
NEAR = 46
"""Labels of one rule that point less far apart than this, pixels, are one."""
GAP = 4


@lru_cache
def font(size: int) -> Any:
    """Pillow's own typeface at a size in pixels."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


def legible(text: str) -> str:
    """The text in letters that the typeface has, which are ASCII: accents go, of other scripts question marks stay."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(c for c in plain if not unicodedata.combining(c)).encode("ascii", "replace").decode()


@dataclass
class Pointer:
    """Something to point at in a picture.

    x, y    where, pixels
    radius  of what is pointed at, pixels
    hidden  behind something: its ring is broken
    places  how many it stands for
    letter  of its close-up, or ""
    ring    whether there is a ring round it
    quiet   good to know: a dot instead of a ring, and one label for all with these words
    """

    x: float
    y: float
    radius: float
    words: str
    colour: Colour
    hidden: bool = False
    places: int = 1
    letter: str = ""
    ring: bool = True
    quiet: bool = False


def point_at(image: NDArray[np.uint8], pointers: list[Pointer]) -> NDArray[np.uint8]:
    """The picture with a ring round everything pointed at, and labels along the sides with lines to the rings."""
    from PIL import Image, ImageDraw

    height, width = image.shape[:2]
    large = Image.fromarray(image).resize((2 * width, 2 * height), Image.Resampling.BILINEAR)
    draw = ImageDraw.Draw(large)
    for pointer in pointers:
        if pointer.quiet:
            draw.ellipse([2 * value + d for d in (-5, 5) for value in (pointer.x, pointer.y)], pointer.colour)
        elif pointer.ring:
            _ring(draw, pointer)
    labels = _gathered(pointers)
    placed = _placed(labels, width, height)
    for (left, top, right, bottom), pointer in placed:
        side = right if pointer.x > right else left if pointer.x < left else (left + right) / 2
        start = np.array([side, (top + bottom) / 2])
        end = np.array([pointer.x, pointer.y])
        reach = np.linalg.norm(end - start)
        if reach > 1:
            short = max(pointer.radius, RING) if pointer.ring and 1.15 * pointer.radius <= LARGEST else 2
            tip = end - (end - start) / reach * min(short, reach)
            draw.line([*(2 * start), *(2 * tip)], mixed(pointer.colour, INK, 0.25), 2)
    for box, pointer in placed:
        left, top, right, bottom = (2 * value for value in box)
        draw.rounded_rectangle((left, top, right, bottom), 8, (255, 255, 255), mixed(pointer.colour, INK, 0.2), 3)
        draw.text((left + 10, top + 3), _words(pointer), mixed(pointer.colour, (0, 0, 0), 0.35), font(26))
    return np.asarray(large.resize((width, height), Image.Resampling.BOX))


def _ring(draw: Any, pointer: Pointer) -> None:
    radius = 2 * max(1.15 * pointer.radius, RING)
    if radius > 2 * LARGEST:
        return  # large enough to be seen: a ring would only be in the way
    box = (2 * pointer.x - radius, 2 * pointer.y - radius, 2 * pointer.x + radius, 2 * pointer.y + radius)
    if not pointer.hidden:
        draw.ellipse(box, None, (255, 255, 255), 9)
        draw.ellipse(box, None, pointer.colour, 5)
        return
    for start in range(0, 360, 45):
        draw.arc(box, start, start + 27, pointer.colour, 5)


def _words(pointer: Pointer) -> str:
    words = legible(pointer.words) + (f" x{pointer.places}" if pointer.places > 1 else "")
    return f"{pointer.letter}  {words}" if pointer.letter else words


def _gathered(pointers: list[Pointer]) -> list[Pointer]:
    """One label for what is close together and has the same words; those with a letter keep theirs."""
    kept: list[Pointer] = []
    for pointer in pointers:
        for other in kept:
            near = pointer.quiet or np.hypot(other.x - pointer.x, other.y - pointer.y) < NEAR
            if other.words == pointer.words and near and not pointer.letter:
                other.places += pointer.places
                break
        else:
            kept.append(Pointer(**vars(pointer)))
    # too many labels hide what they point at: the rest of a rule goes with its nearest
    while len(kept) > 26:
        last = kept.pop()
        same = [other for other in kept if other.words == last.words]
        if same:
            min(same, key=lambda other: np.hypot(other.x - last.x, other.y - last.y)).places += last.places
    return kept


def _placed(labels: list[Pointer], width: int, height: int):
    """Boxes (left, top, right, bottom) for labels, in a column at each side, apart from each other."""
    placed = []
    for side in (0, 1):
        column = sorted((p for p in labels if (p.x > width / 2) == bool(side)), key=lambda p: p.y)
        rows = [20.0] * len(column)
        room = height - 2 * GAP
        top = [min(max(p.y - 10, GAP), room - 20) for p in column]
        step = min(24.0, room / max(len(column), 1))
        for k in range(1, len(column)):
            top[k] = max(top[k], top[k - 1] + step)
        over = top[-1] + 20 - room if column else 0
        for k in range(len(column) - 1, -1, -1):
            limit = room - 20 if k == len(column) - 1 else top[k + 1] - step
            if over > 0:
                top[k] = min(top[k], limit)
        for y, row, pointer in zip(top, rows, column, strict=True):
            long = font(13).getlength(_words(pointer)) + 11
            left = width - GAP - long if side else GAP
            placed.append(((left, y, left + long, y + row), pointer))
    return placed


# ---- panels ----


@dataclass(frozen=True)
class Line:
    """A line of a panel: words, with a patch of colour before them."""

    words: str
    colour: Colour | None = None
    size: int = 13
    ink: Colour = INK
    gap: int = 3


def panel(lines: list[Line], width: int, height: int, ramp: tuple[str, str, str, str] | None = None):
    """(h, w, 3) uint8: lines under each other, broken at the width; what does not fit is left out, and said to be."""
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (width, height), BACKGROUND)
    draw = ImageDraw.Draw(picture)
    y = 8
    if ramp is not None:
        y = _draw_ramp(draw, ramp, width, y)
    for number, line in enumerate(lines):
        indent = 10 + (20 if line.colour is not None else 0)
        rows = wrapped(line.words, width - indent - 8, line.size)
        if y + (line.size + 3) * len(rows) > height - 18 and number < len(lines) - 1:
            draw.text((10, y), f"... and {len(lines) - number} more lines", mixed(INK, BACKGROUND, 0.4), font(12))
            break
        if line.colour is not None:
            draw.rectangle((10, y + 2, 23, y + 2 + line.size - 1), line.colour, INK)
        for row in rows:
            draw.text((indent, y), row, line.ink, font(line.size))
            y += line.size + 3
        y += line.gap
    return np.asarray(picture)


def _draw_ramp(draw: Any, words: tuple[str, str, str, str], width: int, y: int) -> int:
    draw.text((10, y), words[0], INK, font(13))
    across = width - 20
    colours = palette.ramp(np.linspace(0, 1, across))
    for k, colour in enumerate(colours.tolist()):
        draw.line((10 + k, y + 20, 10 + k, y + 34), tuple(colour))
    for place, text in zip((0, 0.5, 1), words[1:], strict=True):
        long = font(12).getlength(text)
        draw.text((10 + place * (across - long), y + 37), text, INK, font(12))
    return y + 60


def wrapped(text: str, width: float, size: int) -> list[str]:
    """The text in rows that fit ``width`` pixels."""
    rows, row = [], ""
    for word in legible(text).split():
        longer = f"{row} {word}".strip()
        if font(size).getlength(longer) > width and row:
            rows.append(row)
            row = word
        else:
            row = longer
    return [*rows, row]


def titled(image: NDArray[np.uint8], words: str, colour: Colour, dots=()) -> NDArray[np.uint8]:
    """The picture with a coloured frame, a title in its corner, and dots at places (x, y)."""
    from PIL import Image, ImageDraw

    picture = Image.fromarray(image)
    draw, words = ImageDraw.Draw(picture), legible(words)
    height, width = image.shape[:2]
    for x, y in dots:
        draw.ellipse((x - 5, y - 5, x + 5, y + 5), colour, (255, 255, 255), 2)
    draw.rectangle((0, 0, width - 1, height - 1), None, colour, 3)
    draw.rectangle((0, 0, font(13).getlength(words) + 14, 21), colour)
    draw.text((7, 3), words, (255, 255, 255), font(13))
    return np.asarray(picture)
