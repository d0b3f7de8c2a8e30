"""Memory stays with the process."""

import subprocess
import sys

import pytest

CODE = """
import resource, sys
import numpy as np
from renderer.tracing.memory import keep_freed_memory
if sys.argv[1] == "keep":
    keep_freed_memory()
for _ in range(4):
    np.ones(1 << 20)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    np.ones(1 << 20)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's malloc is asked for")
def test_arrays_used_again_and_again_cost_no_page_faults():
    """20 arrays of 8 MB are 40,000 small pages where memory goes back in between; huge pages need fewer."""
    done = subprocess.run([sys.executable, "-c", CODE, "keep"], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 20


THREADS = """
import os, sys, threading
os.cpu_count = lambda: 2
import numpy as np
from renderer.tracing.memory import give_back_memory, keep_freed_memory
keep_freed_memory()
stop, idle = threading.Event(), []
for _ in range(10):
    work = threading.Thread(target=lambda: np.ones(3 << 20).sum())
    work.start()
    work.join()
    # who comes next finds the arenas so far in use
    idle.append(threading.Thread(target=lambda: (np.ones(1000), stop.wait())))
    idle[-1].start()
give_back_memory()
print(int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
stop.set()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's malloc is asked for")
def test_memory_does_not_grow_as_threads_come_and_go():
    """Three arenas keep 24 MB each at most, and the interpreter with NumPy takes 40; ten arenas would keep 240."""
    done = subprocess.run([sys.executable, "-c", THREADS], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 150e6


HUGE = """
import ctypes, re, sys
import numpy as np
from renderer.tracing.memory import keep_pages_small
ctypes.CDLL(None).prctl(41, 0, 0, 0, 0)  # whoever started this may have asked for small pages
if sys.argv[1] == "small":
    keep_pages_small()
kept = np.ones(1 << 23)
print(re.search(r"AnonHugePages: +([0-9]+)", open("/proc/self/smaps_rollup").read()).group(1))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux is asked for")
def test_no_memory_lies_in_huge_pages_where_scenes_come_and_go():
    """An array of 64 MB has some thirty of them where the system gives any."""

    def kilobytes(way):
        done = subprocess.run([sys.executable, "-c", HUGE, way], capture_output=True, text=True, check=True)
        return int(done.stdout)

    if not kilobytes("as usual"):
        pytest.skip("this system gives no huge pages")
    assert kilobytes("small") == 0


GARBAGE = """
import gc
from renderer.tracing.memory import give_back_memory
give_back_memory()
gc.collect()
give_back_memory()
print(gc.collect())
"""


def test_giving_memory_back_leaves_nothing_to_the_garbage_collector():
    """Every ctypes.CDLL is a class, and classes are cycles."""
    done = subprocess.run([sys.executable, "-c", GARBAGE], capture_output=True, text=True, check=True)
    assert int(done.stdout) == 0
