"""What a rule is: plain data next to the function that looks for the fault."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..closedness import Assessment, assess
from ..medium import Medium
from ..mesh import Mesh
from ..topology import Topology
from .outcome import FixSafety, Severity


class NotRun(Exception):
    """A rule that cannot look says why; it ends as ``not-run`` with this reason, never as ``pass``."""


@dataclass(frozen=True, eq=False)
class Neighbour:
    """Another object of the scene, in the frame and unit of the mesh under examination.

    translucent  whether light enters it
    """

    name: str
    mesh: Mesh
    translucent: bool = True


@dataclass(frozen=True)
class Context:
    """What the command knows besides the mesh.

    medium           what the mesh is made of, coefficients per mesh unit; None where no material was named
    unit             what one mesh unit is: mm, cm, m, inch; None where it was not said
    neighbours       the other objects of its scene; None where no scene was given
    pixel_footprint  width in mesh units of what a pixel covers where the mesh is nearest to the camera; None
                     without a scene, and where the mesh is behind the camera
    opaque           the scene gives the mesh a material that light does not enter
    extent           longest side of the whole scene, mesh units; None takes that of the mesh and its neighbours
    """

    medium: Medium | None = None
    unit: str | None = None
    neighbours: tuple[Neighbour, ...] | None = None
    pixel_footprint: float | None = None
    opaque: bool = False
    extent: float | None = None


class Subject:
    """A mesh under examination, and what several rules want to know of it."""

    def __init__(self, mesh: Mesh, context: Context | None = None):
        self.mesh = mesh
        self.context = context or Context()

    @property
    def topology(self) -> Topology:
        """The mesh's topology."""
        return self.mesh.topology

    @cached_property
    def assessment(self) -> Assessment:
        """Components, roles, holes."""
        return assess(self.mesh)

    @cached_property
    def vertex_of_point(self) -> NDArray[np.int64]:
        """(k,) the first vertex in the file at each of the topology's points."""
        first = np.full(len(self.topology.points), len(self.mesh.vertices))
        point = self.topology.point_of_vertex
        np.minimum.at(first, point, np.arange(len(point)))
        return first

    def edge_vertices(self, edges: ArrayLike) -> NDArray[np.int64]:
        """(k, 2) file vertices at the ends of the topology's edges ``edges`` (k,)."""
        return self.vertex_of_point[self.topology.edges[np.asarray(edges, np.int64)]]


@dataclass(frozen=True)
class Finding:
    """What a rule found in a mesh, all of it together.

    count       of what the rule's name names
    message     what is there, with the tolerance and its unit
    faces (f,), edges (e, 2), vertices (v,), face_pairs (p, 2)  indices in file order: where it is
    """

    count: int
    message: str
    faces: ArrayLike = field(default_factory=list)
    edges: ArrayLike = field(default_factory=list)
    vertices: ArrayLike = field(default_factory=list)
    face_pairs: ArrayLike = field(default_factory=list)


@dataclass(frozen=True)
class Rule:
    """A fault a mesh can have.

    code, name    stable; the name is that of the fault
    severity      unless the user says otherwise
    finds         one sentence: what the rule finds
    why           what the fault does to the light
    fix           how to get rid of it
    fix_safety    what such a fix promises
    check         the function that looks: a Finding, or None where there is nothing. May raise NotRun.
    on_file       looks at what the file holds, before the geometry is trusted
    """

    code: str
    name: str
    severity: Severity
    finds: str
    why: str
    fix: str
    fix_safety: FixSafety
    check: Callable[[Subject], Finding | None]
    on_file: bool = False


@lru_cache
def all_rules() -> tuple[Rule, ...]:
    """Every rule of every family in this package, ordered by code.

    Raises ValueError for two rules of one code.
    """
    package = importlib.import_module(__package__)
    rules: dict[str, Rule] = {}
    for module in pkgutil.iter_modules(package.__path__):
        family = importlib.import_module(f"{__package__}.{module.name}")
        for rule in vars(family).values():
            if isinstance(rule, Rule) and rules.setdefault(rule.code, rule) is not rule:
                raise ValueError(f"two rules are called {rule.code}")
    return tuple(rules[code] for code in sorted(rules))


def plural(count: int, noun: str, nouns: str | None = None) -> str:
    """``1 hole``, ``2 holes``."""
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"
