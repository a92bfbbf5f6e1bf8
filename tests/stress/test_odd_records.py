"""What is detected in any record, of force or sound, is sound, and no kernel leaves its arrays."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from . import odd_records, odd_sounds

BROKE = (96, 150, 261, 316, 333, 341, 463)
"""Records that once ended the process, or gave times outside of the record."""
BROKE_OFF = (73, 103)
"""Sounds that ring and are too short to be predicted."""


@pytest.mark.parametrize("number", [*BROKE, *range(100_000, 100_060)])
def test_what_is_found_is_sound(number):
    odd_records.check(number)


@pytest.mark.parametrize("number", [*BROKE_OFF, *range(100_000, 100_060)])
def test_what_is_found_in_sounds_is_sound_and_the_same_in_blocks(number):
    odd_sounds.check(number)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [("records", 5000), ("sounds", 1000)])
def test_no_index_is_out_of_bounds(tmp_path, kind, count):
    settings = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-m", f"tests.stress.odd_{kind}", "200000", str(count)],
        cwd=Path(__file__).resolve().parents[2],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
