"""Commands that are not there yet say so."""

import pytest

from cli import sss_chart


@pytest.mark.parametrize("command", [sss_chart])
def test_a_command_to_come_says_so_in_one_line_and_status_two(command, capsys):
    assert command.main(["bunny.ply", "--screenshot", "x.png"]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"{command.PROGRAM}: error: ") and captured.err.count("\n") == 1
    assert "not part of this version" in captured.err and captured.out == ""


@pytest.mark.parametrize("command", [sss_chart])
def test_help_and_version_work(command, capsys):
    assert command.main(["--help"]) == 0 and command.main(["--version"]) == 0
    assert "not part of this version yet" in capsys.readouterr().out
