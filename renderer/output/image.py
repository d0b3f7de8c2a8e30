"""Pictures as files: PNG to look at, EXR and NPZ to compute with. Written beside and renamed, never half."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from sss_tools.arrays import ARRAY_ERRORS, read_npz
from sss_tools.errors import InputError
from sss_tools.files import write_atomically

from .film import Film


@dataclass(eq=False)
class Picture:
    """A film and what else a file says of it. Arrays are (h, w, ...), row 0 on top.

    seconds    wall time of the command
    shader_id  (h, w) int32: -1 none, 0 path, 1 plumb, 2 scalar, 3 diffuse fallback
    object_id  (h, w) int32: -1 none, else the object's place in the scene
    aovs       further (h, w) or (h, w, 3) arrays by name
    """

    film: Film
    seconds: float
    shader_id: NDArray[np.int32]
    object_id: NDArray[np.int32]
    aovs: dict[str, NDArray] = field(default_factory=dict)

    def layers(self) -> dict[str, NDArray]:
        """All arrays but the image, by name: standard error, shader, object, the samples of each pixel
        where they differ, then ``aovs``."""
        return {
            "stderr": self.film.stderr().astype(np.float32),
            "shader_id": np.asarray(self.shader_id, np.int32),
            "object_id": np.asarray(self.object_id, np.int32),
            **({"samples": self.film.samples()} if self.film.skipped.any() else {}),
            **self.aovs,
        }


def check_writable(path: Path) -> None:
    """Raise InputError if ``write`` could not write to ``path``. Whatever is there stays as it is."""
    if path.suffix.lower() not in _ENCODERS:
        problem = f'"{path.suffix}" is no kind of picture' if path.suffix else "the name has no suffix"
        raise InputError(path, problem, f"end it in {', '.join(_ENCODERS)}")
    target = Path(os.path.realpath(path))
    try:
        if target.is_dir():
            raise InputError(path, "is a folder", "name a file in it")
        if not target.parent.is_dir():
            raise InputError(path, f"there is no folder {path.parent}", "create it")
        if target.exists() and not os.access(target, os.W_OK):
            raise InputError(path, "the file is write-protected", "choose another name")
        # permissions, read-only file systems and names too long: the surest test is a file beside it
        NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}.").close()
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror})", "choose another place") from None


def write(path: Path, picture: Picture) -> None:
    """Write ``picture`` as its suffix says, whole or not at all.

    PNG: sRGB, 8 bits, cut at 1; pixels without a valid sample are magenta. EXR: linear float32 radiance in
    R, G, B, every other array in a layer of its name. NPZ: ``image``, ``passes``, ``seconds``, the layers by
    name, and the film's sums, so that parts can be merged and renders resumed.

    Raises InputError for what ``check_writable`` refuses, and when writing fails.
    """
    check_writable(path)
    try:
        write_atomically(path, _ENCODERS[path.suffix.lower()](picture))
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror or error})", "choose another place") from None


def read(path: Path) -> Picture:
    """The picture that ``write`` put into an NPZ file.

    Raises InputError for a file that is missing, corrupt, or holds no film.
    """
    try:
        arrays = read_npz(path)
        film = Film.from_arrays(arrays)
        picture = Picture(film, float(arrays["seconds"]), arrays["shader_id"], arrays["object_id"])
    except FileNotFoundError:
        raise InputError(path, "there is no such file", "check the path") from None
    except ARRAY_ERRORS as error:
        raise InputError(path, f"holds no film ({error})", "give an npz file of sss-render") from None
    for name, array in (("shader_id", picture.shader_id), ("object_id", picture.object_id)):
        if array.shape != film.hits.shape or array.dtype != np.int32:
            raise InputError(path, f"its {name} is {array.dtype} of shape {array.shape}", "give a file of sss-render")
    known = film.arrays().keys() | _npz_arrays(picture).keys()
    picture.aovs = {name: array for name, array in arrays.items() if name not in known}
    for name, array in picture.aovs.items():
        if array.shape not in (film.hits.shape, film.sum.shape) or array.dtype.kind not in "fiub":
            raise InputError(path, f"its {name} is {array.dtype} of shape {array.shape}", "give a file of sss-render")
    return picture


def merge(parts: Mapping[Path, Picture]) -> Picture:
    """One picture of all parts: their passes together; shaders, objects and AOVs of the first; seconds added.

    Raises InputError, naming the file, for a part that does not belong to the first or repeats passes, and for
    no parts.
    """
    if not parts:
        raise InputError("merge", "no parts were given", "name npz files of sss-render")
    (first, base), *others = parts.items()
    merged = Picture(Film.blank(base.film.resolution, base.film.scene_hash, base.film.seed), 0.0,
                     base.shader_id, base.object_id, base.aovs)  # fmt: skip
    for path, part in ((first, base), *others):
        try:
            merged.film.merge(part.film)
        except ValueError as error:
            raise InputError(path, f"does not go with {first}: {error}", "merge parts of one render") from None
        merged.seconds += part.seconds
    return merged


# ---- the kinds of files ----


def linear_to_srgb(linear) -> NDArray:
    """sRGB values of linear intensity in [0, 1] (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def film_png(film: Film) -> bytes:
    """A PNG of the mean radiance: sRGB, 8 bits, cut at 1; pixels without a valid sample are magenta."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    mean = film.mean()
    shown = np.where(np.isnan(mean), (1.0, 0.0, 1.0), np.clip(mean, 0, 1))
    about = PngInfo()
    about.add(b"sRGB", b"\0")  # the colour space, perceptual intent
    pixels = np.rint(255 * linear_to_srgb(shown)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", pnginfo=about)
    return file.getvalue()


def _png(picture: Picture) -> bytes:
    return film_png(picture.film)


def _exr(picture: Picture) -> bytes:
    import OpenEXR

    header = {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "sceneHash": picture.film.scene_hash,
        "seed": str(picture.film.seed),
        "passes": picture.film.passes,
    }
    channels = _channels("", picture.film.mean())
    for name, array in picture.layers().items():
        channels |= _channels(f"{name}.", array)
    # the library writes to names only
    with TemporaryDirectory() as folder:
        path = Path(folder, "picture.exr")
        try:
            OpenEXR.File(header, channels).write(str(path))
        except RuntimeError as error:
            raise OSError(str(error)) from None
        return path.read_bytes()


def _channels(prefix: str, array: NDArray) -> dict[str, NDArray[np.float32]]:
    array = np.asarray(array, np.float32)
    if array.ndim == 2:
        return {f"{prefix}Y": array.copy()}
    return {f"{prefix}{channel}": array[..., k].copy() for k, channel in enumerate("RGB")}


def _npz(picture: Picture) -> bytes:
    file = io.BytesIO()
    arrays = {**_npz_arrays(picture), **picture.film.arrays()}
    # uncompressed: noise does not compress, and this is written while a render goes on
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()


def _npz_arrays(picture: Picture) -> dict[str, NDArray]:
    return {
        "image": picture.film.mean().astype(np.float32),
        "passes": np.array(picture.film.passes),
        "seconds": np.array(picture.seconds),
        **picture.layers(),
    }


_ENCODERS = {".png": _png, ".exr": _exr, ".npz": _npz}
