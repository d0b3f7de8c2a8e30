"""Which colour means what. All colours are sRGB, 0 to 255; those of plain surfaces are the thumbnails', too."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools import thumbnail
from sss_tools.validation.outcome import RuleReport, Severity

Colour = tuple[int, int, int]

WALL: Colour = thumbnail.COLOURS[0]
"""Surface with nothing wrong."""
INSIDE: Colour = thumbnail.INSIDE
BACKGROUND: Colour = thumbnail.BACKGROUND
CAP: Colour = (150, 205, 235)
INK: Colour = (38, 38, 42)
CAMERA: Colour = (60, 60, 70)
LIGHT: Colour = (214, 150, 0)
UNKNOWN: Colour = (176, 176, 180)
"""Where a quantity has no value."""

RULES: dict[str, Colour] = {
    "SSS101": (226, 26, 28),
    "SSS102": (255, 127, 0),
    "SSS103": (240, 60, 160),
    "SSS201": (152, 40, 190),
    "SSS202": (110, 60, 220),
    "SSS203": (0, 110, 220),
    "SSS204": (0, 60, 160),
    "SSS301": (230, 30, 100),
    "SSS302": (200, 60, 0),
    "SSS303": (170, 110, 0),
    "SSS304": (140, 0, 60),
    "SSS305": (30, 150, 170),
    "SSS401": (200, 160, 0),
    "SSS402": (130, 150, 40),
    "SSS403": (100, 120, 120),
    "SSS404": (90, 140, 100),
    "SSS501": (0, 140, 90),
    "SSS502": (120, 120, 200),
    "SSS503": (60, 130, 40),
    "SSS601": (90, 90, 200),
    "SSS602": (160, 0, 160),
    "SSS701": (90, 90, 90),
    "SSS702": (90, 90, 90),
}
"""Of each rule; loud for what ruins light, duller for what is good to know."""

ROLES: dict[str, Colour] = {
    "solid": WALL,
    "cavity": (60, 160, 205),
    "internal": (230, 30, 100),
    "sheet": (255, 150, 40),
}

COMPONENTS: tuple[Colour, ...] = (
    *thumbnail.COLOURS, (170, 200, 100), (110, 195, 205), (230, 165, 200), (190, 170, 130)
)  # fmt: skip
"""Of components of one role, in turn."""

SHADERS: dict[str, Colour] = {
    "path": (214, 96, 77),
    "plumb": (244, 180, 80),
    "scalar": (116, 173, 209),
    "diffuse": (171, 190, 170),
    "opaque": (160, 160, 160),
    "mirror": (200, 210, 225),
}

RAMP = np.array(
    [(165, 0, 38), (215, 48, 39), (244, 109, 67), (253, 174, 97), (254, 224, 144),
     (224, 243, 248), (171, 217, 233), (116, 173, 209), (69, 117, 180), (49, 54, 149)], float
)  # fmt: skip
"""From too little to plenty: ColorBrewer's RdYlBu, which the colour-blind can tell apart."""


def of_rule(rule: RuleReport) -> Colour:
    """The colour of a rule's findings; half as loud for information and for what is waived."""
    colour = RULES.get(rule.code, (90, 90, 90))
    quiet = rule.severity == Severity.INFO and rule.code != "SSS305"
    return mixed(colour, WALL, 0.4) if quiet or rule.reason is not None else colour


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """``colour`` with ``share`` of another one in it."""
    first, second = np.array(colour, float), np.array(other, float)
    red, green, blue = np.rint(first + share * (second - first)).astype(int).tolist()
    return red, green, blue


def ramp(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(n, 3) colours of values (n,) from 0, too little, to 1, plenty; grey where a value is not finite."""
    known = np.isfinite(values)
    place = np.clip(np.where(known, values, 0), 0, 1) * (len(RAMP) - 1)
    steps = np.arange(len(RAMP))
    colours = np.stack([np.interp(place, steps, RAMP[:, channel]) for channel in range(3)], axis=-1)
    colours[~known] = UNKNOWN
    return np.rint(colours).astype(np.uint8)
