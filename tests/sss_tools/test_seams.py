import numpy as np

from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.seams import edges_closed_by_welding


def cracked_box(gap):
    """A box whose top stands ``gap`` above its sides."""
    box = shapes.box()
    top = box.vertices[box.faces][..., 2].min(axis=1) == box.bounds[1, 2]
    vertices = np.concatenate([box.vertices, box.vertices + np.array([0, 0, gap])])
    return Mesh(vertices, np.where(top[:, None], box.faces + len(box.vertices), box.faces))


def test_both_sides_of_a_crack_are_found():
    topology = cracked_box(1e-7).topology
    assert edges_closed_by_welding(topology, 1e-6).tolist() == topology.boundary_edges.tolist()
    assert len(topology.boundary_edges) == 8


def test_a_gap_wider_than_the_tolerance_is_no_crack():
    assert len(edges_closed_by_welding(cracked_box(1e-5).topology, 1e-6)) == 0


def test_corners_that_touch_without_edges_that_do_are_no_crack():
    left = shapes.box()
    sheet = Mesh(left.vertices, left.faces[:2])
    corner = shapes.moved(sheet, [1e-7, 1e-7, 5.0])
    assert len(edges_closed_by_welding(shapes.joined(sheet, corner).topology, 1e-6)) == 0


def test_edges_far_apart_that_line_up_across_the_sorting_direction_are_no_crack():
    from sss_tools.seams import _GENERIC

    sheet = Mesh(shapes.box().vertices, shapes.box().faces[:1])
    across = np.cross(_GENERIC, [0.0, 0, 1])
    mesh = shapes.joined(sheet, shapes.moved(sheet, 5 * across))
    assert len(edges_closed_by_welding(mesh.topology, 1e-6)) == 0
