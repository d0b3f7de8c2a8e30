"""caps, internal, unite, split, rebuild: what triggers them, what all but does, what they must not lose."""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.repair import ladder, repair_mesh
from sss_tools.repair.draft import Declined, Draft
from sss_tools.repair.holes import cap_holes, missing_loops
from sss_tools.repair.judge import Examined, VisibleSurface
from sss_tools.repair.nonmanifold import split_non_manifold
from sss_tools.repair.rebuild import rebuild
from sss_tools.repair.triangulation import triangulate_loop
from sss_tools.repair.unite import remove_internal, unite, unite_both_signs

igl = pytest.importorskip("igl")


def condition(mesh: Mesh):
    return Examined(Draft.of(mesh)).condition


def statuses(report) -> dict[str, str]:
    return {rung.name: rung.status for rung in report.rungs}


def boxes_sharing_an_edge() -> Mesh:
    return shapes.joined(shapes.box(), shapes.moved(shapes.box(), (1, 1, 0)))


def boxes_sharing_a_corner() -> Mesh:
    return shapes.joined(shapes.box(), shapes.moved(shapes.box(), (1, 1, 1)))


class TestCaps:
    @pytest.mark.parametrize("radius", [0.1, 0.3, 0.6])
    def test_a_hole_in_a_ball_is_closed_and_nothing_else_moves(self, radius):
        bowl = shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1]], radius)
        result, report = repair_mesh(bowl, unsafe=True)
        assert statuses(report)["caps"] == "applied"
        assert report.status == "fixed"
        # the old faces are all there: rounding of the nearest point is all there is
        assert report.after["distance"] < 1e-14
        assert condition(result).is_solid

    def test_a_large_curved_hole_gets_a_smooth_cap(self):
        # a flat cap would cut 0.07 off the top of the ball; a faired one bulges out to about half of that or better
        bowl = shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1]], 0.5)
        result, _ = repair_mesh(bowl, unsafe=True)
        rim = bowl.topology.points[bowl.topology.edges[bowl.topology.boundary_edges]].reshape(-1, 3)
        flat = rim[:, 2].mean()
        assert result.vertices[:, 2].max() > flat + 0.5 * (1 - flat)

    def test_a_flat_hole_is_cut_in_its_plane(self):
        tube = shapes.cylinder(segments=64)
        open_top = Mesh(tube.vertices, tube.faces[~(tube.vertices[tube.faces][..., 2] == 0.5).all(axis=1)])
        result, report = repair_mesh(open_top, unsafe=True)
        assert report.status == "fixed"
        assert result.volume == pytest.approx(tube.volume)

    def test_a_whole_solid_misses_nothing(self):
        assert missing_loops(Draft.of(shapes.torus())) == []

    def test_a_shallow_dish_is_a_sheet_and_not_capped(self):
        ball = shapes.icosphere(1.0, 3)
        dish = Mesh(ball.vertices, ball.faces[(ball.vertices[ball.faces][..., 2] > 0.7).all(axis=1)])
        result, report = repair_mesh(dish, unsafe=True)
        assert result is None
        assert report.status == "refused"
        assert "encloses no volume" in str(report.reason)

    def test_loops_that_touch_in_a_point_are_capped_one_by_one(self):
        ball = shapes.icosphere(1.0, 3)
        point = ball.faces[0, 0]
        around = np.flatnonzero((ball.faces == point).any(axis=1))
        mesh = Mesh(ball.vertices, np.delete(ball.faces, [around[0], around[3]], axis=0))
        result, report = repair_mesh(mesh, unsafe=True)
        assert report.status == "fixed"
        assert len(result.faces) == len(ball.faces)

    def test_a_curve_that_crosses_itself_in_its_plane_is_not_cut_by_ears(self):
        angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
        eight = np.stack([np.sin(angle), np.sin(angle) * np.cos(angle) + 0.3 * np.cos(angle), 0 * angle], axis=1)
        triangles, flat = triangulate_loop(eight, np.zeros((12, 12), bool))
        assert flat
        assert len(triangles) == 10  # the search for the least area takes over, and never fails

    def test_no_triangle_doubles_an_edge_that_is_there(self):
        square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]], float)
        for a, b in ((0, 2), (1, 3)):
            taken = np.zeros((4, 4), bool)
            taken[a, b] = taken[b, a] = True
            triangles, _ = triangulate_loop(square, taken)
            assert not any({a, b} <= set(triangle) for triangle in triangles.tolist())

    def test_caps_that_would_leave_a_crossing_surface_are_undone(self, monkeypatch):
        def crossed(draft):
            capped = cap_holes(draft)
            if capped is None:
                return None
            box = shapes.moved(shapes.box(), (0, 0, -0.9))
            start = len(capped.mesh.vertices)
            return Draft(
                draft.source,
                np.concatenate([capped.mesh.vertices, box.vertices]),
                np.concatenate([capped.mesh.faces, box.faces + start]),
                np.concatenate([capped.birth, np.zeros(12, np.int64)]),
            )

        steps = tuple(
            ladder.Step("caps", crossed, None, step.wanted, step.leaves) if step.name == "caps" else step
            for step in ladder.STEPS
            if step.name not in ("unite", "rebuild", "internal")
        )
        monkeypatch.setattr(ladder, "STEPS", (*steps, ladder.Step("rebuild", lambda draft: None)))
        result, report = repair_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3), unsafe=True)
        assert statuses(report)["caps"] == "undone"
        assert result is None


class TestInternal:
    def test_a_ball_inside_a_ball_goes_and_the_outer_one_keeps_its_faces(self):
        ball = shapes.icosphere()
        draft = remove_internal(Draft.of(shapes.with_internal(ball, (0, 0, 0), 0.4)))
        assert draft is not None
        assert np.array_equal(draft.faces, ball.faces)

    def test_a_sheet_inside_a_ball_goes(self):
        sheet = Mesh([[-0.2, -0.2, 0], [0.2, -0.2, 0], [0, 0.2, 0.01]], [[0, 1, 2]])
        result, report = repair_mesh(shapes.joined(shapes.icosphere(), sheet), unsafe=True)
        assert report.status == "fixed"
        assert len(result.faces) == len(shapes.icosphere().faces)

    def test_a_cavity_is_not_internal(self):
        assert remove_internal(Draft.of(shapes.hollow_ball())) is None

    def test_a_solid_inside_a_cavity_is_not_internal(self):
        nested = shapes.joined(shapes.hollow_ball(), shapes.icosphere(0.3))
        assert remove_internal(Draft.of(nested)) is None
        assert repair_mesh(nested, unsafe=True)[1].status == "unchanged"


class TestUnite:
    def test_overlapping_boxes_become_one(self):
        overlap = shapes.joined(shapes.box(), shapes.moved(shapes.box(), (0.5, 0.25, 0.1)))
        result, report = repair_mesh(overlap, unsafe=True)
        assert report.status == "fixed"
        assert result.volume == pytest.approx(2 - 0.5 * 0.75 * 0.9)
        assert condition(result).solids == 1

    def test_a_cavity_survives_the_union_of_its_solid_with_another(self):
        overlap = shapes.joined(shapes.hollow_ball(1.0, 0.4), shapes.moved(shapes.icosphere(0.5), (1.1, 0, 0)))
        result, report = repair_mesh(overlap, unsafe=True)
        assert statuses(report)["unite"] == "applied"
        assert condition(result).cavities == 1
        assert result.volume > shapes.hollow_ball(1.0, 0.4).volume

    def test_a_surface_that_is_not_closed_is_declined(self):
        with pytest.raises(Declined, match="not closed"):
            unite(Draft.of(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3)))

    def test_boxes_apart_are_left_alone(self):
        apart = shapes.joined(shapes.box(), shapes.moved(shapes.box(), (1.001, 0, 0)))
        assert repair_mesh(apart, unsafe=True)[1].status == "unchanged"

    def test_matter_of_negative_sign_can_be_kept(self):
        crossing = shapes.joined(shapes.box(), shapes.inverted(shapes.moved(shapes.box(), (0.5, 0, 0))))
        draft = unite_both_signs(Draft.of(crossing))
        # what both claim cancels: half a box of either sign is left
        assert draft.mesh.volume == pytest.approx(1)

    def test_faces_between_coordinates_of_single_precision_stay_exact(self):
        far = shapes.moved(shapes.joined(shapes.box(), shapes.moved(shapes.box(), (0.5, 0.25, 0.1))), (1e6, 1e6, 0))
        result, report = repair_mesh(far, unsafe=True)
        assert report.status == "fixed"
        assert condition(result).crossings == 0


class TestSplit:
    @pytest.mark.parametrize("touching", [boxes_sharing_an_edge, boxes_sharing_a_corner])
    def test_touching_boxes_come_apart_even_after_an_exact_weld(self, touching):
        result, report = repair_mesh(touching(), unsafe=True)
        assert statuses(report)["split"] == "applied"
        assert condition(result).is_solid
        assert condition(result).solids == 2
        # drawn apart by 2e-5 of the diagonal at most
        assert result.volume == pytest.approx(2, rel=1e-3)

    def test_matter_stays_together_round_a_shared_edge(self):
        draft = split_non_manifold(Draft.of(boxes_sharing_an_edge()))
        volumes = [part.volume for part in draft.assessment.components]
        assert volumes == pytest.approx([1, 1], rel=1e-3)

    def test_an_edge_whose_ends_hold_together_is_parted_in_the_middle(self):
        # a ring of boxes round a hole that closes in one edge: both sides of it belong to one solid
        block = shapes.joined(
            boxes_sharing_an_edge(),
            Mesh(shapes.moved(shapes.box((2, 2, 1)), (0.5, 0.5, 1)).vertices, shapes.box().faces),
            Mesh(shapes.moved(shapes.box((2, 2, 1)), (0.5, 0.5, -1)).vertices, shapes.box().faces),
        )
        result, report = repair_mesh(block, unsafe=True)
        assert report.status == "fixed"
        assert condition(result).is_solid
        assert condition(result).solids == 1

    def test_a_manifold_is_left_alone(self):
        assert split_non_manifold(Draft.of(shapes.torus())) is None


class TestRebuild:
    def test_the_surface_is_where_it_was_and_the_cavity_too(self):
        hollow = shapes.hollow_ball()
        draft = rebuild(Draft.of(hollow))
        assert Examined(draft).condition.is_solid
        assert Examined(draft).condition.cavities == 1
        # half a cell of the grid (0.7 % of the diagonal)
        assert VisibleSurface(hollow).distance_to(draft.mesh) < 0.0035
        assert draft.mesh.volume == pytest.approx(hollow.volume, rel=0.01)

    def test_it_is_not_tried_where_another_rung_made_a_solid(self):
        _, report = repair_mesh(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3), unsafe=True)
        assert statuses(report)["rebuild"] == "skipped"

    def test_a_sheet_is_declined(self):
        with pytest.raises(Declined):
            rebuild(Draft.of(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])))


class TestRefusal:
    def test_soup_is_refused_with_a_reason(self):
        corners = np.random.default_rng(5).uniform(size=(90, 3))
        result, report = repair_mesh(Mesh(corners, np.arange(90).reshape(-1, 3)), unsafe=True)
        assert result is None
        assert report.status == "refused"
        assert "30" in str(report.reason)

    def test_a_sheet_written_twice_is_refused(self):
        sheet = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]])
        assert repair_mesh(sheet, unsafe=True)[1].status == "refused"
