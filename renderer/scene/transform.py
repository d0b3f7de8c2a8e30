"""Placing a mesh in the scene."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from sss_tools.keys import Key, Kind, Place, read_keys, to_number, to_vector
from sss_tools.mesh import Mesh

Matrix = NDArray[np.float64]


def _to_scale(value) -> NDArray[np.float64]:
    return to_vector(value) if isinstance(value, list) else np.full(3, to_number(value))


def _to_matrix(value) -> Matrix:
    return np.array([to_vector(row) for row in value])


_KEYS = {
    "scale": Key(
        Kind("one number or three, none zero", _to_scale, lambda s: s.shape == (3,) and s.all()), None),
    "rotate": Key(
        Kind("an axis that is not zero and degrees, [x, y, z, degrees]", to_vector,
             lambda r: r.shape == (4,) and r[:3].any()), None),
    "translate": Key(Kind("three numbers", to_vector, lambda t: t.shape == (3,)), None),
    "matrix": Key(
        Kind("four rows of four numbers, the last row 0, 0, 0, 1", _to_matrix,
             lambda m: m.shape == (4, 4) and (m[3] == (0, 0, 0, 1)).all()), None),
}  # fmt: skip


def read_transform(table, place: Place) -> Matrix:
    """(4, 4) matrix acting on columns: translate * rotate * scale, or the matrix given.

    Raises InputError for bad values and for transforms that flatten what they place.
    """
    values = read_keys(table, _KEYS, place)
    matrix = values.pop("matrix")
    if matrix is None:
        matrix = np.eye(4)
        scale, turn, shift = values["scale"], values["rotate"], values["translate"]
        if scale is not None:
            matrix[:3, :3] = np.diag(scale)
        if turn is not None:
            matrix[:3, :3] = rotation(turn[:3], float(np.radians(turn[3]))) @ matrix[:3, :3]
        if shift is not None:
            matrix[:3, 3] = shift
    elif any(value is not None for value in values.values()):
        problem = f'{place.name} has "matrix" beside "scale", "rotate" or "translate"'
        raise place.error(problem, "give the one or the others")
    # a ratio of 1e12 between the longest and the shortest side leaves float64 four digits: a sheet by intent
    if not np.linalg.cond(matrix[:3, :3]) < 1e12:
        raise place.error(f"{place.name} flattens the mesh: it has no inverse", "give it three axes that span space")
    return matrix


def rotation(axis, angle_rad: float) -> Matrix:
    """(3, 3) right-handed rotation about ``axis`` (any length but zero), by Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * (cross @ cross)


def transformed(mesh: Mesh, matrix: Matrix) -> Mesh:
    """The mesh in scene coordinates; itself where the matrix changes nothing.

    A mirroring matrix turns faces inside out, so their corners are swapped back: outside stays outside.
    """
    if np.array_equal(matrix, np.eye(4)):
        return mesh
    linear = matrix[:3, :3]
    attributes = dict(mesh.vertex_attributes)
    # what overflows is for the caller to find, as in any mesh
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = mesh.vertices @ linear.T + matrix[:3, 3]
        if "normal" in attributes:
            # normals are covectors: the inverse transpose keeps them perpendicular and on their side
            normals = attributes["normal"] @ np.linalg.inv(linear)
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            attributes["normal"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    mirrors = np.linalg.slogdet(linear).sign < 0
    faces = mesh.faces[:, ::-1] if mirrors else mesh.faces
    return dataclasses.replace(mesh, vertices=vertices, faces=faces, vertex_attributes=attributes)
