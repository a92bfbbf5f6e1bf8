"""Memory that one detection of sound leaves for the next."""

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
mapped()
print(mapped() - mapped())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other libraries decide otherwise")
def test_memory_let_go_is_not_mapped_anew():
    run = [sys.executable, "-c", USED_TWICE]
    given_back, kept = (
        -int(subprocess.run([*run, *more], capture_output=True, check=True, text=True).stdout)
        for more in ([], ["keep"])
    )
    assert given_back > 500  # pages, of 1536
    assert kept < 50
