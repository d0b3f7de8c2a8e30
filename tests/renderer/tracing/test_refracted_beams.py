"""Which facets light a point: the grid against all pairs, and flat faces in many pieces."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.description import DirectionalLight, PointLight
from renderer.scene.lights import DirectionalSource, PointSource
from renderer.tracing.beam_generation import Facets, Generation
from renderer.tracing.refracted_beams import FAR_CHANCE, RefractedBeams
from sss_tools.mesh import Mesh
from sss_tools.rays import UnitFrame
from sss_tools.shapes import box, icosphere
from tests.renderer.scenes import bumpy_ball

SUN = DirectionalLight(np.array([-1.0, -2, -0.5]), np.ones(3))
LAMPS = {"sun": SUN, "lamp": PointLight(np.array([0.9, 1.7, 0.4]), np.ones(3)),
         "near lamp": PointLight(np.array([0.05, 1.08, 0.02]), np.ones(3))}  # fmt: skip
FRAME = UnitFrame(np.zeros(3), 1.0)


def beams_of(mesh: Mesh, light, sigma_t: float = 0.1, ior: float = 1.5, mirrored: int = 0) -> RefractedBeams:
    facets = Facets(0, mesh.vertices[mesh.faces], mesh.face_normals)
    source = DirectionalSource.of(light) if isinstance(light, DirectionalLight) else PointSource.of(light, FRAME)
    beams = RefractedBeams(facets, ior, source, sigma_t, *mesh.bounds)
    for _ in range(mirrored):
        assert beams.mirror()
    return beams


def points(count: int = 400, half: float = 0.45):
    return np.random.default_rng(3).uniform(-half, half, (3, count))


def pairs(found):
    """Sorted rows of point and triangles."""
    rows = np.stack([found.point, *found.triangle], axis=1)
    return rows[np.lexsort(rows.T[::-1])]


@pytest.mark.parametrize("lamp", LAMPS)
@pytest.mark.parametrize("shape", ["ball", "bumpy", "box"])
def test_grid_finds_what_trying_all_beams_finds(lamp, shape):
    mesh = {"ball": lambda: icosphere(1, 2), "bumpy": lambda: bumpy_ball(2), "box": lambda: box((2, 2, 1))}[shape]()
    beams, position = beams_of(mesh, LAMPS[lamp], mirrored=1), points()
    for generation, one in enumerate(beams.generations):
        point, beam = (grid.ravel() for grid in np.mgrid[: position.shape[1], : len(one.base)])
        every = beams._arrivals(position, point, beam, generation, 10.0)
        assert len(every.point) > 200
        assert_array_equal(pairs(beams.near_arrivals(position, generation)), pairs(every))


@pytest.mark.parametrize("lamp", LAMPS)
def test_mirrored_beams_are_all_there(lamp):
    """Against every facet as a mirror of every beam, none left out beforehand."""
    mesh, position = box((1.6, 2, 1.2)), points()
    beams = beams_of(mesh, LAMPS[lamp], mirrored=1)
    first = beams.generations[0]
    beam, mirror = (grid.ravel() for grid in np.mgrid[: len(first.base), : len(mesh.faces)])
    differs = mirror != first.base[beam]
    beam, mirror = beam[differs], mirror[differs]
    normal = mesh.face_normals[mirror]
    axis = first.axis[beam] - 2 * (first.axis[beam] * normal).sum(axis=1, keepdims=True) * normal
    ones = np.ones(len(beam))
    # mirrors turned away from the beam have no beam
    turned = (first.axis[beam] * normal).sum(axis=1) > 0.02
    beam, mirror, axis, ones = beam[turned], mirror[turned], axis[turned], ones[turned]
    wide = 5 * ones if lamp != "sun" else 0 * ones
    found = beams.near_arrivals(position, 1)
    beams.generations[1] = Generation(beams._facets, mirror, beam, axis, wide, 5 * ones, ones, ones, *mesh.bounds)
    point, pair = (grid.ravel() for grid in np.mgrid[: position.shape[1], : len(beam)])
    every = beams._arrivals(position, point, pair, 1, 10.0)
    assert len(every.point) > 200
    assert_array_equal(pairs(found), pairs(every))


def tessellated_slab(n: int = 8) -> Mesh:
    """A box whose top is n x n squares of two triangles each, on round coordinates."""
    u = np.linspace(-0.5, 0.5, n + 1)
    x, z = (grid.ravel() for grid in np.meshgrid(u, u, indexing="ij"))
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([corner, corner + 1, corner + n + 2], 1),
                            np.stack([corner, corner + n + 2, corner + n + 1], 1)])  # fmt: skip
    top = Mesh(np.stack([x, np.full_like(x, 0.25), z], axis=1), faces)
    assert (top.face_normals[:, 1] > 0).all()
    return top


def lattice():
    """Points on and off the sides and corners of the prisms behind the tessellated top, for light from above."""
    u = (np.arange(32) + 0.5) / 32 - 0.5
    u = np.sort(np.concatenate([u, np.linspace(-0.4375, 0.4375, 15)]))
    x, z = np.meshgrid(u, u)
    return np.stack([x.ravel(), np.zeros(x.size), z.ravel()])


DOWN = {"sun": DirectionalLight(np.array([0.0, -1, 0]), np.ones(3)),
        "lamp": PointLight(np.array([0.0, 20.25, 0]), np.ones(3)),
        "slanted": DirectionalLight(np.array([0.3, -1, 0.2]), np.ones(3))}  # fmt: skip


def counts(light) -> np.ndarray:
    mesh = tessellated_slab()
    position = lattice()
    facets = Facets(0, mesh.vertices[mesh.faces], mesh.face_normals)
    source = DirectionalSource.of(light) if isinstance(light, DirectionalLight) else PointSource.of(light, FRAME)
    beams = RefractedBeams(facets, 1.5, source, 0.1, (-0.5, -0.25, -0.5), (0.5, 0.25, 0.5))
    inner = np.abs(position[[0, 2]]).max(axis=0) < 0.3
    return np.bincount(beams.near_arrivals(position).point, minlength=position.shape[1])[inner]


@pytest.mark.parametrize("light", DOWN)
def test_flat_faces_in_pieces_light_every_point_once(light):
    assert_array_equal(counts(DOWN[light]), 1)


def test_sides_that_belong_to_both_facets_are_caught(monkeypatch):
    """The companion."""
    from renderer.tracing import beam_generation

    sound = beam_generation.side_planes

    def closed(corners, direction):
        planes, forward = sound(corners, direction)
        return planes, np.ones_like(forward)

    monkeypatch.setattr(beam_generation, "side_planes", closed)
    assert (counts(DOWN["sun"]) > 1).any()


@pytest.mark.parametrize("lamp", LAMPS)
def test_near_and_far_make_the_whole(lamp):
    mesh, position = icosphere(1, 2), points()
    whole, parts = beams_of(mesh, LAMPS[lamp], 0.1), beams_of(mesh, LAMPS[lamp], 20.0)
    assert whole.all_near and not parts.all_near
    assert_allclose(parts.near, -np.log(FAR_CHANCE) / 20)
    near, far = parts.near_arrivals(position), parts.far_arrivals(position)
    assert near.length.max() <= parts.near < far.length.min()
    together = np.concatenate([pairs(near), pairs(far)])
    assert_array_equal(together[np.lexsort(together.T[::-1])], pairs(whole.near_arrivals(position)))


@pytest.mark.parametrize("lamp", ["sun", "lamp"])
def test_flux_through_a_plane_below_is_what_entered(lamp):
    """Energy: under a box's top, where no other face interferes, focus integrates to the light on the top.

    A midpoint rule of 200^2 points on the plane; the beam's edges cut its cells, of which there are 800: 0.5 %.
    """
    mesh = box((1, 1, 1))
    beams = beams_of(mesh, SUN if lamp == "sun" else PointLight(np.array([0.3, 1.5, 0.2]), np.ones(3)))
    u = (np.arange(200) + 0.5) / 200 * 2 - 1
    x, z = (grid.ravel() for grid in np.meshgrid(u, u))
    found = beams.near_arrivals(np.stack([x, np.full_like(x, 0.2), z]))
    top = np.abs(found.hit[0][1] - 0.5) < 1e-9
    # across the plane, not the beam
    flux = (found.focus * -found.direction[0][1])[top].sum() * 0.01**2
    if lamp == "sun":
        towards = -SUN.direction / np.linalg.norm(SUN.direction)
        entered = towards[1]
    else:
        v = (np.arange(400) + 0.5) / 400 - 0.5
        a, b = np.meshgrid(v, v)
        squared = (a - 0.3) ** 2 + 1 + (b - 0.2) ** 2
        entered = (squared**-1.5).mean()
    assert_allclose(flux, entered, rtol=0.005)
