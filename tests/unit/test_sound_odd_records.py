"""What is said of records that are hardly sound."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Recording, detect_impacts
from impactsig.detect.sound._core_kernels import CONVERTER_STEP, GREATEST, LEAST
from impactsig.detect.sound._cores import cores_of, on_steps

RATE = 22050
TIME = np.arange(3 * RATE) / RATE


def detect(x):
    return detect_impacts(Recording(x, RATE, sensor="sound"))


@pytest.mark.parametrize("kind", [float, np.float32])
def test_a_computed_sine_was_not_rounded_by_a_converter(kind):
    found = detect(np.sin(2 * np.pi * 440.0 * TIME).astype(kind))
    assert not found.notes
    rounded = np.round(20000 * np.sin(2 * np.pi * 440.0 * TIME)).astype(np.int16)
    assert any("step of the converter" in note for note in detect(rounded).notes)


def test_samples_of_a_converter_are_whole_steps_apart():
    rng = np.random.default_rng(1)
    codes = np.round(30 * rng.normal(size=40_000))
    for samples in (codes, codes / 32768 - 0.1, (codes / 32768).astype(np.float32)):
        cores = cores_of(samples, 16)
        assert np.isfinite(cores[:, CONVERTER_STEP]).all()
        assert on_steps(cores)
    cores[0, GREATEST] += 0.4 * cores[0, CONVERTER_STEP]
    assert not on_steps(cores)
    assert (cores[:, LEAST] < cores[:, GREATEST]).all()


@pytest.mark.parametrize("count", [2, 10, 40, 100])
def test_a_record_may_be_too_short(count):
    found = detect(np.random.default_rng(count).normal(size=count))
    assert "and an impact needs 4 ms before it" in found.reason
    assert not found.notes


def test_two_values_are_no_clipping():
    bits = np.random.default_rng(1).integers(0, 2, len(TIME)).astype(np.int16)
    for x in (bits, np.sign(np.sin(2 * np.pi * 50.3 * TIME) + 1e-9)):
        (note,) = detect(x).notes
        assert note.startswith("Nearly all samples are")
    clipped = np.clip(np.random.default_rng(1).normal(size=len(TIME)), -1.0, 1.0)
    assert any("clipped" in note for note in detect(clipped).notes)
