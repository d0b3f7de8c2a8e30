"""Is this mesh fit for subsurface scattering, and can it be made so?

The names below are the stable interface; they are imported when first used, so that commands start quickly.
"""

from typing import TYPE_CHECKING

from .lazy import names_from

if TYPE_CHECKING:
    from .closedness import Closedness, assess
    from .errors import InputError
    from .loading import load_mesh
    from .medium import PRESETS, Medium
    from .mesh import Mesh
    from .record import read_record, write_record
    from .validation.run import check_mesh
    from .writing import write_mesh

_HOMES = {
    "Closedness": "closedness",
    "InputError": "errors",
    "Medium": "medium",
    "Mesh": "mesh",
    "PRESETS": "medium",
    "assess": "closedness",
    "check_mesh": "validation.run",
    "load_mesh": "loading",
    "read_record": "record",
    "write_mesh": "writing",
    "write_record": "record",
}

__all__ = [
    "PRESETS",
    "Closedness",
    "InputError",
    "Medium",
    "Mesh",
    "assess",
    "check_mesh",
    "load_mesh",
    "read_record",
    "write_mesh",
    "write_record",
]

__getattr__ = names_from(__name__, _HOMES)
