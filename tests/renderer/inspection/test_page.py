"""The page holds everything, asks nobody, and its view answers to real clicks and keys."""

import json
import re

import numpy as np
import pytest

from renderer.inspection.exhibit import put_together
from renderer.inspection.page import render_page
from renderer.inspection.simplification import simplified
from renderer.inspection.specimen import Inspection
from sss_tools import shapes
from tests.renderer.inspection import browser
from tests.renderer.inspection.exhibits import ball_in_ball, exhibit, inspection, punctured_ball


def data_of(page: str) -> dict:
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1])


def test_every_finding_is_a_row_with_its_why():
    shown = exhibit(shapes.joined(punctured_ball(), shapes.moved(ball_in_ball(), [3, 0, 0])))
    page = render_page(shown)
    rules = shown.inspection.specimens[0].findings
    assert {rule.code for rule in rules} >= {"SSS101", "SSS301"}
    assert page.count('class="finding"') == len(rules)
    for rule in rules:
        assert rule.code in page and rule.why.split(":")[0] in page


def test_the_page_names_no_other_place():
    page = render_page(exhibit(punctured_ball()), picture=b"\x89PNG\r\n\x1a\nnot much")
    assert not re.search(r"""(src|href)\s*=\s*["'](?!data:)""", page) and "://" not in page
    assert "default-src 'none'" in page and "data:image/png;base64," in page


def test_names_cannot_break_out_of_the_page():
    nasty = '</script><b onload="x">@DATA@ & co'
    checked = inspection(punctured_ball())
    page = render_page(put_together(Inspection(nasty, checked.specimens)))
    assert "<b onload" not in page and page.count("</script>") == 2
    assert data_of(page)["findings"]


def test_simplified_surfaces_are_as_small_as_asked_and_stay_in_place():
    (surface,) = exhibit(shapes.icosphere(1.0, 6)).surfaces
    light = simplified(surface, 8000)
    assert 0.5 * 8000 < len(light.faces) <= 1.1 * 8000
    radius = np.linalg.norm(light.points, axis=1)
    # a cell is about 1/36 wide; its points' mean lies within the facet's sagitta below the surface
    assert radius.max() < 0.5001 and radius.min() > 0.495
    assert (surface.colours[0] == light.colours).all() and set(light.source) <= set(surface.source)


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    if browser.installed() is None:
        pytest.skip("no Chromium is installed")
    page = browser.Browser(tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


def test_in_chromium_a_click_on_a_finding_moves_the_camera(chromium, tmp_path):
    shown = exhibit(punctured_ball())
    path = tmp_path / "page.html"
    path.write_text(render_page(shown))
    chromium.open(path)
    assert chromium.value("document.documentElement.dataset.error") is None
    before = chromium.value("[...sssView.target, sssView.distance]")
    chromium.click(*chromium.middle_of("tr.finding"))
    chromium.wait_for("sssView.spot === 0")
    wanted = data_of(path.read_text())["spots"][0]["view"]
    there = [*wanted["target"], wanted["distance"]]
    # all of them: one may be there before the others are
    chromium.wait_for(f"[...sssView.target, sssView.distance].every((x, k) => Math.abs(x - {there}[k]) < 1e-6)")
    after = chromium.value("[...sssView.target, sssView.distance]")
    assert not np.allclose(after, before, atol=0.1)
    # the key goes on to the next place, the button back to the whole
    chromium.press("n")
    chromium.wait_for("sssView.spot === 1")
    chromium.click(*chromium.middle_of("#whole"))
    chromium.wait_for(f"Math.abs(sssView.distance - {before[3]}) < 1e-6")
    assert chromium.complaints == []


def test_in_chromium_a_face_tells_its_findings(chromium, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(render_page(exhibit(shapes.inverted(shapes.icosphere(1.0, 3)))))
    chromium.open(path)
    chromium.click(*chromium.middle_of("#canvas"))
    chromium.wait_for("document.getElementById('told').textContent.includes('SSS204 inverted-shell')")
    assert chromium.complaints == []


def test_in_chromium_what_is_inside_glows_through(chromium, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(render_page(exhibit(ball_in_ball())))
    chromium.open(path)
    middle = """(() => { const gl = canvas.getContext('webgl2'), p = new Uint8Array(4);
        gl.readPixels(canvas.width >> 1, canvas.height >> 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, p); return [...p]; })()"""
    red, green, _, _ = chromium.value(middle)
    assert red > green + 60  # the rule's crimson
    chromium.press("x")
    chromium.wait_for("!sssView.xray")
    red, green, _, _ = chromium.value(middle)
    assert abs(red - green) < 20  # the wall, which is nearly grey
