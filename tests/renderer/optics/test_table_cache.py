import numpy as np
import pytest

from renderer.optics.table_cache import cached
from sss_tools.cache import FOLDER_VARIABLE


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


class Counted:
    """A computation that counts how often it is asked."""

    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return np.arange(6.0).reshape(2, 3)


def test_the_second_time_it_comes_from_disk(folder):
    compute = Counted()
    first = cached("table", "key", (2, 3), compute)
    second = cached("table", "key", (2, 3), compute)
    assert compute.calls == 1
    assert first.dtype == second.dtype == np.float32
    np.testing.assert_array_equal(first, second)
    assert [path.suffix for path in folder.iterdir()] == [".npy"]


def test_another_key_is_another_table(folder):
    compute = Counted()
    cached("table", "one", (2, 3), compute)
    cached("table", "two", (2, 3), compute)
    assert compute.calls == 2


@pytest.mark.parametrize("damage", [b"", b"not an array", None])
def test_a_damaged_file_is_replaced(folder, damage):
    compute = Counted()
    cached("table", "key", (2, 3), compute)
    (path,) = folder.iterdir()
    path.write_bytes(path.read_bytes()[:-4] if damage is None else damage)
    np.testing.assert_array_equal(cached("table", "key", (2, 3), compute), compute())
    assert cached("table", "key", (2, 3), pytest.fail).shape == (2, 3)


def test_numbers_that_are_not_finite_are_not_trusted(folder):
    compute = Counted()
    cached("table", "key", (2, 3), lambda: np.full((2, 3), np.nan))
    cached("table", "key", (2, 3), compute)
    assert compute.calls == 1


def test_an_unwritable_folder_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("a file where the folder should be")
    monkeypatch.setenv(FOLDER_VARIABLE, str(blocked / "cache"))
    compute = Counted()
    assert cached("table", "key", (2, 3), compute).shape == (2, 3)
    assert cached("table", "key", (2, 3), compute).shape == (2, 3)
    assert compute.calls == 2
