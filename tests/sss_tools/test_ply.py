import struct

import numpy as np
import pytest

from sss_tools.ply import fans, read_ply
from sss_tools.shapes import icosphere
from sss_tools.writing import ply_bytes

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]]
POLYGONS = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
TRIANGLES = [[0, 3, 2], [0, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def pyramid(form: str, line_end: str = "\n") -> bytes:
    """A pyramid whose bottom is a quadrilateral, so that the faces' lists differ in length; faces have a quality."""
    header = [
        "ply",
        f"format {form} 1.0",
        "comment a pyramid",
        "element vertex 5",
        "property float x",
        "property float y",
    ]
    header += ["property double z"]
    header += ["property uchar red", "property uchar green", "property uchar blue"]
    header += ["element face 5", "property list uchar int vertex_indices", "property float quality", "end_header", ""]
    order = ">" if "big" in form else "<"
    if form == "ascii":
        rows = [f"{x} {y} {z} 10 20 30" for x, y, z in SQUARE]
        rows += [" ".join(map(str, [len(p), *p, 0.5])) for p in POLYGONS]
        return line_end.join([*header[:-1], *rows, ""]).encode()
    body = b"".join(struct.pack(order + "ffdBBB", *p, 10, 20, 30) for p in SQUARE)
    body += b"".join(struct.pack(f"{order}B{len(p)}if", len(p), *p, 0.5) for p in POLYGONS)
    return line_end.join(header).encode() + body


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_polygons_of_mixed_length_become_fans_in_file_order(form, line_end):
    vertices, faces, attributes = read_ply(pyramid(form, line_end))
    assert vertices.tolist() == SQUARE
    assert faces.tolist() == TRIANGLES
    assert attributes["color"].tolist() == [[10, 20, 30, 255]] * 5


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_every_cut_is_noticed(form):
    whole = pyramid(form)
    # the last number of an ASCII file may lose digits unseen
    for length in range(len(whole) - (4 if form == "ascii" else 0)):
        with pytest.raises(ValueError, match=r"truncated|header|odd line|no number"):
            read_ply(whole[:length])


def test_a_cut_says_what_was_promised_and_what_is_there():
    ball = ply_bytes(icosphere(1.0, 1))
    with pytest.raises(ValueError, match="promises 80 of 'face', 79 are there"):
        read_ply(ball[:-1])
    with pytest.raises(ValueError, match="promises 42 of 'vertex', 30 are there"):
        read_ply(ball[: ball.index(b"end_header\n") + 11 + 30 * 24 + 5])
    with pytest.raises(ValueError, match="promises 5 of 'face', 3 are there"):
        read_ply(pyramid("binary_little_endian")[:-20])


def test_triangle_strips_are_unrolled_with_even_winding():
    header = b"ply\nformat ascii 1.0\nelement vertex 7\nproperty float x\nproperty float y\nproperty float z\n"
    header += b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    points = b"".join(b"%d %d 0\n" % (i // 2, i % 2) for i in range(7))
    _, faces, _ = read_ply(header + points + b"8 0 1 2 3 -1 4 5 6\n")
    assert faces.tolist() == [[0, 1, 2], [2, 1, 3], [4, 5, 6]]


def test_fans_leave_out_what_is_no_polygon():
    assert fans(np.array([2, 5, 0, 3]), np.arange(10)).tolist() == [[2, 3, 4], [2, 4, 5], [2, 5, 6], [7, 8, 9]]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"ply\n", b"plx\n"),
        (b"property float x", b"property half x"),
        (b"element vertex 5", b"element vertex five"),
        (b"element vertex 5", b"element vertex -5"),
        (b"format ascii 1.0", b"comment none"),
        (b"end_header", b"end"),
        (b"property float x", b"property float w"),
        (b"0.5 0.5 1 10", b"0.5 abc 1 10"),
    ],
)
def test_what_is_no_ply_file_is_refused(old, new):
    assert old in pyramid("ascii")
    with pytest.raises(ValueError, match=r"header|vertices have no x|no number"):
        read_ply(pyramid("ascii").replace(old, new, 1))


def test_texture_coordinates_normals_and_float_colors_are_kept():
    names = ["x", "y", "z", "nx", "ny", "nz", "u", "v", "red", "green", "blue", "alpha"]
    header = "\n".join(["ply", "format ascii 1.0", "element vertex 1", *(f"property float {n}" for n in names)])
    _, faces, attributes = read_ply(f"{header}\nend_header\n1 2 3 0 0 1 0.25 0.75 1 0.5 0 1\n".encode())
    assert len(faces) == 0
    assert attributes["normal"].tolist() == [[0, 0, 1]]
    assert attributes["uv"].tolist() == [[0.25, 0.75]]
    assert attributes["color"].tolist() == [[255, 128, 0, 255]]


def test_not_a_number_is_read_as_such():
    vertices, _, _ = read_ply(pyramid("ascii").replace(b"0.5 0.5 1 10", b"nan -inf 1 10"))
    assert np.isnan(vertices[4, 0])
    assert vertices[4, 1] == -np.inf


@pytest.mark.parametrize("element", ["vertex", "face"])
def test_absurd_counts_are_refused_without_room_for_them(element):
    with pytest.raises(ValueError, match="promises 900000000000"):
        read_ply(pyramid("binary_little_endian").replace(f"{element} 5".encode(), f"{element} 900000000000".encode()))
    with pytest.raises(ValueError, match="no properties"):
        read_ply(b"ply\nformat ascii 1.0\nelement face 900000000000\nend_header\n")
