"""The regression guard: accuracy and speed against what benchmarks/guard.py kept. About half a minute of CPU time.

Accuracy raises a false alarm once in a thousand runs with fresh random numbers (``guard.FALSE_ALARM``). It sees path
pictures that are 3 % too bright and faster shaders whose RMS error grew by half, which the planted losses show. Speed
has no false-alarm rate, but a bound far outside of what repetitions differ by: twice the kept ratio of CPU seconds to
those of a fixed kernel, in each of three measurements; on a crowded machine measurements differ by up to a half.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from renderer.study import guard
from renderer.study.judges import Bias
from tests.assertions import seed

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def scenes():
    return guard.scenes()


@pytest.fixture(scope="module")
def kept():
    return json.loads((HERE / "guard.json").read_text())


@pytest.fixture(scope="module")
def exact():
    """The kept exact pictures, by scene."""
    with np.load(HERE / "guard.npz") as arrays:
        return {
            name: guard.Pictures(
                tuple(arrays[f"{name}_mean{k}"].astype(float) for k in (0, 1)),
                tuple(arrays[f"{name}_stderr{k}"].astype(float) for k in (0, 1)),
                arrays[f"{name}_where"], int(arrays[f"{name}_passes"]),
            )
            for name in guard.CASES
        }  # fmt: skip


@pytest.fixture(scope="module")
def biases(kept):
    return {tuple(key.split()): Bias(**entry) for key, entry in kept["squared_bias"].items()}


@pytest.fixture(scope="module")
def now(scenes):
    return {
        (name, method): guard.pictures(scene, method, seed(7)) for name, scene in scenes.items()
        for method in guard.PASSES
    }  # fmt: skip


@pytest.mark.slow
def test_no_shader_has_lost_accuracy(exact, biases, now):
    assert guard.accuracy_losses(exact, biases, now) == []


@pytest.mark.slow
@pytest.mark.parametrize("method", guard.PASSES)
def test_a_planted_loss_of_accuracy_is_found(exact, biases, now, method):
    spoiled = {**now, ("ball", method): _spoiled(now["ball", method], method, exact["ball"])}
    lost = guard.accuracy_losses(exact, biases, spoiled)
    assert len(lost) == 1 and lost[0].startswith(f"ball, {method}: ")


def _spoiled(shown: guard.Pictures, method: str, exact: guard.Pictures) -> guard.Pictures:
    """Path 3 % too bright; of the others what they are wrong by, half as much again."""
    if method == "path":
        return shown.times(1.03)
    level = exact.together().mean
    return guard.Pictures(
        tuple(mean + 0.5 * (mean - level) for mean in shown.means), shown.stderrs, shown.where, shown.passes
    )


@pytest.mark.slow
def test_nothing_has_become_much_slower(scenes, kept):
    assert guard.lasting_speed_losses(kept["times_the_kernel"], lambda: guard.speed_ratios(scenes["ball"])) == []


@pytest.mark.slow
def test_a_planted_loss_of_speed_is_found(scenes, kept):
    """Everything does its work four times over; measured once, as sound code passes at the first measurement, too."""
    lost = guard.lasting_speed_losses(
        kept["times_the_kernel"], lambda: guard.speed_ratios(scenes["ball"], repeats=2, work=4), attempts=1
    )
    assert len(lost) == len(kept["times_the_kernel"])


def test_only_what_every_measurement_finds_slow_is_lost():
    """At most twice the kept ratio: path is crowded in two of three, plumb always slow, scalar just within."""
    measured = iter([{"path": 5.0, "plumb": 2.1, "scalar": 1.9}, {"path": 2.5, "plumb": 9.0, "scalar": 4.0},
                     {"path": 1.5, "plumb": 2.1, "scalar": 4.0}])  # fmt: skip
    kept = {"path": 1.0, "plumb": 1.0, "scalar": 1.0}
    lost = guard.lasting_speed_losses(kept, lambda: next(measured))
    assert len(lost) == 1 and lost[0].startswith("plumb: 2.1 times")
    # no more is measured once nothing is slow
    attempts = iter([{"path": 1.0}])
    assert guard.lasting_speed_losses({"path": 1.0}, lambda: next(attempts)) == []
