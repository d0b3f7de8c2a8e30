"""Bounds that data mark, promises of ``auto``, and small scenes as files."""

import json
import shlex

import numpy as np
import pytest

from cli.sss_render import main as render
from renderer.output import image
from renderer.scene.scene_file import load_scene
from renderer.study import stability_bench, studies
from renderer.study.accuracy import Truth
from renderer.study.methods import SHADERS
from renderer.study.stability import Choice, Found, Outcome, Step
from renderer.study.stability_report import bounds, rows
from renderer.study.studies import STUDIES, Study


def outcome(method: str, error: float, stderr: float = 1e-6, rare: str = "") -> Outcome:
    return Outcome(method, 16, error**2, stderr, error**2, stderr, 0.0, 0.0, 0.1, 1.0, rare, "")


def found(values, errors, log=True, choices=(), truth=lambda: None) -> Found:
    study = Study("a-study", "?", "x", tuple(values), lambda value: None, truth, log)
    steps = [
        Step(value, 30.0, 100, tuple(outcome(method, error) for method in SHADERS), tuple(choices), "strict", "")
        for value, error in zip(values, errors, strict=True)
    ]
    return Found(study, tuple(steps))


def test_a_bound_is_interpolated_in_the_logarithms():
    """From 5 % at 1 to 20 % at 100, the bound of 10 % is half way in both logarithms."""
    assert found([1, 100], [0.05, 0.2]).usable("plumb") == [pytest.approx((1, 10))]
    assert found([0, 90], [0.05, 0.2], log=False).usable("plumb") == [pytest.approx((0, 45))]


def test_ranges_in_the_midst_at_the_ends_and_none():
    assert len(found([1, 2, 3, 4, 5], [0.01, 0.5, 0.01, 0.5, 0.01]).usable("plumb")) == 3
    assert found([1, 2], [0.5, 0.4]).usable("plumb") == []
    assert bounds(found([1, 2], [0.5, 0.4]), "scalar") == "nowhere"
    assert bounds(found([1, 2], [0.01, 0.02]), "scalar") == "all"
    assert bounds(found([-90, 90], [0.01, 0.02], log=False), "scalar") == "all"
    assert bounds(found([1, 2], [0.5, 0.4], truth=None), "path") == "exact"


def test_a_broken_promise_is_found_and_a_kept_one_is_not():
    """Wrong by 20 % where 15 % are allowed, and where 25 % are."""
    broken, kept = Choice(0.25, "scalar", 0.15, 0.1), Choice(0.0, "scalar", 0.25, 0.1)
    result = found([1, 2], [0.2, 0.2], choices=(kept, broken, Choice(1.0, "path", 0.001, 0.0)))
    assert [choice for _, choice in result.broken()] == [broken, broken]


def test_an_error_within_its_noise_breaks_no_promise():
    choice = Choice(0.25, "plumb", 0.15, 0.1)
    step = Step(1.0, 30.0, 9, (outcome("plumb", 0.2, stderr=0.01),), (choice,), "strict", "")
    assert Found(STUDIES["wall"], (step,)).broken() == []


@pytest.mark.parametrize("name", STUDIES)
def test_scenes_of_all_studies_are_read_at_both_ends(tmp_path, name):
    study = STUDIES[name]
    for value in (study.values[0], study.values[-1]):
        scene = load_scene(study.scene(value).write(tmp_path, "case"))
        assert all(np.isfinite(thing.mesh.vertices).all() for thing in scene.objects)
        for thing in scene.objects:
            # holes make volumes uncertain, but not their sign
            assert thing.mesh.volume > 0


def test_wedges_have_the_angle_that_they_are_asked_for():
    for angle in (10.0, 90.0, 150.0):
        mesh = studies.wedge(angle)
        front = mesh.vertices[np.isclose(mesh.vertices[:, 2], mesh.vertices[:, 2].max())]
        assert len(front) == 2 and np.allclose(front[:, 0], 0)
        back = mesh.vertices[~np.isclose(mesh.vertices[:, 2], mesh.vertices[:, 2].max())]
        half = np.degrees(np.arctan(abs(back[0, 0]) / (front[0, 2] - back[0, 2])))
        assert 2 * half == pytest.approx(angle, abs=1e-9)
        assert mesh.topology.boundary_edges.size == 0


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A study of one value with little effort, its folder, and how often something was measured."""
    folder = tmp_path_factory.mktemp("stability")
    study = Study("tiny", "?", "x", (1.0,), lambda value: studies.Case([studies.ball(1)]))
    bench = stability_bench.Bench(folder, stability_bench.Effort(0.01))
    return stability_bench.sweep(bench, study), folder, study


@pytest.mark.slow
def test_commands_of_a_row_make_the_pictures_it_was_judged_by(measured, monkeypatch):
    result, folder, _ = measured
    monkeypatch.chdir(folder)
    told = {row["method"]: row for row in rows(result)}
    pictures = {}
    for method in ("path", "diffuse"):
        films = []
        for command in told[method]["commands"].split(" && "):
            program, *arguments = shlex.split(command)
            assert program == "sss-render" and render([*arguments, "-q"]) == 0
            films.append(image.read(folder / arguments[-1]).film)
        pictures[method] = films
    blocks = {method: [stability_bench._blocks(film.mean()) for film in films] for method, films in pictures.items()}
    full = [stability_bench._blocks(film.object_pixels().astype(float))[..., 0] == 1 for film in pictures["path"]]
    again = Truth(tuple(blocks["path"]), full[0] & full[1]).bias(blocks["diffuse"])
    assert again.squared == pytest.approx(told["diffuse"]["squared_bias"], rel=1e-6)


def test_steps_come_in_the_order_of_their_values_whatever_that_of_the_study(tmp_path, monkeypatch):
    """A study may begin at the harmless end; bounds are read from small to large."""
    bench = stability_bench.Bench(tmp_path, stability_bench.FULL)
    steps = {step.value: step for step in found([1, 100], [0.05, 0.2]).steps}
    monkeypatch.setattr(bench, "known", lambda study, value: steps[value])
    study = Study("down", "?", "x", (100, 1), lambda value: None, lambda: None)
    assert bounds(stability_bench.sweep(bench, study), "plumb") == "to 10"


@pytest.mark.slow
def test_what_was_measured_is_not_measured_again(measured, monkeypatch):
    result, folder, study = measured
    log = folder / "steps.jsonl"
    log.write_text(log.read_text() + json.dumps({"key": "cut o"})[:7])
    monkeypatch.setattr(stability_bench.Bench, "_measure", lambda *_: pytest.fail("measured again"))
    again = stability_bench.sweep(stability_bench.Bench(folder, stability_bench.Effort(0.01)), study)
    assert again.steps == result.steps
