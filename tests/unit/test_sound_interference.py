"""What a microphone hears beside impacts, and impacts that are hard to hear."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.recordings import score
from benchmarks.sound_timing import pink
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound.sound import detect_sound

RATE = 22_050


def detect(x, rate=RATE, **settings):
    return detect_sound(lambda: [Piece(0, x)], rate, **settings)


def knocks(rng, time, tones, decay, seconds, rate=RATE):
    """Sounds of three tones between two, in random phases, of peak 1 nearly."""
    t = np.arange(round(seconds * rate)) / rate
    x = np.zeros(len(t))
    for start in time:
        first = int(np.ceil(start * rate))
        since = t[first : first + round(8 * decay * rate)] - start
        for tone in rng.uniform(*tones, 3):
            wave = np.sin(2 * np.pi * tone * since + rng.uniform(0, 2 * np.pi))
            x[first : first + len(since)] += 0.5 * np.exp(-since / decay) * wave
    return x


@pytest.mark.parametrize("rate", [11_025, 44_100])
def test_impacts_that_ring_below_500_hz_alone_are_found(rate):
    scores = []
    for seed in (1, 2, 3, 5, 6):
        rng = np.random.default_rng(seed)
        time = 0.3 + np.cumsum(rng.uniform(0.08, 0.3, 60))
        x = knocks(rng, time, (250.0, 450.0), 8e-3, time[-1] + 0.5, rate)
        x += 0.15 * rng.standard_normal(len(x))
        scores.append(score(detect(x, rate).time, time, 10e-3)[0])
    assert np.mean(scores) > 0.85


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_single_samples_are_no_impacts_where_others_ring(seed):
    rng = np.random.default_rng(seed)
    time = 0.2 + np.cumsum(rng.uniform(0.1, 0.3, 30))
    x = knocks(rng, time, (800.0, 4000.0), 5e-3, time[-1] + 0.5)
    x += 0.02 * rng.standard_normal(len(x))
    at = rng.choice(len(x), 20, replace=False)
    x[at] += rng.uniform(0.7, 3.0, 20) * rng.choice([-1, 1], 20)
    found = detect(x)
    assert score(found.time, time, 10e-3)[0] > 0.94
    assert "single samples" in found.notes[0]


def test_impacts_that_begin_with_a_jump_are_no_clicks():
    rng = np.random.default_rng(4)
    time = 0.2 + np.cumsum(rng.uniform(0.05, 0.2, 60))
    x = knocks(rng, time, (500.0, 800.0), 8e-3, time[-1] + 0.5, 44_100)
    x += 0.005 * rng.standard_normal(len(x))
    found = detect(x, 44_100)
    assert score(found.time, time, 10e-3)[0] > 0.97
    assert not found.notes


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_codes_that_toggle_in_a_quiet_record_are_no_impacts(seed):
    rng = np.random.default_rng(seed)
    time = 0.3 + np.cumsum(rng.uniform(0.3, 1.0, 15))
    x = knocks(rng, time, (300.0, 1500.0), 4e-3, time[-1] + 0.5, 44_100)
    step = 1.0 / 40
    x = step * np.round(x / step + 0.3 * pink(rng, len(x), 44_100))
    found = detect(x, 44_100)
    assert score(found.time, time, 10e-3)[0] > 0.93
    assert any("converter" in note for note in found.notes)
