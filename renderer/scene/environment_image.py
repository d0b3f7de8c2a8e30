"""Reading images of radiance for environment lights: EXR, NPY, NPZ, and PNG or JPEG decoded from sRGB."""

from __future__ import annotations

import io
import os
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sss_tools import unfolding
from sss_tools.arrays import ARRAY_ERRORS, read_npy, read_npz
from sss_tools.errors import InputError
from sss_tools.reading import read_file

from . import exr_header

_MOST_SCANS = 256
"""Of a JPEG; each takes time for all pixels. Encoders write ten."""


def read_environment_image(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear radiance, row 0 on top.

    EXR: channels R, G, B, or Y alone, of the first part. NPY: an array (h, w, 3) or (h, w). NPZ: the array
    ``image``, which sss-render's own output has. PNG, JPEG: 8 bits, sRGB.

    Raises InputError for a missing or corrupt file, another kind, another shape, and for values that no light
    has: not finite, or negative.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(path, "is no image of a kind that can be read", f"give one of {', '.join(_READERS)}")
    if not is_file(path):
        raise InputError(path, "there is no such environment image", "give a path relative to the scene file")
    try:
        image = np.asarray(reader(path))
    # the libraries' errors for broken files, named: SyntaxError is Pillow's for PNG chunks
    except (*ARRAY_ERRORS, SyntaxError, struct.error) as error:
        raise InputError(path, f"the image cannot be read ({error})", "write it again") from None
    if image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=2)
    if image.ndim != 3 or image.shape[2] != 3 or image.size == 0 or image.dtype.kind not in "fiu":
        raise InputError(path, f"holds {image.dtype} of shape {image.shape}", "give numbers, (height, width, 3)")
    # before the change to float32, which would make large numbers infinite
    limit = np.finfo(np.float32).max
    wrong = int(np.count_nonzero(~((image >= 0) & (image <= limit))))
    if wrong:
        raise InputError(path, f"{wrong} values are negative or not finite", "clean them: radiance is neither")
    return np.ascontiguousarray(image, np.float32)


def is_file(path: Path) -> bool:
    """Whether there is such a file; False, and no error, for a name that no file can have."""
    try:
        return path.is_file()
    except OSError:  # a name too long for the file system, before Python 3.14
        return False


def _read_exr(path: Path) -> NDArray:
    import OpenEXR

    data = read_file(path)
    unfolding.check_image(exr_header.unfolded_bytes(data), len(data))
    with _silence(), OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    names = ("R", "G", "B") if "R" in channels else ("Y", "Y", "Y")
    if not channels.keys() >= set(names):
        raise ValueError(f"no channels R, G, B or Y among {', '.join(channels)}")
    return np.stack([channels[name] for name in names], axis=-1)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep OpenEXR from writing about broken files to stderr and stdout: its exceptions say as much."""
    with Path(os.devnull).open("w") as void, redirect_stdout(void):
        kept = os.dup(2)
        os.dup2(void.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def _read_npz(path: Path) -> NDArray:
    return read_npz(path, "image")["image"]


def _read_srgb(path: Path) -> NDArray:
    from PIL import Image, UnidentifiedImageError

    data = read_file(path)
    if path.suffix.lower() != ".png" and data.count(b"\xff\xda") > _MOST_SCANS:
        raise ValueError(f"more than {_MOST_SCANS} scans")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of many pixels: they are counted here
        try:
            # of other formats some are decoded by other programs
            picture = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        except UnidentifiedImageError:
            raise ValueError("it is neither PNG nor JPEG") from None
        except Image.DecompressionBombError as error:
            raise ValueError(str(error)) from None
    with picture:
        if picture.mode[0] in "IF":
            raise ValueError("16 bits a channel; 8 are read, EXR holds more")
        unfolding.check_image(4 * 3 * picture.width * picture.height, len(data))
        encoded = np.asarray(picture.convert("RGB"))
    return srgb_to_linear(np.arange(256, dtype=np.float32) / 255)[encoded]


def srgb_to_linear(encoded) -> NDArray:
    """Linear intensity of sRGB values in [0, 1] (IEC 61966-2-1, inverse of the transfer function)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


_READERS = {
    ".exr": _read_exr, ".npy": read_npy, ".npz": _read_npz,
    ".png": _read_srgb, ".jpg": _read_srgb, ".jpeg": _read_srgb,
}  # fmt: skip
