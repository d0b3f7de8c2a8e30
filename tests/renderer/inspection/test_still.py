"""Stills show what was found where it is, whoever draws them."""

import numpy as np
import pytest

from renderer.inspection import gl, palette
from renderer.inspection.layer import Clip, seen_through
from renderer.inspection.ray_artist import RayArtist
from renderer.inspection.still import close_view, compose
from renderer.inspection.viewpoint import centred
from renderer.inspection.vtk_artist import VtkArtist
from sss_tools import shapes
from sss_tools.medium import Medium
from tests.renderer.inspection.exhibits import ball_in_ball, exhibit, punctured_ball

SIZE = (240, 200)


@pytest.fixture(scope="module")
def usable_gl():
    drawable = gl.preflight()
    if drawable.window is None:
        pytest.skip(drawable.problem)


@pytest.fixture(params=["rays", "vtk"])
def artist_for(request):
    """A function that makes an artist for an exhibit: both kinds must show the same."""
    if request.param == "rays":
        return RayArtist
    request.getfixturevalue("usable_gl")
    return VtkArtist


def hue_share(image, colour) -> float:
    """The share of a picture's pixels whose colour points the same way as ``colour``, however bright, but no grey."""
    picture, wanted = image.reshape(-1, 3).astype(float), np.array(colour, float)
    picture, wanted = picture - picture.min(axis=1, keepdims=True), wanted - wanted.min()
    length = np.linalg.norm(picture, axis=1)
    cosine = picture @ wanted / np.maximum(length, 1e-9) / np.linalg.norm(wanted)
    return float(((cosine > 0.985) & (length > 40)).mean())


def test_a_clean_ball_is_plain(artist_for):
    image = (
        artist_for(exhibit(shapes.icosphere(1.0, 3))).draw(exhibit(shapes.icosphere(1.0, 3)).overview(1.2), SIZE).image
    )
    assert hue_share(image, palette.RULES["SSS101"]) == 0
    covered = (np.abs(image.astype(int) - palette.BACKGROUND).max(axis=2) > 8).mean()
    # a ball across MARGIN of the height: pi/4 (0.84 x 200)^2 of 240 x 200 pixels
    assert covered == pytest.approx(np.pi / 4 * (0.84 * 200) ** 2 / (240 * 200), rel=0.05)


def test_the_rim_of_a_hole_is_drawn(artist_for):
    shown = exhibit(shapes.punctured(shapes.icosphere(1.0, 4), [[0.5, 0.3, 0.8]], 0.2))
    assert hue_share(artist_for(shown).draw(shown.overview(1.2), SIZE).image, palette.RULES["SSS101"]) > 0.005


def test_what_is_inside_shines_through_and_only_then(artist_for):
    shown = exhibit(ball_in_ball())
    artist, view = artist_for(shown), shown.overview(1.2)
    colour = palette.RULES["SSS301"]
    assert hue_share(artist.draw(view, SIZE).image, colour) == 0
    # the inner ball is two fifths as wide as the outer one
    ball = np.pi / 4 * (0.4 * 0.84 * 200) ** 2 / (240 * 200)
    assert hue_share(seen_through(artist, view, SIZE).image, colour) == pytest.approx(ball, rel=0.15)


def test_a_clip_opens_the_wall(artist_for):
    shown = exhibit(ball_in_ball())
    # the half behind is kept, and shows the violet of backs
    image = artist_for(shown, Clip(2, 0.0, 0.5)).draw(shown.overview(1.2), SIZE).image.astype(int)
    assert (image[..., 2] > image[..., 1] + 12).mean() > 0.1
    whole = artist_for(shown).draw(shown.overview(1.2), SIZE).image.astype(int)
    assert (whole[..., 2] > whole[..., 1] + 12).mean() == 0


def test_depths_are_along_the_line_of_sight(artist_for):
    shown = exhibit(shapes.icosphere(1.0, 4))
    view = shown.overview(1.2)
    layer = artist_for(shown).draw(view, SIZE)
    distance = np.linalg.norm(view.position - view.target)
    # the ball has radius 1/2 in the frame; facets, a depth buffer of 24 bits and the pixel beside the middle
    assert layer.depth[100, 120] == pytest.approx(distance - 0.5, abs=2e-3)
    assert np.isinf(layer.depth[0, 0])


def test_close_ups_are_not_cut_off_and_their_background_does_not_glow(artist_for):
    # a dent of a thousandth of the size, a finding inside that shines, nothing behind at the rim of the view
    shown = exhibit(ball_in_ball())
    artist = artist_for(shown)
    for radius in (0.3, 1e-3, 1e-4):
        view = centred([0.0, 0.2, 1.0], np.array([0.0, 0.1, 0.488]), radius)
        alone, both = artist.draw(view, SIZE), seen_through(artist, view, SIZE)
        hidden = np.isfinite(artist.draw(view, SIZE, shining=True).depth)
        assert np.isfinite(alone.depth[100, 120])
        # a front, not the violet of backs
        assert alone.image[100, 120, 0] >= alone.image[100, 120, 2]
        assert (both.image[~hidden] == alone.image[~hidden]).all()


def test_only_what_shines_has_a_depth_among_what_shines(artist_for):
    # one rim near the camera and one far away: depths of very different size
    shown = exhibit(shapes.punctured(shapes.icosphere(1.0, 5), [[0.5, 0.3, 0.8], [-0.5, -0.3, -0.8]], 0.02))
    number = next(k for k, spot in enumerate(shown.spots) if spot.code == "SSS101")
    layer = artist_for(shown).draw(close_view(shown, number, 1.2), SIZE, shining=True)
    plain = np.abs(layer.image.astype(int) - palette.BACKGROUND).max(axis=2) < 4
    assert plain.mean() > 0.3 and np.isinf(layer.depth[plain]).all()


def test_a_tiny_hole_has_a_ring_a_label_and_a_close_up():
    ball = shapes.icosphere(1.0, 5)
    shown = exhibit(shapes.punctured(ball, [[0.5, 0.3, 0.8]], 0.03))
    (spot,) = (spot for spot in shown.spots if spot.code == "SSS101")
    assert spot.radius < 0.03
    artist = RayArtist(shown)
    still = compose(shown, artist, (700, 500))
    assert still.shape == (500, 700, 3)
    bare = artist.draw(shown.overview(1.0), (467, 375)).image
    main, insets = still[:375, :467], still[375:, :116]
    colour = palette.RULES["SSS101"]
    assert hue_share(main, colour) > 2 * hue_share(bare, colour) > 0  # the ring and the label
    assert hue_share(insets, colour) > 0.04
    view = close_view(shown, shown.spots.index(spot), 1.0)
    x, y, _ = view.project(spot.centre, (100, 100))
    # perspective moves the middle of what is framed a little
    assert abs(x - 50) < 8 and abs(y - 50) < 8


def test_thickness_is_coloured_in_mean_free_paths():
    ball = shapes.icosphere(1.0, 3)
    thick, thin = (
        exhibit(ball, colour="thickness", medium=Medium.from_albedo([0.9] * 3, [sigma] * 3)) for sigma in (50.0, 0.05)
    )
    assert thick.legend.scale is not None and "mean free paths" in thick.legend.scale[0]
    # two radii are 100 mean free paths, the blue end, or a tenth of one, the red end
    blue, red = (np.median(shown.surfaces[0].colours, axis=0) for shown in (thick, thin))
    assert np.abs(blue - palette.RAMP[-1]).max() < 20 and np.abs(red - palette.RAMP[0]).max() < 20


def test_components_are_coloured_by_role():
    shown = exhibit(shapes.hollow_ball(1.0, 0.5, 2), colour="component")
    colours = {tuple(colour) for colour in shown.surfaces[0].colours.tolist()}
    assert colours == {palette.ROLES["solid"], palette.ROLES["cavity"]}
    assert [key.split(": ")[1] for key, _, _ in shown.legend.entries] == ["solid", "cavity"]


def test_a_finding_with_holes_counts_in_the_panel_and_the_rings():
    still = compose(exhibit(punctured_ball()), RayArtist(exhibit(punctured_ball())), (900, 500))
    assert hue_share(still[:, 600:], palette.RULES["SSS101"]) > 0.0005
