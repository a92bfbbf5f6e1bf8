"""Sound that still rings when it is struck again: strikes are what its past does not predict."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.recordings import score
from benchmarks.ringing import SECONDS, measured, struck
from impactsig import Recording, detect_impacts
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound._cores import window_size
from impactsig.detect.sound._kernels import GROUP
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound._windows import windows
from impactsig.detect.sound.powers._ringing_kernels import prediction_gain
from impactsig.detect.sound.powers.bands import bands_at
from impactsig.detect.sound.powers.ringing import (
    lasting,
    modes_in,
    octaves_at,
    predictable,
    prediction,
)
from impactsig.detect.sound.sound import detect_sound, surveyed


def find(x, rate):
    return detect_impacts(Recording(x, rate, sensor="sound"))


def filter_of(x, rate):
    """The filter behind which a record is searched."""
    return surveyed(lambda: [Piece(0, x)], float(rate), scale_at(rate)).survey.filter


@pytest.mark.parametrize("modes", [2, 6, 12])
@pytest.mark.parametrize("rate", [8000, 22_050, 44_100])
def test_strikes_on_what_still_rings_are_found_and_their_errors_hold(rate, modes):
    x, time = struck(rate, modes, 0.25, (0.3, 0.6), 5, lowest=1500.0)
    found = find(x, rate)
    f1, _, pairs = score(found.time, time, 5e-3)
    assert f1 > 0.95
    off = found.time[pairs[:, 0]] - time[pairs[:, 1]]
    off -= np.median(off)
    assert np.sqrt(np.mean(off**2)) < 1.3 * np.sqrt(np.mean(found.time_error**2))


def test_strikes_that_share_a_waveform_are_timed_by_it():
    x, time = struck(22_050, 12, 0.25, (0.3, 0.6), 6, np.arange(12.0), 1500.0)
    found = find(x, 22_050)
    f1, _, pairs = score(found.time, time, 5e-3)
    off = found.time[pairs[:, 0]] - time[pairs[:, 1]]
    assert f1 > 0.98
    assert np.median(np.abs(off - np.median(off))) < 5e-6


@pytest.mark.parametrize(("rate", "seed"), [(8000, 7), (22_050, 7), (44_100, 10)])
def test_phases_of_few_modes_are_not_taken_for_a_common_waveform(rate, seed):
    x, time = struck(rate, 1, 0.2, (0.3, 0.6), seed, lowest=1500.0)
    assert measured(x, rate, time, 5e-3)[2] < 1.3  # 27 to 36 where any number of modes is compared


def test_peaks_are_those_of_the_record_and_not_of_what_is_unpredicted():
    rate = 22_050
    x, _ = struck(rate, 6, 0.25, (0.3, 0.6), 5, lowest=1500.0)
    found = find(x, rate)
    size = round(4e-3 * rate)
    share = []
    for start, peak in zip(found.time, found.peak, strict=True):
        first = round(start * rate)
        share.append(peak / np.abs(x[first : first + size] - x[first - size : first].mean()).max())
    assert np.median(share) == pytest.approx(1.0, abs=0.02)
    assert np.mean(np.abs(np.log(share)) < 0.1) > 0.8


def test_cuts_into_blocks_change_nothing():
    x, _ = struck(8000, 6, 0.25, (0.3, 0.6), 5, lowest=1500.0)
    whole = detect_sound(lambda: [Piece(0, x)], 8000.0)
    cuts = [0, 3001, 9000, 50_123, len(x)]
    parts = [Piece(a, x[a:b]) for a, b in pairwise(cuts)]
    again = detect_sound(lambda: parts, 8000.0)
    np.testing.assert_array_equal(whole.time, again.time)
    np.testing.assert_array_equal(whole.probability, again.probability)
    np.testing.assert_array_equal(whole.peak, again.peak)


def test_strikes_that_ring_beside_hum_are_found():
    rate = 22_050
    x, time = struck(rate, 6, 0.25, (0.3, 0.6), 5, lowest=1500.0)
    t = np.arange(len(x)) / rate
    x += sum(30.0 / m * np.sin(2 * np.pi * 50 * m * t + m) for m in (1, 2, 3, 5))
    assert score(find(x, rate).time, time, 5e-3)[0] > 0.97


def test_an_autoregressive_process_has_its_own_coefficients():
    rate, radius, angle = 8000, 0.995, 2 * np.pi * 0.3
    x = np.random.default_rng(1).standard_normal(20 * rate)
    for n in range(2, len(x)):
        x[n] += 2 * radius * np.cos(angle) * x[n - 1] - radius**2 * x[n - 2]
    scale = scale_at(rate)
    taps = prediction(windows([Piece(0, x)], window_size(scale)), rate, scale, None, 1.0).taps
    np.testing.assert_allclose(taps[:3], [1, -2 * radius * np.cos(angle), radius**2], atol=0.05)
    np.testing.assert_allclose(taps[3:], 0.0, atol=0.05)
    left = np.convolve(x, taps, "valid")
    assert np.var(left) == pytest.approx(1.0, rel=0.03)


def test_lines_of_equal_power_are_counted():
    scale = scale_at(22_050)
    size = 4096
    spectrum = np.full(size // 2 + 1, 1e-6)
    for count in range(1, 9):
        spectrum[600 + 150 * count : 602 + 150 * count] = 1.0
        assert modes_in(spectrum, scale) == pytest.approx(count, rel=1e-3)
    assert modes_in(np.ones(size // 2 + 1), scale) == 1.0


@pytest.mark.parametrize("rate", [8000, 44_100])
def test_what_decays_between_impacts_is_searched_as_it_is(rate):
    noise = 0.01 * np.random.default_rng(2).standard_normal(round(SECONDS * rate))
    assert filter_of(noise, rate) is None
    decayed, _ = struck(rate, 6, 0.25, (0.003, 0.01), 5, lowest=1500.0)
    assert filter_of(decayed, rate) is None
    ringing, _ = struck(rate, 6, 0.25, (0.3, 0.6), 5, lowest=1500.0)
    assert filter_of(ringing, rate).predicts


def test_a_fast_machine_leaves_no_time_to_ring():
    # Periods of 10 to 20 ms are correlated as ringing is, and predicting them removes impacts.
    rate = 22_050
    x = 0.02 * np.random.default_rng(3).standard_normal(10 * rate)
    since = np.arange(round(0.02 * rate)) / rate
    for start in np.arange(0.05, 9.9, 0.01):
        first = round(start * rate)
        x[first : first + len(since)] += np.exp(-since / 4e-3) * np.sin(6e3 * np.pi * since)
    scale = scale_at(rate)
    assert lasting(windows([Piece(0, x)], window_size(scale)), rate, scale)
    assert filter_of(x, rate) is None


def test_tails_40_db_below_the_loudest_are_no_ringing():
    rate = 22_050.0
    scale = scale_at(rate)
    gain = bands_at(rate, GROUP * scale.hop).gain
    noise, loudest = np.ones(len(gain)), np.ones(len(gain))
    noise[60:] = 1e-2
    noise[80] = 1.0
    assert predictable(np.array([[noise, loudest]]) * gain, rate, scale)
    assert not predictable(np.array([[noise, 1e4 * loudest]]) * gain, rate, scale)


@pytest.mark.parametrize(
    ("rate", "seed"),
    [
        (22_050, 601),  # weak ringing hardly changes it: 26 us where it is not used
        (44_100, 602),  # by it some are 2.2 ms off, a beat of two modes, and were stated as 20 us
    ],
)
def test_a_waveform_in_the_record_times_strikes_where_attacks_agree(rate, seed):
    x, time = struck(rate, 6, 0.15, (0.03, 0.08), seed, 1.3 * np.arange(6), 1000.0)
    assert filter_of(x, rate).predicts
    _, scatter, off = measured(x, rate, time, 5e-3)
    assert scatter < 6e-6
    assert off < 1.5


@pytest.mark.parametrize("cores", [1, 2, 5])
def test_the_gain_of_prediction_is_that_of_arithmetic_over_geometric_means(cores):
    scale = scale_at(22_050.0)
    gain, edges, share = octaves_at(22_050.0, scale)
    assert edges[-1] == len(gain)
    narrow = np.random.default_rng(cores).exponential(1.0, (cores, 2, len(gain))) ** 4
    narrow[:, 1] *= 1e3
    narrow[0, 0] = 0.0
    noise, loudest = (narrow / gain).swapaxes(0, 1)
    gains = []
    for first, last in pairwise(edges):
        least = 1e-4 * loudest[:, first:last].max(axis=1)
        own, weights = np.maximum(noise[:, first:last], least[:, None]), gain[first:last]
        np.testing.assert_allclose(share[first:last], weights / weights.sum())
        mean = np.average(own, axis=1, weights=weights)
        gains.append(np.log(mean) - np.average(np.log(own), axis=1, weights=weights))
    expected = np.median(gains, axis=1).max()
    assert prediction_gain(narrow, gain, edges, share) == pytest.approx(expected, rel=1e-12)
