"""weld, degenerates, duplicates, orientation: each with a mesh that needs it, and one that all but does."""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.repair import repair_mesh
from sss_tools.repair.degenerates import remove_degenerates
from sss_tools.repair.draft import Draft
from sss_tools.repair.duplicates import remove_duplicates
from sss_tools.repair.judge import Examined
from sss_tools.repair.orientation import orient
from sss_tools.repair.weld import weld


def faults(mesh: Mesh) -> dict[str, int]:
    return Examined(Draft.of(mesh)).condition.faults()


def unwelded(mesh: Mesh, gap: float) -> Mesh:
    """Every corner a vertex of its own, shaken by up to ``gap`` of the diagonal."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    noise = np.random.default_rng(3).uniform(-1, 1, corners.shape) / np.sqrt(3)
    return Mesh(corners + gap * mesh.diagonal / 2 * noise, np.arange(len(corners)).reshape(-1, 3))


def two_boxes_with_a_double_wall() -> Mesh:
    """Two boxes side by side, each complete: the wall between them is there twice, facing both ways."""
    box = shapes.box()
    return shapes.joined(box, Mesh(box.vertices * (-1, 1, 1) + (1, 0, 0), box.faces[:, ::-1]))


class TestWeld:
    def test_a_seam_within_the_tolerance_is_closed(self):
        # half of SSS103's tolerance of 1e-5
        welded = weld(Draft.of(unwelded(shapes.icosphere(), 5e-6)))
        assert welded is not None
        assert len(welded.topology.boundary_edges) == 0

    def test_a_gap_ten_times_the_tolerance_is_no_seam(self):
        box = shapes.box()
        apart = shapes.joined(shapes.punctured(box, [[0, 0, 0.5]], 0.3), shapes.moved(top(box), (0, 0, 1e-4 * 1.75)))
        assert weld(Draft.of(apart)) is None

    def test_a_whole_mesh_is_left_alone(self):
        assert weld(Draft.of(shapes.icosphere())) is None


def top(box: Mesh) -> Mesh:
    """The two faces of a box at z = 0.5."""
    return Mesh(box.vertices, box.faces[(box.vertices[box.faces][..., 2] == 0.5).all(axis=1)])


class TestDegenerates:
    def test_faces_with_a_repeated_corner_are_dropped(self):
        box = shapes.box()
        mesh = Mesh(box.vertices, np.concatenate([box.faces, [[0, 0, 1], [3, 3, 3]]]))
        draft = remove_degenerates(Draft.of(mesh))
        assert draft is not None
        assert len(draft.faces) == 12
        assert faults(draft.mesh) == {}

    def test_an_edge_without_length_is_collapsed_and_nothing_opens(self):
        ball = shapes.icosphere(1.0, 2)
        vertices = ball.vertices.copy()
        a, b = ball.faces[0, :2]
        vertices[b] = vertices[a] + 1e-12
        draft = remove_degenerates(Draft.of(Mesh(vertices, ball.faces)))
        assert draft is not None
        assert len(draft.faces) == len(ball.faces) - 2
        assert faults(draft.mesh) == {}

    def test_a_flat_triangle_is_flipped_away(self):
        # the middle of an edge as a point of one of its two faces only: a flat face fills the crack
        box = shapes.box()
        a, b, c = box.faces[0]
        middle = (box.vertices[a] + box.vertices[b]) / 2
        faces = np.concatenate([box.faces[1:], [[a, 8, c], [8, b, c], [a, b, 8]]])
        mesh = Mesh(np.concatenate([box.vertices, [middle]]), faces)
        draft = remove_degenerates(Draft.of(mesh))
        assert draft is not None
        assert (draft.mesh.face_areas > 0.01).all()
        assert faults(draft.mesh) == {}
        assert remove_degenerates(draft) is None

    def test_a_thin_face_above_the_tolerance_stays(self):
        # 1e-6 of the diagonal, a thousand times the tolerance
        assert remove_degenerates(Draft.of(shapes.box((1, 1, 1e-6)))) is None


class TestDuplicates:
    def test_copies_facing_alike_become_one(self):
        box = shapes.box()
        draft = remove_duplicates(Draft.of(Mesh(box.vertices, np.concatenate([box.faces, box.faces[:3]]))))
        assert draft is not None
        assert sorted(map(tuple, draft.faces)) == sorted(map(tuple, Draft.of(box).faces))

    def test_a_wall_between_two_solids_written_twice_cancels(self):
        mesh = two_boxes_with_a_double_wall()
        draft = remove_duplicates(Draft.of(mesh))
        assert draft is not None
        assert len(draft.faces) == len(mesh.faces) - 4
        assert faults(draft.mesh) == {}
        assert draft.mesh.volume == pytest.approx(2)

    def test_of_a_patch_written_both_ways_one_stays_and_is_turned_to_fit(self):
        box = shapes.box()
        mesh = Mesh(box.vertices, np.concatenate([box.faces[:2, ::-1], box.faces]))
        draft = remove_duplicates(Draft.of(mesh))
        assert draft is not None
        assert len(draft.topology.boundary_edges) == 0
        result, report = repair_mesh(mesh)
        assert report.status == "fixed"
        assert result is not None
        assert result.volume == pytest.approx(1)

    def test_a_sheet_written_twice_stays(self):
        sheet = top(shapes.box())
        assert remove_duplicates(Draft.of(shapes.joined(sheet, shapes.inverted(sheet)))) is None

    def test_neighbours_are_no_duplicates(self):
        assert remove_duplicates(Draft.of(shapes.box())) is None


class TestOrientation:
    def test_faces_that_disagree_are_turned(self):
        ball = shapes.icosphere()
        faces = ball.faces.copy()
        faces[5:50] = faces[5:50, ::-1]
        draft = orient(Draft.of(Mesh(ball.vertices, faces)))
        assert draft is not None
        assert np.array_equal(draft.mesh.face_normals, ball.face_normals)

    def test_a_solid_inside_out_is_turned_with_its_cavity(self):
        draft = orient(Draft.of(shapes.inverted(shapes.hollow_ball())))
        assert draft is not None
        assert draft.mesh.volume == pytest.approx(shapes.hollow_ball().volume)
        assert Examined(draft).condition.cavities == 1

    def test_a_hollow_ball_is_left_alone(self):
        assert orient(Draft.of(shapes.hollow_ball())) is None

    def test_one_of_two_solids_inside_out_is_turned_alone(self):
        ball = shapes.icosphere()
        draft = orient(Draft.of(shapes.joined(ball, shapes.inverted(shapes.moved(ball, (3, 0, 0))))))
        assert draft is not None
        assert draft.mesh.volume == pytest.approx(2 * ball.volume)

    def test_an_open_bowl_inside_out_is_turned(self):
        bowl = shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.5)
        draft = orient(Draft.of(shapes.inverted(bowl)))
        assert draft is not None
        assert np.array_equal(draft.mesh.face_normals, bowl.face_normals)


class TestTheLadder:
    def test_safe_fixes_close_no_hole(self):
        result, report = repair_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3))
        assert result is None
        assert report.status == "unchanged"
        assert "--unsafe-fixes" in str(report.reason)

    def test_a_rung_that_makes_things_worse_is_undone_and_says_so(self, monkeypatch):
        from sss_tools.repair import ladder

        def vandal(draft):
            return Draft(draft.source, draft.mesh.vertices, draft.topology.faces[1:], draft.birth[1:], "dropped")

        steps = tuple(ladder.Step("weld", vandal, safe=True) if step.name == "weld" else step for step in ladder.STEPS)
        monkeypatch.setattr(ladder, "STEPS", steps)
        result, report = repair_mesh(shapes.inverted(shapes.box()))
        assert {rung.name: rung.status for rung in report.rungs}["weld"] == "undone"
        assert "open edges" in str(report.rungs[0].reason)
        assert result is not None
        assert report.status == "fixed"

    def test_a_rung_that_shrinks_the_solid_is_undone(self, monkeypatch):
        from sss_tools.repair import ladder

        def shrink(draft):
            return Draft(draft.source, 0.9 * draft.mesh.vertices, draft.topology.faces, draft.birth, "shrunk")

        steps = tuple(ladder.Step("weld", shrink, safe=True) if s.name == "weld" else s for s in ladder.STEPS)
        monkeypatch.setattr(ladder, "STEPS", steps)
        mesh = shapes.joined(shapes.box(), shapes.inverted(shapes.moved(shapes.box(), (3, 0, 0))))
        _, report = repair_mesh(mesh)
        assert report.rungs[0].status == "undone"

    @pytest.mark.parametrize("values", [np.nan, np.inf])
    def test_coordinates_that_are_not_finite_are_a_callers_mistake(self, values):
        box = shapes.box()
        vertices = box.vertices.copy()
        vertices[0] = values
        with pytest.raises(ValueError, match="finite"):
            repair_mesh(Mesh(vertices, box.faces))
