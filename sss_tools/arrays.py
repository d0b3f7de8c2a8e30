"""Reading NPY and NPZ files of strangers: plain numbers, as many as the file holds, and nothing that is executed."""

from __future__ import annotations

import math
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import IO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from . import unfolding
from .errors import InputError
from .reading import opened

ARRAY_ERRORS = (OSError, ValueError, KeyError, EOFError, AttributeError, TypeError, OverflowError, RuntimeError,
                NotImplementedError, IndexError, BadZipFile, struct.error, zlib.error)  # fmt: skip
"""What broken files make of NumPy, zipfile, and of those who take the arrays for what they are not."""

MOST_ARRAYS = 1000


def read_npy(path: Path) -> NDArray:
    """The array of an NPY file. Raises one of ``ARRAY_ERRORS``, or InputError, for a file that holds another or less.

    Objects (pickles) are refused: reading them runs whatever they name.
    """
    with opened(path) as file:
        return _array(file, os.fstat(file.fileno()).st_size)


def read_npz(path: Path, wanted: str | None = None) -> dict[str, NDArray]:
    """The arrays of an NPZ file by name, or the ``wanted`` one alone. Raises as ``read_npy`` does."""
    arrays = {}
    with opened(path) as source, zipfile.ZipFile(source) as archive:
        members = archive.infolist()
        if len(members) > MOST_ARRAYS:
            raise InputError(path, f"holds {len(members)} arrays, more than {MOST_ARRAYS}", "check where it comes from")
        unfolding.check_geometry(sum(member.file_size for member in members), os.fstat(source.fileno()).st_size)
        for member in members:
            name = member.filename.removesuffix(".npy")
            if wanted is None or name == wanted:
                with archive.open(member) as file:
                    arrays[name] = _array(file, member.file_size)
    return arrays


def _array(file: IO[bytes], size: int) -> NDArray:
    """The array in a file of ``size`` bytes, which its header is held against before any memory is asked for."""
    version = np.lib.format.read_magic(file)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read_header is None:
        raise ValueError(f"version {version} of the format is unknown")
    try:
        shape, fortran, kind = read_header(file)
    except Exception as error:  # a literal of Python, so whatever its parser raises
        raise ValueError(f"its header makes no sense ({type(error).__name__})") from None
    if kind.hasobject:
        raise ValueError("it holds objects, not numbers")
    promised = math.prod(shape) * kind.itemsize
    held = size - file.tell()
    if promised != held:
        raise ValueError(f"its header promises {promised} bytes, {held} are there")
    data: NDArray = np.empty(held, np.uint8)
    filled = 0
    while filled < held:
        count = file.readinto(memoryview(data)[filled:])  # type: ignore
        if not count:
            raise EOFError(f"its header promises {promised} bytes, {filled} are there")
        filled += count
    values = data.view(kind) if held else np.empty(0, kind)
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
