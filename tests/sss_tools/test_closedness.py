import csv
import json

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.closedness import Closedness, assess
from sss_tools.mesh import Mesh


def without_faces(mesh, chosen):
    return Mesh(mesh.vertices, np.delete(mesh.faces, chosen, axis=0))


def roles(mesh):
    return [component.role for component in assess(mesh).components]


def two_sided_sheet():
    grid = shapes.icosphere()
    cap = grid.faces[grid.vertices[grid.faces].mean(axis=1)[:, 2] > 0.5]
    return Mesh(grid.vertices, np.concatenate([cap, cap[:, ::-1]]))


def split_along_a_seam(mesh):
    """Every face with vertices of its own, as texture seams do it."""
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def test_a_box_is_closed_and_strict():
    verdict = assess(shapes.box(2.0)).closedness
    assert verdict == Closedness("closed", True, True, True, False, False, 0, (), 0.0, "strict")


def test_a_box_of_separate_triangles_with_equal_corners_is_closed():
    assert assess(split_along_a_seam(shapes.box())).closedness.state == "closed"


def test_volume_is_that_of_the_material():
    hollow = assess(shapes.hollow_ball(1.0, 0.5, 4))
    solid, cavity = hollow.components
    # the shells are inscribed polyhedra of one kind, so their volumes are as the cubes of the radii
    assert -cavity.volume == pytest.approx(solid.volume / 8, rel=1e-12)
    assert hollow.volume == pytest.approx(solid.volume * 7 / 8, rel=1e-12)


def test_a_hollow_ball_is_a_solid_with_a_cavity_and_strict():
    assessment = assess(shapes.hollow_ball())
    assert [part.role for part in assessment.components] == ["solid", "cavity"]
    assert assessment.closedness.hole_handling == "strict"
    assert not assessment.closedness.internal_geometry


def test_a_hollow_ball_turned_inside_out_is_an_inverted_solid_with_a_cavity():
    assessment = assess(shapes.inverted(shapes.hollow_ball()))
    assert [part.role for part in assessment.components] == ["solid", "cavity"]
    assert assessment.inverted.tolist() == [True, False]
    assert assessment.closedness.hole_handling == "terminate"


def test_a_ball_inside_a_solid_is_internal_and_flagged():
    assessment = assess(shapes.with_internal(shapes.icosphere(), [0, 0, 0], 0.3))
    assert [part.role for part in assessment.components] == ["solid", "internal"]
    assert assessment.closedness.internal_geometry
    assert (assessment.closedness.state, assessment.closedness.hole_handling) == ("closed", "terminate")


def test_a_ball_inside_a_cavity_is_a_solid():
    nested = shapes.joined(shapes.hollow_ball(1.0, 0.6), shapes.icosphere(0.3))
    assert roles(nested) == ["solid", "cavity", "solid"]
    assert not assess(nested).closedness.internal_geometry


def test_the_volume_of_matter_does_not_hang_on_orientation():
    ball, away = shapes.icosphere(), shapes.moved(shapes.icosphere(), [3, 0, 0])
    apart, one_inverted = assess(shapes.joined(ball, away)), assess(shapes.joined(shapes.inverted(ball), away))
    # the signed volumes of the second cancel
    assert one_inverted.volume == pytest.approx(0, abs=1e-12)
    assert one_inverted.matter == pytest.approx(apart.matter) == pytest.approx(2 * ball.volume)
    hollow = assess(shapes.inverted(shapes.hollow_ball(1.0, 0.5, 4)))
    assert hollow.matter == pytest.approx(-hollow.volume)


def test_overlapping_balls_are_solids_with_internal_geometry():
    apart = shapes.joined(shapes.icosphere(), shapes.moved(shapes.icosphere(), [3, 0, 0]))
    overlapping = shapes.joined(shapes.icosphere(), shapes.moved(shapes.icosphere(), [1, 0, 0]))
    assert not assess(apart).closedness.internal_geometry
    assert assess(overlapping).closedness.internal_geometry
    assert roles(overlapping) == ["solid", "solid"]


def test_a_wall_across_a_solid_is_a_patch_with_solid_on_both_sides():
    left = shapes.box(1.0)
    right = shapes.moved(left, [left.bounds[1, 0] - left.bounds[0, 0], 0, 0])
    assessment = assess(shapes.joined(left, right))
    assert assessment.closedness.internal_geometry
    walls = np.concatenate(assessment.interior.patches)
    faces = np.concatenate([left.faces, right.faces + len(left.vertices)])
    vertices = np.concatenate([left.vertices, right.vertices])
    assert len(walls) == 4
    # all corners of the wall lie in the plane where the boxes touch
    np.testing.assert_array_equal(vertices[faces[walls]][..., 0], left.bounds[1, 0])


def test_a_box_turned_inside_out_is_inverted():
    assessment = assess(shapes.inverted(shapes.box()))
    assert assessment.inverted.tolist() == [True]
    assert assessment.components[0].volume == pytest.approx(-1)
    assert not assessment.closedness.oriented


def test_a_ball_with_a_small_hole_encloses_a_volume_and_can_be_capped():
    ball = shapes.icosphere(1.0, 4)
    verdict = assess(shapes.punctured(ball, [[0, 0, 1]], 0.2)).closedness
    assert (verdict.state, verdict.boundary_loops, verdict.hole_handling) == ("holes", 1, "cap")
    (hole,) = verdict.holes
    # a rim zigzags between the two rings of a facet's width (0.07) about the radius asked for
    assert hole.diameter == pytest.approx(0.4, abs=0.14)
    assert hole.centroid == pytest.approx((0, 0, 0.98), abs=0.03)
    assert hole.area == pytest.approx(np.pi * 0.2**2, rel=0.5)
    assert verdict.hole_area_fraction == pytest.approx(hole.area / ball.area, rel=0.05)


def test_the_rim_of_a_square_hole_is_measured_exactly():
    box = shapes.box(2.0)
    top = np.flatnonzero(box.vertices[box.faces][..., 2].min(axis=1) == box.bounds[1, 2])
    (hole,) = assess(without_faces(box, top)).closedness.holes
    assert (hole.edges, hole.perimeter, hole.area) == (4, pytest.approx(8), pytest.approx(4))
    assert hole.diameter == pytest.approx(np.sqrt(8))
    assert hole.centroid == pytest.approx((*box.bounds.mean(axis=0)[:2], box.bounds[1, 2]))


def test_two_holes_that_touch_in_a_point_cannot_be_capped():
    ball = shapes.icosphere(1.0, 3)
    point = ball.faces[0, 0]
    fan = np.flatnonzero((ball.faces == point).any(axis=1))
    opposite = [fan[0], next(f for f in fan if len(np.intersect1d(ball.faces[f], ball.faces[fan[0]])) == 1)]
    verdict = assess(without_faces(ball, opposite)).closedness
    assert (verdict.state, verdict.boundary_loops, verdict.hole_handling) == ("holes", 1, "terminate")


@pytest.mark.parametrize(("half_angle", "state"), [(40, "holes"), (90, "holes"), (110, "holes"), (125, "open")])
def test_a_ball_is_open_from_where_no_place_in_it_is_three_quarters_wrapped(half_angle, state):
    """Seen from the far pole a hole of half angle a subtends a cone of half angle a / 2 (inscribed angles).

    The winding number there is (1 + cos(a / 2)) / 2: 3/4 for a = 120 degrees.
    """
    ball = shapes.icosphere(1.0, 4)
    height = ball.vertices[ball.faces].mean(axis=1)[:, 2]
    assert assess(without_faces(ball, height > np.cos(np.radians(half_angle)))).closedness.state == state


def test_sheets_alone_are_open():
    box = shapes.box()
    assessment = assess(Mesh(box.vertices, box.faces[:2]))
    assert (assessment.closedness.state, assessment.closedness.hole_handling) == ("open", "surface")
    assert assessment.closedness.boundary_loops == 1 and assessment.closedness.holes == ()
    assert [part.role for part in assessment.components] == ["sheet"]


def test_a_two_sided_sheet_is_closed_and_encloses_nothing():
    assessment = assess(two_sided_sheet())
    assert [(part.role, part.closed) for part in assessment.components] == [("sheet", True)]
    assert assessment.closedness.state == "open"


def test_a_thin_plate_encloses_a_volume():
    assert assess(shapes.slab(1.0, 1e-5)).closedness.state == "closed"


def test_a_sheet_beside_a_solid_does_not_change_its_state():
    box = shapes.box()
    sheet = shapes.moved(Mesh(box.vertices, box.faces[:2]), [5, 5, 5])
    assessment = assess(shapes.joined(box, sheet))
    assert assessment.closedness.state == "closed"
    assert [part.role for part in assessment.components] == ["solid", "sheet"]
    assert not assessment.closedness.watertight


def test_a_sheet_inside_a_solid_is_internal_geometry():
    box = shapes.box(4.0)
    sheet = shapes.icosphere(0.2)
    cap = Mesh(sheet.vertices, sheet.faces[:3])
    assert assess(shapes.joined(box, shapes.moved(cap, box.bounds.mean(axis=0)))).closedness.internal_geometry


def test_the_worst_state_of_two_solids_counts():
    both = shapes.joined(shapes.box(), shapes.moved(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.2), [5, 0, 0]))
    assert assess(both).closedness.state == "holes"


def test_some_faces_turned_over_are_a_flag_and_no_hole():
    ball = shapes.icosphere()
    faces = ball.faces.copy()
    faces[::5] = faces[::5][:, ::-1]
    verdict = assess(Mesh(ball.vertices, faces)).closedness
    assert (verdict.state, verdict.oriented, verdict.hole_handling) == ("closed", False, "terminate")


def test_scale_and_place_change_nothing():
    hollow = shapes.hollow_ball()
    for scale, offset in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e5)):
        verdict = assess(Mesh(hollow.vertices * scale + offset, hollow.faces)).closedness
        assert (verdict.state, verdict.hole_handling) == ("closed", "strict")


def test_faces_without_area_alone_are_open():
    line = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2], [0, 0, 1]]))
    assert assess(line).closedness.state == "open"


def test_an_assessment_refuses_what_has_no_place():
    with pytest.raises(ValueError, match="finite"):
        assess(Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [np.nan, 0, 0]]), np.array([[0, 1, 2]])))
    with pytest.raises(ValueError, match="without faces"):
        assess(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))


def test_a_verdict_survives_json():
    verdict = assess(shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3)).closedness
    assert verdict.holes
    assert Closedness.from_json(json.loads(json.dumps(verdict.to_json()))) == verdict
    with pytest.raises(ValueError, match="no such state"):
        Closedness.from_json({**verdict.to_json(), "state": "ajar"})


ENCLOSE_NOTHING = {"chair_model.obj", "soup.stl"}
"""A component must be able to bound a volume: the chair's sheets are closed, but written twice, and its volume is
zero; the soup is of single triangles, which wind by less than 1/2 each, whatever they add up to."""


def expected_state(row):
    if row["file"] in ENCLOSE_NOTHING:
        return "open"
    if int(row["boundary_edges"]) == 0:
        return "closed"
    return "holes" if float(row["max_winding"]) >= 0.75 else "open"


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_real_meshes_have_the_state_that_other_tools_say(shared):
    from sss_tools.errors import InputError
    from sss_tools.loading import load_mesh

    folder, judged = shared / "meshes", 0
    with (folder / "MANIFEST.csv").open() as file:
        for row in csv.DictReader(file):
            if row["class"] in ("corrupt", "either"):
                continue
            try:
                mesh = load_mesh(folder / row["file"])
            except InputError as error:
                pytest.fail(str(error))
            assessment = assess(mesh)
            verdict = assessment.closedness
            assert verdict.state == expected_state(row), row["file"]
            assert verdict.watertight == (row["watertight_welded"] == "True"), row["file"]
            assert verdict.boundary_loops == int(row["n_boundary_loops"]), row["file"]
            assert len(assessment.components) == int(row["n_components"]), row["file"]
            pinches = int(row["nonmanifold_vertices"])
            assert verdict.manifold == (int(row["nonmanifold_edges"]) == 0 and pinches == 0), row["file"]
            if row["internal_geometry"] == "yes" and verdict.state != "open":
                assert verdict.internal_geometry, row["file"]
            if row["class"] == "clean":
                assert verdict.hole_handling == "strict", row["file"]
                # the manifest's volumes are those of the signed sum
                assert assessment.volume == pytest.approx(float(row["volume"]), rel=1e-6), row["file"]
            judged += 1
    assert judged > 60


def test_the_bunny_has_five_holes_that_can_be_capped(shared):
    from sss_tools.loading import load_mesh

    for name in ("bunny_bun_zipper_with_holes.ply", "bunny_stanford.obj"):
        verdict = assess(load_mesh(shared / "meshes" / name)).closedness
        assert (verdict.state, len(verdict.holes), verdict.hole_handling) == ("holes", 5, "cap")
        assert sum(hole.edges for hole in verdict.holes) == 223


def test_the_wall_between_a_solid_and_one_turned_inside_out_bounds_both():
    box = shapes.box()
    assert not assess(shapes.joined(box, shapes.inverted(shapes.moved(box, [1, 0, 0])))).closedness.internal_geometry
