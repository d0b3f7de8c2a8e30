"""What does the light do inside?

The names below are the stable interface; they are imported when first used, so that commands start quickly.
"""

from typing import TYPE_CHECKING

from sss_tools.lazy import names_from

if TYPE_CHECKING:
    from .job import Budget, execute
    from .output.film import Film
    from .output.image import Picture
    from .render import Renderer, Settings
    from .scene.description import Scene
    from .scene.scene_file import load_scene
    from .scene.staging import stage_mesh

_HOMES = {
    "Budget": "job",
    "Film": "output.film",
    "Picture": "output.image",
    "Renderer": "render",
    "Scene": "scene.description",
    "Settings": "render",
    "execute": "job",
    "load_scene": "scene.scene_file",
    "stage_mesh": "scene.staging",
}

__all__ = [
    "Budget",
    "Film",
    "Picture",
    "Renderer",
    "Scene",
    "Settings",
    "execute",
    "load_scene",
    "stage_mesh",
]

__getattr__ = names_from(__name__, _HOMES)
