"""A window to turn an inspection in: a click asks a face, n and p go from finding to finding."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from . import palette
from .exhibit import Exhibit
from .layer import Clip
from .simplification import simplified
from .spots import faces_of
from .still import close_view
from .viewpoint import Viewpoint
from .vtk_artist import add_strokes, add_surface, clipped, look

LIGHT = 80_000
"""Most faces drawn while the view turns; at rest all are. Software takes a tenth of a second for them, on two cores."""
XRAY = 0.3
"""How opaque the wall is while what is inside is to be seen."""
HELP = "n next finding   p previous   x through the wall   r whole   click: what is this face?   q quit"


class Window:
    """A pyvista window on an exhibit.

    spot  number of the spot gone to last, -1 for none
    told  what it says at the bottom
    """

    def __init__(self, exhibit: Exhibit, clip: Clip | None = None, size: tuple[int, int] = (1200, 850)):
        import pyvista

        self.exhibit, self.spot, self.told, self.xray = exhibit, -1, "", False
        self._clip, self._size = clip, size
        plotter = pyvista.Plotter(window_size=list(size), lighting="none", title=exhibit.inspection.title)
        self.plotter = cast(Any, plotter)
        self.plotter.add_light(pyvista.Light(light_type="headlight"))
        self.plotter.set_background(palette.BACKGROUND)
        self.plotter.renderer.SetNearClippingPlaneTolerance(1e-5)  # close-ups are near
        self.plotter.render_window.SetMultiSamples(0)  # software takes as long for them as for all the rest
        self._fine: list[Any] = []
        self._coarse: list[Any] = []
        self._glow: list[Any] = []
        self._fill()
        self._write(HELP)
        self._listen()
        self.whole()

    def run(self) -> None:
        """Show the window until it is closed."""
        self.plotter.show(auto_close=True)

    def close(self) -> None:
        """Close it."""
        self.plotter.close()

    # ---- what it can do ----

    def whole(self) -> None:
        """Show everything."""
        self.spot = -1
        self._look(self.exhibit.overview(self._size[0] / self._size[1]))

    def jump(self, step: int) -> None:
        """Go on, or back, to another place of a finding; what is inside is shown through the wall."""
        spots = self.exhibit.spots
        if not spots:
            self._write("nothing was found")
            return
        self.spot = (self.spot + step) % len(spots) if self.spot >= 0 or step > 0 else len(spots) - 1
        spot = spots[self.spot]
        inside = bool(self.exhibit.inside[self.spot])
        self.look_through(inside)
        self._look(close_view(self.exhibit, self.spot, self._size[0] / self._size[1]))
        where = ", inside" if inside else ""
        self._write(f"{spot.code} {spot.name}{where}   ({self.spot + 1} of {len(spots)} places)\n{HELP}")

    def look_through(self, through: bool) -> None:
        """Make the wall translucent, or solid again."""
        self.xray = through
        for actor in (*self._fine, *self._coarse):
            actor.prop.opacity = XRAY if through else 1.0
        for actor in self._glow:
            actor.visibility = through
        self.plotter.render()

    def ask(self, x: float, y: float) -> None:
        """Say what is known of the face at a place of the window, pixels from the lower left."""
        from vtkmodules.vtkRenderingCore import vtkCellPicker

        picker = vtkCellPicker()
        picker.SetTolerance(0)
        picker.PickFromListOn()
        self.show_fine(True)
        for actor in self._fine:
            picker.AddPickList(actor)
        picker.Pick(x, y, 0, self.plotter.renderer)
        actor, cell = picker.GetActor(), picker.GetCellId()
        if actor is None or cell < 0:
            self._write(HELP)
            return
        surface = next(s for a, s in zip(self._fine, self._surface_of, strict=True) if a is actor)
        if surface.number < 0:
            self._write("a cap over a hole")
            return
        face = int(surface.source[cell])
        specimen = self.exhibit.inspection.specimens[surface.number]
        found = [f"{rule.code} {rule.name}" for rule in specimen.findings if face in faces_of(rule)]
        several = len(self.exhibit.inspection.specimens) > 1
        name = f"{specimen.name}, " if several else ""
        self._write(f"{name}face {face}: {', '.join(found) or 'no finding'}\n{HELP}")

    # ---- how ----

    def _fill(self) -> None:
        exhibit, plotter = self.exhibit, self.plotter
        total = sum(len(surface.faces) for surface in exhibit.surfaces)
        self._surface_of = []
        for surface in exhibit.surfaces:
            every = np.arange(len(surface.faces))
            actors = add_surface(plotter, surface, every)
            self._fine += actors
            self._surface_of += [surface] * len(actors)
            if total > LIGHT:
                light = simplified(surface, max(int(LIGHT * len(surface.faces) / total), 100))
                fronts, backs = add_surface(plotter, light, np.arange(len(light.faces)))
                fronts.prop.culling = "none"  # one pass while it turns
                plotter.remove_actor(backs, reset_camera=False, render=False)
                self._coarse.append(fronts)
            if surface.shining.any():
                self._glow += add_surface(plotter, surface, np.flatnonzero(surface.shining))
        strokes = [add_strokes(plotter, strokes) for strokes in exhibit.strokes if len(strokes.ends)]
        for actor in (*self._fine, *self._coarse, *self._glow, *strokes):
            clipped(actor, exhibit, self._clip)
        for actor in self._glow:
            actor.visibility = False
        self._label()
        self.show_fine(True)

    def _label(self) -> None:
        """A dot and the code at every place, as large on the screen from near and far."""
        spots = [spot for spot in self.exhibit.spots if spot.severity != "info" and not spot.waived]
        spots = spots or list(self.exhibit.spots)
        for code in dict.fromkeys(spot.code for spot in spots):
            group = [spot for spot in spots if spot.code == code]
            self.plotter.add_point_labels(
                np.array([spot.centre for spot in group]), [code] * len(group), font_size=13, point_size=9,
                point_color=group[0].colour, text_color=palette.mixed(group[0].colour, (0, 0, 0), 0.4),
                shape_color="white", shape_opacity=0.75, margin=2, always_visible=True, reset_camera=False,
                render=False, render_points_as_spheres=False,
            )  # fmt: skip
        for place, words, colour in self.exhibit.labels:
            self.plotter.add_point_labels(
                place[None], [words], font_size=13, show_points=False, text_color=colour, shape_opacity=0.5,
                always_visible=True, reset_camera=False, render=False,
            )  # fmt: skip

    def _listen(self) -> None:
        plotter = self.plotter
        for key, act in (
            ("n", lambda: self.jump(1)), ("p", lambda: self.jump(-1)), ("r", self.whole),
            ("x", lambda: self.look_through(not self.xray)),
        ):  # fmt: skip
            # pyvista's own meaning of some of these keys goes
            plotter.reset_key_events() if key == "n" else None
            plotter.add_key_event(key, act)
        interactor = plotter.iren
        interactor.add_observer("StartInteractionEvent", lambda *_: self.show_fine(False))
        interactor.add_observer("EndInteractionEvent", self._rest)
        self._pressed = (0, 0)
        interactor.add_observer("LeftButtonPressEvent", self._press)
        interactor.add_observer("LeftButtonReleaseEvent", self._release)

    def _press(self, *_: Any) -> None:
        self._pressed = self.plotter.iren.get_event_position()

    def _release(self, *_: Any) -> None:
        x, y = self.plotter.iren.get_event_position()
        # a drag turns; a click asks
        if abs(x - self._pressed[0]) + abs(y - self._pressed[1]) < 4:
            self.ask(x, y)
            self.plotter.render()

    def _rest(self, *_: Any) -> None:
        self.show_fine(True)
        self.plotter.render()

    def show_fine(self, fine: bool) -> None:
        """All faces at rest; fewer while the view turns, where there are many."""
        if not self._coarse:
            return
        for actor in self._fine:
            actor.visibility = fine
        for actor in self._coarse:
            actor.visibility = not fine

    def _look(self, view: Viewpoint) -> None:
        look(self.plotter, view)
        self.plotter.reset_camera_clipping_range()
        self.plotter.render()

    def _write(self, words: str) -> None:
        self.told = words
        self.plotter.add_text(words, position="lower_left", font_size=9, color=palette.INK, name="told", render=False)
