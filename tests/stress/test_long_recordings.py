"""Recordings larger than the memory they may take."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

from benchmarks.recordings import load_cell

RATE = 50_000

ANALYSE = """
import json, sys, impactsig
from tests.memory import peak
found = impactsig.detect_impacts(sys.argv[1], sensor="force")
print(json.dumps({"impacts": len(found), "duration": found.duration, "MB": peak()}))
"""


def repeat_to_wav(path, minutes):
    """A 16-bit WAV of the load-cell minute again and again; the impacts in one minute."""
    truth = load_cell(duration=60.0)
    minute = np.round(truth.samples / 16 * 32767).astype(np.int16)
    with soundfile.SoundFile(path, "w", RATE, 1, "PCM_16") as file:
        for _ in range(minutes):
            file.write(minute)
    return len(truth.time)


def analyse(path):
    run = subprocess.run(
        [sys.executable, "-c", ANALYSE, str(path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    return json.loads(run.stdout)


@pytest.mark.slow
def test_two_hours_in_under_400_megabytes(tmp_path):
    path = tmp_path / "two_hours.wav"
    each = repeat_to_wav(path, 120)
    assert path.stat().st_size > 700e6
    found = analyse(path)
    assert found["duration"] == 7200.0
    assert found["impacts"] == pytest.approx(120 * each, rel=0.01)
    assert found["MB"] < 400


@pytest.mark.slow
def test_memory_does_not_grow_with_the_length(tmp_path):
    short, long = tmp_path / "short.wav", tmp_path / "long.wav"
    repeat_to_wav(short, 1)
    each = repeat_to_wav(long, 4)
    little, much = analyse(short), analyse(long)
    assert much["impacts"] == pytest.approx(4 * each, rel=0.01)
    # 9 million more samples would take 72 MB as numbers; frames kept and ranges grow by some.
    assert much["MB"] - little["MB"] < 36
