"""The peer's times, with a stand-in for Mitsuba: how long calls take is known."""

import json
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from cli import mitsuba_peer

LOAD, RENDER = 0.2, 0.3


@pytest.fixture
def mitsuba(monkeypatch):
    """A module that loads and renders in known times."""

    def load_file(path, rr_depth):
        time.sleep(LOAD)
        film = SimpleNamespace(size=lambda: (4, 2))
        return SimpleNamespace(sensors=lambda: [SimpleNamespace(film=lambda: film)])

    def render(scene, spp, seed):
        time.sleep(RENDER)
        return np.full((2, 4, 3), 0.5)

    stand_in = SimpleNamespace(set_variant=lambda name: None, load_file=load_file, render=render)
    monkeypatch.setitem(sys.modules, "mitsuba", stand_in)
    monkeypatch.setattr(mitsuba_peer, "process_start", time.monotonic)


def test_seconds_are_those_of_the_process_and_add_up(mitsuba, tmp_path):
    begun = time.monotonic()
    report, picture = tmp_path / "a.json", tmp_path / "a.npz"
    options = ["--passes", "3", "--variant", "scalar_rgb", "--report", str(report)]
    assert mitsuba_peer.main(["scene.xml", "-o", str(picture), *options]) == 0
    spent = time.monotonic() - begun
    told = json.loads(report.read_text())
    assert LOAD + RENDER < told["seconds"] <= spent
    assert LOAD < told["build"] <= told["setup"] and told["render"] > RENDER
    assert told["setup"] + told["render"] <= told["seconds"]
    assert np.load(picture)["image"].shape == (2, 4, 3)
