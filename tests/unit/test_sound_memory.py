"""Memory that one detection of sound leaves for the next."""

import os
import platform
import subprocess
import sys

import pytest

USED_TWICE = """
import resource, sys
import numpy as np
from impactsig.detect.sound._memory import keep_memory
if "keep" in sys.argv:
    keep_memory()
def mapped():
    arrays = [np.ones(1 << 17) for _ in range(6)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
seen = [mapped() for _ in range(6)]
print(min(later - earlier for earlier, later in zip(seen, seen[1:])))
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other libraries decide otherwise")
def test_memory_let_go_is_not_mapped_anew():
    # Dask sets MALLOC_TRIM_THRESHOLD_ for its workers, and with it in its own process for a while.
    env = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    run = [sys.executable, "-c", USED_TWICE]
    given_back, kept = (
        int(
            subprocess.run(
                [*run, *more], capture_output=True, check=True, text=True, env=env
            ).stdout
        )
        for more in ([], ["keep"])
    )
    # The least of several: what imports let go may be given back after the first.
    assert given_back > 500  # pages, of 1536
    assert kept < 50
