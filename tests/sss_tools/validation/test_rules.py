"""Each rule: a mesh that triggers it, a near miss that does not, and what is reported."""

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.validation.outcome import FixSafety, Outcome, Severity
from sss_tools.validation.rule import Subject, all_rules
from sss_tools.validation.run import LISTED, check_mesh, check_subject

CONTRACT = {
    "SSS101": ("open-boundary", "error"),
    "SSS102": ("open-sheet", "error"),
    "SSS103": ("unwelded-seam", "error"),
    "SSS201": ("non-manifold-edge", "error"),
    "SSS202": ("non-manifold-vertex", "warning"),
    "SSS203": ("inconsistent-winding", "error"),
    "SSS204": ("inverted-shell", "error"),
    "SSS301": ("internal-geometry", "error"),
    "SSS302": ("self-intersection", "error"),
    "SSS303": ("duplicate-face", "error"),
    "SSS304": ("overlapping-solids", "error"),
    "SSS305": ("cavity", "info"),
    "SSS401": ("degenerate-face", "warning"),
    "SSS402": ("needle-face", "info"),
    "SSS403": ("unreferenced-vertex", "info"),
    "SSS404": ("coarse-tessellation", "info"),
    "SSS501": ("thin-wall", "warning"),
    "SSS502": ("scale-mismatch", "warning"),
    "SSS503": ("near-contact", "warning"),
    "SSS601": ("float32-resolution", "warning"),
    "SSS602": ("non-finite", "error"),
    "SSS701": ("empty", "error"),
    "SSS702": ("unreadable", "error"),
}


def run(mesh, code):
    (result,) = (rule for rule in check_mesh(mesh).rules if rule.code == code)
    return result


def found(mesh):
    return {rule.code: rule.count for rule in check_mesh(mesh).findings}


def flipped(mesh, chosen):
    faces = mesh.faces.copy()
    faces[chosen] = faces[chosen][:, ::-1]
    return Mesh(mesh.vertices, faces)


def with_faces(mesh, faces):
    return Mesh(mesh.vertices, np.concatenate([mesh.faces, faces]))


def top_of(box):
    return box.vertices[box.faces][..., 2].min(axis=1) == box.bounds[1, 2]


def cracked_box(gap):
    """A box whose top stands ``gap`` above its sides."""
    box = shapes.box()
    vertices = np.concatenate([box.vertices, box.vertices + np.array([0, 0, gap])])
    return Mesh(vertices, np.where(top_of(box)[:, None], box.faces + len(box.vertices), box.faces))


def balls_joined_at_a_vertex():
    ball = shapes.icosphere(1.0, 1)
    point = ball.vertices[0]
    # turned about that point by half a turn, the second ball has exactly that vertex
    other = shapes.moved(Mesh(point - (ball.vertices - point), ball.faces[:, ::-1]), [0, 0, 0])
    return shapes.joined(ball, other)


def test_the_codes_names_and_severities_are_those_promised():
    assert {rule.code: (rule.name, rule.severity.value) for rule in all_rules()} == CONTRACT


@pytest.mark.parametrize("rule", all_rules(), ids=lambda rule: rule.code)
def test_every_rule_says_what_it_finds_what_that_does_and_what_helps(rule):
    assert len(rule.finds) > 5 and len(rule.why) > 25 and len(rule.fix) > 5
    assert isinstance(rule.fix_safety, FixSafety)
    assert rule.why.endswith(".")


@pytest.mark.parametrize(
    "mesh",
    [shapes.box(), shapes.icosphere(), shapes.torus(), shapes.cylinder(), shapes.slab(1.0, 0.01)],
    ids=["box", "ball", "torus", "cylinder", "slab"],
)
def test_a_sound_solid_has_no_finding_at_any_scale_and_place(mesh):
    for scale, offset in ((1.0, 0.0), (1e-7, 0.0), (1e7, 0.0), (1.0, 100.0)):
        assert found(Mesh(mesh.vertices * scale + offset, mesh.faces)) == {}


def test_rules_that_need_a_material_or_a_scene_are_not_run_without():
    reasons = {rule.code: rule.reason for rule in check_mesh(shapes.box()).rules if rule.outcome == "not-run"}
    assert reasons == {
        "SSS304": "no scene",
        "SSS404": "no scene and no material",
        "SSS501": "no material",
        "SSS502": "no material",
        "SSS503": "no scene",
    }


def test_open_boundary_counts_loops_and_says_where():
    ball = shapes.icosphere(1.0, 4)
    two = shapes.punctured(ball, [[0, 0, 1], [0, 0, -1]], 0.2)
    result = run(two, "SSS101")
    assert (result.outcome, result.count, result.severity) == (Outcome.FAIL, 2, Severity.ERROR)
    assert "2 holes" in result.message and "% of the diagonal" in result.message
    rim = two.vertices[np.array(result.edges)]
    # every reported edge lies on one of the two rims
    assert (np.abs(rim[..., 2]) > 0.95).all()
    assert result.bbox[0][2] < -0.95 and result.bbox[1][2] > 0.95


def test_a_texture_seam_is_no_open_boundary():
    box = shapes.box()
    split = Mesh(box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(12, 3))
    assert found(split) == {}


def test_open_sheet_counts_components_and_spares_solids():
    box = shapes.box()
    sheet = Mesh(box.vertices, box.faces[:2])
    assert found(sheet) == {"SSS102": 1, "SSS403": len(box.vertices) - len(np.unique(box.faces[:2]))}
    both = shapes.joined(box, shapes.moved(sheet, [3, 0, 0]), shapes.moved(sheet, [6, 0, 0]))
    result = run(both, "SSS102")
    assert (result.count, result.faces) == (2, [12, 13, 14, 15])
    assert result.message.startswith("2 of 3 components")


def test_unwelded_seam_is_no_hole_besides():
    result = run(cracked_box(1e-6), "SSS103")
    assert (result.outcome, result.count, result.fix) == (Outcome.FAIL, 8, FixSafety.SAFE)
    assert "units" in result.message and "1e-05 of the diagonal" in result.message
    assert "SSS101" not in found(cracked_box(1e-6))


def test_a_gap_as_wide_as_one_would_model_is_a_hole_and_no_seam():
    assert "SSS103" not in found(cracked_box(1e-3))
    assert found(cracked_box(1e-3))["SSS101"] == 1


def test_non_manifold_edge_counts_edges():
    left = shapes.box()
    right = shapes.moved(left, [1.0, 1.0, 0])
    mesh = shapes.joined(left, right)
    shared = np.intersect1d(left.vertices[:, :2].max(axis=0), right.vertices[:, :2].min(axis=0))
    assert len(shared) == 1  # the boxes touch along one upright edge
    result = run(mesh, "SSS201")
    assert (result.count, len(result.edges)) == (1, 1)
    assert found(mesh) == {"SSS201": 1}
    assert found(shapes.joined(left, shapes.moved(left, [1.001, 1.001, 0]))) == {}


def test_non_manifold_vertex_is_a_warning_at_the_point():
    mesh = balls_joined_at_a_vertex()
    result = run(mesh, "SSS202")
    assert (result.count, result.severity, result.vertices) == (1, Severity.WARNING, [0])
    assert result.centroid == pytest.approx(mesh.vertices[0].tolist())
    assert "SSS202" not in found(shapes.joined(shapes.box(), shapes.moved(shapes.box(), [1.001, 1.001, 1.001])))


def test_inconsistent_winding_counts_edges_and_says_nothing_of_the_shell():
    ball = shapes.icosphere()
    assert found(flipped(ball, [5])) == {"SSS203": 3}
    mostly = flipped(ball, np.arange(len(ball.faces)) > 3)
    assert set(found(mostly)) == {"SSS203"}


def test_inverted_shell_counts_solids():
    box, ball = shapes.box(), shapes.moved(shapes.icosphere(), [5, 0, 0])
    assert found(shapes.inverted(box)) == {"SSS204": 1}
    result = run(shapes.joined(shapes.inverted(box), ball), "SSS204")
    assert (result.count, result.faces) == (1, list(range(12)))


def test_the_inner_shell_of_a_hollow_ball_is_a_cavity_and_neither_inverted_nor_internal():
    assert found(shapes.hollow_ball()) == {"SSS305": 1}
    assert run(shapes.hollow_ball(), "SSS305").severity == Severity.INFO
    assert run(shapes.icosphere(), "SSS305").outcome == Outcome.PASS


def test_internal_geometry_finds_a_nested_solid():
    mesh = shapes.with_internal(shapes.box(4.0), shapes.box(4.0).bounds.mean(axis=0), 0.5)
    result = run(mesh, "SSS301")
    assert (result.count, result.faces[0], result.fix) == (1, 12, FixSafety.UNSAFE)
    assert "1 component inside a solid" in result.message
    assert set(found(mesh)) == {"SSS301"}


def test_internal_geometry_finds_overlapping_solids_but_not_near_ones():
    ball = shapes.icosphere()
    overlapping = shapes.joined(ball, shapes.moved(ball, [1.5, 0, 0]))
    assert found(overlapping) == {"SSS301": 2, "SSS302": 180}
    # the cap of each ball in the other, up to the plane half way between them
    result = run(overlapping, "SSS301")
    height = np.abs(overlapping.vertices[overlapping.faces][..., 0] - 0.75).max(axis=1)
    deep = overlapping.vertices[overlapping.faces].mean(axis=1)
    inside = np.where(np.arange(len(height)) < len(ball.faces), deep[:, 0] > 0.85, deep[:, 0] < 0.65)
    assert set(np.flatnonzero(inside)) <= set(result.faces)
    assert "2 patches with solid on both sides" in result.message
    assert found(shapes.joined(ball, shapes.moved(ball, [2.001, 0, 0]))) == {}


def test_internal_geometry_finds_solids_that_overlap_with_a_few_large_faces():
    """Every face near the overlap is cut: there is no patch inside, only faces that reach in."""
    boxes = shapes.joined(shapes.box(), shapes.moved(shapes.box(), [0.7, 0.6, 0.8]))
    result = run(boxes, "SSS301")
    assert result.count == 2 and "2 components reaching into a solid" in result.message
    assert len(result.faces) >= 2 and run(boxes, "SSS302").outcome == Outcome.FAIL


def test_internal_geometry_is_found_inside_a_solid_with_holes():
    holed = shapes.punctured(shapes.icosphere(1.0, 4), [[0, 0, 1]], 0.2)
    result = run(shapes.with_internal(holed, [0, 0, -0.2], 0.3), "SSS301")
    assert result.count == 1 and min(result.faces) == len(holed.faces)
    cavity = shapes.joined(holed, shapes.inverted(shapes.icosphere(0.3)))
    assert run(cavity, "SSS301").outcome == Outcome.PASS and run(cavity, "SSS305").count == 1


def test_a_solid_that_passes_through_itself_at_large_has_internal_geometry_and_a_small_fold_has_not():
    ring = shapes.torus(1.0, 0.15)
    x, y, z = ring.vertices.T
    angle, beside = np.arctan2(y, x), np.hypot(x, y) - 1
    # the ring laid in a figure of eight, which passes through itself where it crosses
    middle = np.stack([1.5 * np.sin(angle), np.sin(2 * angle), z], axis=1)
    along = np.stack([1.5 * np.cos(angle), 2 * np.cos(2 * angle)])
    along /= np.linalg.norm(along, axis=0)
    eight = Mesh(middle + np.stack([beside * along[1], -beside * along[0], 0 * z], axis=1), ring.faces)
    assert run(eight, "SSS302").outcome == run(eight, "SSS301").outcome == Outcome.FAIL
    inner = eight.vertices[eight.faces[run(eight, "SSS301").faces]].mean(axis=1)
    assert np.linalg.norm(inner, axis=1).max() < 1
    ball = shapes.icosphere(1.0, 4)
    poked = ball.vertices.copy()
    near = np.argsort(np.linalg.norm(poked - [0, 0, 1], axis=1))
    poked[near[0]] += 2 * (poked[near[1]] - poked[near[0]])
    folded = Mesh(poked, ball.faces)
    assert run(folded, "SSS302").outcome == Outcome.FAIL and run(folded, "SSS301").outcome == Outcome.PASS


def test_internal_geometry_finds_a_wall_between_boxes():
    box = shapes.box()
    mesh = shapes.joined(box, shapes.moved(box, [1, 0, 0]))
    result = run(mesh, "SSS301")
    assert result.count == 4 and "4 patches with solid on both sides" in result.message
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[result.faces]][..., 0], box.bounds[1, 0])


def test_duplicate_face_reports_pairs_whichever_way_they_face():
    box = shapes.box()
    mesh = with_faces(box, [box.faces[3][::-1], np.roll(box.faces[7], 1), box.faces[3]])
    result = run(mesh, "SSS303")
    assert (result.count, result.face_pairs) == (3, [[3, 12], [7, 13], [3, 14]])
    assert run(box, "SSS303").outcome == Outcome.PASS


def test_degenerate_face_is_one_without_height_at_this_scale():
    box = shapes.box()
    a, b = box.vertices[box.faces[0][:2]]
    for scale in (1e-6, 1.0, 1e6):
        vertices = np.concatenate([box.vertices, [(a + b) / 2, (a + b) / 2 + [0, 0, 1e-12]]]) * scale
        flat = with_faces(Mesh(vertices, box.faces), [[*box.faces[0][:2], 8], [0, 0, 8]])
        result = run(flat, "SSS401")
        assert (result.count, result.faces, result.severity) == (2, [12, 13], Severity.WARNING)
        assert "1 with a repeated corner" in result.message
    tiny = shapes.joined(box, shapes.moved(shapes.box(1e-6), [3, 3, 3]))
    assert run(tiny, "SSS401").outcome == Outcome.PASS


def test_needle_face_is_a_thousand_times_as_long_as_high():
    assert run(shapes.box([1, 1, 1 / 900]), "SSS402").outcome == Outcome.PASS
    result = run(shapes.box([1, 1, 1 / 1100]), "SSS402")
    # both triangles of the four narrow sides
    assert (result.count, result.severity) == (8, Severity.INFO)


def test_unreferenced_vertex_is_one_no_face_names():
    box = shapes.box()
    mesh = Mesh(np.concatenate([box.vertices, [[0, 0, 0.1], [9, 9, 9]]]), box.faces)
    result = run(mesh, "SSS403")
    assert (result.count, result.vertices, result.severity) == (2, [8, 9], Severity.INFO)
    assert found(mesh) == {"SSS403": 2}


def test_float32_resolution_depends_on_edge_and_offset_alone():
    ball = shapes.icosphere(1.0, 4)  # edges of 0.07
    assert "SSS601" not in found(shapes.moved(ball, [1e3, 0, 0]))  # steps of 6e-5
    far = run(shapes.moved(ball, [1e6, 0, 0]), "SSS601")  # steps of 0.06
    assert (far.count, far.severity) == (len(ball.vertices), Severity.WARNING)
    assert "0.0625 units" in far.message
    scaled = Mesh(shapes.moved(ball, [1e6, 0, 0]).vertices * 1e3, ball.faces)
    assert "SSS601" in found(scaled)


def test_tiny_edges_near_the_origin_are_resolved():
    mesh = shapes.joined(shapes.box(), shapes.box(1e-6))
    assert "SSS601" not in found(mesh)


def test_edges_too_short_for_the_size_of_the_mesh_are_no_matter_of_offset():
    # steps of 3e-8 at 0.4, wherever the mesh is moved to
    mesh = shapes.joined(shapes.box(), shapes.moved(shapes.box(5e-8), [0.4, 0.4, 0.4]))
    assert "SSS601" not in found(mesh)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e39])
def test_non_finite_stops_the_other_rules(bad):
    box = shapes.box()
    vertices = box.vertices.copy()
    vertices[3, 1] = bad
    report = check_mesh(Mesh(vertices, box.faces))
    assert [(rule.code, rule.count, rule.vertices) for rule in report.findings] == [("SSS602", 1, [3])]
    assert report.exit_status == 2
    others = {rule.outcome for rule in report.rules if rule.code not in ("SSS602", "SSS701", "SSS702")}
    assert others == {Outcome.NOT_RUN}


def test_a_mesh_without_faces_is_empty():
    report = check_mesh(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))
    assert [rule.code for rule in report.findings] == ["SSS701"]
    assert report.exit_status == 2 and report.closedness is None


def test_long_lists_are_cut_and_say_so():
    ball = shapes.icosphere(1.0, 4)
    result = run(shapes.inverted(ball), "SSS204")
    assert len(ball.faces) > LISTED == len(result.faces) and result.truncated
    assert not run(shapes.inverted(shapes.box()), "SSS204").truncated


def test_all_indices_are_listed_where_that_is_wanted():
    ball = shapes.inverted(shapes.icosphere(1.0, 4))
    report = check_subject(Subject(ball), listed=None)
    (result,) = (rule for rule in report.rules if rule.code == "SSS204")
    assert result.faces == list(range(len(ball.faces))) and not result.truncated


def test_indices_are_those_of_the_file_and_not_of_welded_points():
    ball = shapes.icosphere(1.0, 3)
    hole = shapes.punctured(ball, [[0, 0, 1]], 0.2)
    split = Mesh(hole.vertices[hole.faces].reshape(-1, 3), np.arange(3 * len(hole.faces)).reshape(-1, 3))
    edges = np.array(run(split, "SSS101").edges)
    assert edges.max() > len(hole.vertices)
    assert (split.vertices[edges][..., 2] > 0.9).all()


def test_the_far_vase_and_no_other_clean_mesh_loses_its_vertices(shared):
    from sss_tools.loading import load_mesh

    assert run(load_mesh(shared / "meshes" / "derived_far_vase.stl"), "SSS601").count > 1000
    for name in ("Vase.stl", "spot.obj", "bunny_stanford.obj", "7_8ths_cube.stl", "fandisk.obj"):
        assert run(load_mesh(shared / "meshes" / name), "SSS601").outcome == Outcome.PASS


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("spot.obj", {}),
        ("bunny_stanford.obj", {"SSS101": 5}),
        ("bunny_bun_zipper_with_holes.ply", {"SSS101": 5, "SSS403": 1113}),
        ("derived_inverted_vase.stl", {"SSS204": 1}),
        ("admesh_block_normal-directions-bad.stl", {"SSS203": 3}),
        ("shared.STL", {"SSS201": 1}),
        ("cow.obj", {"SSS202": 1, "SSS302": 85}),
        ("joined_tetrahedra.obj", {"SSS201": 3, "SSS301": 2, "SSS303": 1}),
        ("wallhole.obj", {"SSS201": 1, "SSS302": 50, "SSS303": 1, "SSS401": 11}),
        ("beetle_vw.obj", {"SSS101": 22, "SSS102": 1, "SSS201": 47, "SSS302": 59}),
    ],
)
def test_real_meshes_have_the_findings_that_other_tools_count(shared, name, expected):
    from sss_tools.loading import load_mesh

    assert found(load_mesh(shared / "meshes" / name)) == expected


def test_patches_beyond_the_budget_are_no_pass(monkeypatch):
    from sss_tools import interior

    monkeypatch.setattr(interior, "PAIRS", 1)
    ball = shapes.icosphere()
    near = shapes.joined(shapes.box(4.0), *(shapes.moved(ball, [1.5 + d, 1.5, 1.5]) for d in (0, 0.5)))
    hollow = run(shapes.hollow_ball(), "SSS301")
    assert hollow.outcome == Outcome.NOT_RUN and "1 patch could not be looked at" in hollow.reason
    assert run(near, "SSS301").outcome == Outcome.FAIL
