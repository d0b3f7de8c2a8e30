"""The benchmark that scores facts about real meshes: what it must not let pass."""

import pytest

from benchmarks import manifest_facts
from benchmarks.manifest_facts import Comparison, complaints, ending
from sss_tools import shapes
from sss_tools.validation.run import check_file, check_mesh
from sss_tools.validation.settings import Settings

RIGHT = [Comparison("a.ply", f"fact {number}", "1", "1") for number in range(99)]


@pytest.fixture(autouse=True)
def one_explanation(monkeypatch):
    monkeypatch.setattr(manifest_facts, "EXPLANATIONS", {("b.ply", "holes"): "ours: it is a seam"})


def test_an_explained_disagreement_passes():
    assert complaints([*RIGHT, Comparison("b.ply", "holes", "1", "0", "ours: it is a seam")], {"c.ply": "SSS702"}) == []


def test_a_new_disagreement_and_a_stale_explanation_are_named():
    found = complaints([*RIGHT, Comparison("b.ply", "components", "1", "2")], {})
    assert [line.split(": ")[:3] for line in found] == [
        ["UNEXPLAINED", "b.ply", "components"],
        ["STALE", "b.ply", "holes"],
    ]


def test_too_many_explained_disagreements_miss_the_target():
    wrong = Comparison("b.ply", "holes", "1", "0", "ours: it is a seam")
    assert complaints([*RIGHT, wrong, wrong, wrong], {})[0].startswith("MISSED: 97.06%")


def test_a_corrupt_file_that_is_accepted_is_named(tmp_path):
    assert ending(check_mesh(shapes.box())) == "accepted"
    (tmp_path / "cut.ply").write_text("ply")
    assert ending(check_file(tmp_path / "cut.ply", Settings())) == "SSS702"
    holes = Comparison("b.ply", "holes", "1", "0", "ours: it is a seam")
    assert complaints([*RIGHT, holes], {"c.ply": "accepted"}) == ["NOT REFUSED: c.ply: accepted"]
