"""Where modes are shared, and how many: each rule just beside where it changes a result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.sound_timing import MODES, band_limited
from impactsig.detect.sound.timing._shared_exponents import (
    RINGS,
    _counts,
    no_rings,
    rings_of_shared,
    with_rings,
)
from impactsig.detect.sound.timing._shared_modes_kernels import put_begins
from impactsig.detect.sound.timing._shift_errors import _variance
from impactsig.detect.sound.timing.shared_modes import EARLIER, SHARES, SharedModes


@pytest.mark.parametrize(
    ("third", "counts"),
    [
        (1.2e-3, [2]),  # as noise may be
        (3.0e-3, [2, 4]),  # of the two eigenvalues of a mode, the stronger may be this
        (5.0e-3, [3, 4]),  # more than four times noise
    ],
)
def test_eigenvalues_above_noise_are_of_modes(third, counts):
    rings = replace(no_rings(16_000.0, RINGS[0]), floor=1.0)
    values = [1e-3] * (len(rings.total) - 3) + [third, 1.0, 1.0]
    assert _counts(values, rings, 1e-3) == counts


@pytest.mark.parametrize(("rate", "timed"), [(22_050, True), (44_100, False)])
def test_above_24_khz_attacks_are_exact_by_themselves(rate, timed):
    truth = band_limited(rate, "resample_poly", 49.0, 207, modes=MODES["three"], count=12)
    modes = SharedModes(float(rate), 1, 2)
    modes.add(truth.samples, np.rint(truth.time * rate) - 0.5)
    assert np.isfinite(modes.timing()[:, 0]).all() == timed


@pytest.mark.parametrize(
    ("rate", "abrupt", "by_crossings"),
    [(16_000.0, 0.09, True), (16_000.0, 0.11, False), (16_001.0, 0.09, False)],
)
def test_crossings_time_what_does_not_begin_abruptly(monkeypatch, rate, abrupt, by_crossings):
    modes = SharedModes(rate, 1, 2)
    monkeypatch.setattr(modes, "_abruptness", lambda waves: np.full(len(waves), abrupt))
    assert modes._by_crossings(np.empty((3, 1))) == by_crossings


@pytest.mark.parametrize(("beside", "colour"), [(0.4, 1.0 + 1.6 / 3.0), (-0.5, 1 / 3), (-0.7, 0.1)])
def test_coloured_noise_makes_a_shift_no_surer_than_by_a_tenth(beside, colour):
    weights, covariance = np.ones(3), np.array([2.0, 2.0 * beside])
    assert _variance(weights, covariance, white=True) == pytest.approx(colour)
    assert _variance(weights, covariance) == pytest.approx(3.0 * colour)


@pytest.mark.parametrize(
    ("shares", "noise", "share"),
    [(SHARES, 0.0, 0.3), (SHARES, 0.1, 0.4), (SHARES, 0.2, 0.6), (EARLIER, 0.0, 0.15)],
)
def test_sounds_are_timed_at_a_share_of_their_greatest_that_noise_does_not_reach(
    shares, noise, share
):
    modes, crossed = SharedModes(8000.0, 1, 2), np.empty((1, 3))
    sound = np.clip((np.arange(100.0) - 30.0) / 20.0, 0.0, 1.0)[None]
    sound[0, :24] = noise  # four times that counts
    modes._cross(sound, crossed, shares)
    assert crossed[0, 0] == pytest.approx(30.0 + 20.0 * share, abs=0.5)


@pytest.mark.parametrize(("left", "fitted"), [(0.09, True), (0.11, False)])
def test_a_fit_that_leaves_a_tenth_of_a_sound_does_not_time_it(left, fitted):
    modes = SharedModes(8000.0, 1, 2)
    modes.latency, modes.spread = 2.0, 0.5
    crossed, fits = np.array([[40.0, 1.0, 0.0]]), np.array([[33.0, 0.1, left]])
    (first, error), (other, larger) = (modes._shifts(crossed, one)[0] for one in (fits, None))
    assert first - other == (-5.0 if fitted else 0.0)
    assert (error, larger) == (0.1 if fitted else 0.5, 0.5)


def test_rings_begin_a_while_after_the_crossing():
    sounds = np.random.default_rng(8).standard_normal((1, 100))
    rings, changed = no_rings(8000.0, RINGS[0]), []
    for at in (14, 15):  # 0.6 ms after sample 10
        other = sounds.copy()
        other[0, at] += 9.0
        totals = [with_rings(rings, one, np.array([10.0]), 8000.0).total for one in (sounds, other)]
        changed.append(not np.array_equal(*totals))
    assert changed == [False, True]


def test_waves_that_a_record_does_not_hold_begin_nowhere():
    first = np.empty(4, np.int64)
    put_begins(np.array([3.5, 4.5, 88.5, 89.5]), 5, 16, 100, first)
    np.testing.assert_array_equal(first, [-1, 0, 84, -1])


@pytest.mark.parametrize(("count", "shared"), [(9, False), (10, True)])
def test_few_sounds_of_many_modes_do_not_share_them(count, shared):
    # Sounds of one mode each have two poles: six modes in nine sounds are hardly shared.
    rate, time = 16_000.0, np.arange(200) / 16_000.0
    frequency = 1500.0 + 900.0 * (np.arange(count) % 6)
    sounds = np.exp(-time / 8e-3) * np.sin(2.0 * np.pi * frequency[:, None] * time + 0.3)
    found = rings_of_shared(sounds, np.zeros(count), rate, 1e-12)
    assert (found is not None) == shared
