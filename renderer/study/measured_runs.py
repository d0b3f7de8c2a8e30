"""Renders in processes of their own, their times, and a log of them that survives an interruption.

A run is one command line, and the command line is kept: whoever has the log can run any single line of it again.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sss_tools.errors import InputError

from . import methods

LOG = "runs.jsonl"
ABOUT = "about.json"
PICTURES = "pictures"
MITSUBA = "mitsuba"


class PeerFailed(Exception):
    """Another renderer did not render the scene; its last words."""


@dataclass(frozen=True)
class Task:
    """One render to measure.

    scene    the scene's name in charts; source is the file, as the user wrote it
    method   "path", "plumb", "scalar", "diffuse", "auto", "mitsuba", or "reference" (path, for judging the others)
    quality  of "auto", else None
    turn     which of the repeated runs; its seed is its own
    """

    scene: str
    source: str
    method: str
    passes: int
    turn: int
    seed: int
    quality: float | None = None

    @property
    def name(self) -> str:
        """A name for files."""
        quality = "" if self.quality is None else f"-q{self.quality:g}"
        return f"{self.scene}-{self.method}{quality}-{self.passes}-{self.turn}"

    @property
    def setting(self) -> str:
        """What was swept, in words."""
        return f"{self.passes} pass{'es' * (self.passes > 1)}" if self.quality is None else f"q {self.quality:g}"


@dataclass(frozen=True)
class Run:
    """A task and what was measured.

    seconds    wall time from the start of the process until the picture was written
    setup      of it, everything before the first sample: interpreter, loading, checking the mesh, building
    build      of the set-up, the building of the ray caster and the tables alone
    render     wall seconds of rendering
    cpu        seconds of all cores, of the whole process
    stderr     mean relative standard error that the renderer states; None where it states none
    shaders    chosen for the translucent objects
    load       mean number of processes that wanted a core when the run began
    command    that makes the same picture
    source_digest  of the scene file, so that runs of a file that has changed are not taken for its runs
    """

    task: Task
    seconds: float
    setup: float
    build: float
    render: float
    cpu: float
    stderr: float | None
    shaders: str
    load: float
    command: str
    source_digest: str


@dataclass
class Lab:
    """Runs tasks in the folder ``folder``, or finds that they have been run.

    render  the command that stands for ``sss-render``; peer the one that renders Mitsuba's scenes
    tell    is told of every run that was made, not found
    """

    folder: Path
    render: Sequence[str]
    peer: Sequence[str]
    threads: int | None = None
    tell: Callable[[Run], None] = lambda run: None
    runs: dict[str, Run] = field(default_factory=dict)

    def open(self, about: dict[str, str]) -> None:
        """Read what an earlier session measured here.

        Raises InputError for a folder that cannot be written to, or that holds runs of another machine or version.
        """
        try:
            (self.folder / PICTURES).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(self.folder, f"cannot be made ({error.strerror})", "choose another folder") from None
        there = self.folder / ABOUT
        if there.is_file():
            try:
                known = json.loads(there.read_text())
            except ValueError:
                raise InputError(there, "is damaged", "give -o an empty folder") from None
            different = [key for key in about if known.get(key) != about[key]]
            if different:
                key = different[0]
                raise InputError(
                    self.folder, f"holds runs of another machine or version ({key} {known.get(key)}, now {about[key]})",
                    "give -o an empty folder",
                )  # fmt: skip
        there.write_text(json.dumps(about, indent=1) + "\n")
        for entry in read_log(self.folder / LOG):
            try:
                run = Run(Task(**entry.pop("task")), **entry)
            except (KeyError, TypeError):
                continue
            if self.picture_path(run.task).is_file():
                self.runs[run.task.name] = run

    def picture_path(self, task: Task) -> Path:
        """Where the picture of a run is kept."""
        return self.folder / PICTURES / f"{task.name}.npz"

    def picture(self, task: Task) -> dict[str, NDArray]:
        """The kept arrays: ``image`` (h, w, 3) float32, and of ours ``where`` (h, w) bool, pixels all of whose samples
        met a translucent object first."""
        with np.load(self.picture_path(task)) as arrays:
            return dict(arrays)

    def run(self, task: Task) -> Run:
        """The measured run of ``task``.

        Raises InputError for a scene that ``sss-render`` refuses, PeerFailed where Mitsuba fails.
        """
        digest = _digest(Path(task.source))
        known = self.runs.get(task.name)
        if known is not None and known.source_digest == digest:
            return known
        measured = self._mitsuba(task) if task.method == "mitsuba" else self._ours(task)
        load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
        run = Run(task, **measured, load=load, source_digest=digest)
        add_to_log(self.folder / LOG, asdict(run))
        self.runs[task.name] = run
        self.tell(run)
        return run

    def _ours(self, task: Task) -> dict:
        picture = self.picture_path(task)
        fresh, report = picture.with_name(f"{task.name}.new.npz"), picture.with_suffix(".json")
        options = [*arguments(task), *(["--threads", str(self.threads)] if self.threads else [])]
        cpu = _timed([*self.render, *options, "-o", str(fresh), "--report", str(report), "-q"], task)
        told = json.loads(report.read_text())
        with np.load(fresh) as arrays:
            hits, image = arrays["film_hits"], arrays["image"]
        np.savez(picture, image=image, where=hits == told["passes"])
        fresh.unlink()
        report.unlink()
        seconds = told["seconds"]
        return {
            "seconds": seconds["total"],
            "setup": seconds["total"] - seconds["render"] - seconds["write"],
            "build": seconds["build"],
            "render": seconds["render"],
            "cpu": cpu,
            "stderr": told["mean_relative_stderr"],
            "shaders": " ".join(sorted({one["shader"] for one in told["objects"] if one["state"] is not None})),
            "command": shlex.join(["sss-render", *options, "-o", f"{task.name}.npz"]),
        }

    def _mitsuba(self, task: Task) -> dict:
        scene = self.folder / MITSUBA / f"{task.scene}-{_digest(Path(task.source))}.xml"
        export = [task.source, "--export", "mitsuba", "-o", str(scene)]
        if not scene.is_file():
            scene.parent.mkdir(exist_ok=True)
            _timed([*self.render, *export, "-q"], task)
        picture = self.picture_path(task)
        options = ["--passes", str(task.passes), "--seed", str(task.seed), "-o"]
        told = picture.with_suffix(".json")
        cpu = _timed([*self.peer, str(scene), *options, str(picture), "--report", str(told)], task)
        seconds = json.loads(told.read_text())
        told.unlink()
        commands = (
            ["sss-render", *export],
            ["python", "-m", "cli.mitsuba_peer", str(scene), *options, f"{task.name}.npz"],
        )
        return {
            **{key: seconds[key] for key in ("seconds", "setup", "build", "render")},
            "cpu": cpu,
            "stderr": None,
            "shaders": seconds["variant"],
            "command": " && ".join(shlex.join(command) for command in commands),
        }


def read_log(path: Path) -> Iterator[dict[str, Any]]:
    """The entries of a log, but for the line that was being written when a session was cut off."""
    for line in path.read_text().splitlines() if path.is_file() else ():
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        if isinstance(entry, dict):
            yield entry


def add_to_log(path: Path, entry: dict[str, Any]) -> None:
    """Append an entry, on a line of its own whatever is there."""
    with path.open("a+b") as log:
        end = log.seek(0, os.SEEK_END)
        if end:
            log.seek(end - 1)
        half = end > 0 and log.read(1) != b"\n"
        log.write(b"\n" * half + json.dumps(entry).encode() + b"\n")


def arguments(task: Task) -> list[str]:
    """What ``sss-render`` is told for a task of ours, but for the output."""
    if task.method == "auto":
        how = [] if task.quality is None else ["--quality", f"{task.quality:g}"]
    else:
        how = methods.options("path" if task.method == "reference" else task.method)
    return [task.source, *how, "--passes", str(task.passes), "--seed", str(task.seed)]


def _timed(command: Sequence[str], task: Task) -> float:
    """Run a command to its end; its seconds on all cores. What it says is shown only if it fails."""
    begun, start = _children_cpu(), time.perf_counter()
    # whatever folder this is started in, the commands are those beside this file
    paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        words = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        if task.method == "mitsuba":
            raise PeerFailed(words)
        raise InputError(task.source, words.removeprefix("sss-render: error: "), "mend the scene, or leave it out")
    ended = _children_cpu()
    return time.perf_counter() - start if begun is None or ended is None else ended - begun


def _children_cpu() -> float | None:
    try:
        import resource
    except ImportError:  # Windows
        return None
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _digest(path: Path) -> str:
    return blake2b(path.read_bytes(), digest_size=8).hexdigest()
