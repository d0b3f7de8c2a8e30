"""What the file's frame, order and seams must not change: the findings.

Every mesh is turned, moved, scaled, permuted and cut at seams, and each rule must find as many of what it names as
before. Turns round coordinates, so meshes whose fault is an exact contact are only turned by right angles.
"""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.validation.rule import Context, Neighbour
from sss_tools.validation.run import check_mesh

RIGHT = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
"""A turn that permutes coordinates and changes signs: exact."""

ANY = np.linalg.qr(np.array([[0.3, -0.8, 0.5], [0.9, 0.2, -0.3], [0.1, 0.6, 0.7]]))[0]
ANY *= np.linalg.det(ANY)


def without(mesh, face):
    return Mesh(mesh.vertices, np.delete(mesh.faces, face, axis=0))


def with_faces(mesh, *faces):
    return Mesh(mesh.vertices, np.concatenate([mesh.faces, np.array(faces)]))


def flipped(mesh, chosen):
    faces = mesh.faces.copy()
    faces[chosen] = faces[chosen][:, ::-1]
    return Mesh(mesh.vertices, faces)


def touching_boxes():
    return shapes.joined(shapes.box(), shapes.moved(shapes.box(), [1, 0.25, 0.25]))


BALL = shapes.icosphere(1.0, 2)
GENERAL = {
    "sound ball": BALL,
    "ball with a hole": shapes.punctured(BALL, [[0, 0, 1]], 0.4),
    "turned inside out": shapes.inverted(BALL),
    "with a turned face": flipped(BALL, [7]),
    "hollow": shapes.hollow_ball(1.0, 0.5, 2),
    "with a seed": shapes.with_internal(BALL, [0.1, 0, 0], 0.3, 1),
    "overlapping balls": shapes.joined(BALL, shapes.moved(BALL, [1.3, 0.2, 0.1])),
    "thin plate": shapes.slab(1.0, 0.02),
    "rough cylinder": shapes.cylinder(0.5, 1.0, 12),
    "sheet": Mesh(BALL.vertices[BALL.faces[:9]].reshape(-1, 3), np.arange(27).reshape(-1, 3)),
}
EXACT = {
    "touching boxes": touching_boxes(),
    "with a copied face": with_faces(shapes.box(), shapes.box().faces[3, ::-1]),
    "with a face folded back": with_faces(without(shapes.box(), 0), shapes.box().faces[0, [1, 0, 2]]),
    "with a collapsed face": with_faces(shapes.box(), [0, 1, 1]),
}
MEDIUM = Medium.from_albedo([0.9, 0.8, 0.7], 10.0)


def findings(mesh, scale=1.0):
    context = Context(MEDIUM.scaled(1 / scale), "mm", ())
    return {(rule.code, rule.count) for rule in check_mesh(mesh, context).findings}


def permuted(mesh, seed=4):
    random = np.random.default_rng(seed)
    place = random.permutation(len(mesh.vertices))
    vertices = np.empty_like(mesh.vertices)
    vertices[place] = mesh.vertices
    faces = place[mesh.faces][random.permutation(len(mesh.faces))]
    turn = random.integers(0, 3, len(faces))[:, None]
    return Mesh(vertices, np.take_along_axis(faces, (np.arange(3) + turn) % 3, axis=1))


def split_at_seams(mesh):
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


@pytest.mark.parametrize("name", GENERAL | EXACT)
def test_order_and_seams_change_no_finding(name):
    mesh = (GENERAL | EXACT)[name]
    expected = findings(mesh)
    assert expected or name == "sound ball"
    assert findings(permuted(mesh)) == expected
    assert findings(split_at_seams(mesh)) == expected


@pytest.mark.parametrize("name", GENERAL | EXACT)
@pytest.mark.parametrize("power", [-20, 20])
def test_scale_changes_no_finding(name, power):
    # a millionth and a million; a power of two, so that exact contacts stay exact
    scale = 2.0**power
    mesh = (GENERAL | EXACT)[name]
    assert findings(Mesh(mesh.vertices * scale, mesh.faces), scale) == findings(mesh)


@pytest.mark.parametrize("name", GENERAL)
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scale_by_powers_of_ten_changes_no_finding_of_general_meshes(name, scale):
    mesh = GENERAL[name]
    assert findings(Mesh(mesh.vertices * scale, mesh.faces), scale) == findings(mesh)


@pytest.mark.parametrize("name", GENERAL)
def test_turning_changes_no_finding(name):
    mesh = GENERAL[name]
    assert findings(Mesh(mesh.vertices @ ANY.T, mesh.faces)) == findings(mesh)


@pytest.mark.parametrize("name", EXACT)
def test_turning_by_right_angles_changes_no_finding_of_exact_contacts(name):
    mesh = EXACT[name]
    assert findings(Mesh(mesh.vertices @ RIGHT.T, mesh.faces)) == findings(mesh)


@pytest.mark.parametrize("name", GENERAL)
def test_moving_by_a_thousand_extents_changes_no_finding(name):
    mesh = GENERAL[name]
    assert findings(Mesh(mesh.vertices + np.array([1e3, -7e2, 4e2]) * mesh.longest_side, mesh.faces)) == findings(mesh)


@pytest.mark.parametrize("gap", [-0.5, 0.0, 1e-7, 0.5])
def test_findings_between_neighbours_do_not_depend_on_frame_and_order(gap):
    box, other = shapes.box(), shapes.moved(shapes.box(), [1 + gap, 0.25, 0.25])

    def outcomes(change):
        context = Context(neighbours=(Neighbour("other", change(other)),))
        return {
            rule.code: (rule.outcome, rule.count)
            for rule in check_mesh(change(box), context).rules
            if rule.code in ("SSS304", "SSS503")
        }

    expected = outcomes(lambda mesh: mesh)
    assert outcomes(permuted) == outcomes(split_at_seams) == expected
    for scale in (2.0**-20, 2.0**20):
        assert outcomes(lambda mesh, scale=scale: Mesh(mesh.vertices * scale, mesh.faces)) == expected
    assert outcomes(lambda mesh: Mesh(mesh.vertices @ RIGHT.T, mesh.faces)) == expected
    assert outcomes(lambda mesh: Mesh(mesh.vertices + np.array([1024.0, -512, 256]), mesh.faces)) == expected
