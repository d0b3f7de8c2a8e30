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
