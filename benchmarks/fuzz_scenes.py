"""Damaged scenes, environment images and parts of renders, read as sss-render reads them.

A forked process reads ``BATCH`` of them after each other, so that a crash costs a batch and not the run. Whatever is
no refusal in one line is a fault.
"""

from __future__ import annotations

import io
import os
import random
import resource
import signal
import tempfile
from contextlib import redirect_stderr
from functools import lru_cache
from pathlib import Path

import numpy as np
from fuzz_inputs import damaged_in_places, damaged_zip
from hostile_inputs import png, put
from hostile_scenes import CAMERA, LIGHT, OBJECT, part, scene

BATCH = 25
SECONDS = 20
MEMORY = 2 * 2**30
_SCENE = """
[scene]
unit = "cm"
[[light]]
type = "rectangle"
center = [0, 3, 0]
target = [0, 0, 0]
half = [1, 1]
radiance = 4
[[object]]
name = "two"
mesh = "ball.ply"
material = "wax"
transform = { scale = 0.5, rotate = [0, 1, 0, 30.0], translate = [3, 0, 0] }
[material.wax]
type = "translucent"
preset = "marble"
roughness = 0.2
"""


@lru_cache
def valid() -> dict[str, tuple[str, bytes]]:
    """A small valid file of every kind: name of the kind -> suffix, bytes."""
    import OpenEXR
    from PIL import Image

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        film = part(folder).read_bytes()
        exr = folder / "a.exr"
        pixels = np.linspace(0, 1, 8 * 4 * 3, dtype=np.float32).reshape(4, 8, 3)
        OpenEXR.File({"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": pixels}).write(
            str(exr)
        )
        jpeg, npy, npz = io.BytesIO(), io.BytesIO(), io.BytesIO()
        Image.fromarray((255 * pixels).astype(np.uint8)).save(jpeg, "JPEG")
        np.save(npy, pixels)
        np.savez_compressed(npz, image=pixels)
        return {
            "scene": (".toml", (CAMERA + LIGHT + OBJECT + _SCENE).encode()),
            "part": (".npz", film),
            "sky-exr": (".exr", exr.read_bytes()),
            "sky-jpg": (".jpg", jpeg.getvalue()),
            "sky-npy": (".npy", npy.getvalue()),
            "sky-npz": (".npz", npz.getvalue()),
            "sky-png": (".png", png(8, 4, bytes(4 * 25))),
        }


def damaged(seed: int, number: int) -> tuple[str, str, bytes]:
    """Kind, suffix and bytes of an input, the same wherever it is made."""
    chance = random.Random(f"render:{seed}:{number}")
    kinds = sorted(valid())
    kind = kinds[number % len(kinds)]
    suffix, data = valid()[kind]
    if suffix == ".npz" and chance.random() < 0.7:
        return kind, suffix, damaged_zip(data, chance)
    return kind, suffix, damaged_in_places(data, data, chance)


def outcomes(seed: int, numbers: range) -> tuple[list[tuple[str, str]], int]:
    """Kind and outcome of each input, as in ``fuzz``, and the most memory any batch held, in bytes."""
    import hostile  # noqa: F401 - before the forks, so that each is spared the imports

    import renderer.render  # noqa: F401

    found: list[tuple[str, str]] = []
    most = 0
    for start in range(numbers.start, numbers.stop, BATCH):
        batch = range(start, min(start + BATCH, numbers.stop))
        ended, memory = _forked(seed, batch)
        most = max(most, memory)
        if len(ended) < len(batch):
            # one crashed; each alone says which
            ended = [_forked_alone(seed, number) for number in batch]
        found += [(damaged(seed, number)[0], outcome) for number, outcome in zip(batch, ended, strict=True)]
    return found, most


def _forked_alone(seed: int, number: int) -> str:
    ended, _ = _forked(seed, range(number, number + 1))
    return ended[0] if ended else "crash"


def _data() -> int:
    """Bytes of data that this process has mapped, touched or not (proc(5), VmData)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmData"))


def _forked(seed: int, numbers: range) -> tuple[list[str], int]:
    """What a child made of the inputs before it ended, and the most memory it held."""
    answer, far_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(answer)
        try:
            # beyond what the parent has already, which the child shares
            resource.setrlimit(resource.RLIMIT_DATA, (_data() + MEMORY, resource.RLIM_INFINITY))
            for number in numbers:
                os.write(far_end, f"{_read(*damaged(seed, number))}\n".encode())
        finally:
            os._exit(0)
    os.close(far_end)
    with os.fdopen(answer, "rb") as file:
        ended = file.read().decode().splitlines()
    _, _, use = os.wait4(child, 0)
    return ended, 1024 * use.ru_maxrss


class _TookTooLong(BaseException):
    pass


def _give_up(*_: object) -> None:
    raise _TookTooLong


def _read(kind: str, suffix: str, data: bytes) -> str:
    """One of the columns of ``fuzz``."""
    from hostile import READERS

    signal.signal(signal.SIGALRM, _give_up)
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as name, redirect_stderr(said):
        folder = Path(name)
        path = put(folder / f"a{suffix}", data)
        if kind.startswith("sky"):
            light = f'[[light]]\ntype = "environment"\nimage = "{path.name}"\n'
            path = scene(folder, CAMERA + light + OBJECT)
        elif kind == "scene":
            path = scene(folder, "")
            path.write_bytes(data)
        signal.alarm(SECONDS)
        try:
            status = READERS["part" if kind == "part" else "scene"](path)
        except _TookTooLong:
            return "hang"
        except Exception:
            return "raised"
        finally:
            signal.alarm(0)
    lines = [line for line in said.getvalue().splitlines() if not line.startswith("sss-render: warning:")]
    if status == 2 and len(lines) == 1:
        return "out of memory" if "out of memory" in lines[0] else "refused"
    return "usable" if status == 0 and not lines else "raised"
