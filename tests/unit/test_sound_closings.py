"""Gates that attenuate what is softer than a threshold, but not to zero."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Recording, detect_impacts
from impactsig.detect.sound.powers.closings import closed_in, opened_noise

RATE = 22050
NOTE = "the noise is lowered"


def knocks(rng, rate=RATE, seconds=12.0):
    """Impacts in white noise, and their instants."""
    x = np.zeros(round(seconds * rate))
    time = np.arange(0.2, seconds - 0.2, 0.3) + 0.1 * rng.random(
        len(np.arange(0.2, seconds - 0.2, 0.3))
    )
    for at in time:
        first = int(np.ceil(at * rate))
        t = np.arange(first, min(first + rate // 10, len(x))) / rate - at
        tone = np.sin(2 * np.pi * rng.uniform(0.1, 0.35) * rate * t + rng.uniform(0, 6))
        x[first : first + len(t)] += rng.uniform(0.7, 1.3) * np.exp(-t / 0.004) * tone
    return x + 0.02 * rng.normal(size=len(x)), time


def gated(x, rate, floor, hold=0.05, threshold=0.2):
    """x behind a gate that is held open after each sample above a threshold."""
    index = np.arange(len(x))
    loud = np.maximum.accumulate(np.where(np.abs(x) > threshold, index, -len(x)))
    return x * np.where(index - loud <= hold * rate, 1.0, floor)


def octaves(rng, count=600, closed=1e-3):
    """Powers of five octaves behind a gate that a sound opens every 60 parts, for 8 of them."""
    parts = rng.chisquare(40, (5, count)) / 40 * np.geomspace(1.0, 0.1, 5)[:, None]
    phase = np.arange(count) % 60
    parts[:, phase == 0] *= 100.0
    parts[:, phase >= 8] *= closed
    return parts, phase >= 8


@pytest.mark.parametrize("closed", [1e-2, 1e-3, 1e-5])
def test_noise_behind_an_open_gate_is_higher_by_its_attenuation(closed):
    parts, shut = octaves(np.random.default_rng(1), closed=closed)
    noise = closed * np.geomspace(1.0, 0.1, 5)
    opened = opened_noise(parts, noise[:3])
    assert opened == pytest.approx(1.0 / closed, rel=0.2)
    np.testing.assert_array_equal(closed_in(parts[:3], opened * noise[:3], 600), shut)


def test_what_decays_before_it_falls_is_no_gate():
    parts, _ = octaves(np.random.default_rng(2))
    phase = np.arange(600) % 60
    decaying = np.maximum(1e5 * np.exp(-1.5 * phase), 1.0) * np.geomspace(1.0, 0.1, 5)[:, None]
    assert opened_noise(decaying, np.geomspace(1.0, 0.1, 5)[:3]) == 0.0
    parts[:, phase == 0] /= 100.0  # noise that is switched on and off
    assert opened_noise(parts, 1e-3 * np.geomspace(1.0, 0.1, 5)[:3]) == 0.0
    parts, _ = octaves(np.random.default_rng(2))
    parts[0, phase < 8] *= 30.0  # a sound of another spectrum
    assert opened_noise(parts, 1e-3 * np.geomspace(1.0, 0.1, 5)[:3]) == 0.0


def test_few_closings_are_no_gate():
    parts, _ = octaves(np.random.default_rng(3), count=170)
    assert opened_noise(parts, 1e-3 * np.geomspace(1.0, 0.1, 5)[:3]) == 0.0


@pytest.mark.parametrize("rate", [8000, RATE])
@pytest.mark.parametrize("floor", [0.003, 0.03, 0.1])
def test_impacts_behind_a_gate_with_a_floor_are_those_without_it(rate, floor):
    x, time = knocks(np.random.default_rng([4, rate]), rate)
    plain = detect_impacts(Recording(x, rate, sensor="sound"))
    found = detect_impacts(Recording(gated(x, rate, floor), rate, sensor="sound"))
    assert abs(len(found) - len(plain)) <= 1
    near = np.abs(found.time[:, None] - time).min(axis=1)
    assert np.count_nonzero(near > 0.005) <= 1
    assert not any(NOTE in note for note in plain.notes)
    assert any(NOTE in note for note in found.notes)


def test_a_gate_that_opens_without_a_sound_is_no_impact():
    """The noise that it lets through is not louder than elsewhere."""
    rng = np.random.default_rng(5)
    x, _ = knocks(rng)
    y = gated(x, RATE, 0.03)
    for at in np.arange(0.05, 11.5, 1.1):  # opens without a sound
        first = round(at * RATE)
        y[first : first + round(0.06 * RATE)] = x[first : first + round(0.06 * RATE)]
    found = detect_impacts(Recording(y, RATE, sensor="sound"))
    plain = detect_impacts(Recording(x, RATE, sensor="sound"))
    assert abs(len(found) - len(plain)) <= 1
