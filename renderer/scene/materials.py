"""Materials from their tables in a scene file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sss_tools.keys import Key, Kind, Place, one_of, read_variant, to_colour, to_number
from sss_tools.medium import PRESETS, Medium

from .description import Diffuse, Material, Mirror, Translucent

_COEFFICIENT = Kind("one number or three, each 0 or more, in 1/unit", to_colour, lambda c: (c >= 0).all())
_LENGTH = Kind("one number or three, each above 0, in units", to_colour, lambda r: (r > 0).all())
_SHARE = Kind("one number or three, each from 0 to 1", to_colour, lambda c: ((c >= 0) & (c <= 1)).all())

_WAYS: dict[tuple[str, str], Callable[..., Medium]] = {
    ("sigma_a", "sigma_s"): Medium.from_coefficients,
    ("albedo", "sigma_t"): Medium.from_albedo,
    ("color", "radius"): Medium.from_color,
}
"""The three ways to say a medium beside a preset."""
_LISTED_WAYS = ", or ".join(f'"{first}" and "{second}"' for first, second in _WAYS)

_KEYS: dict[str, dict[str, Key]] = {
    "translucent": {
        "preset": Key(one_of(PRESETS), None),
        "sigma_a": Key(_COEFFICIENT, None),
        "sigma_s": Key(_COEFFICIENT, None),
        "albedo": Key(_SHARE, None),
        "sigma_t": Key(_COEFFICIENT, None),
        "color": Key(_SHARE, None),
        "radius": Key(_LENGTH, None),
        "g": Key(Kind("a mean cosine between -1 and 1", to_number, lambda g: -1 < g < 1), None),
        "ior": Key(Kind("an index of refraction, 1 or more", to_number, lambda n: n >= 1), None),
        "roughness": Key(Kind("a GGX alpha from 0 (smooth) to 1", to_number, lambda a: 0 <= a <= 1), 0.0),
    },
    "diffuse": {"reflectance": Key(_SHARE)},
    "mirror": {"reflectance": Key(_SHARE, to_colour(1.0))},
}


def read_material(table: Any, unit: str, place: Place) -> Material:
    """The material that ``table`` describes, with coefficients per scene unit.

    unit  what one scene unit is; presets, which are in 1/mm, are converted by it

    Raises InputError for unknown keys and types, missing and contradictory keys, and media that cannot be.
    """
    kind, values = read_variant(table, _KEYS, place)
    if kind == "translucent":
        return Translucent(_medium(values, unit, place), values["roughness"])
    return Mirror(**values) if kind == "mirror" else Diffuse(**values)


def _medium(values: dict[str, Any], unit: str, place: Place) -> Medium:
    ways = [way for way in _WAYS if any(values[name] is not None for name in way)]
    if len(ways) > 1:
        given = " and ".join(f'"{name}"' for way in ways for name in way if values[name] is not None)
        raise place.error(f"{place.name} says its medium twice, by {given}", f"keep either {_LISTED_WAYS}")
    if not ways and values["preset"] is None:
        raise place.error(f"{place.name} says no medium", f'give "preset", or {_LISTED_WAYS}')
    way = ways[0] if ways else ("sigma_a", "sigma_s")
    optional = {name: values[name] for name in ("g", "ior") if values[name] is not None}
    try:
        if values["preset"] is not None:
            base = _preset(values["preset"], unit, optional)
            optional = {"g": base.g, "ior": base.ior}
            for name, value in _said_by(base).items():
                values[name] = value if values[name] is None else values[name]
        missing = [name for name in way if values[name] is None]
        if missing:
            raise place.error(f'missing key "{missing[0]}" in {place.name}', f"give {_LISTED_WAYS}")
        return _WAYS[way](*(values[name] for name in way), **optional)
    except ValueError as error:
        raise place.error(f"in {place.name}, {error}", "correct the medium") from None


def _preset(name: str, unit: str, optional: dict[str, float]) -> Medium:
    """The preset; another ``g`` keeps its reduced scattering coefficient, which is what was measured."""
    measured = Medium.preset(name, unit)
    g, ior = optional.get("g", measured.g), optional.get("ior", measured.ior)
    return Medium.from_coefficients(measured.sigma_a, measured.reduced_scattering / (1 - g), g=g, ior=ior)


def _said_by(medium: Medium) -> dict[str, Any]:
    """What a medium gives for the keys left out; a colour cannot be kept while the radius changes."""
    return {
        "sigma_a": medium.sigma_a,
        "sigma_s": medium.sigma_s,
        "albedo": medium.single_scattering_albedo,
        "sigma_t": medium.sigma_t,
        "radius": medium.transport_mean_free_path,
    }
