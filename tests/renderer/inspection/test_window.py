"""The window, on a screen of its own, driven by real keys and a real mouse."""

import os
import select
import shutil
import subprocess
import sys
import time

import pytest

from sss_tools import shapes
from sss_tools.writing import write_mesh

CODE = """
import sys
from renderer.inspection.window import Window

def tell(self, words):
    self.told = words
    print("told:", words.splitlines()[0], flush=True)

def run(self):
    self.plotter.iren.initialize()
    self.plotter.render()
    print("open", self.plotter.render_window.GetClassName(), flush=True)
    self.plotter.show(auto_close=True)

Window._write, Window.run = tell, run
from cli.sss_inspect import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture
def screen():
    """The name of a display without a monitor."""
    for program in ("Xvfb", "xdotool"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed")
    pytest.importorskip("pyvista")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(write)
    ready, _, _ = select.select([read], [], [], 60)
    # the pipe stays open: the server writes the end of the line after the number, or dies of it
    name = os.read(read, 16).decode().strip() if ready else ""
    try:
        if not name:
            pytest.skip("Xvfb does not start")
        yield f":{name}"
    finally:
        server.kill()
        server.wait()
        os.close(read)


class Driver:
    """The command in a process, and hands on its window."""

    def __init__(self, display: str, *arguments: str, code: str = CODE):
        self.environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": os.pathsep.join(p or "." for p in sys.path)}
        self.environment.pop("VTK_DEFAULT_OPENGL_WINDOW", None)
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=self.environment,
        )
        self.lines: list[str] = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def wait_for(self, words: str, seconds: float = 120) -> str:
        """The first line from now on that has these words."""
        assert self.process.stdout is not None
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            ready, _, _ = select.select([self.process.stdout], [], [], 0.5)
            if ready:
                line = self.process.stdout.readline().decode()
                if not line:
                    break
                self.lines.append(line)
                if words in line:
                    return line
        self.process.kill()
        raise AssertionError(
            f"no line with {words!r} in {self.lines}; {self.process.communicate()[1].decode()[-2000:]}"
        )

    def hand(self, *command: str) -> None:
        """One movement of xdotool."""
        subprocess.run(["xdotool", *command], env=self.environment, check=True, timeout=60)


def test_keys_go_from_finding_to_finding_and_a_click_asks_a_face(screen, tmp_path):
    path = tmp_path / "ball.ply"
    write_mesh(shapes.inverted(shapes.punctured(shapes.icosphere(1.0, 3), [[0, 0, 1], [1, 0, 0]], 0.25)), path)
    with Driver(screen, str(path), "-q") as window:
        assert "vtkXOpenGLRenderWindow" in window.wait_for("open")
        time.sleep(1)
        window.hand("mousemove", "600", "425")
        window.hand("key", "n")
        first = window.wait_for("(1 of 3 places)")
        window.hand("key", "n")
        window.wait_for("(2 of 3 places)")
        window.hand("key", "p")
        assert window.wait_for("(1 of 3 places)") == first
        window.hand("key", "r")
        time.sleep(1)
        window.hand("click", "1")
        assert "SSS204 inverted-shell" in window.wait_for("face ")
        window.hand("key", "q")
        assert window.process.wait(60) == 0


def test_the_live_picture_turns_under_the_mouse_and_rests_on_the_reference(screen, tmp_path):
    path = tmp_path / "ball.ply"
    write_mesh(shapes.ellipsoid((1.0, 0.7, 0.5), 3), path)
    code = CODE.replace("renderer.inspection.window import Window", "renderer.inspection.live_window import LiveWindow")
    live = (
        code[: code.index("def tell")]
        + """
before = LiveWindow._tell
def tell(self, words):
    before(self, words)
    print("told:", words, self.live.camera.position, flush=True)
LiveWindow._tell = tell
"""
        + code[code.index("from cli") :]
    )
    # two millimetres of ketchup: few collisions, and passes take a fraction of a second
    look = [str(path), "--live", "--size", "500x400", "--material", "ketchup", "--unit", "mm", "-q"]
    with Driver(screen, *look, code=live) as window:
        window.wait_for("ready")
        first = window.wait_for("standard error")
        window.hand("mousemove", "240", "240")
        window.hand("mousedown", "1")
        for x in (260, 300, 340):
            window.hand("mousemove", str(x), "230")
        moving = window.wait_for("pictures/s")
        window.hand("mouseup", "1")
        window.hand("click", "4")
        rest = window.wait_for("standard error")
        places = [line[line.index("[") :] for line in (first, moving, rest)]
        assert len(set(places)) == 3
        window.hand("key", "q")
        assert window.process.wait(60) == 0


def test_without_a_screen_the_command_says_so_in_one_line(tmp_path):
    path = tmp_path / "ball.ply"
    write_mesh(shapes.icosphere(1.0, 1), path)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p or "." for p in sys.path)}
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"):
        environment.pop(name, None)
    code = "import sys; from cli.sss_inspect import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run([sys.executable, "-c", code, str(path)], env=environment, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "no window can be opened" in done.stderr and "--screenshot" in done.stderr
