"""What is detected in any force record is sound, and no kernel leaves its arrays."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from .odd_records import check

BROKE = (96, 150, 261, 316, 333, 341, 463)
"""Records that once ended the process, or gave times outside of the record."""


@pytest.mark.parametrize("number", [*BROKE, *range(100_000, 100_060)])
def test_what_is_found_is_sound(number):
    check(number)


@pytest.mark.slow
def test_no_index_is_out_of_bounds(tmp_path):
    settings = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-m", "tests.stress.odd_records", "200000", "5000"],
        cwd=Path(__file__).resolve().parents[2],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
