"""What several tests need: kernels compiled from these sources, and real recordings if any."""

from __future__ import annotations

import getpass
import hashlib
import os
import re
import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
# Kernels, and the constants of events.
COMPILED = rb"(?m)^@(njit|cfunc|kernel|inner|inlined)|^(COLUMNS|DEGREE) ="


def fresh_kernels():
    """Let numba cache compiled kernels in a folder of these very sources.

    Its own cache asks whether the file of a kernel has changed, not the files whose functions and
    constants the kernel has taken in.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    sources = [path.read_bytes() for path in sorted((ROOT / "impactsig").rglob("*.py"))]
    kernels = [text for text in sources if re.search(COMPILED, text)]
    version = hashlib.sha256(b"".join(kernels)).hexdigest()[:16]
    caches = Path(tempfile.gettempdir()) / f"impactsig-kernels-{getpass.getuser()}"
    (caches / version).mkdir(parents=True, exist_ok=True)
    os.utime(caches / version)
    for old in sorted(caches.iterdir(), key=lambda cache: cache.stat().st_mtime)[:-4]:
        shutil.rmtree(old, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(caches / version)


fresh_kernels()

# The same examples in every run of CI; new ones on a developer's machine.
settings.register_profile("ci", derandomize=True, deadline=None)
settings.register_profile("here", deadline=None)  # a first call compiles
settings.load_profile("here")
if os.environ.get("CI"):
    settings.load_profile("ci")

SHARED = Path(os.environ.get("IMPACTSIG_SHARED_DATA", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def shared_data():
    """Path of a real recording; the test is skipped where the recordings are absent."""

    def path(relative):
        found = SHARED / relative
        if not found.exists():
            pytest.skip(f"real recording {relative} is not here (set IMPACTSIG_SHARED_DATA)")
        return found

    return path
