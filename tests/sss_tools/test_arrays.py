"""NPY and NPZ files of strangers."""

import io

import numpy as np
import pytest

from sss_tools.arrays import ARRAY_ERRORS, read_npy, read_npz


@pytest.mark.parametrize(
    "array",
    [np.arange(24.0).reshape(2, 3, 4), np.asfortranarray(np.arange(6).reshape(2, 3)), np.zeros((0, 3), np.float32),
     np.array("text"), np.array(3), np.arange(4, dtype=">i2"), np.array([True, False])],
    ids=["c", "fortran", "empty", "text", "scalar", "big endian", "bool"],
)  # fmt: skip
def test_arrays_are_read_as_numpy_reads_them(tmp_path, array):
    np.save(tmp_path / "a.npy", array)
    np.savez_compressed(tmp_path / "a.npz", a=array, b=array)
    for read in (read_npy(tmp_path / "a.npy"), read_npz(tmp_path / "a.npz")["b"]):
        assert read.dtype == array.dtype and read.shape == array.shape and np.array_equal(read, array)
    assert list(read_npz(tmp_path / "a.npz", "a")) == ["a"]


def test_whatever_is_cut_off_is_missed(tmp_path):
    file = io.BytesIO()
    np.save(file, np.arange(6.0))
    whole, path = file.getvalue(), tmp_path / "a.npy"
    for length in (0, 5, 9, 40, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(ARRAY_ERRORS):
            read_npy(path)
    path.write_bytes(whole + b"x")
    with pytest.raises(ValueError, match="promises 48 bytes, 49 are there"):
        read_npy(path)
