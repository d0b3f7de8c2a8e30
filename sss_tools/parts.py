"""A mesh's components, measured: how large, how closed, and which of them enclose a volume."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np

from .enclosure import enclosed_side
from .interior import Shell
from .patches import orient_consistently
from .topology import Topology

FLAT = 1e-3
"""A closed component whose volume is below this share of area times diagonal is looked at for what it encloses:
two sheets back to back are closed, too."""


class Parts:
    """The components with their measures, one array entry each.

    faces         (m, 3) over the topology's points, turned so that neighbours agree
    groups        the faces of each component, in file order
    closed        (c,) no boundary edge
    lower, upper  (c, 3) bounding boxes
    volumes       (c,) signed, cubic mesh units; those of closed components mean something
    areas         (c,) square mesh units
    encloses      (c,) whether it bounds a volume
    sign          (c,) 1 where the normals point away from that volume, -1 where into it
    """

    def __init__(self, topology: Topology):
        self.topology = topology
        self.points = topology.points
        self.faces, _ = orient_consistently(topology)
        component = topology.component_of_face
        self.count = topology.component_count
        order = np.argsort(component, kind="stable")
        order = order[np.searchsorted(component[order], 0) :]
        starts = np.searchsorted(component[order], np.arange(self.count + 1))
        self.groups = [order[a:b] for a, b in pairwise(starts)]

        sides = topology.face_edges[topology.live]
        self.component_of_edge = np.zeros(len(topology.edges), np.int64)
        self.component_of_edge[sides] = component[topology.live][:, None]
        open_sides = np.bincount(self.component_of_edge[topology.boundary_edges], minlength=self.count)
        self.closed = open_sides == 0

        self.lower, self.upper = np.empty((self.count, 3)), np.empty((self.count, 3))
        self.volumes, self.areas = np.empty(self.count), np.empty(self.count)
        for number, group in enumerate(self.groups):
            corners = self.points[self.faces[group]]
            columns = corners.reshape(-1, 3).T
            self.lower[number] = [column.min() for column in columns]
            self.upper[number] = [column.max() for column in columns]
            vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            # about the middle: far from the origin the tetrahedra would cancel to nothing
            first = corners[:, 0] - (self.lower[number] + self.upper[number]) / 2
            self.volumes[number] = np.einsum("ij,ij->", first, vectors) / 6
            self.areas[number] = np.linalg.norm(vectors, axis=1).sum() / 2
        self.sign = np.sign(self.volumes)
        self.encloses = np.array([self._encloses(number) for number in range(self.count)], bool)

    def _encloses(self, number: int) -> bool:
        """Whether a component bounds a volume; settles its sign where the volume does not."""
        scale = self.areas[number] * np.linalg.norm(self.upper[number] - self.lower[number])
        if self.closed[number] and abs(self.volumes[number]) > FLAT * scale:
            return True
        # two triangles enclose nothing; neither does what has no extent
        if len(self.groups[number]) < 3 or scale <= 0:
            return False
        side = enclosed_side(self.points, self.faces[self.groups[number]])
        if side == 0:
            return False
        self.sign[number] = side
        return True

    @cached_property
    def shells(self) -> list[Shell]:
        """The components that enclose volume, in their order."""
        return [
            Shell(self.faces[self.groups[number]], self.lower[number], self.upper[number])
            for number in np.flatnonzero(self.encloses)
        ]
