"""The ladder as a whole: idempotence, attributes, corpus."""

import csv

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sss_tools import shapes
from sss_tools.loading import load_mesh
from sss_tools.mesh import Body, Mesh
from sss_tools.repair import repair_mesh

pytest.importorskip("igl")

SOLIDS = {
    "ball": shapes.icosphere(1.0, 2),
    "ring": shapes.torus(around=12, across=8),
    "hollow": shapes.hollow_ball(1.0, 0.4, 2),
    "pair": shapes.joined(shapes.box(), shapes.moved(shapes.box(), (0.5, 0.3, 0.2))),
}


@st.composite
def damaged(draw) -> Mesh:
    """A solid with faces deleted, turned, doubled and vertices merged."""
    mesh = SOLIDS[draw(st.sampled_from(sorted(SOLIDS)))]
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    faces = mesh.faces.copy()
    turned = random.choice(len(faces), draw(st.integers(0, 6)), replace=False)
    faces[turned] = faces[turned, ::-1]
    doubled = random.choice(len(faces), draw(st.integers(0, 4)), replace=False)
    faces = np.concatenate([faces, faces[doubled]])
    faces = np.delete(faces, random.choice(len(faces), draw(st.integers(0, 5)), replace=False), axis=0)
    for a, b in random.choice(len(mesh.vertices), (draw(st.integers(0, 2)), 2), replace=False):
        faces[faces == a] = b
    return Mesh(mesh.vertices, faces)


@pytest.fixture(scope="module")
def coarse_rebuild():
    """A coarse grid for the last rung: what it makes is not the point here, that it settles is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sss_tools.repair.rebuild.POINTS", 8_000)
        yield


@settings(max_examples=25, deadline=None, derandomize=True)
@given(damaged(), st.booleans())
def test_fixing_twice_is_a_no_op(coarse_rebuild, mesh, unsafe):
    result, report = repair_mesh(mesh, unsafe)
    if result is not None:
        again, second = repair_mesh(result, unsafe)
        assert again is None, [rung for rung in second.rungs if rung.status == "applied"]
        assert second.status == "unchanged"
    assert not (report.status == "fixed" and repair_mesh(result, unsafe)[1].reason != "nothing to repair")


@pytest.mark.parametrize("name", sorted(set(SOLIDS) - {"pair"}))
def test_clean_meshes_are_left_alone(name):
    assert repair_mesh(SOLIDS[name], unsafe=True)[1].status == "unchanged"


def textured_ball() -> Mesh:
    """A ball with a UV seam, colours and two bodies, a few faces missing."""
    ball = shapes.icosphere(1.0, 3)
    corners = ball.vertices[ball.faces].reshape(-1, 3)
    colour = np.rint(255 * np.clip((corners + 1) / 2, 0, 1)).astype(np.uint8)
    attributes = {"uv": corners[:, :2] * 0.5, "color": np.concatenate([colour, np.full((len(colour), 1), 255)], 1)}
    attributes["color"] = attributes["color"].astype(np.uint8)
    faces = np.arange(len(corners)).reshape(-1, 3)[6:]
    half = len(faces) // 2
    bodies = (Body("lower", 0, half, "wax"), Body("upper", half, len(faces) - half, "jade"))
    return Mesh(corners, faces, bodies, attributes)


def test_attributes_of_what_stays_are_kept_bit_for_bit():
    mesh = textured_ball()
    result, report = repair_mesh(mesh, unsafe=True)
    assert report.status == "fixed"
    known = {tuple(v): tuple(uv) for v, uv in zip(mesh.vertices, mesh.vertex_attributes["uv"], strict=True)}
    corners = result.faces[: len(mesh.faces) // 2].ravel()
    for vertex in corners:
        assert tuple(result.vertex_attributes["uv"][vertex]) == known[tuple(result.vertices[vertex])]
    assert result.vertex_attributes["color"].dtype == np.uint8


def test_caps_take_the_attributes_of_their_rim():
    mesh = textured_ball()
    result, _ = repair_mesh(mesh, unsafe=True)
    assert np.isfinite(result.vertex_attributes["uv"]).all()
    assert result.vertex_attributes["uv"].min() >= mesh.vertex_attributes["uv"].min()
    assert result.vertex_attributes["uv"].max() <= mesh.vertex_attributes["uv"].max()


def test_bodies_and_materials_are_kept_and_cover_all_faces():
    result, _ = repair_mesh(textured_ball(), unsafe=True)
    assert [(body.name, body.material) for body in result.bodies] == [("lower", "wax"), ("upper", "jade")]
    assert sum(body.face_count for body in result.bodies) == len(result.faces)


def test_what_interpolation_made_is_listed():
    pair = shapes.joined(shapes.box(), shapes.moved(shapes.box(), (0.5, 0.3, 0.2)))
    mesh = Mesh(pair.vertices, pair.faces, pair.bodies, {"uv": pair.vertices[:, :2].copy()})
    result, report = repair_mesh(mesh, unsafe=True)
    # the attribute is linear in position, and so is interpolation: rounding is all that can differ
    assert np.allclose(result.vertex_attributes["uv"], result.vertices[:, :2], atol=1e-12)
    assert any("interpolated" in line for line in report.lost)


def test_the_input_is_not_changed():
    mesh = textured_ball()
    before = mesh.vertices.copy(), mesh.faces.copy(), mesh.vertex_attributes["uv"].copy()
    repair_mesh(mesh, unsafe=True)
    after = mesh.vertices, mesh.faces, mesh.vertex_attributes["uv"]
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


def rows(shared, *classes):
    with (shared / "meshes" / "MANIFEST.csv").open() as file:
        return [row for row in csv.DictReader(file) if row["class"] in classes]


@pytest.mark.slow
def test_clean_real_meshes_are_left_alone(shared):
    for row in rows(shared, "clean"):
        assert repair_mesh(load_mesh(shared / "meshes" / row["file"]), unsafe=True)[0] is None, row["file"]


@pytest.mark.parametrize(
    "name",
    ["shared.STL", "joined_tetrahedra.obj", "not_convex.obj", "multibody.stl", "featuretype.STL", "suzanne.obj"],
)
def test_small_broken_real_meshes_become_solids(shared, name):
    result, report = repair_mesh(load_mesh(shared / "meshes" / name), unsafe=True)
    assert report.status == "fixed"
    assert repair_mesh(result, unsafe=True)[0] is None


@pytest.mark.parametrize("name", ["soup.stl", "plane.ply", "woody.obj", "alligator.obj", "many_small_holes.ply"])
def test_open_sheets_and_soups_are_refused(shared, name):
    assert repair_mesh(load_mesh(shared / "meshes" / name), unsafe=True)[1].status == "refused"
