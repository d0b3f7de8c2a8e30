"""Every code: a mesh that triggers it, a near miss that does not, the tolerance its message states, and its cure."""

from typing import NamedTuple

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.rays import RAY_OFFSET
from sss_tools.repair.ladder import repair_mesh
from sss_tools.validation.outcome import FixSafety, Outcome
from sss_tools.validation.rule import Context, Neighbour, all_rules
from sss_tools.validation.run import check_file, check_mesh
from sss_tools.writing import write_mesh

BOX = shapes.box()
BALL = shapes.icosphere(1.0, 3)
EXACT = "exact, no tolerance"
UNIT_BOX = 3**0.5


class Case(NamedTuple):
    """Meshes either side of a rule's line, what the rule says of the first, and what is known besides each mesh."""

    trigger: Mesh
    near_miss: Mesh
    states: tuple[str, ...]
    context: Context = Context()
    near_context: Context | None = None


def box_with(faces=(), vertices=()):
    points = np.concatenate([BOX.vertices, np.reshape(np.asarray(vertices, float), (-1, 3))])
    return Mesh(points, np.concatenate([BOX.faces, np.reshape(np.asarray(faces, int), (-1, 3))]))


def cracked(gap):
    """A box whose lid stands ``gap`` above its sides."""
    lid = BOX.vertices[BOX.faces][..., 2].min(axis=1) > 0
    vertices = np.concatenate([BOX.vertices, BOX.vertices + np.array([0, 0, gap])])
    return Mesh(vertices, np.where(lid[:, None], BOX.faces + len(BOX.vertices), BOX.faces))


def turned(faces):
    mixed = BOX.faces.copy()
    mixed[faces] = mixed[faces, ::-1]
    return Mesh(BOX.vertices, mixed)


def two(*offset):
    """Two unit boxes, the second moved by ``offset``."""
    return shapes.joined(BOX, shapes.moved(BOX, offset))


def shard(height):
    """A flat tetrahedron: a box's neighbour all faces of which are ``height`` high or more."""
    points = np.array([[3.0, 0, 0], [4, 0, 0], [3.5, height, 0], [3.5, height / 2, height]])
    return shapes.joined(BOX, Mesh(points, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))


def with_split_edge():
    """A box one edge of which has a point in its middle on one side and a face without height on the other."""
    a, b, _ = BOX.faces[0]
    (other,) = (k for k in range(1, 12) if {a, b} <= set(BOX.faces[k].tolist()))
    faces = [face for k, face in enumerate(BOX.faces.tolist()) if k]
    c = next(corner for corner in BOX.faces[0] if corner not in (a, b))
    assert other
    faces += [[a, 8, c], [8, b, c], [a, b, 8]]
    return Mesh(np.concatenate([BOX.vertices, [(BOX.vertices[a] + BOX.vertices[b]) / 2]]), faces)


def with_corner(value):
    vertices = BOX.vertices.copy()
    vertices[3, 1] = value
    return Mesh(vertices, BOX.faces)


def made_of(mean_free_path, unit="cm", **more):
    return Context(Medium.from_albedo(0.9, 1 / mean_free_path), unit, **more)


def beside(gap):
    return Context(unit="cm", neighbours=(Neighbour("other", shapes.moved(BOX, [1 + gap, 0.25, 0.25])),))


RESOLVED = 4 * float(RAY_OFFSET)
"""Twice the ray offset in a scene two units long."""

CASES = {
    "SSS101": Case(shapes.punctured(BALL, [[0, 0, 1]], 0.3), BALL, ("1 hole", "units across", "% of the diagonal")),
    "SSS102": Case(
        shapes.joined(BOX, shapes.moved(Mesh(BOX.vertices, BOX.faces[:2]), [3, 0, 0])),
        shapes.joined(BOX, shapes.moved(BOX, [3, 0, 0])),
        ("1 of 2 components encloses nothing", "winding number below 0.75"),
    ),
    "SSS103": Case(cracked(0.9e-5 * UNIT_BOX), cracked(1.2e-5 * UNIT_BOX), ("1.73e-05 units", "1e-05 of the diagonal")),
    "SSS201": Case(two(1, 1, 0), two(1.001, 1.001, 0), ("1 edge", EXACT)),
    "SSS202": Case(two(1, 1, 1), two(1.001, 1.001, 1.001), ("1 vertex", EXACT)),
    "SSS203": Case(turned([0]), BOX, ("3 edges", EXACT)),
    "SSS204": Case(shapes.inverted(BOX), BOX, ("1 solid", "by the sign of the volume, no tolerance")),
    "SSS301": Case(
        shapes.joined(shapes.box(4.0), BALL),
        shapes.joined(shapes.box(4.0), shapes.moved(BALL, [3.1, 0, 0])),
        ("1 component inside a solid", "more than 0.5 of a turn"),
    ),
    "SSS302": Case(two(1, 0.25, 0.25), two(1 + 2.0**-52, 0.25, 0.25), ("pairs of faces", EXACT)),
    "SSS303": Case(box_with(BOX.faces[:1]), BOX, ("1 face", EXACT)),
    "SSS304": Case(BOX, BOX, ("overlaps or touches other", EXACT), beside(0.0), beside(2.0**-50)),
    "SSS305": Case(shapes.hollow_ball(), BALL, ("1 void", "cubic units", "more than 0.5 of a turn")),
    "SSS401": Case(shard(0.9e-9 * 4.6), shard(1.2e-9 * 4.6), ("without area", "units", "1e-09 of the diagonal")),
    "SSS402": Case(
        shapes.box([1, 1, 1 / 1100]), shapes.box([1, 1, 1 / 900]), ("more than 1000 times as long as high",)
    ),
    "SSS403": Case(box_with(vertices=[[0, 0, 0.1]]), BOX, ("1 vertex that no face uses",)),
    "SSS404": Case(
        shapes.cylinder(1.0, 2.0, 12),
        shapes.cylinder(1.0, 2.0, 20),
        ("20 to 30 degrees", "more than 45", "transport mean free path of 0.1 cm"),
        made_of(0.1),
    ),
    "SSS501": Case(
        shapes.slab(1.0, 0.099),
        shapes.slab(1.0, 0.101),
        ("thinner than 0.1 cm", "ray offset of 1e-06 cm"),
        made_of(0.1),
    ),
    "SSS502": Case(BALL, BALL, ("like glass", "free path is 1.4 cm"), made_of(1.4), made_of(1.2)),
    "SSS503": Case(
        BOX,
        BOX,
        ("rays need 4e-06 cm", "2e-06 of the scene's longest side"),
        beside(0.9 * RESOLVED),
        beside(1.1 * RESOLVED),
    ),
    "SSS601": Case(
        shapes.moved(BALL, [1e6, 0, 0]), shapes.moved(BALL, [1e4, 0, 0]), ("steps of single precision", "0.0625 units")
    ),
    "SSS602": Case(with_corner(1e39), with_corner(1e38), ("single precision ends at 3.4e38",)),
    "SSS701": Case(Mesh(BOX.vertices, np.zeros((0, 3), int)), BOX, ("no faces (8 vertices)",)),
}


def result_of(code, mesh, context):
    (result,) = (rule for rule in check_mesh(mesh, context).rules if rule.code == code)
    return result


def test_there_is_a_case_for_every_code():
    assert {*CASES, "SSS702"} == {rule.code for rule in all_rules()}


@pytest.mark.parametrize("code", CASES)
def test_the_trigger_fails_and_states_the_tolerance_and_its_unit(code):
    case = CASES[code]
    result = result_of(code, case.trigger, case.context)
    assert result.outcome == Outcome.FAIL and result.count >= 1
    assert [text for text in case.states if text not in result.message] == [], result.message


@pytest.mark.parametrize("code", CASES)
def test_the_near_miss_passes(code):
    case = CASES[code]
    near_miss = case.near_context or case.context
    assert result_of(code, case.near_miss, near_miss).outcome == Outcome.PASS


@pytest.mark.parametrize("code", CASES)
def test_a_finding_says_where_it_is(code):
    case = CASES[code]
    result = result_of(code, case.trigger, case.context)
    listed = result.faces or result.edges or result.vertices or result.face_pairs
    assert bool(listed) == (code != "SSS701")


def test_a_file_cut_short_is_unreadable_and_a_whole_one_is_not(tmp_path):
    path = tmp_path / "ball.ply"
    write_mesh(BALL, path)
    data = path.read_bytes()
    path.write_bytes(data[:-1])
    (cut,) = check_file(path).findings
    assert (cut.code, cut.count) == ("SSS702", 1) and cut.message
    path.write_bytes(data)
    assert not check_file(path).findings


FIXED = [rule for rule in all_rules() if rule.fix_safety != FixSafety.NONE]


@pytest.mark.parametrize("rule", FIXED, ids=lambda rule: rule.code)
def test_a_fix_that_is_promised_is_made(rule):
    """A safe fix by the safe rungs alone. What a rule calls unsafe those leave, or it would be safe."""
    case = CASES[rule.code]
    # of a solid that is flat nothing would be left
    broken = with_split_edge() if rule.code == "SSS401" else case.trigger
    assert result_of(rule.code, broken, case.context).outcome == Outcome.FAIL
    cured = {}
    for unsafe in (False, True):
        result, _ = repair_mesh(broken, unsafe=unsafe)
        cured[unsafe] = result is not None and result_of(rule.code, result, case.context).outcome == Outcome.PASS
    assert cured == {False: rule.fix_safety == FixSafety.SAFE, True: True}
