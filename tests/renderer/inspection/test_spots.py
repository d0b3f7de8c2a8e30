"""Findings fall into the places a reader would point at."""

import numpy as np

from renderer.inspection.spots import SPOTS, find_spots
from sss_tools import shapes
from sss_tools.mesh import Mesh
from tests.renderer.inspection.exhibits import ball_in_ball, inspection, punctured_ball


def test_each_hole_is_a_place_of_its_own_with_its_middle_and_radius():
    spots = [spot for spot in find_spots(inspection(punctured_ball())) if spot.code == "SSS101"]
    assert len(spots) == 2
    # the frame is as wide as the ball: what is at z = 1 there is at 1/2 here
    ends = sorted(spot.centre[2] for spot in spots)
    assert ends[0] < -0.45 and ends[1] > 0.45
    for spot in spots:
        assert np.abs(spot.centre[:2]).max() < 0.02 and 0.08 < spot.radius < 0.15
        assert np.sign(spot.centre[2]) * spot.normal[2] > 0.9
        assert len(spot.edges) > 5 and len(spot.faces) > 5


def test_places_are_the_same_wherever_the_mesh_is_and_however_large():
    mesh = punctured_ball()
    near, far = (find_spots(inspection(m)) for m in (mesh, Mesh(1000 * mesh.vertices + [5e5, 0, -3e5], mesh.faces)))
    for spot, same in zip(near, far, strict=True):
        # doubles 5e5 from the origin are 6e-11 apart, in a frame of 2000 that is nothing
        assert np.abs(spot.centre - same.centre).max() < 1e-9 and spot.code == same.code


def test_errors_come_before_information():
    mesh = shapes.joined(punctured_ball(), shapes.hollow_ball(0.2, 0.1, 2))
    codes = [spot.severity for spot in find_spots(inspection(mesh))]
    assert codes == sorted(codes, key=["error", "warning", "info"].index) and "info" in codes


def test_many_places_are_the_largest_and_one_for_the_rest():
    thorns = np.stack([np.arange(400), np.zeros(400), np.zeros(400)], axis=1) * 0.01
    body = shapes.box(10.0)
    loose = Mesh(np.concatenate([body.vertices, thorns]), body.faces)
    spots = [spot for spot in find_spots(inspection(loose)) if spot.code == "SSS403"]
    assert len(spots) == SPOTS and sum(spot.places for spot in spots) == 400


def test_vertices_that_are_not_finite_are_shown_beside_their_neighbours():
    mesh = shapes.icosphere(1.0, 2)
    vertices = mesh.vertices.copy()
    vertices[5] = np.nan
    spots = find_spots(inspection(Mesh(vertices, mesh.faces)))
    assert [spot.code for spot in spots] == ["SSS602"]
    assert np.isfinite(spots[0].centre).all() and spots[0].radius > 0


def test_a_component_inside_is_one_place_with_all_its_faces():
    mesh = ball_in_ball()
    (spot,) = (spot for spot in find_spots(inspection(mesh)) if spot.code == "SSS301")
    assert len(spot.faces) == 320 and np.abs(spot.centre).max() < 1e-6
