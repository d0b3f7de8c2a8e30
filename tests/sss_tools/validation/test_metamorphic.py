"""What the file's frame, order and seams must not change: the findings.

For every rule there is a mesh that triggers it and a near miss. Each is turned, moved by a thousand times its size,
scaled by 1e-6 to 1e6, permuted and split at seams; then *every* rule must answer as before: the same outcome, the same
count, the same faces, edges, vertices and pairs. Lengths in the material are scaled along.

Where that cannot be, it is said here, and what holds all the same is tested at the end:

- SSS601 is about the place: moving is what it warns of. (``EXEMPT``)
- SSS602 counts the file's vertices: a seam through a bad one makes it two. (``EXEMPT``)
- SSS302 and SSS304 are exact, so contacts without depth are there or not as rounding has it, and SSS301, SSS503 with
  them. They are compared after changes that round nothing: quarter turns, powers of two. (``Case.contact``)
- SSS501 casts rays, and which of two faces in one place a ray meets first is chance. (``Case.coincident``)
- SSS502 takes what is not closed for its box, and SSS501, SSS503 and SSS103 have tolerances relative to the box, which
  turning changes by up to the square root of three: they are compared beyond that factor. (SSS502: ``Case.by_box``)
- SSS301 lists the cut faces that its budget reaches, the largest first; of a mesh this small, all.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.validation import run
from sss_tools.validation.outcome import FixSafety, Severity
from sss_tools.validation.rule import Context, Finding, Neighbour, Rule, all_rules
from tests.sss_tools.validation.metamorphic import (
    Change,
    answers,
    moved_by,
    permuted,
    scaled,
    split_at_seams,
    turned,
    turned_at_random,
)

BALL = shapes.icosphere(1.0, 2)
BOX = shapes.box()
NOTHING = Mesh(BALL.vertices, np.zeros((0, 3), int))
CLOUDY = Medium.from_albedo([0.9, 0.8, 0.7], 10.0)
"""Mean free path 0.1."""
ALONE = Context(CLOUDY, "mm", ())


def with_faces(mesh, *faces):
    return Mesh(mesh.vertices, np.concatenate([mesh.faces, np.array(faces)]))


def with_vertices(mesh, *vertices):
    return Mesh(np.concatenate([mesh.vertices, np.array(vertices, float)]), mesh.faces)


def flipped(mesh, chosen):
    faces = mesh.faces.copy()
    faces[chosen] = faces[chosen][:, ::-1]
    return Mesh(mesh.vertices, faces)


def ball_at(*place, radius=1.0):
    return shapes.moved(shapes.icosphere(radius, 2), place)


def box_at(*place, size=1.0):
    return shapes.moved(shapes.box(size), place)


def part_of_ball(half_angle, subdivisions=3):
    """What is within an angle of the pole, degrees."""
    ball = shapes.icosphere(1.0, subdivisions)
    height = ball.vertices[ball.faces].mean(axis=1)[:, 2]
    return Mesh(ball.vertices, ball.faces[height > np.cos(np.radians(half_angle))])


def cracked_box(gap):
    """A box whose top stands ``gap`` above its sides."""
    top = (BOX.vertices[BOX.faces][..., 2] == 0.5).all(axis=1)
    vertices = np.concatenate([BOX.vertices, BOX.vertices + np.array([0, 0, gap])])
    return Mesh(vertices, np.where(top[:, None], BOX.faces + 8, BOX.faces))


def balls_joined_at_a_vertex(apart=0.0):
    """Two balls, one the mirror image of the other in a common vertex."""
    corner = BALL.vertices[0]
    return shapes.joined(BALL, Mesh(corner - (BALL.vertices - corner) + apart * corner, BALL.faces[:, ::-1]))


def with_sliver(mesh, height):
    """One more face over the first side, as good as flat."""
    a, b, c = mesh.vertices[mesh.faces[0]]
    more = with_vertices(mesh, (a + b) / 2 + height * (a + b - 2 * c))
    return with_faces(more, [*mesh.faces[0, [1, 0]], len(mesh.vertices)])


def with_copies(mesh, *orders):
    """The fourth face once more for each order of its corners."""
    return with_faces(mesh, *(mesh.faces[3, order] for order in orders))


def with_a_bad_vertex(mesh):
    vertices = mesh.vertices.copy()
    vertices[5, 1] = np.nan
    return Mesh(vertices, mesh.faces)


def beside(other):
    return Context(CLOUDY, "mm", (Neighbour("other", other),))


TOUCHING = shapes.joined(BOX, box_at(1, 0.25, 0.25))


@dataclass(frozen=True, eq=False)
class Case:
    """A mesh in its context, and what must be found there.

    code        the rule it is about
    triggers    whether that rule finds something, or only nearly
    contact     codes that hang on a contact without depth: compared only after changes that round nothing
    coincident  faces lie in one place: which of them SSS501 names is chance
    by_box      it is judged by its box, near what SSS502 allows
    """

    code: str
    name: str
    triggers: bool
    mesh: Mesh
    context: Context = ALONE
    contact: frozenset[str] = frozenset()
    coincident: bool = False
    by_box: bool = False

    @property
    def size(self) -> float:
        """Longest side of what is finite."""
        finite = self.mesh.vertices[np.isfinite(self.mesh.vertices).all(axis=1)]
        return float(np.ptp(finite, axis=0).max())


def cases_of(code, trigger, near_miss, context=ALONE, near_context=None, contact=(), coincident=False):
    """The mesh that triggers a rule, and the near miss."""
    return [
        Case(code, f"{code} found", True, trigger, context, frozenset(contact), coincident),
        Case(code, f"{code} near miss", False, near_miss, near_context or context, frozenset(contact)),
    ]


CASES = [
    *cases_of("SSS101", shapes.punctured(BALL, [[0, 0, 1]], 0.4), part_of_ball(50)),
    *cases_of("SSS102", part_of_ball(50), part_of_ball(100)),
    *cases_of("SSS103", cracked_box(1e-6), cracked_box(1e-3)),
    *cases_of("SSS201", shapes.joined(BOX, box_at(1, 1, 0)), shapes.joined(BOX, box_at(1.001, 1.001, 0))),
    *cases_of("SSS202", balls_joined_at_a_vertex(), balls_joined_at_a_vertex(1e-6)),
    *cases_of("SSS203", flipped(BALL, [7, 8, 40]), BALL),
    *cases_of("SSS204", shapes.joined(shapes.inverted(BALL), ball_at(3, 0, 0)), shapes.hollow_ball(1.0, 0.5, 2)),
    *cases_of("SSS301", shapes.with_internal(BALL, [0.1, 0, 0], 0.3, 1), shapes.hollow_ball(1.0, 0.9, 2)),
    *cases_of("SSS302", shapes.joined(BALL, ball_at(1.3, 0.2, 0.1)), shapes.joined(BALL, ball_at(2.001, 0, 0))),
    *cases_of("SSS303", with_copies(BALL, [2, 1, 0]), with_copies(BALL, [0, 0, 1]), coincident=True),
    *cases_of("SSS304", BOX, BOX, beside(box_at(0.7, 0.3, 0.2)), beside(box_at(1.5, 0.3, 0.2))),
    *cases_of("SSS305", shapes.hollow_ball(1.0, 0.5, 2), shapes.joined(BALL, shapes.inverted(ball_at(3, 0, 0)))),
    # the sliver lies in its neighbour's plane as exactly as rounding has it
    *cases_of("SSS401", with_sliver(BOX, 1e-12), with_sliver(BOX, 1e-6), contact=["SSS301", "SSS302"]),
    *cases_of("SSS402", shapes.box([1, 1, 1 / 1100]), shapes.box([1, 1, 1 / 900])),
    *cases_of("SSS403", with_vertices(BOX, [0, 0, 0.1], [9, 9, 9]), BOX),
    *cases_of("SSS404", shapes.cylinder(1.0, 2.0, 12), shapes.cylinder(1.0, 2.0, 20)),
    *cases_of("SSS501", shapes.slab(1.0, 0.09), shapes.slab(1.0, 0.11)),
    *cases_of("SSS502", shapes.icosphere(0.07, 2), shapes.icosphere(0.08, 2)),
    *cases_of("SSS503", BOX, BOX, beside(box_at(1 + 1e-7, 0.3, 0.2)), beside(box_at(1 + 1e-3, 0.3, 0.2))),
    *cases_of("SSS601", ball_at(1e8, 2e7, 0), ball_at(1e3, 2e2, 0)),
    *cases_of("SSS602", with_a_bad_vertex(BALL), BALL),
    *cases_of("SSS701", NOTHING, part_of_ball(20)),
    # what meets, nests and repeats
    Case("SSS302", "deep overlap", True, shapes.joined(BALL, ball_at(0.4, 0.1, 0.1))),
    Case("SSS301", "deep overlap of unlike balls", True, shapes.joined(BALL, ball_at(0.9, 0.1, 0.2, radius=0.5))),
    Case("SSS301", "three in a row", True, shapes.joined(BALL, ball_at(0.6, 0.1, 0.2), ball_at(1.2, -0.1, 0.3))),
    Case("SSS301", "boxes that overlap", True, shapes.joined(BOX, box_at(0.7, 0.6, 0.8))),
    Case("SSS305", "broken out", True, shapes.joined(BALL, shapes.inverted(ball_at(0.41, 0.07, 0.32, radius=0.6)))),
    Case("SSS101", "open box", True, Mesh(BOX.vertices, BOX.faces[2:])),
    Case("SSS204", "inside out with a hole", True, shapes.inverted(shapes.punctured(BALL, [[0, 0, 1]], 0.4))),
    Case("SSS303", "copies of one face", True, with_copies(BOX, [0, 1, 2], [2, 1, 0], [1, 2, 0]), coincident=True),
    Case("SSS201", "box with a fin", True, with_faces(with_vertices(BOX, [-1.2, 0.1, 1.3]), [1, 3, 8])),
    Case("SSS302", "boxes that touch", True, TOUCHING, ALONE, frozenset(["SSS301", "SSS302"]), coincident=True),
    Case("SSS304", "neighbours that touch", True, BOX, beside(box_at(1, 0.25, 0.25)), frozenset(["SSS304", "SSS503"])),
    Case("SSS102", "single triangle", True, Mesh(BALL.vertices[BALL.faces[0]], [[0, 1, 2]]), by_box=True),
]

EXEMPT = {"moved": {"SSS601"}, "split": {"SSS602"}}
"""Codes that may answer otherwise, by kind of change."""


def changes_of(case: Case) -> list[Change]:
    """What is done to each mesh."""
    far = 2.0 ** np.ceil(np.log2(1000 * case.size))
    return [
        turned(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), "turned by right angles", exact=True),
        *(turned_at_random(seed) for seed in (1, 2, 3)),
        moved_by(np.array([1.0, -0.7, 0.4]) * 1000 * case.size, "moved"),
        moved_by(np.array([1.0, -0.5, 0.25]) * far, "moved by powers of two", exact=case.size == 1),
        *(scaled(factor) for factor in (2.0**-20, 2.0**20, 1e-6, 1e-3, 1e3, 1e6)),
        *(permuted(seed) for seed in (4, 5)),
        split_at_seams(1.0),
        split_at_seams(0.5),
    ]


@cache
def answers_at_first(case: Case):
    return answers(case.mesh, case.context)


def differing(case: Case, change: Change) -> dict[str, tuple]:
    """The rules that answer otherwise after a change, but for those that may: what they said, and what they say."""
    exempt = set(EXEMPT.get(change.kind, ()))
    if not change.exact:
        exempt |= case.contact
    if case.coincident:
        exempt.add("SSS501")
    if case.by_box and change.kind == "turned":
        exempt.add("SSS502")
    before, after = answers_at_first(case), answers(case.mesh, case.context, change)
    return {code: (before[code], after[code]) for code in before.keys() - exempt if before[code] != after[code]}


def test_every_rule_has_a_mesh_that_triggers_it_and_a_near_miss():
    about = {(case.code, case.triggers) for case in CASES}
    # a mesh in hand was readable
    codes = {rule.code for rule in all_rules()} - {"SSS702"}
    assert about == {(code, triggers) for code in codes for triggers in (True, False)}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_mesh_triggers_its_rule_and_the_near_miss_does_not(case):
    assert (answers_at_first(case)[case.code].outcome == "fail") == case.triggers


@pytest.mark.parametrize("number", range(len(changes_of(CASES[0]))), ids=[c.name for c in changes_of(CASES[0])])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_frame_order_and_seams_change_no_answer(case, number):
    assert differing(case, changes_of(case)[number]) == {}


# What holds for the rules that are exempt.


def test_moving_far_and_back_leaves_float32_resolution_as_it_was():
    # edges of 1e-3 of the whole: resolved at home, not a million sizes away
    mesh = shapes.joined(BOX, box_at(2, 0, 0, size=1e-3))
    there, back = (moved_by([sign * 2.0**20, 0, 0], "moved") for sign in (1, -1))
    home = answers(mesh, Context())["SSS601"]
    away = there.apply(mesh).mesh
    assert (home.outcome, answers(mesh, Context(), there)["SSS601"].outcome) == ("pass", "fail")
    # the small box has corners at odd multiples of 0.0005, rounded at most to 2^-33 out there
    assert answers(away, Context(), back)["SSS601"] == home


def test_a_seam_through_a_bad_vertex_changes_neither_outcome_nor_faces():
    mesh = with_a_bad_vertex(BALL)
    before, after = (answers(mesh, ALONE, change)["SSS602"] for change in (permuted(1), split_at_seams(1.0)))
    assert (before.outcome, before.faces) == (after.outcome, after.faces)
    assert before.count == 1 and after.count == len(before.faces)


@pytest.mark.parametrize("depth", [1e-9, -1e-9])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_contacts_deeper_than_rounding_do_not_hang_on_the_frame(depth, seed):
    """A billionth deep or apart is a million times the rounding of turned coordinates, 1e-16."""
    boxes = shapes.joined(BOX, box_at(1 - depth, 0.23, 0.31))
    near = Case("SSS302", "", depth > 0, boxes)
    assert answers(boxes, ALONE)["SSS302"] == answers(boxes, ALONE, turned_at_random(seed))["SSS302"]
    assert (answers_at_first(near)["SSS302"].outcome == "fail") == near.triggers
    context = beside(box_at(1 - depth, 0.23, 0.31))
    assert answers(BOX, context)["SSS304"] == answers(BOX, context, turned_at_random(seed))["SSS304"]


@pytest.mark.parametrize("case", [case for case in CASES if case.coincident], ids=lambda case: case.name)
def test_thin_walls_differ_only_where_faces_coincide(case):
    before = answers_at_first(case)
    double = before["SSS302"].faces | before["SSS303"].faces
    for change in changes_of(case):
        after = answers(case.mesh, case.context, change)["SSS501"]
        assert before["SSS501"].faces ^ after.faces <= double, change.name


# That the comparison can fail: rules with an error planted, and the kind of change that must bring it to light.


def has_short_edges(subject):
    """An absolute tolerance."""
    corners = subject.mesh.vertices[subject.mesh.faces]
    faces = np.flatnonzero((np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2) < 1e-3).any(axis=1))
    return Finding(len(faces), "short edges", faces) if len(faces) else None


def is_tall(subject):
    """A direction of the frame."""
    sides = np.ptp(subject.mesh.bounds, axis=0)
    return Finding(1, "taller than wide") if sides[2] > 1.1 * sides[0] else None


def is_far(subject):
    """The origin."""
    return Finding(1, "far") if np.abs(subject.mesh.bounds).max() > 100 * subject.mesh.longest_side else None


def begins_large(subject):
    """The order of the faces."""
    areas = subject.mesh.face_areas
    return Finding(1, "large") if areas[0] > areas.mean() else None


def has_open_edges(subject):
    """Edges by vertex, not by place: every seam is a gap."""
    edges = np.sort(subject.mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    single = np.unique(edges, axis=0, return_counts=True)[1] == 1
    return Finding(int(single.sum()), "open edges") if single.any() else None


def names_the_first_face(subject):
    """Faces that are not those meant; outcome and count are right."""
    return Finding(1, "something", faces=[0])


@pytest.mark.parametrize(
    ("check", "kind"),
    [
        (has_short_edges, "scaled"),
        (is_tall, "turned"),
        (is_far, "moved"),
        (begins_large, "permuted"),
        (has_open_edges, "split"),
        (names_the_first_face, "permuted"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_planted_error_comes_to_light(monkeypatch, check, kind):
    planted = Rule("SSS999", "planted", Severity.ERROR, "", "", "", FixSafety.NONE, check)
    monkeypatch.setattr(run, "all_rules", lambda: (*all_rules(), planted))
    case = Case("SSS999", "planted", True, shapes.cylinder(0.4, 1.0, 12))
    caught = {change.kind for change in changes_of(case) if "SSS999" in differing(case, change)}
    assert caught == {kind}
