"""Scenes, environment images and parts of renders made to harm whoever reads them, as ``hostile_inputs`` has meshes."""

from __future__ import annotations

import io
import os
import struct
import zipfile
from pathlib import Path

import numpy as np
from hostile_inputs import attack, png, put

from sss_tools import shapes
from sss_tools.writing import ply_bytes

# ---- scenes ----

CAMERA = "[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov = 30\nresolution = [8, 8]\n"
LIGHT = '[[light]]\ntype = "environment"\nradiance = 1\n'
OBJECT = '[[object]]\nmesh = "ball.ply"\nmaterial = "m"\n[material.m]\ntype = "diffuse"\nreflectance = 0.5\n'


def scene(folder: Path, text: str) -> Path:
    """A scene file beside a small ball."""
    put(folder / "ball.ply", ply_bytes(shapes.icosphere(1.0, 1)))
    return put(folder / "scene.toml", text)


@attack("scene", "such a file may have")
def _(folder: Path) -> Path:
    """TOML with 1e6 lights"""
    light = '[[light]]\ntype = "point"\nposition = [0, 3, 0]\nintensity = 1\n'
    return scene(folder, CAMERA + light * 1_000_000 + OBJECT)


@attack("scene", "more than 10000")
def _(folder: Path) -> Path:
    """TOML with 20 000 lights"""
    light = '[[light]]\ntype = "point"\nposition = [0, 3, 0]\nintensity = 1\n'
    return scene(folder, CAMERA + light * 20_000 + OBJECT)


@attack("scene", "more than 10000")
def _(folder: Path) -> Path:
    """TOML with 20 000 objects"""
    objects = "".join(f'[[object]]\nname = "{k}"\nmesh = "ball.ply"\nmaterial = "m"\n' for k in range(20_000))
    return scene(folder, CAMERA + LIGHT + objects + OBJECT)


@attack("scene", "nested too deeply")
def _(folder: Path) -> Path:
    """TOML of 1e6 opening brackets"""
    return scene(folder, "a = " + "[" * 1_000_000)


@attack("scene", "a key of more than 32 parts")
def _(folder: Path) -> Path:
    """TOML key of 1e6 dotted parts"""
    return scene(folder, "a." * 1_000_000 + "a = 1\n")


@attack("scene", "a key of more than 32 parts")
def _(folder: Path) -> Path:
    """TOML table of 1e6 quoted dotted parts"""
    return scene(folder, "[" + "'a' . " * 600_000 + "a]\n")


@attack("scene", "unknown key")
def _(folder: Path) -> Path:
    """TOML with a key of 3 MB"""
    return scene(folder, "a" * 3_000_000 + " = 1\n")


@attack("scene", "is no valid TOML")
def _(folder: Path) -> Path:
    """TOML with a number of 1e6 digits"""
    return scene(folder, "a = " + "1" * 1_000_000)


@attack("scene", "at most 67108864 pixels")
def _(folder: Path) -> Path:
    """scene of 1e18 pixels"""
    return scene(folder, CAMERA.replace("[8, 8]", "[1000000000, 1000000000]") + LIGHT + OBJECT)


@attack("scene", "is a device")
def _(folder: Path) -> Path:
    """scene that is a link to a device without end"""
    (folder / "scene.toml").symlink_to("/dev/zero")
    return folder / "scene.toml"


@attack("scene", "no such mesh")
def _(folder: Path) -> Path:
    """scene whose mesh is a pipe"""
    os.mkfifo(folder / "pipe.ply")
    return scene(folder, CAMERA + LIGHT + OBJECT.replace("ball", "pipe"))


def sky(folder: Path, name: str, data: bytes | str) -> Path:
    """A scene with this environment image."""
    put(folder / name, data)
    return scene(folder, f'{CAMERA}[[light]]\ntype = "environment"\nimage = "{name}"\n{OBJECT}')


def npy(shape: str, data: bytes = b"", kind: str = "<f4") -> bytes:
    """An NPY file whose header says ``shape``."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


@attack("scene", "cannot be read")
def _(folder: Path) -> Path:
    """PNG sky that promises 1e10 pixels"""
    return sky(folder, "a.png", png(100_000, 100_000))


@attack("scene", "unfold to")
def _(folder: Path) -> Path:
    """PNG sky of 49 million black pixels in 140 kB"""
    return sky(folder, "a.png", png(7000, 7000, bytes(7000 * 21_001)))


@attack("scene", "neither PNG nor JPEG")
def _(folder: Path) -> Path:
    """PostScript that calls itself a PNG sky"""
    return sky(folder, "a.png", "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n(w) (written) file\nshowpage\n")


@attack("scene", "scans")
def _(folder: Path) -> Path:
    """JPEG sky of 10 000 scans"""
    from PIL import Image

    file = io.BytesIO()
    Image.new("RGB", (64, 64)).save(file, "JPEG", progressive=True)
    data = file.getvalue()
    start, end = data.rindex(b"\xff\xda"), data.rindex(b"\xff\xd9")
    return sky(folder, "a.jpg", data[:start] + data[start:end] * 10_000 + data[end:])


@attack("scene", "unfold to")
def _(folder: Path) -> Path:
    """EXR sky that promises 1e10 pixels"""
    import OpenEXR

    name = str(folder / "a.exr")
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.zeros((4, 4, 3), np.float32)}).write(name)
    data = Path(name).read_bytes()
    window = struct.pack("<4i", 0, 0, 3, 3)
    return sky(folder, "a.exr", data.replace(window, struct.pack("<4i", 0, 0, 99_999, 99_999)))


@attack("scene", "promises 12000000000000 bytes")
def _(folder: Path) -> Path:
    """NPY sky that promises 1e12 pixels"""
    return sky(folder, "a.npy", npy("(1000000, 1000000, 3)"))


@attack("scene", "objects")
def _(folder: Path) -> Path:
    """NPY sky that is a pickle"""
    file = io.BytesIO()
    np.save(file, np.array([_Pickled()], object), allow_pickle=True)
    return sky(folder, "a.npy", file.getvalue())


class _Pickled:
    """Runs a command when it is unpickled."""

    def __reduce__(self):
        return os.system, ("touch written",)


@attack("scene", "unfold to")
def _(folder: Path) -> Path:
    """NPZ sky of 300 MiB of zeros, deflated"""
    return sky(folder, "a.npz", _npz(image=npy("(4096, 6400, 3)", bytes(4096 * 6400 * 12))))


@attack("scene", "is no image of a kind")
def _(folder: Path) -> Path:
    """Radiance HDR sky that promises 1e10 pixels"""
    return sky(folder, "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n")


# ---- parts of renders ----


def _npz(**arrays: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in arrays.items():
            archive.writestr(f"{name}.npy", data)
    return target.getvalue()


def part(folder: Path, **changes: np.ndarray | bytes) -> Path:
    """A film of 4 x 4 pixels with some arrays changed."""
    flat, colour = np.zeros((4, 4), np.int32), np.zeros((4, 4, 3))
    arrays: dict[str, np.ndarray | bytes] = {
        "film_scene_hash": np.array("x"), "film_seed": np.array("0"), "film_ranges": np.array([[0, 1]]),
        "film_sum": colour, "film_sum_of_squares": colour, "film_hits": flat, "film_left_out": flat,
        "film_biased": flat.astype(bool), "seconds": np.array(1.0), "shader_id": flat, "object_id": flat, **changes,
    }  # fmt: skip
    return put(folder / "a.npz", _npz(**{name: _as_npy(array) for name, array in arrays.items()}))


def _as_npy(array: np.ndarray | bytes) -> bytes:
    if isinstance(array, bytes):
        return array
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    return file.getvalue()


@attack("part", "objects")
def _(folder: Path) -> Path:
    """part that is a pickle"""
    return part(folder, film_seed=np.array(_Pickled(), object))


@attack("part", "promises")
def _(folder: Path) -> Path:
    """part of 1e12 pixels"""
    return part(folder, film_hits=npy("(1000000, 1000000)", kind="<i4"))


@attack("part", "unfold to")
def _(folder: Path) -> Path:
    """part of 67 million pixels in 300 kB"""
    return part(folder, film_hits=npy("(8192, 8192)", bytes(2**28), "<i4"))


@attack("part", "hits has shape")
def _(folder: Path) -> Path:
    """part of no pixels in 1e9 rows"""
    return part(folder, film_hits=npy("(1000000000, 0)", kind="<i4"))


@attack("part", "more than can be counted")
def _(folder: Path) -> Path:
    """part of 2^62 passes"""
    return part(folder, film_ranges=np.array([[0, 2**62]]))


@attack("part", "cannot have")
def _(folder: Path) -> Path:
    """part with negative counts"""
    return part(folder, film_hits=np.full((4, 4), -5, np.int32))


@attack("part", "shader_id is")
def _(folder: Path) -> Path:
    """part whose layers have other shapes"""
    return part(folder, shader_id=np.zeros((9000, 2, 2), np.int32))


@attack("part", "no short texts")
def _(folder: Path) -> Path:
    """part with a hash of 40 MB"""
    return part(folder, film_scene_hash=np.array("x" * 10_000_000))


@attack("part", "no ranges of passes")
def _(folder: Path) -> Path:
    """part with 1e6 ranges"""
    starts = 2 * np.arange(1_000_000)
    return part(folder, film_ranges=np.stack([starts + 1, starts], axis=1))
