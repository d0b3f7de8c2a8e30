import os

import pytest

from sss_tools.cache import FOLDER_VARIABLE, cache_folder, prune, store


def test_without_the_variable_it_is_the_users_cache_folder(monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    assert "sss-tools" in str(cache_folder())


def test_the_variable_names_another_folder(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    assert cache_folder() == tmp_path


def test_what_cannot_be_stored_is_no_error(tmp_path):
    (tmp_path / "file").write_text("a file where the folder should be")
    store(tmp_path / "file" / "entry", b"data")
    store(tmp_path / "folder" / "entry", b"data")
    assert (tmp_path / "folder" / "entry").read_bytes() == b"data"


@pytest.mark.parametrize(("limit", "left"), [(40, "abcd"), (39, "bcd"), (20, "cd"), (0, "")])
def test_what_was_used_longest_ago_goes_first(tmp_path, limit, left):
    for age, name in enumerate("dcba"):
        (tmp_path / name).write_bytes(bytes(10))
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    prune(tmp_path, limit)
    assert "".join(sorted(path.name for path in tmp_path.iterdir())) == left


def test_a_folder_that_is_not_there_needs_no_pruning(tmp_path):
    prune(tmp_path / "none", 0)
