"""Drawing with pyvista and OpenGL, off screen."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from . import palette
from .exhibit import Exhibit, Strokes, Surface
from .layer import FINER, Clip, Layer, averaged
from .viewpoint import Viewpoint


class VtkArtist:
    """Draws an exhibit with VTK. Make one only where ``gl.preflight`` found that VTK can draw."""

    def __init__(self, exhibit: Exhibit, clip: Clip | None = None):
        self._exhibit, self._clip = exhibit, clip
        self._plotters: dict[tuple[bool, tuple[int, int]], Any] = {}

    def draw(self, view: Viewpoint, size: tuple[int, int], shining: bool = False) -> Layer:
        """Everything, or only what shines through, in a picture of ``size`` (width, height)."""
        fine = (size[0] * FINER, size[1] * FINER)
        plotter = self._plotter(fine, shining)
        if plotter is None:
            width, height = size
            blank = np.tile(np.array(palette.BACKGROUND, np.uint8), (height, width, 1))
            return Layer(blank, np.full((height, width), np.inf, np.float32))
        look(plotter, view)
        # VTK's own choice would cut off what is a thousand times nearer than the farthest
        distance = float(np.linalg.norm(view.target - view.position))
        farthest = distance + 4.0
        plotter.camera.clipping_range = (max(0.02 * distance, distance - 1.5), farthest)
        plotter.render()
        image = np.asarray(plotter.screenshot(return_img=True))[..., :3]
        depth = -np.asarray(plotter.get_image_depth(reset_camera_clipping_range=False), np.float32)
        # where nothing is: NaN, or the far end with its rounding
        return averaged(image, np.where(depth < 0.999 * farthest, depth, np.inf).astype(np.float32))

    def close(self) -> None:
        """Let go of VTK's windows."""
        for plotter in self._plotters.values():
            if plotter is not None:
                plotter.close()
        self._plotters.clear()

    def _plotter(self, size: tuple[int, int], shining: bool) -> Any:
        key = (shining, size)
        if key not in self._plotters:
            import pyvista

            plotter = cast(Any, pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none"))
            plotter.render_window.SetMultiSamples(0)  # pixels are averaged already
            plotter.add_light(pyvista.Light(light_type="headlight"))
            plotter.set_background(palette.BACKGROUND)
            drawn = fill(plotter, self._exhibit, self._clip, shining, FINER)
            self._plotters[key] = plotter if drawn else None
        return self._plotters[key]


def look(plotter: Any, view: Viewpoint) -> None:
    """Put a plotter's camera at a viewpoint."""
    plotter.camera.position = tuple(view.position)
    plotter.camera.focal_point = tuple(view.target)
    plotter.camera.up = tuple(view.up)
    plotter.camera.view_angle = view.fov


def fill(plotter: Any, exhibit: Exhibit, clip: Clip | None = None, shining: bool = False, finer: int = 1) -> int:
    """Put an exhibit into a plotter whose pixels are ``finer`` times smaller; returns how many things were put in."""
    drawn = 0
    for surface in exhibit.surfaces:
        faces = np.flatnonzero(surface.shining) if shining else np.arange(len(surface.faces))
        if len(faces):
            for actor in add_surface(plotter, surface, faces):
                clipped(actor, exhibit, clip)
            drawn += 1
    for strokes in exhibit.strokes:
        if len(strokes.ends) and (strokes.shining or not shining):
            clipped(add_strokes(plotter, strokes, finer), exhibit, clip)
            drawn += 1
    return drawn


def add_surface(plotter: Any, surface: Surface, faces) -> list[Any]:
    """Put some faces of a surface into a plotter, fronts and backs; returns their actors."""
    import pyvista

    body = pyvista.PolyData.from_regular_faces(surface.points.astype(float), surface.faces[faces])
    body.cell_data["colour"] = surface.colours[faces]
    common = {
        "smooth_shading": False, "ambient": 0.35, "diffuse": 0.65, "specular": 0.0,
        "show_scalar_bar": False, "reset_camera": False, "render": False,
    }  # fmt: skip
    # VTK gives both sides of a face the same scalars
    front = plotter.add_mesh(body, scalars="colour", rgb=True, culling="back", **common)
    behind = body.copy(deep=False)
    behind.cell_data["colour"] = surface.backs[faces]
    back = plotter.add_mesh(behind, scalars="colour", rgb=True, culling="front", **common)
    return [front, back]


def add_strokes(plotter: Any, strokes: Strokes, finer: int = 1) -> Any:
    """Put lines into a plotter, as tubes of one width on the screen; returns the actor."""
    import pyvista

    points = strokes.ends.reshape(-1, 3)
    number = np.arange(len(points)).reshape(-1, 2)
    lines = pyvista.PolyData(points, lines=np.column_stack([np.full(len(number), 2), number]).ravel())
    actor = plotter.add_mesh(
        lines, color=strokes.colour, line_width=finer * strokes.width, render_lines_as_tubes=strokes.width > 3,
        lighting=False, show_scalar_bar=False, reset_camera=False, render=False,
    )  # fmt: skip
    # lines on a surface win over it
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-1, -4)
    return actor


def clipped(actor: Any, exhibit: Exhibit, clip: Clip | None) -> None:
    """Cut an actor off at the planes of a clip."""
    if clip is None:
        return
    from vtkmodules.vtkCommonDataModel import vtkPlane

    for limit, sign in zip(clip.planes(exhibit), (1.0, -1.0), strict=True):
        plane = vtkPlane()
        normal, origin = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        normal[clip.axis], origin[clip.axis] = sign, float(limit)
        plane.SetNormal(*normal)
        plane.SetOrigin(*origin)
        actor.mapper.AddClippingPlane(plane)
