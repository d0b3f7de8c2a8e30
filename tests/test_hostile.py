"""Files made to harm whoever reads them; benchmarks/hostile.py prints the same as a table."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "benchmarks"
pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="forks, pipes, links and memory limits as Linux has them"
)


def python(*arguments, **options):
    """A fresh interpreter that finds the benchmarks, the package, and nothing beside the files it reads."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": f"{BENCHMARKS}{os.pathsep}{ROOT}"},
        **options,
    )


def test_hostile_files_are_refused_in_bounded_time_and_memory_and_reading_them_does_nothing_else():
    """At most 20 s of processor time and 2 GiB each; no file written, no socket, no process, no foreign code."""
    done = python(BENCHMARKS / "hostile.py", "--light", "--json")
    results = json.loads(done.stdout)
    assert [(result["name"], result["faults"]) for result in results if result["faults"]] == []
    assert len(results) > 70 and done.returncode == 0


def test_what_a_reader_does_besides_reading_is_noticed(tmp_path):
    deeds = python(
        "-c",
        "import os, socket, subprocess, pickle, hostile\n"
        "deeds = []\n"
        "hostile.watch(deeds)\n"
        "open('read-only', 'a').close(); open('read-only').close(); os.rename('read-only', 'b'); os.remove('b')\n"
        "socket.socket().close(); subprocess.run(['true']); os.system('true'); pickle.loads(b'cos\\nsystem\\n.')\n"
        "exec(compile('1', '/tmp/foreign.py', 'exec'))\n"
        "print(*(deed.split()[0] for deed in deeds))\n",
        cwd=tmp_path,
    ).stdout.split()
    expected = {"open", "os.rename", "os.remove", "socket.__new__", "subprocess.Popen", "os.system",
                "pickle.find_class", "exec"}  # fmt: skip
    assert expected <= set(deeds) and deeds.count("open") == 1


def test_the_judge_of_hostile_files_can_find_fault(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import hostile

    try:
        attack = hostile.Attack("a", "mesh", "promises", lambda folder: folder)
        good = hostile.Result("a", 2, "a.ply: promises much; check it\n", 0.1, 10**8, [], True)
        assert hostile.faults(attack, good) == []
        for change in (
            {"status": 0}, {"status": None}, {"lines": "a.ply: something else; check it\n"}, {"seconds": 21.0},
            {"memory": 2**32}, {"deeds": ["open a w"]}, {"kept": False}, {"lines": "promises\na\n"},
        ):  # fmt: skip
            assert hostile.faults(attack, replace(good, **change)), change
    finally:
        for name in ("hostile", "hostile_inputs", "hostile_scenes"):
            sys.modules.pop(name, None)


def test_a_folder_of_hostile_files_is_checked_with_one_line_each_and_the_sound_one_is_reported(tmp_path):
    script = (
        "import pathlib, sys, hostile_inputs\n"
        "for number, attack in enumerate(hostile_inputs.ATTACKS):\n"
        "    if attack.reader == 'mesh' and attack.says and any(word in attack.name for word in sys.argv[1:]):\n"
        "        folder = pathlib.Path(str(number)); folder.mkdir(); attack.write(folder); print(attack.name)\n"
        "(folder / 'sound.ply').write_bytes(hostile_inputs.ply_bytes(hostile_inputs.shapes.icosphere(1.0, 1)))\n"
    )
    written = python("-c", script, "PLY", "laughs", "circle", "line breaks", "device", cwd=tmp_path).stdout.splitlines()
    assert len(written) >= 8
    checked = python("-m", "cli.sss_check", ".", "--format", "concise", "--jobs", "1", "--no-cache", cwd=tmp_path)
    assert checked.returncode == 2
    assert checked.stderr.count("sss-check: error: ") == checked.stderr.count("\n") == len(written)
    assert checked.stdout.count(" error ") == checked.stdout.count("\n") == len(written)
    assert "\x1b" not in checked.stdout + checked.stderr
