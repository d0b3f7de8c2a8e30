"""Renders in processes of their own that something is done to, and what became of them."""

from __future__ import annotations

import io
import mmap
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from renderer.checkpoint import checkpoint_path
from sss_tools import shapes
from sss_tools.writing import ply_bytes

PASSES = 48
SCENE = """
[camera]
position = [0, 0.5, 6]
target = [0, 0, 0]
fov = 25
resolution = [64, 56]
[[light]]
type = "environment"
radiance = 0.7
[[object]]
mesh = "ball.ply"
material = "wax"
shader = "path"
[material.wax]
type = "translucent"
albedo = [0.95, 0.9, 0.8]
sigma_t = 6.0
"""


Seconds = tuple[float, float]
"""Of wall time, and of the command's processor time."""


@dataclass
class Trials:
    """What became of the trials of one fault.

    lost      finished passes that the second run had to render again, a trial each
    wrong     pixels that differ from the undisturbed picture
    ending    from the fault to the end of the command, where it ends it
    recovery  from the start of the second run to its first new pass, or its end
    broken    what must not happen: half files, tracebacks, wrong statuses
    """

    fault: str
    count: int = 0
    lost: list[int] = field(default_factory=list)
    wrong: int = 0
    ending: list[Seconds] = field(default_factory=list)
    recovery: list[Seconds] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)

    def row(self) -> str:
        """Of the table in Markdown."""
        lost = f"{max(self.lost, default=0)}, {np.mean(self.lost or [0]):.1f}"
        return (
            f"| {self.fault} | {self.count} | {lost} | {self.wrong} | {_most_and_mean(self.ending)} | "
            f"{_most_and_mean(self.recovery)} | {len(self.broken)} |"
        )


HEADER = """\
| fault | injected | passes lost: most, mean | wrong pixels | to end, s: most, mean | of processor \
| to recover, s: most, mean | of processor | broken |
|---|---:|---:|---:|---:|---:|---:|---:|---:|"""


def _most_and_mean(seconds: list[Seconds]) -> str:
    """Two cells."""
    if not seconds:
        return " | "
    most, mean = np.max(seconds, axis=0), np.mean(seconds, axis=0)
    cells = (f"{most[0]:.1f}, {mean[0]:.1f}", "" if np.isnan(mean[1]) else f"{most[1]:.2f}, {mean[1]:.2f}")
    return " | ".join(cells)


class Work:
    """A folder with the scene, and what its render gives undisturbed.

    refresh  seconds between checkpoints, where not those of the command
    """

    def __init__(self, folder: Path, refresh: float | None = None, passes: int = PASSES):
        self.folder, self.refresh, self.passes = folder, refresh, passes
        (folder / "ball.ply").write_bytes(ply_bytes(shapes.icosphere(1.0, 2)))
        (folder / "scene.toml").write_text(SCENE)
        ended = self.render(folder / "whole.npz").end()
        assert ended.status == 0, ended.said
        self.seconds = ended.seconds[0]
        with np.load(folder / "whole.npz") as arrays:
            self.whole = arrays["film_sum"]

    def render(
        self,
        out: Path,
        *more: str,
        before: Callable[[], object] = lambda: None,
        fresh: bool = False,
        scheduler: str | None = None,
    ) -> Running:
        """Start the command in a process of its own. ``before`` runs in it, before it begins; a ``fresh`` one starts
        another interpreter, as a shell does, and its passes are not counted."""
        arguments = [*self._arguments(out), "--passes", str(self.passes), *more]
        arguments += ["--threads", "1"] if scheduler is None else ["--scheduler", scheduler]
        return Running(arguments, self.refresh, before, fresh)

    def timed(self, out: Path, seconds: float, before: Callable[[], object]) -> Running:
        """A render with a budget of seconds."""
        return Running([*self._arguments(out), "--time", str(seconds), "--threads", "1"], self.refresh, before)

    def _arguments(self, out: Path) -> list[str]:
        return [str(self.folder / "scene.toml"), "-o", str(out), "--quiet"]

    def wrong_pixels(self, out: Path, tolerance: float = 1e-12) -> int:
        """Of a finished picture; sums of the same passes agree to 1e-12, however they were split."""
        with np.load(out) as arrays:
            if int(arrays["passes"]) != self.passes:
                return arrays["film_hits"].size
            apart = ~np.isclose(arrays["film_sum"], self.whole, rtol=tolerance, atol=0)
        return int(apart.any(axis=-1).sum())


@dataclass
class Ended:
    """How a command ended.

    status   as a shell sees it
    said     on both streams
    seconds  from its start to its end
    first    the same up to its first pass in the film; to its end where there was none
    """

    status: int
    said: str
    seconds: Seconds
    first: Seconds


class Running:
    """The command in a forked process, with the number of its finished passes."""

    def __init__(self, arguments: list[str], refresh: float | None, before: Callable[[], object], fresh: bool = False):
        self._counter = mmap.mmap(-1, 24)
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - read when the process is through
        self.started = time.monotonic()
        self.pid = os.fork()
        if self.pid == 0:
            self._run(arguments, refresh, before, fresh)

    def _run(self, arguments: list[str], refresh: float | None, before: Callable[[], object], fresh: bool) -> None:
        code = 70
        try:
            os.dup2(self._said.fileno(), 1)
            os.dup2(self._said.fileno(), 2)
            if fresh:
                signal.signal(signal.SIGINT, signal.SIG_DFL)
                os.execv(sys.executable, [sys.executable, "-m", "cli.sss_render", *arguments])
            from cli.sss_render import main
            from renderer import checkpoint
            from renderer.output.film import Film

            sys.stdout, sys.stderr = (io.TextIOWrapper(io.FileIO(k, "w", closefd=False)) for k in (1, 2))
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if refresh is not None:
                checkpoint.REFRESH_EVERY, checkpoint.REFRESH_SHARE = refresh, 1.0
            add = Film.add_pass

            def counted(film: Film, *rest: object, **named: object) -> None:
                add(film, *rest, **named)  # type: ignore[arg-type]
                count = int.from_bytes(self._counter[:8], "little") + 1
                self._counter[:8] = count.to_bytes(8, "little")
                if count == 1:
                    self._counter[8:16] = time.monotonic_ns().to_bytes(8, "little")
                    self._counter[16:] = time.process_time_ns().to_bytes(8, "little")

            Film.add_pass = counted  # type: ignore[method-assign, assignment]
            before()
            code = main(arguments)
            sys.stdout.flush()
            sys.stderr.flush()
        except KeyboardInterrupt:
            code = 130  # before the command began
        finally:
            os._exit(code)

    @property
    def finished(self) -> int:
        """Passes in the film so far."""
        return int.from_bytes(self._counter[:8], "little")

    def runs(self) -> bool:
        """Whether it has not ended."""
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None

    def seconds(self) -> Seconds:
        """Since its start; fields 14 and 15 of /proc/PID/stat (proc(5)) are the processor's."""
        fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return time.monotonic() - self.started, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> Ended:
        """Wait."""
        _, status, used = os.wait4(self.pid, 0)
        seconds = time.monotonic() - self.started, used.ru_utime + used.ru_stime
        self._said.seek(0)
        said = self._said.read().decode(errors="replace")
        self._said.close()
        wall, processor = (int.from_bytes(self._counter[k : k + 8], "little") / 1e9 for k in (8, 16))
        first = (wall - self.started, processor) if wall else seconds
        return Ended(os.waitstatus_to_exitcode(status), said, seconds, first)


def passes_in(path: Path) -> int:
    """Passes of a film; raises where the file is not whole."""
    with np.load(path) as arrays:
        for name in arrays.files:
            arrays[name]
        return int(arrays["passes"])


def recover(work: Work, trials: Trials, out: Path, finished: int) -> None:
    """Resume, or begin again where nothing was kept, and judge the picture."""
    unfinished = checkpoint_path(out)
    kept = 0
    for path in (unfinished, out):
        if path.exists():
            try:
                kept = max(kept, passes_in(path))
            except Exception as error:
                trials.broken.append(f"{path.name} is not whole ({error})")
    trials.lost.append(max(finished - kept, 0))
    ended = work.render(out, *(["--resume"] if kept else [])).end()
    trials.recovery.append(ended.first)
    if ended.status != 0 or ended.said:
        trials.broken.append(f"second run: status {ended.status}: {ended.said}")
    else:
        trials.wrong += work.wrong_pixels(out)
    if unfinished.exists():
        trials.broken.append("the checkpoint stays")
