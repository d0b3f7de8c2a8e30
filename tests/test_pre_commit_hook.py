"""The hook for pre-commit names a command that there is, and the kinds of files that it reads."""

import re
import tomllib
from pathlib import Path

from cli.sss_check import _parser
from sss_tools.loading import SUFFIXES

ROOT = Path(__file__).parents[1]
HOOK = dict(
    line.removeprefix("- ").strip().split(": ", 1)
    for line in (ROOT / ".pre-commit-hooks.yaml").read_text().splitlines()
)


def test_the_entry_is_a_command_of_this_package_with_options_it_takes():
    command, *options = HOOK["entry"].split()
    with (ROOT / "pyproject.toml").open("rb") as file:
        assert command in tomllib.load(file)["project"]["scripts"]
    assert _parser().parse_args([*options, "a.ply"]).paths == ["a.ply"]


def test_it_runs_on_every_kind_of_mesh_and_on_nothing_else():
    pattern = re.compile(HOOK["files"])
    for suffix in SUFFIXES:
        assert pattern.search(f"models/bunny{suffix}") and pattern.search(f"BUNNY{suffix.upper()}")
    for name in ("bunny.ply.sss.json", "plymouth.txt", "scene.toml"):
        assert not pattern.search(name)
