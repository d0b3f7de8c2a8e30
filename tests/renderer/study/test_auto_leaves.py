"""``auto`` leaves every method before it is more wrong than it allows itself: bounds of docs/limits.md that it handles.

A small version of ``sss-chart stability``, of the ends of some of its sweeps: about half a minute of CPU time. False
alarms of each study: ``stability.PROMISES_FALSE_ALARM``. Errors are seen where they are larger than what is allowed by
some three standard errors; blind to values in between, which the full sweeps see.
"""

from dataclasses import replace

import pytest

from renderer.study.stability import Found
from renderer.study.stability_bench import Bench, Effort, sweep
from renderer.study.studies import STUDIES

ENDS = {"wall": (0.5, 16.0), "aspect": (1.0, 16.0), "corner": (40.0, 150.0), "albedo": (0.5, 1e-3)}
SHORT = Effort(0.4)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The ends of each sweep, by study."""
    bench = Bench(tmp_path_factory.mktemp("ends"), SHORT)
    return {name: sweep(bench, replace(STUDIES[name], values=values)) for name, values in ENDS.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", ENDS)
def test_auto_leaves_a_method_before_it_fails(swept, name):
    found = swept[name]
    assert found.broken() == []
    # there is something to leave: at some quality a fast shader is chosen, and at one of the ends one is unusable
    assert any(choice.shader != "path" for step in found.steps for choice in step.choices)
    assert any(outcome.error > 0.1 for step in found.steps for outcome in step.outcomes)


@pytest.mark.slow
@pytest.mark.parametrize("name", ENDS)
def test_rare_events_are_within_budget(swept, name):
    assert swept[name].rare() == []


@pytest.mark.slow
def test_an_auto_that_stays_too_long_is_found(swept):
    """What is chosen for the least quality, kept for the highest, where a sixtieth of the error is allowed."""
    found = swept["wall"]
    stubborn = [
        replace(step, choices=tuple(replace(choice, shader=step.choices[0].shader) for choice in step.choices))
        for step in found.steps
    ]
    assert len(Found(found.study, tuple(stubborn)).broken()) >= 2
