"""A folder with a small scene, and commands in fresh interpreters."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from sss_tools import shapes
from sss_tools.writing import write_mesh

SCENE = """
[camera]
position = [0, 1, 6]
target = [0, 0, 0]
fov = 26
resolution = [24, 20]

[[light]]
type = "environment"
radiance = [0.5, 0.6, 0.7]

[[object]]
name = "ball"
mesh = "ball.ply"
material = "wax"

[material.wax]
type = "translucent"
albedo = [0.9, 0.8, 0.7]
sigma_t = 6.0
"""


@pytest.fixture
def workplace(tmp_path, monkeypatch) -> Path:
    """The current folder: ``ball.ply``, a closed ball of radius 1, and ``scene.toml`` that shows it."""
    monkeypatch.chdir(tmp_path)
    write_mesh(shapes.icosphere(1.0, 2), "ball.ply")
    Path("scene.toml").write_text(SCENE)
    return tmp_path


def interpreter(code: str, *arguments: str, **options) -> subprocess.Popen:
    """Code in a fresh interpreter that finds what this one finds; its output is text, in pipes.

    A shell that runs the tests in the background has them ignore SIGINT, and what they start would inherit that.
    """
    if sys.platform != "win32":
        options.setdefault("preexec_fn", partial(signal.signal, signal.SIGINT, signal.SIG_DFL))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path)}
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, **options,
    )  # fmt: skip


@pytest.fixture
def start():
    """``interpreter``; what still runs at the end of the test is killed."""
    begun: list[subprocess.Popen] = []

    def begin(code: str, *arguments: str, **options) -> subprocess.Popen:
        begun.append(interpreter(code, *arguments, **options))
        return begun[-1]

    yield begin
    for process in begun:
        if process.poll() is None:
            process.kill()
        process.communicate()
