"""Reading tables by description: what each key may hold, and one clear line where it holds something else.

A ``Kind`` says what a value may be, a ``Key`` adds the default, ``read_keys`` turns a TOML table into values.
Nothing here knows what a scene or a configuration is.
"""

from __future__ import annotations

import difflib
import math
import reprlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

_COMPARED = 100
"""Characters of names, and names, that are compared to find the nearest."""

REQUIRED = object()
"""The default of keys that have none."""


@dataclass(frozen=True)
class Kind:
    """What a value may be.

    expected  completes "give ..." in messages
    convert   the value from what TOML holds; raises ValueError, TypeError or OverflowError for another type
    accepts   whether the converted value is allowed
    """

    expected: str
    convert: Callable[[Any], Any]
    accepts: Callable[[Any], bool] = lambda _: True

    def read(self, value: Any) -> Any:
        """The converted value. Raises ValueError, TypeError or OverflowError for what is not of this kind."""
        result = self.convert(value)
        if not self.accepts(result):
            raise ValueError
        return result


@dataclass(frozen=True)
class Key:
    """One key of a table: its kind, and the value where it is left out (``REQUIRED``: it may not be)."""

    kind: Kind
    default: Any = REQUIRED


@dataclass(frozen=True)
class Place:
    """Where in which file something stands, for messages."""

    file: Path
    name: str

    def error(self, problem: str, remedy: str) -> InputError:
        """``FILE: problem; remedy``."""
        return InputError(self.file, problem, remedy)

    def within(self, name: str) -> Place:
        """A place in the same file."""
        return Place(self.file, name)


def read_keys(table: Any, keys: Mapping[str, Key], place: Place) -> dict[str, Any]:
    """The values of ``table``, one for each of ``keys``.

    Raises InputError for what is no table, for unknown keys (naming the nearest valid one), for missing keys
    and for values that are not of their kind.
    """
    _refuse_unknown(table, keys, place)
    return {name: _value(name, table, key, place) for name, key in keys.items()}


def read_variant(table: Any, variants: Mapping[str, Mapping[str, Key]], place: Place) -> tuple[str, dict[str, Any]]:
    """The ``type`` of ``table`` and its other values, for tables whose keys depend on their type.

    Raises InputError as ``read_keys`` does, and for unknown types.
    """
    kind = Key(one_of(variants))
    if not isinstance(table, dict) or "type" not in table:
        _refuse_unknown(table, {"type", *(name for keys in variants.values() for name in keys)}, place)
    chosen = _value("type", table, kind, place)
    values = read_keys(table, {"type": kind, **variants[chosen]}, place.within(f"{place.name} ({chosen})"))
    return values.pop("type"), values


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """A remedy that names the valid name nearest to ``name``, however far it is."""
    # names come from files, and comparing takes time of the product of their lengths
    by_lower_case = {entry[:_COMPARED].lower(): entry for entry in islice(valid, _COMPARED)}
    nearest = difflib.get_close_matches(name[:_COMPARED].lower(), by_lower_case, n=1, cutoff=0.0)
    return f'did you mean "{by_lower_case[nearest[0]]}"?' if nearest else "there is none"


def _refuse_unknown(table: Any, valid: Iterable[str], place: Place) -> None:
    if not isinstance(table, dict):
        raise place.error(f"{place.name} is {_shown(table)}", f"make it a table with the keys {_listed(valid)}")
    for name in table:
        if name not in valid:
            raise place.error(f'unknown key "{name}" in {place.name}', did_you_mean(name, valid))


def _value(name: str, table: dict, key: Key, place: Place) -> Any:
    if name not in table:
        if key.default is REQUIRED:
            raise place.error(f'missing key "{name}" in {place.name}', f"give {key.kind.expected}")
        return key.default
    try:
        return key.kind.read(table[name])
    except (ValueError, TypeError, OverflowError):
        problem = f'"{name}" in {place.name} is {_shown(table[name])}'
        raise place.error(problem, f"give {key.kind.expected}") from None


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _shown(value: Any) -> str:
    return f'"{reprlib.repr(value)[1:-1]}"' if isinstance(value, str) else reprlib.repr(value)


# ---- conversions ----


def to_number(value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    number = float(value)
    if not math.isfinite(number):
        raise ValueError
    return number


def to_vector(value: Any) -> NDArray[np.float64]:
    """A list of finite numbers, as an array; its length is for ``accepts`` to check."""
    if not isinstance(value, list):
        raise TypeError
    return np.array([to_number(entry) for entry in value])


def to_colour(value: Any) -> NDArray[np.float64]:
    """Three numbers, or one that stands for all three channels: (3,)."""
    colour = to_vector(value) if isinstance(value, list) else np.full(3, to_number(value))
    if colour.shape != (3,):
        raise ValueError
    return colour


def to_whole_numbers(value: Any) -> tuple[int, ...]:
    """A list of whole numbers, as a tuple."""
    if not isinstance(value, list) or not all(type(entry) is int for entry in value):
        raise TypeError
    return tuple(value)


def to_text(value: Any) -> str:
    """A string that is not blank."""
    if not isinstance(value, str) or not value.strip():
        raise ValueError
    return value


def one_of(words: Iterable[str]) -> Kind:
    """One of the given words."""
    words = tuple(words)
    return Kind(f"one of {_listed(words)}", to_text, words.__contains__)
