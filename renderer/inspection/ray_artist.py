"""Drawing with our own rays: no OpenGL, no display, nothing but Embree and Pillow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sss_tools.rays import RayCaster

from . import palette
from .exhibit import Exhibit, Surface, joined
from .layer import FINER, NEARER, Clip, Layer, averaged
from .viewpoint import Viewpoint


class RayArtist:
    """Draws an exhibit by one ray a sample: colours by face, shaded by a lamp at the camera."""

    def __init__(self, exhibit: Exhibit, clip: Clip | None = None):
        self._exhibit, self._clip = exhibit, clip
        surfaces = exhibit.surfaces
        self._all = _Triangles(surfaces)
        self._shining = _Triangles(tuple(surface.part(surface.shining) for surface in surfaces))

    def draw(self, view: Viewpoint, size: tuple[int, int], shining: bool = False) -> Layer:
        """Everything, or only what shines through, in a picture of ``size`` (width, height)."""
        fine = (size[0] * FINER, size[1] * FINER)
        colour, depth = self._trace(self._shining if shining else self._all, view, fine)
        self._strokes(colour, depth, view, fine, shining)
        return averaged(colour, depth)

    def _trace(self, triangles: _Triangles, view: Viewpoint, size: tuple[int, int]):
        width, height = size
        direction = view.rays(size)
        colour = np.tile(np.array(palette.BACKGROUND, float), (width * height, 1))
        depth = np.full(width * height, np.inf, np.float32)
        if triangles.caster is None:
            return colour.reshape(height, width, 3), depth.reshape(height, width)
        enter, leave = self._range(view, direction)
        origin = np.ascontiguousarray((view.position[:, None] + enter * direction).astype(np.float32))
        distance, hit = triangles.caster.closest(origin, direction, np.maximum(leave - enter, 0).astype(np.float32))
        found = np.flatnonzero((hit >= 0) & (leave > enter))
        face = hit[found]
        facing = np.einsum("ij,ij->i", triangles.normals[face], direction[:, found].T)
        base = np.where((facing < 0)[:, None], triangles.colours[face], triangles.backs[face])
        colour[found] = base * (0.35 + 0.65 * np.abs(facing))[:, None]
        depth[found] = (distance[found] + enter[found]) * (view.axes[2] @ direction[:, found])
        return colour.reshape(height, width, 3), depth.reshape(height, width)

    def _range(self, view: Viewpoint, direction: NDArray[np.float32]):
        """Where each ray enters and leaves what is kept."""
        n = direction.shape[1]
        enter, leave = np.zeros(n), np.full(n, 1e6)
        if self._clip is not None:
            along = direction[self._clip.axis].astype(float)
            along = np.where(np.abs(along) < 1e-12, 1e-12, along)
            limits = [(limit - view.position[self._clip.axis]) / along for limit in self._clip.planes(self._exhibit)]
            enter = np.maximum(enter, np.minimum(*limits))
            leave = np.maximum(np.minimum(leave, np.maximum(*limits)), 0)
        return enter, leave

    def _strokes(self, colour, depth, view: Viewpoint, size: tuple[int, int], shining: bool) -> None:
        """Draw lines over the picture where nothing is clearly nearer."""
        from PIL import Image, ImageDraw

        nearer = 4 * NEARER * float(np.linalg.norm(view.target - view.position))
        for strokes in self._exhibit.strokes:
            if shining and not strokes.shining:
                continue
            ends = strokes.ends.astype(float)
            if self._clip is not None:
                ends = ends[self._clip.keeps(self._exhibit, ends).all(axis=1)]
            screen = view.project(ends, size)
            screen = screen[(screen[..., 2] > 1e-6).all(axis=1)]
            # a line of many pixels is drawn in pieces, each as deep as its middle
            mask, far = Image.new("L", size), Image.new("F", size, np.inf)
            ink, deep = ImageDraw.Draw(mask), ImageDraw.Draw(far)
            for (x0, y0, z0), (x1, y1, z1) in screen.tolist():
                pieces = int(np.clip(max(abs(x1 - x0), abs(y1 - y0)) / 24, 1, 200))
                for k in range(pieces):
                    a, b = k / pieces, (k + 1) / pieces
                    line = (x0 + a * (x1 - x0), y0 + a * (y1 - y0), x0 + b * (x1 - x0), y0 + b * (y1 - y0))
                    broad = int(strokes.width * FINER)
                    ink.line(line, 255, broad)
                    deep.line(line, z0 + (a + b) / 2 * (z1 - z0), broad)
            drawn = np.asarray(mask) > 0
            its_depth = np.asarray(far)
            drawn = drawn & (its_depth < depth + nearer)
            colour[drawn] = strokes.colour
            depth[drawn] = its_depth[drawn]


class _Triangles:
    """Surfaces together, ready for rays."""

    def __init__(self, surfaces: tuple[Surface, ...]):
        surfaces = tuple(surface for surface in surfaces if len(surface.faces))
        self.caster: RayCaster | None = None
        if not surfaces:
            return
        points, faces = joined(surfaces)
        a, b, c = (points[faces[:, k]].astype(float) for k in range(3))
        normals = np.cross(b - a, c - a)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        self.normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        self.colours = np.concatenate([surface.colours for surface in surfaces]).astype(float)
        self.backs = np.concatenate([surface.backs for surface in surfaces]).astype(float)
        self.caster = RayCaster(points, faces)
