"""Low tones far above the noise: no impacts by themselves, and none hidden by them."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Recording, detect_impacts
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound.powers.bands import bands_at
from impactsig.detect.sound.powers.hum import centres, high_pass, lowest

SECONDS = 20.0
HARMONICS = 1, 2, 3, 5, 7, 9


def hum(rate):
    t = np.arange(round(SECONDS * rate)) / rate
    return sum(np.sin(2 * np.pi * 50 * m * t + m) / m for m in HARMONICS)


def detect(x, rate):
    return detect_impacts(Recording(x, rate, sensor="sound"))


@pytest.mark.parametrize("rate", [8000, 22_050])
def test_hum_is_no_impact(rate):
    noise = 1e-3 * np.random.default_rng(3).standard_normal(round(SECONDS * rate))
    assert not len(detect(hum(rate) + noise, rate))
    found = detect(np.round(8000 * hum(rate)).astype(np.int16), rate)
    assert not len(found)
    assert not any("rises" in note for note in found.notes)


@pytest.mark.parametrize("rate", [8000, 22_050])
def test_impacts_40_db_below_hum_are_found_and_timed(rate):
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.1, 0.4, 70))
    x = hum(rate) + 1e-3 * rng.standard_normal(round(SECONDS * rate))
    for start in time:
        k = np.arange(int(np.ceil(start * rate)), int((start + 0.04) * rate))
        since = k / rate - start
        for tone in (1500.0, 2700.0):
            x[k] += 0.01 * np.exp(-since / 4e-3) * np.sin(2 * np.pi * tone * since + 1.0)
    found = detect(x, rate)
    assert len(found) == len(time)
    off = found.time - time
    assert np.std(off) < 20e-6
    assert np.std(off) < 1.5 * np.mean(found.time_error)


@pytest.mark.parametrize("rate", [8000, 44_100])
def test_the_filter_stops_what_it_must_and_passes_the_octaves(rate):
    scale = scale_at(rate)
    bands = bands_at(rate, 16 * scale.hop)
    stopped = int(np.count_nonzero(centres(bands) < 500.0 / rate))
    stop = high_pass(scale, rate, bands, stopped)
    np.testing.assert_array_equal(stop.taps, stop.taps[::-1])
    half = stop.delay
    for frequency, gain in ((200.0, 0.0), (450.0, 0.0), (1.02 * lowest(scale) * rate, 1.0)):
        tone = np.cos(2 * np.pi * frequency * np.arange(8 * half) / rate)
        inside = stop.of(tone)[half:-half]
        np.testing.assert_allclose(inside, gain * tone[half:-half], atol=1e-4)


def test_an_offset_is_filtered_out_to_the_ends_of_a_record():
    scale = scale_at(8000.0)
    bands = bands_at(8000.0, scale.hop)
    stop = high_pass(scale, 8000.0, bands, 5)
    assert np.abs(stop.of(np.full(3000, 5.0))).max() < 1e-3
