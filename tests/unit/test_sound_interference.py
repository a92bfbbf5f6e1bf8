"""What a microphone hears beside impacts, and impacts that are hard to hear."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from benchmarks.recordings import coloured, score
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound._nearby import (
    greatest_within,
    places_about,
    ranked,
    separate_crests,
)
from impactsig.detect.sound._nearby_kernels import (
    greatest_about,
    greatest_beside,
    number_as_high,
    strongest_beside,
)
from impactsig.detect.sound.powers.band_kernels import band_growth
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
    x = step * np.round(x / step + 0.3 * coloured(rng, len(x), 44_100))
    found = detect(x, 44_100)
    assert score(found.time, time, 10e-3)[0] > 0.93
    assert any("converter" in note for note in found.notes)


def voice(rng, seconds, pitch, rate=RATE):
    """Pulses of a pitch that wavers, through three resonances, louder towards the middle."""
    since = np.arange(round(seconds * rate)) / rate
    wavering = pitch * (1 + 0.1 * np.sin(2 * np.pi * 3.0 * since))
    x = np.diff(np.floor(np.cumsum(wavering) / rate), prepend=0.0)
    x += 0.02 * rng.standard_normal(len(x))
    for formant in (500.0, 1500.0, 2700.0):
        x = signal.lfilter(*signal.iirpeak(formant, 8, fs=rate), x) + 0.1 * x
    x *= np.sin(np.pi * (np.arange(len(x)) + 0.5) / len(x)) ** 0.7
    return x / np.abs(x).max()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_pulses_of_a_voice_are_no_impacts(seed):
    rng = np.random.default_rng(seed)
    time = 0.2 + np.cumsum(rng.uniform(0.1, 0.3, 60))
    x = knocks(rng, time, (800.0, 4000.0), 5e-3, time[-1] + 0.5)
    x += 0.005 * rng.standard_normal(len(x))
    for start in np.arange(0.1, time[-1] - 0.5, 0.8):
        word = 0.2 * voice(rng, rng.uniform(0.15, 0.4), rng.uniform(100.0, 220.0))
        x[round(start * RATE) :][: len(word)] += word
    found = detect(x)
    assert score(found.time, time, 10e-3)[0] > 0.85  # 0.23 where pulses count
    assert "pulses of a voice" in found.notes[-1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_notes_that_swell_are_no_impacts(seed):
    rng = np.random.default_rng(seed)
    time = 0.2 + np.cumsum(rng.uniform(0.2, 0.6, 30))
    x = knocks(rng, time, (800.0, 4000.0), 5e-3, time[-1] + 0.5)
    x += 0.01 * rng.standard_normal(len(x))
    for start in np.arange(0.1, time[-1] - 0.7, 0.6):
        since = np.arange(round(0.5 * RATE)) / RATE
        envelope = np.minimum(np.minimum(since / 0.05, 1.0), (0.5 - since) / 0.08)
        tone = 220.0 * 2.0 ** (rng.integers(0, 24) / 12)
        note = sum(np.sin(2 * np.pi * m * tone * since) / m for m in (1, 2))
        x[round(start * RATE) :][: len(since)] += 0.3 * envelope * note
    assert score(detect(x).time, time, 10e-3)[0] > 0.96  # 0.81 where notes count


def test_what_goes_on_to_rise_is_measured():
    rng = np.random.default_rng(0)
    power = rng.exponential(1.0, (7, 40)) * rng.choice([1.0, 30.0], (7, 40))
    background, frames, out = rng.uniform(0.1, 1.0, (7, 4)), np.array([0, 5, 11, 30]), np.empty(4)
    earlier, now, following = (np.ascontiguousarray(p) for p in np.split(power, [2, 34], axis=1))
    band_growth(earlier, now, following, 3, background, 10, frames, out)
    for k, i in enumerate(frames):
        base = np.maximum(power[:, i], 2.0 * background[:, i // 10])
        rise = np.maximum(np.log(power[:, i + 2] / base), 0.0)
        grown = np.log(np.maximum(power[:, i + 5], base) / power[:, i + 2])
        np.testing.assert_allclose(out[k], np.average(grown, weights=rise), rtol=1e-12)


@pytest.mark.parametrize(("kind", "count"), [(float, 90), (np.float32, 90), (float, 5000)])
def test_ranked_values_are_those_of_sorted_windows(kind, count):
    rng = np.random.default_rng(5)
    values = rng.integers(0, count // 7, count).astype(kind)  # many are equal
    first = np.sort(rng.integers(0, count + 1, 200))
    last = np.minimum(first + rng.integers(0, count // 3, 200), count)
    last = np.maximum.accumulate(last)
    rank = rng.integers(-2, count // 3 + 2, 200)
    twice = np.repeat(np.arange(5), 2)  # two of each, of few windows
    for some in (slice(None), twice + 80):
        found = ranked(values, first[some], last[some], rank[some])
        assert found.dtype == kind
        for a, b, r, one in zip(first[some], last[some], rank[some], found, strict=True):
            assert one == (np.sort(values[a:b])[r] if 0 <= r < b - a else 0.0)
    assert ranked(values[:0], first[:1] * 0, first[:1] * 0, rank[:1] * 0) == [0.0]


@pytest.mark.parametrize("reach", [0.0, 0.5, 3.0, 3.7, 1e6])
@pytest.mark.parametrize("count", [0, 1, 300])
def test_the_greatest_height_from_reach_before_until_reach_after(count, reach):
    rng = np.random.default_rng(7)
    place, height = np.cumsum(rng.integers(1, 9, count)), rng.integers(0, 9, count) / 2.0
    near = [
        height[(place >= at - reach) & (place < at + reach) | (place == at)].max() for at in place
    ]
    found = np.empty(count)
    greatest_about(place, height, reach, np.empty(count, np.int64), found)
    np.testing.assert_array_equal(found, near)


@pytest.mark.parametrize("count", [0, 1, 300])
@pytest.mark.parametrize("in_order", [True, False])
def test_places_about_others_are_those_of_a_binary_search(count, in_order):
    rng = np.random.default_rng(8)
    places, at = np.sort(rng.integers(0, 400, count)), rng.integers(-50, 450, 200) / 2.0
    at = np.sort(at) if in_order else at
    for before, after in ((0.0, 0.0), (2.5, 7.0), (1e4, 1e4)):
        expected = np.searchsorted(places, (at - before, at + after))
        np.testing.assert_array_equal(places_about(places, at, before, after), expected)


def test_the_greatest_within_reach_is_that_of_padded_values():
    values = np.random.default_rng(6).standard_normal(40)
    for reach in (1, 2, 4, 50):
        slow = [values[max(k - reach, 0) : k + reach + 1].max() for k in range(40)]
        np.testing.assert_array_equal(greatest_within(values, reach), slow)
        found = [greatest_beside(values, at, reach) for at in (39, 3, -2, 50)]
        np.testing.assert_array_equal(found, np.take(slow, [-1, 3, 0, -1]))
    values[5:9] = 9.0
    assert [strongest_beside(values, at, 2) for at in (8, 4, 9)] == [6, 5, 7]


def test_separate_crests_are_those_that_none_nearby_exceeds():
    rng = np.random.default_rng(7)
    for values in (rng.standard_normal(300), rng.integers(0, 4, 300).astype(float), np.ones(20)):
        for reach in (1, 3, 40):
            slow = []
            for k, value in enumerate(values):
                near = values[max(k - reach, 0) : k + reach + 1]
                first = not slow or k - slow[-1] > reach
                if value > 0.5 and value == near.max() and first:
                    slow.append(k)
            np.testing.assert_array_equal(separate_crests(values, reach, 0.5), slow)


def test_others_as_high_are_counted():
    height = np.random.default_rng(0).exponential(1.0, 60)
    for k in (3, 17, 40):
        higher = np.count_nonzero(height[3:41] > 0.4 * height[k]) - 1
        assert number_as_high(height, k, 3, 41, 0.4) == higher


def test_an_impact_that_a_click_hides_is_found():
    rng = np.random.default_rng(1)
    time = 0.2 + np.cumsum(rng.uniform(0.1, 0.3, 40))
    x = knocks(rng, time, (800.0, 4000.0), 5e-3, time[-1] + 0.5)
    x += 0.02 * rng.standard_normal(len(x))
    x[np.round((time[::2] - 6e-3) * RATE).astype(int)] += 8.0
    found = detect(x)
    assert len(found.time) == len(time)
    np.testing.assert_allclose(found.time, time, atol=2e-3)
    assert found.notes[0].startswith("20 single samples")
    whole = [Piece(0, x[:30_000]), Piece(30_000, x[30_000:30_001]), Piece(30_001, x[30_001:])]
    cut = detect_sound(lambda: whole, RATE)
    np.testing.assert_array_equal(cut.time, found.time)
