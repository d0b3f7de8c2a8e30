"""TOML files of strangers: parsed in a time and memory that their size bounds."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from .errors import InputError
from .reading import read_file

MOST_BYTES = 4 * 2**20
"""A parser in Python takes a second and 50 MB for a megabyte; a scene of a thousand objects has a fifth of one."""

MOST_PARTS = 32
"""A key of n dotted parts takes the parser time of n^2."""

_PART = rb"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rb"(?<![A-Za-z0-9_-])%b(?:[ \t]*+\.[ \t]*+%b){%d}" % (_PART, _PART, MOST_PARTS))


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises InputError for what is no TOML, is larger than ``MOST_BYTES``, or is nested beyond what the parser bears;
    OSError as ``open`` does.
    """
    data = read_file(path, MOST_BYTES)
    if _LONG_KEY.search(data):
        raise InputError(path, f"has a key of more than {MOST_PARTS} parts", "give it fewer dots")
    try:
        return tomllib.loads(data.decode().replace("\r\n", "\n"))
    # ValueError: syntax, text that is not UTF-8, and numbers of absurd length alike
    except ValueError as error:
        raise InputError(path, f"is no valid TOML: {error}", "correct the syntax") from None
    except RecursionError:
        raise InputError(path, "is no valid TOML: it is nested too deeply", "use fewer brackets") from None
