import signal

import pytest

from cli import command
from sss_tools.errors import InputError


def raising(error):
    def body(argv):
        raise error

    return body


def test_the_status_of_the_body_is_the_commands():
    assert command.run("sss-test", lambda argv: len(argv), ["a", "b", "c"]) == 3


def test_an_input_error_is_one_line_and_status_two(capsys):
    assert command.run("sss-test", raising(InputError("a\nb.ply", "bad\nthing", "mend it"))) == 2
    assert capsys.readouterr().err == "sss-test: error: a b.ply: bad thing; mend it\n"


def test_an_interrupt_is_status_130(capsys):
    assert command.run("sss-test", raising(KeyboardInterrupt())) == 130
    assert capsys.readouterr().err == "sss-test: error: interrupted\n"


@pytest.fixture
def signals():
    """As a shell leaves them to a command in the foreground; tests may run in the background."""
    before = [signal.signal(signal.SIGINT, signal.default_int_handler), signal.signal(signal.SIGTERM, signal.SIG_DFL)]
    yield
    for number, handler in zip((signal.SIGINT, signal.SIGTERM), before, strict=True):
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_an_interrupt_and_handlers_are_put_back(number, capsys, signals):
    def body(argv):
        signal.raise_signal(number)

    before = signal.getsignal(number)
    assert command.run("sss-test", body) == 130
    assert capsys.readouterr().err == "sss-test: error: interrupted\n"
    assert signal.getsignal(number) is before


def test_an_interrupt_that_a_library_takes_for_an_error_of_its_own_is_one_line(capsys, signals):
    """As NumPy does while it is being imported."""

    def body(argv):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise ImportError("the installation is broken") from error

    assert command.run("sss-test", body) == 130
    assert capsys.readouterr().err == "sss-test: error: interrupted\n"


def test_an_error_without_an_interrupt_is_not_hidden():
    with pytest.raises(ImportError):
        command.run("sss-test", raising(ImportError("no such module")))


def test_a_signal_that_is_ignored_stays_so(signals):
    def body(argv):
        signal.raise_signal(signal.SIGINT)
        return 7

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    assert command.run("sss-test", body) == 7


def test_an_interrupt_before_anything_is_ready_for_it_is_one_line(capsys, monkeypatch):
    monkeypatch.setattr(command, "_run", lambda *_: raising(KeyboardInterrupt())(None))
    assert command.run("sss-test", len) == 130
    assert capsys.readouterr().err == "sss-test: error: interrupted\n"


def test_a_bad_option_is_one_line_and_status_two(capsys):
    def body(argv):
        command.ArgumentParser("sss-test").parse_args(argv)

    assert command.run("sss-test", body, ["--no-such-option"]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("sss-test: error: ") and captured.err.count("\n") == 1
    assert captured.out == ""


def test_version_and_help_are_status_zero(capsys):
    for option in ("--version", "--help"):
        assert command.run("sss-test", command.ArgumentParser("sss-test").parse_args, [option]) == 0
    assert command.version() in capsys.readouterr().out


def test_library_warnings_are_one_line(capsys):
    import warnings

    def body(argv):
        warnings.warn("the record\nis old", stacklevel=1)
        return 0

    assert command.run("sss-test", body) == 0
    assert capsys.readouterr().err == "sss-test: warning: the record is old\n"


@pytest.mark.parametrize("name", ["\udcff.ply", "a b.ply"])
def test_names_that_are_no_text_can_be_complained_about(name, capsys):
    command.complain("sss-test", name)
    assert capsys.readouterr().err.startswith("sss-test: error: ")


def test_there_is_no_progress_bar_where_there_is_no_terminal(capsys):
    with command.progress(10, "checking") as advance:
        for _ in range(10):
            advance()
    assert capsys.readouterr() == ("", "")


def test_a_progress_bar_shows_on_a_terminal_after_a_while(monkeypatch, capsys):
    monkeypatch.setattr(command, "PATIENCE", 0.0)
    monkeypatch.setattr(command.sys.stderr, "isatty", lambda: True, raising=False)
    with command.progress(3, "checking") as advance:
        advance()
        advance()
    assert "checking" in capsys.readouterr().err
