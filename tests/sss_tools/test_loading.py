import csv
import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from sss_tools.errors import InputError
from sss_tools.loading import SUFFIXES, load_mesh
from sss_tools.shapes import box, icosphere


def exported(suffix: str) -> bytes:
    """A ball of 320 faces as trimesh writes it."""
    ball = icosphere(1.0, 2)
    data = trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(file_type=suffix[1:])
    return data.encode() if isinstance(data, str) else data


def write_gltf(folder) -> None:
    ball = icosphere(1.0, 2)
    files = trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(file_type="gltf")
    for name, data in files.items():
        (folder / name).write_bytes(data)


def line_of(path) -> str:
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    line = str(caught.value)
    assert str(path) in line
    assert "\n" not in line
    return line


FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
WHOLE = [suffix for suffix in SUFFIXES if suffix != ".gltf"]


@pytest.mark.parametrize("suffix", WHOLE)
def test_every_kind_is_read(tmp_path, suffix):
    # upper case too: suffixes of files from elsewhere often are
    path = tmp_path / f"ball{suffix.upper()}"
    path.write_bytes(exported(suffix))
    mesh = load_mesh(path)
    assert len(mesh.faces) == 320
    assert mesh.path == path
    # single precision in some formats, eight digits in others
    assert mesh.volume == pytest.approx(icosphere(1.0, 2).volume, rel=1e-6)
    assert len(mesh.topology.boundary_edges) == 0
    assert [(body.first_face, body.face_count) for body in mesh.bodies] == [(0, 320)]


def test_gltf_finds_the_files_beside_it(tmp_path):
    write_gltf(tmp_path)
    assert len(load_mesh(tmp_path / "model.gltf").faces) == 320


@pytest.mark.parametrize("suffix", WHOLE)
@pytest.mark.parametrize("share", [0.05, 0.5, 0.97])
def test_truncated_files_are_refused(tmp_path, suffix, share):
    whole = exported(suffix)
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(whole[: int(share * len(whole))])
    if suffix == ".obj":
        # OBJ says nowhere how much should follow: cut between numbers it is another, shorter file
        path.write_bytes(path.read_bytes().rsplit(b" ", 1)[0])
    assert "unreadable" in line_of(path)


def test_truncated_gltf_is_refused_even_beside_a_whole_one(tmp_path):
    write_gltf(tmp_path)
    (tmp_path / "cut.gltf").write_bytes((tmp_path / "model.gltf").read_bytes()[:300])
    assert "unreadable gltf" in line_of(tmp_path / "cut.gltf")
    buffer = next(tmp_path.glob("*.bin"))
    buffer.write_bytes(buffer.read_bytes()[:100])
    assert "unreadable gltf" in line_of(tmp_path / "model.gltf")


def test_truncated_files_tell_expected_and_found_numbers(tmp_path):
    for suffix, expected in ((".stl", "320 faces in 16084"), (".off", "162 vertices and 320 faces"), (".glb", "bytes")):
        (tmp_path / f"cut{suffix}").write_bytes(exported(suffix)[:4000])
        assert expected in line_of(tmp_path / f"cut{suffix}")
    assert "the file has 4000" in line_of(tmp_path / "cut.stl")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", [b"", b" \n", b"\x00\xff\x10garbage" * 50, b"these are some words\n" * 20])
def test_garbage_is_refused(tmp_path, suffix, content):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    line = line_of(path)
    assert ("empty" if not content.strip() else "unreadable") in line


def test_what_is_no_mesh_file_is_refused(tmp_path):
    assert "no such file" in line_of(tmp_path / "missing.ply")
    assert "no such file" in line_of(tmp_path / "missing.xyz")
    assert "folder" in line_of(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    assert "'.txt' is no known kind" in line_of(tmp_path / "notes.txt")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
        ("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
        ("before.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n"),
        ("words.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 two 3\nf 1 2 3\n"),
        ("flat.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n"),
        ("beyond.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
        ("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
        ("open.stl", "solid a\n" + FACET),
        ("half.stl", "solid a\n" + FACET + FACET.replace("endfacet", "") + "endsolid a\n"),
        ("words.stl", "solid a\n" + FACET.replace("1 0 0", "1 O 0") + "endsolid a\n"),
    ],
)
def test_corrupt_text_is_refused(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert "unreadable" in line_of(tmp_path / name)


def test_ply_indices_out_of_range_are_refused(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
    (tmp_path / "beyond.ply").write_text(header + "3 0 1 3\n")
    assert "indices" in line_of(tmp_path / "beyond.ply")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("comment.obj", "# nothing\n"),
        ("points.obj", "v 0 0 0\nv 1 0 0\n"),
        ("empty.stl", "solid nothing\nendsolid nothing\n"),
        ("empty.off", "OFF\n0 0 0\n"),
        ("empty.ply", "ply\nformat ascii 1.0\nend_header\n"),
        ("empty.gltf", '{"asset": {"version": "2.0"}, "scenes": [{"nodes": []}], "scene": 0}'),
    ],
)
def test_valid_files_without_faces_are_meshes_without_faces(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert len(load_mesh(tmp_path / name).faces) == 0


def test_non_finite_vertices_are_passed_on(tmp_path):
    (tmp_path / "nan.obj").write_text("v 0 nan 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh = load_mesh(tmp_path / "nan.obj")
    assert np.isnan(mesh.vertices[0, 1])
    assert np.isposinf(mesh.vertices[1, 0])


def test_relative_indices_count_from_where_they_stand(tmp_path):
    first = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
    (tmp_path / "relative.obj").write_text(first + "v 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n")
    mesh = load_mesh(tmp_path / "relative.obj")
    assert mesh.vertices[mesh.faces][:, :, 2].tolist() == [[0, 0, 0], [5, 5, 5]]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", ["ball.obj", "ball.off", "ball.stl"])
def test_line_ends_do_not_matter(tmp_path, name, line_end):
    ball = icosphere(1.0, 1)
    kind = "stl_ascii" if name.endswith("stl") else name[-3:]
    text = trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(file_type=kind)
    (tmp_path / name).write_bytes(text.replace("\n", line_end).encode())
    assert load_mesh(tmp_path / name).volume == pytest.approx(ball.volume, rel=1e-5)


def test_polygons_become_triangles(tmp_path):
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0\n"
    (tmp_path / "mixed.obj").write_text(square + "f 1 2 3 4\nf 3 5 4\nf 1 2 5 3 4\n")
    assert len(load_mesh(tmp_path / "mixed.obj").faces) == 2 + 1 + 3


def test_bodies_are_placed_and_mirrored_ones_stay_outward(tmp_path):
    cube = box()
    body = trimesh.Trimesh(cube.vertices, cube.faces, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name="left", geom_name="cube")
    mirror = np.diag([-2.0, 1, 1, 1])
    mirror[:3, 3] = [5, 0, 0]
    scene.add_geometry(body, node_name="right", geom_name="cube", transform=mirror)
    (tmp_path / "two.glb").write_bytes(scene.export(file_type="glb"))
    mesh = load_mesh(tmp_path / "two.glb")
    assert [(b.first_face, b.face_count) for b in mesh.bodies] == [(0, 12), (12, 12)]
    assert mesh.bounds.tolist() == [[-0.5, -0.5, -0.5], [6, 0.5, 0.5]]
    assert mesh.volume == pytest.approx(1 + 2)
    assert mesh.topology.component_count == 2


def test_normals_turn_with_their_body(tmp_path):
    ball = icosphere(1.0, 2)
    body = trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=ball.vertices, process=False)
    for turn in (np.diag([1.0, 1, -3, 1]), np.array([[0.0, -2, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])):
        scene = trimesh.Scene()
        scene.add_geometry(body, transform=turn)
        (tmp_path / "turned.glb").write_bytes(scene.export(file_type="glb", include_normals=True))
        mesh = load_mesh(tmp_path / "turned.glb")
        normals = mesh.vertex_attributes["normal"]
        assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)))
        # the faces' normals are off the vertices' by a fraction of an edge's angle, 0.16 rad, times the stretch
        facing = np.einsum("ij,ij->i", mesh.face_normals, normals[mesh.faces[:, 0]])
        assert facing.min() > 0.8


def test_texture_coordinates_and_colors_are_kept(tmp_path):
    corners = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n"
    (tmp_path / "uv.obj").write_text(corners + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    mesh = load_mesh(tmp_path / "uv.obj")
    assert mesh.vertex_attributes["uv"].tolist() == mesh.vertices[:, :2].tolist()
    (tmp_path / "color.obj").write_text(corners + "f 1 2 3\n")
    assert load_mesh(tmp_path / "color.obj").vertex_attributes["color"][:, :3].tolist() == (255 * np.eye(3)).tolist()


def test_files_outside_the_folder_are_not_read(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    write_gltf(inner)
    tree = json.loads((inner / "model.gltf").read_text())
    buffer = tree["buffers"][0]["uri"]
    (inner / buffer).rename(tmp_path / "outside.bin")
    for uri, expected in (("../outside.bin", "outside its folder"), ("http://localhost/a.bin", "nothing is fetched")):
        tree["buffers"][0]["uri"] = uri
        (inner / "model.gltf").write_text(json.dumps(tree))
        assert expected in line_of(inner / "model.gltf")


@pytest.mark.parametrize("suffix", [".obj", ".off", ".stl"])
def test_a_reader_that_skips_faces_is_not_believed(tmp_path, monkeypatch, suffix):
    (tmp_path / f"ball{suffix}").write_bytes(exported(suffix))
    ball = icosphere(1.0, 2)
    half = trimesh.Scene(trimesh.Trimesh(ball.vertices, ball.faces[:160], process=False))
    monkeypatch.setattr(trimesh, "load_scene", lambda *_, **__: half)
    assert "320 triangles, of which 160" in line_of(tmp_path / f"ball{suffix}")


def test_loading_writes_nothing(tmp_path):
    write_gltf(tmp_path)
    before = {entry.name: entry.stat().st_mtime_ns for entry in tmp_path.iterdir()}
    load_mesh(tmp_path / "model.gltf")
    assert {entry.name: entry.stat().st_mtime_ns for entry in tmp_path.iterdir()} == before


def test_ply_needs_no_other_reader(tmp_path):
    (tmp_path / "ball.ply").write_bytes(exported(".ply"))
    code = "import sys, sss_tools.loading as l; l.load_mesh(sys.argv[1]); assert 'trimesh' not in sys.modules"
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "ball.ply")], check=True)


def test_real_meshes_load_as_the_manifest_says(shared):
    """Sizes of what is readable. Corrupt files are refused, or show their fault: no faces, or NaN."""
    with (shared / "meshes" / "MANIFEST.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        path = shared / "meshes" / row["file"]
        if row["class"] == "either":
            continue
        if row["class"] == "corrupt":
            try:
                mesh = load_mesh(path)
            except InputError:
                continue
            assert len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all(), row["file"]
            continue
        mesh = load_mesh(path)
        found = (len(mesh.vertices), len(mesh.faces))
        assert found == (int(row["n_vertices_file"]), int(row["n_faces"])), row["file"]
        assert sum(body.face_count for body in mesh.bodies) == len(mesh.faces)


def test_truncated_real_meshes_are_refused(shared):
    for name in ("bunny.ply", "featuretype.stl", "milktruck.glb"):
        assert "truncated" in line_of(shared / "meshes" / f"derived_truncated_{name}")
