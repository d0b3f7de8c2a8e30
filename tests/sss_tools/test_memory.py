"""How much memory may be used."""

import subprocess
import sys

import numpy as np
import pytest

from sss_tools import memory
from sss_tools.validation.settings import Settings
from sss_tools.worker import Task

linux = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory as Linux keeps them")


@linux
def test_a_container_counts_where_it_has_less_than_the_machine(tmp_path, monkeypatch):
    limit = tmp_path / "memory.max"
    monkeypatch.setattr(memory, "_CONTAINER", (str(limit),))
    machine = memory.machine_memory()
    assert machine > 2**27
    limit.write_text("max\n")
    assert memory.machine_memory() == machine
    limit.write_text(f"{2**26}\n")
    assert memory.machine_memory() == 2**26 and memory.share_of_memory(0.25) == 2**24


def test_a_mesh_may_take_half_of_the_machine_or_what_the_user_says():
    assert Task("a.ply", Settings()).memory == memory.share_of_memory(0.5)
    assert Task("a.ply", Settings(), max_memory=12345).memory == 12345


@linux
def test_beyond_the_limit_allocations_fail_and_afterwards_they_do_not():
    with memory.limited_memory(2**30), pytest.raises(MemoryError):
        np.ones(2**29)
    assert np.ones(2**24)[-1] == 1


def test_sizes_are_shown_with_their_unit():
    assert memory.shown_size(2**31) == "2 GiB" and memory.shown_size(500 * 2**20) == "500 MiB"


@linux
def test_the_greatest_memory_is_that_of_the_program_not_of_the_one_that_started_it():
    """The parent held 300 MB; the kernel's other count goes on from there."""
    child = "from sss_tools.memory import peak_memory; print(peak_memory())"
    parent = (
        "import os, subprocess, sys; held = bytearray(300_000_000);"
        f"child = os.posix_spawn(sys.executable, [sys.executable, '-c', {child!r}], os.environ); os.waitpid(child, 0)"
    )
    done = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, check=True)
    assert 5e6 < int(done.stdout) < 150e6
