"""Materials by name or file, as the commands take them."""

from __future__ import annotations

from pathlib import Path

from renderer.scene.description import Translucent
from renderer.scene.materials import read_material
from sss_tools.errors import InputError
from sss_tools.keys import Place, did_you_mean
from sss_tools.medium import PRESETS, UNITS, Medium
from sss_tools.toml_file import read_toml


def medium_of(name: str, unit: str = "mm", source: str = "--material") -> Medium:
    """The medium that a preset's name or a TOML file stands for, with coefficients per mesh unit.

    unit    what one mesh unit is
    source  who names it, for messages

    A file has the keys of a translucent ``[material.NAME]`` table of a scene, ``type`` optional, and ``unit``:
    what its own lengths are in, millimetres by default. Raises InputError for what is neither or cannot be read.
    """
    if name in PRESETS:
        return Medium.preset(name, unit)
    path = Path(name)
    if not path.is_file():
        if path.suffix:
            raise InputError(f"{source} {name}", "no such file", "check the path, or name a preset")
        raise InputError(f"{source} {name}", "no such preset, and no such file", did_you_mean(name, PRESETS))
    try:
        table = read_toml(path)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "give a readable TOML file") from None
    own_unit = table.pop("unit", "mm")
    if own_unit not in UNITS:
        raise InputError(path, f'"unit" is {own_unit!r}', f"use one of {', '.join(UNITS)}")
    material = read_material({"type": "translucent", **table}, own_unit, Place(path, "the material"))
    if not isinstance(material, Translucent):
        raise InputError(path, "the material is opaque", 'give one of type "translucent"')
    return material.medium.scaled(UNITS[unit] / UNITS[own_unit])
