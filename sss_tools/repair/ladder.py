"""The ladder: rung after rung, each judged by what it did, and undone where it did harm."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..mesh import Mesh
from .degenerates import remove_degenerates
from .draft import Declined, Draft
from .duplicates import remove_duplicates
from .holes import cap_holes, enclosing_components
from .judge import FARTHEST, FAULTS, Examined, VisibleSurface
from .nonmanifold import split_non_manifold
from .orientation import orient
from .rebuild import rebuild
from .result import Repair, Rung
from .unite import remove_internal, unite, unite_both_signs
from .weld import weld

PASSES = 3
"""How often the ladder is climbed: a later rung may make work for an earlier one."""

SAME_VOLUME = 0.01
"""How much of the volume a safe rung may change where it is known before and after, as a share."""


@dataclass(frozen=True)
class Step:
    """A rung.

    take      the rung itself: a new draft, None where there is nothing to do; Declined where it cannot
    instead   what to try where ``take`` did harm
    wanted    whether it is to be tried on a mesh in this condition
    leaves    faults it may add to, because a later rung sees to them
    safe      keeps the shape: allowed with ``--fix``
    """

    name: str
    take: Callable[[Draft], Draft | None]
    instead: Callable[[Draft], Draft | None] | None = None
    wanted: Callable[[Examined], bool] = lambda examined: True
    leaves: tuple[str, ...] = ()
    safe: bool = False


def _has_open_edges(examined: Examined) -> bool:
    condition = examined.condition
    return condition.open_edges > 0 or condition.non_manifold_edges > 0 or condition.disagreeing_edges > 0


def _is_tangled(examined: Examined) -> bool:
    condition = examined.condition
    return (condition.crossings or 0) + condition.non_manifold_edges + condition.internal > 0


def _holds_something(examined: Examined) -> bool:
    return examined.condition.internal + examined.condition.sheets > 0


def _is_no_solid(examined: Examined) -> bool:
    return not examined.condition.is_solid


TANGLES = ("crossings", "non_manifold_edges", "pinches")
"""What ``unite`` and ``split`` see to."""

STEPS = (
    Step("weld", weld, leaves=("duplicates", "non_manifold_edges", "pinches", "disagreeing_edges"), safe=True),
    Step("degenerates", remove_degenerates, leaves=("duplicates",), safe=True),
    Step("duplicates", remove_duplicates, leaves=("disagreeing_edges",), safe=True),
    Step("orientation", orient, safe=True),
    Step("caps", cap_holes, None, _has_open_edges, (*TANGLES, "duplicates", "inverted")),
    Step("internal", remove_internal, None, _holds_something),
    Step("unite", unite, unite_both_signs, _is_tangled, ("non_manifold_edges", "pinches")),
    Step("split", split_non_manifold, leaves=("inverted",)),
    Step("rebuild", rebuild, None, _is_no_solid),
)


def repair_mesh(mesh: Mesh, unsafe: bool = False) -> tuple[Mesh | None, Repair]:
    """Repair what can be repaired.

    unsafe  also take rungs that invent or remove surface
    Returns the result, None where nothing changed or the mesh was refused, and the report. The result has the
    bodies and vertex attributes of ``mesh``. Repairing a result again changes nothing.
    Raises ValueError for a mesh without faces or with coordinates that are not finite.
    """
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices[mesh.faces]).all():
        raise ValueError("a repair needs faces and finite coordinates")
    with np.errstate(all="ignore"):
        return _Climb(mesh, unsafe).result()


class _Climb:
    """One mesh on the ladder."""

    def __init__(self, mesh: Mesh, unsafe: bool):
        self.unsafe = unsafe
        self.start = self.now = Examined(Draft.of(mesh))
        self.rungs: dict[str, Rung] = {}
        self._visible: VisibleSurface | None = None
        self.seconds: dict[str, float] = {}
        self._idle: set[tuple[str, int]] = set()
        self._drafts: list[Examined] = [self.now]

    @property
    def visible(self) -> VisibleSurface:
        """Of the mesh as it came."""
        if self._visible is None:
            self._visible = VisibleSurface(self.start.mesh)
        return self._visible

    def result(self) -> tuple[Mesh | None, Repair]:
        """Climb, and report."""
        before = self.start.condition
        if before.is_solid and before.degenerates == 0 and not self._has_flat_faces():
            return None, Repair("unchanged", "nothing to repair", before=before.to_json())
        self._climb([step for step in STEPS if step.safe])
        nothing_there = self._encloses_nothing()
        if nothing_there:
            return None, Repair("refused", nothing_there, None, list(self.rungs.values()), before.to_json())
        if self.unsafe:
            self._climb_unsafe()
        after = self.now.condition
        rungs = [self.rungs[step.name] for step in STEPS if step.name in self.rungs]
        left = ", ".join(f"{name.replace('_', ' ')}: {count}" for name, count in after.faults().items())
        if self.now is self.start:
            reason = f"left as it is ({left})" if left else "nothing to repair"
            if left and not self.unsafe:
                reason = f"what is wrong needs --unsafe-fixes ({left})"
            return None, Repair("unchanged", reason, None, rungs, before.to_json())
        report = Repair("partial" if left else "fixed", f"left: {left}" if left else None, None, rungs)
        report.before, report.after = before.to_json(), after.to_json()
        report.after["distance"] = self.visible.distance_to(self.now.mesh)
        report.lost = _lost(self.start.draft, self.now.draft)
        return self.now.draft.finished(), report

    def _has_flat_faces(self) -> bool:
        return remove_degenerates(self.start.draft) is not None

    def _climb(self, steps: list[Step]) -> None:
        for _ in range(PASSES):
            before = self.now
            for step in steps:
                self._take(step)
            if self.now is before:
                return

    def _climb_unsafe(self) -> None:
        """All rungs; where caps cross the surface and no later rung cured it, go back to before the caps."""
        start, noted = self.now, dict(self.rungs)
        self._climb(list(STEPS[:-1]))
        before, after = start.condition, self.now.condition
        if self.now is not start and (after.crossings or 0) > (before.crossings or 0):
            changed = [name for name, rung in self.rungs.items() if rung.status == "applied"]
            self.now = start
            self._drafts.append(start)
            for name in changed:
                if noted.get(name, Rung(name, "skipped")).status != "applied":
                    self.rungs[name] = Rung(name, "undone", "the result would cross itself")
        self._take(STEPS[-1])

    def _take(self, step: Step) -> None:
        """Try a rung; keep what it made if that is better."""
        if (step.name, len(self._drafts)) in self._idle and self.now is self._drafts[-1]:
            return  # tried on this very draft before
        started = time.perf_counter()
        rung = self._try(step)
        if rung.status == "applied":
            self._drafts.append(self.now)
        else:
            self._idle.add((step.name, len(self._drafts)))
        self.seconds[step.name] = self.seconds.get(step.name, 0) + time.perf_counter() - started
        earlier = self.rungs.get(step.name)
        # a later climb that finds nothing more to do does not take back what was done
        if earlier is None or earlier.status == "skipped" or rung.status == "applied":
            self.rungs[step.name] = rung

    def _try(self, step: Step) -> Rung:
        if not step.wanted(self.now):
            return Rung(step.name, "skipped", "nothing to do")
        rung = self._attempt(step, step.take)
        if rung.status == "undone" and step.instead is not None:
            other = self._attempt(step, step.instead)
            return other if other.status == "applied" else rung
        return rung

    def _attempt(self, step: Step, take: Callable[[Draft], Draft | None]) -> Rung:
        try:
            draft = take(self.now.draft)
        except Declined as reason:
            return Rung(step.name, "skipped", str(reason))
        except ImportError as error:
            return Rung(step.name, "skipped", f"needs the package {error.name}: install it")
        if draft is None:
            return Rung(step.name, "skipped", "nothing to do")
        if len(draft.faces) == 0:
            return Rung(step.name, "undone", "nothing would be left")
        after = Examined(draft)
        harm = self._harm(step, after)
        if harm:
            return Rung(step.name, "undone", harm)
        if not step.safe and after.condition.faults() == self.now.condition.faults():
            return Rung(step.name, "skipped", "it would not help")
        self.now = after
        return Rung(step.name, "applied", draft.note)

    def _harm(self, step: Step, after: Examined) -> str | None:
        """What is worse than before, in a few words."""
        old, new = self.now.condition, after.condition
        for name in FAULTS:
            was, now = getattr(old, name) or 0, getattr(new, name) or 0
            if now > was and name not in step.leaves:
                return f"more {name.replace('_', ' ')} than before ({was}, then {now})"
        if new.cavities < old.cavities and new.solids and not old.inverted:
            return f"a cavity would be lost ({old.cavities}, then {new.cavities})"
        if step.safe and step.name != "orientation" and old.volume and new.volume:
            change = abs(new.volume / old.volume - 1)
            if change > SAME_VOLUME:
                return f"the volume would change by {change:.1%}"
        distance = self.visible.distance_to(after.mesh)
        if distance > FARTHEST:
            return f"the visible surface would move by {distance:.1%} of the diagonal"
        return None

    def _encloses_nothing(self) -> str | None:
        """Why there is no solid to be had; None where there is one."""
        if self.now.condition.solids or enclosing_components(self.now.draft).any():
            return None
        count = self.now.condition.sheets
        return (
            f"encloses no volume: {count} open or two-sided {'sheet' if count == 1 else 'sheets'}; "
            "model a wall thickness, or give it an opaque material"
        )


def _lost(start: Draft, now: Draft) -> list[str]:
    """What the result does not carry as the file did."""
    lost = []
    stays = np.zeros(len(start.source.faces), bool)
    stays[now.birth] = True
    for body in start.source.bodies:
        if not stays[body.first_face : body.first_face + body.face_count].any():
            lost.append(f"body {body.name}")
    if start.source.vertex_attributes:
        corners = start.points[start.faces][now.birth]
        # a corner that is none of its birth face's has attributes that were interpolated
        known = (now.points[now.faces][:, :, None] == corners[:, None]).all(-1).any(-1).all(-1)
        if not known.all():
            attributes = ", ".join(start.source.vertex_attributes)
            lost.append(f"{attributes} interpolated on {int((~known).sum())} of {len(known)} faces")
    return lost
