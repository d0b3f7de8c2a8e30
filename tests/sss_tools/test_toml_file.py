"""TOML files of strangers."""

import pytest

from sss_tools.errors import InputError
from sss_tools.toml_file import MOST_BYTES, MOST_PARTS, read_toml


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_tables_are_read_whatever_ends_a_line(tmp_path, end):
    path = tmp_path / "a.toml"
    path.write_bytes(end.join(['a.b."c.d" = 1', "[x]", 'y = """two', 'lines"""', ""]).encode())
    assert read_toml(path) == {"a": {"b": {"c.d": 1}}, "x": {"y": "two\nlines"}}


def test_keys_have_a_limit_and_numbers_and_texts_with_dots_have_not(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(".".join("a" * MOST_PARTS) + " = 1\nb = '" + "a.b " * 100 + "'\nc = [" + "1.5, " * 100 + "]\n")
    read_toml(path)
    for key in (".".join("a" * (MOST_PARTS + 1)), " . ".join(["'a b'"] * (MOST_PARTS + 1))):
        path.write_text(f"{key} = 1\n")
        with pytest.raises(InputError, match="parts"):
            read_toml(path)


def test_a_file_may_have_so_many_bytes_and_no_more(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("#" * (MOST_BYTES - 1) + "\n")
    assert read_toml(path) == {}
    path.write_text("#" * MOST_BYTES + "\n")
    with pytest.raises(InputError, match="bytes"):
        read_toml(path)
