"""Stand-ins for the scene and its lights: what the fast shaders ask of them, and no more."""

from types import SimpleNamespace

import numpy as np
import pytest

from renderer.optics.ball import ball_table
from renderer.shaders.surface import SurfacePoints
from sss_tools.cache import FOLDER_VARIABLE
from sss_tools.rays import RayCaster


class Objects(RayCaster):
    """Meshes as the objects 0, 1, ... of a scene."""

    def __init__(self, *meshes, owners=None):
        offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
        faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]
        super().__init__(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
        self.triangle_normal = np.concatenate([mesh.face_normals for mesh in meshes]).T.astype(np.float32)
        owners = range(len(meshes)) if owners is None else owners
        sizes = [len(mesh.faces) for mesh in meshes]
        self.triangle_object = np.repeat(np.array(list(owners), np.int16), sizes)


class Directional:
    """Parallel light from ``towards``."""

    ambient, radiance = False, None

    def __init__(self, towards, irradiance=(1, 1, 1)):
        self.towards = (np.asarray(towards, float) / np.linalg.norm(towards)).astype(np.float32)
        self.irradiance = np.asarray(irradiance, np.float32)

    def at(self, position):
        n = position.shape[1]
        return (
            np.repeat(self.towards[:, None], n, axis=1),
            np.full(n, np.inf, np.float32),
            np.repeat(self.irradiance[:, None], n, axis=1),
        )


class Point:
    """Light from a place, of irradiance 1 whatever the distance."""

    ambient, radiance = False, None

    def __init__(self, place):
        self.place = np.asarray(place, np.float32)[:, None]

    def at(self, position):
        offset = self.place - position
        distance = np.linalg.norm(offset, axis=0)
        return offset / distance, distance, np.ones_like(position)


class Ambient:
    """The same radiance from everywhere."""

    ambient = True
    axes = (np.array([[1, 1, 1, -1], [1, 1, -1, 1], [1, -1, 1, 1]]) / np.sqrt(3)).astype(np.float32)

    def __init__(self, radiance=(1, 1, 1)):
        self.radiance = np.asarray(radiance, np.float32)

    def at(self, position):
        raise AssertionError("an ambient beam comes from everywhere")


def vertex_points(mesh, curvature):
    """The vertices of a ball about the origin, with the ball's normals."""
    position = mesh.vertices.T.astype(np.float32)
    normal = (mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True)).T.astype(np.float32)
    return SurfacePoints(position, normal, np.full(position.shape[1], curvature, np.float32))


def one_point(position, normal, curvature):
    column = [np.asarray(values, np.float32).reshape(3, 1) for values in (position, normal)]
    return SurfacePoints(*column, np.full(1, curvature, np.float32))


@pytest.fixture(scope="session")
def stage():
    """The stand-ins, under one roof."""
    return SimpleNamespace(
        Objects=Objects, Directional=Directional, Point=Point, Ambient=Ambient,
        vertex_points=vertex_points, one_point=one_point,
    )  # fmt: skip


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory):
    """Tables are cached for the session, and not in the user's folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(tmp_path_factory.mktemp("cache")))
        ball_table.cache_clear()
        yield
