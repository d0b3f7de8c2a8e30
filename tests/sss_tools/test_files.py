import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from sss_tools.files import write_atomically


def test_a_file_is_replaced_whole_and_nothing_is_left_over(tmp_path):
    target = tmp_path / "report.json"
    target.write_text("old")
    write_atomically(target, b"new")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_new_file_has_the_rights_a_plain_open_gives(tmp_path):
    plain = tmp_path / "plain"
    plain.write_text("")
    write_atomically(tmp_path / "atomic", b"")
    assert stat.S_IMODE((tmp_path / "atomic").stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_a_failed_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "report.json"
    target.write_text("old")
    with pytest.raises(TypeError):
        write_atomically(target, "no bytes")
    assert target.read_text() == "old" and list(tmp_path.iterdir()) == [target]


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_atomically(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_bytes() == b"new"


def test_the_null_device_is_written_to_and_stays():
    write_atomically(os.devnull, b"gone")
    assert not Path(os.devnull).is_file()


def test_a_device_that_leads_to_an_open_file_adds_to_that_file(tmp_path):
    code = (
        f"import sys; sys.path[:0] = {sys.path!r}; from sss_tools.files import write_atomically;"
        "print('before', flush=True); write_atomically('/dev/stdout', b'report\\n')"
    )
    with (tmp_path / "out").open("wb") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
        assert os.fstat(out.fileno()).st_nlink == 1  # not replaced by another file
    assert (tmp_path / "out").read_text() == "before\nreport\n"
