"""Changes to a mesh that must not change what is found in it, and how answers are carried back to be compared."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sss_tools.mesh import Mesh
from sss_tools.validation.outcome import Outcome
from sss_tools.validation.rule import Context
from sss_tools.validation.run import check_mesh


@dataclass(frozen=True)
class Changed:
    """A mesh after a change.

    face    (m',) which face of the original each one is
    vertex  (n',) which vertex of the original each one is
    """

    mesh: Mesh
    face: np.ndarray
    vertex: np.ndarray


@dataclass(frozen=True)
class Change:
    """A change of frame, order or indexing.

    kind    turned, moved, scaled, permuted or split
    apply   does it to a mesh, and to its neighbours alike
    scale   what lengths are multiplied by
    exact   no coordinate is rounded, so exact contacts stay exact
    """

    name: str
    kind: str
    apply: Callable[[Mesh], Changed]
    scale: float = 1.0
    exact: bool = True


class Answer(NamedTuple):
    """What a rule says of a mesh, indices being those of the mesh it was made from.

    edges and vertices are sets of places, for which any vertex there may stand; pairs are sets of two faces
    """

    outcome: str
    reason: str | None
    count: int
    faces: frozenset
    edges: frozenset
    vertices: frozenset
    pairs: frozenset


def turned(matrix, name, exact=False):
    """Turned by a rotation (3, 3), one product at a time: equal positions stay equal, which BLAS does not promise."""
    return Change(
        name, "turned", _with_columns(lambda x, y, z: [a * x + b * y + c * z for a, b, c in matrix]), 1, exact
    )


def turned_at_random(seed):
    """Turned by a rotation drawn evenly from all: a random unit quaternion."""
    w, x, y, z = (q := np.random.default_rng(seed).normal(size=4)) / np.linalg.norm(q)
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return turned(matrix, f"turned at random {seed}")


def scaled(factor):
    """Multiplied by a factor, which rounds nothing if it is a power of two."""
    exact = bool(np.frexp(factor)[0] == 0.5)
    return Change(
        f"scaled by {factor:.3g}", "scaled", _with_columns(lambda *xyz: [c * factor for c in xyz]), factor, exact
    )


def moved_by(offset, name, exact=False):
    """Moved by ``offset`` (3,), the neighbours alike."""
    apply = _with_columns(lambda *xyz: [c + d for c, d in zip(xyz, offset, strict=True)])
    return Change(name, "moved", apply, 1, exact)


def permuted(seed):
    """Faces and vertices in another order, and each face begun at another corner."""

    def apply(mesh):
        random = np.random.default_rng(seed)
        vertex, face = random.permutation(len(mesh.vertices)), random.permutation(len(mesh.faces))
        start = random.integers(0, 3, (len(face), 1))
        faces = np.take_along_axis(np.argsort(vertex)[mesh.faces][face], (np.arange(3) + start) % 3, axis=1)
        return Changed(Mesh(mesh.vertices[vertex], faces), face, vertex)

    return Change(f"permuted {seed}", "permuted", apply)


def split_at_seams(share):
    """A share of the faces' corners get vertices of their own, as UV seams do it; vertices no face uses remain."""

    def apply(mesh):
        corners = mesh.faces.ravel()
        own = np.random.default_rng(0).random(len(corners)) < share
        split = corners.copy()
        split[own] = len(mesh.vertices) + np.arange(np.count_nonzero(own))
        vertex = np.concatenate([np.arange(len(mesh.vertices)), corners[own]])
        # what only the split has left without a face goes
        keep = np.union1d(split, np.setdiff1d(np.arange(len(mesh.vertices)), corners))
        faces = np.searchsorted(keep, split).reshape(-1, 3)
        return Changed(Mesh(mesh.vertices[vertex[keep]], faces), np.arange(len(faces)), vertex[keep])

    return Change(f"split at {share:.0%} of the corners", "split", apply)


def _with_columns(change):
    """The mesh with its columns of coordinates changed, indices as they are."""

    def apply(mesh):
        vertices = np.stack(change(*mesh.vertices.T), axis=1)
        return Changed(Mesh(vertices, mesh.faces), np.arange(len(mesh.faces)), np.arange(len(mesh.vertices)))

    return apply


UNCHANGED = Change("unchanged", "", _with_columns(lambda *xyz: xyz))


def answers(mesh: Mesh, context: Context, change: Change = UNCHANGED) -> dict[str, Answer]:
    """What every rule says of a mesh after a change, by code.

    The neighbours change with the mesh, and the lengths in its medium with its unit.
    """
    changed = change.apply(mesh)
    if context.neighbours is not None:
        others = tuple(replace(other, mesh=change.apply(other.mesh).mesh) for other in context.neighbours)
        context = replace(context, neighbours=others)
    if context.medium is not None:
        context = replace(context, medium=context.medium.scaled(1 / change.scale))
    # vertices in one place are one point
    points = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)[1].ravel()
    point, face = points[changed.vertex].tolist(), changed.face.tolist()
    said = {}
    for rule in check_mesh(changed.mesh, context).rules:
        assert not rule.raised and not rule.truncated, f"{rule.code}: {rule.reason or 'too much to list'}"
        pairs = frozenset(frozenset(face[index] for index in pair) for pair in rule.face_pairs)
        said[rule.code] = Answer(
            str(rule.outcome),
            # without the numbers of what stopped it
            (rule.reason or "").split(":")[0] if rule.outcome == Outcome.NOT_RUN else None,
            rule.count,
            frozenset(face[index] for index in rule.faces),
            frozenset(frozenset(point[index] for index in edge) for edge in rule.edges),
            frozenset(point[index] for index in rule.vertices),
            # which copy is the first depends on the order: what is equal to what does not
            _joined(pairs) if rule.code == "SSS303" else pairs,
        )
    return said


def _joined(pairs: frozenset) -> frozenset:
    """Pairs that overlap as one set."""
    groups: list[frozenset] = []
    for pair in pairs:
        touching = [group for group in groups if group & pair]
        groups = [group for group in groups if not group & pair] + [pair.union(*touching)]
    return frozenset(groups)
