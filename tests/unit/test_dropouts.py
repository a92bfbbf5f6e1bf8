"""Stretches of a force record in which the instrument held one value."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from benchmarks.disturbances import converted, stationary
from benchmarks.recordings import score
from impactsig.detect.instrument.dropout_kernels import fill, find_dropouts
from impactsig.impacts import OPEN_END, OPEN_START

RATE = 50_000.0


def detect(samples, **options):
    return impactsig.detect_impacts(
        impactsig.Recording(samples, RATE, units="N", sensor="force"), **options
    )


def silenced(truth, offset, starts, lengths):
    """Samples that fall to zero, the impacts that are left whole, and how many samples fell."""
    x = truth.samples + offset
    whole = np.ones(len(truth.time), bool)
    first, end = truth.time * RATE, (truth.time + truth.contact_time) * RATE
    for start, length in zip(starts, lengths, strict=True):
        x[start : start + length] = 0.0
        whole &= (first > start + length) | (end < start)
    return x, truth.time[whole]


def dropouts(x, zero=0.0):
    room = np.empty((4096, 2), np.int64)
    return room[: find_dropouts(x, zero, np.nan, room)].tolist()


@pytest.mark.parametrize("offset", [-5.0, 0.0, 5.0, 1000.0])
def test_short_dropouts_to_zero_are_no_impacts(offset):
    rng = np.random.default_rng(11)
    truth = stationary(5, 6.0)
    starts = np.sort(rng.choice(1500, 50, replace=False)) * 200
    lengths = rng.integers(20, 200, 50)
    x, time = silenced(truth, offset, starts, lengths)
    found = detect(x)
    assert found.settings["polarity"] == "positive"
    assert score(found.time, time)[0] >= 0.98
    lost = [one for one in found.disturbances if one.kind == "dropout"]
    np.testing.assert_allclose([one.start for one in lost], starts / RATE)
    np.testing.assert_allclose([one.duration for one in lost], lengths / RATE)
    assert found.settings["dropouts"] == pytest.approx(lengths.sum() / RATE)
    assert "drops out 50 times" in found.notes[0]


@pytest.mark.parametrize(("share", "length"), [(0.5, 0.1), (0.7, 1.0), (0.9, 0.1)])
@pytest.mark.parametrize("offset", [0.0, 5.0])
def test_partly_silent_seconds_hold_no_false_impacts(share, length, offset):
    truth = stationary(6, 12.0)
    starts = np.arange(0.05, 12.0 - length, length / share) * RATE
    lengths = np.full(len(starts), round(length * RATE))
    x, time = silenced(truth, offset, starts.astype(int), lengths)
    found = detect(x)
    whole = (found.flags & (OPEN_START | OPEN_END)) == 0
    assert score(found.time[whole], time)[0] >= 0.98
    assert found.noise == pytest.approx(0.1, rel=0.05)


def test_a_pulse_that_a_dropout_cuts_off_is_open_there():
    truth = stationary(5, 2.0, noise=0.02)
    early, late = truth.time[3] * RATE, truth.time[12] * RATE
    x, _ = silenced(truth, 1.0, [int(early) - 60, int(late) + 9], [68, 60])
    found = detect(x)
    first = found.flags[np.argmin(np.abs(found.time - truth.time[3]))]
    second = found.flags[np.argmin(np.abs(found.time - truth.time[12]))]
    assert first & OPEN_START
    assert second & OPEN_END
    assert np.isinf(found.time_error[found.flags & OPEN_START > 0]).all()


def test_a_dropout_across_the_border_of_two_seconds_is_one():
    truth = stationary(5, 3.0)
    x, _ = silenced(truth, 5.0, [50_176 - 10], [20])
    lost = [one for one in detect(x).disturbances if one.kind == "dropout"]
    assert [(round(one.start * RATE), round(one.duration * RATE)) for one in lost] == [(50_166, 20)]


def test_what_is_no_dropout():
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(20_000)
    assert dropouts(noise) == []
    clipped = np.minimum(0.3 * noise + 8 * np.sin(np.arange(20_000) / 300), 6.0)
    assert dropouts(clipped) == []  # the limit of the instrument
    assert dropouts(np.rint(0.3 * noise)) == []  # a quiet record of whole codes
    pulses = np.zeros(20_000)
    pulses[5000:5030] = np.sin(np.pi * np.arange(30) / 30)
    assert dropouts(pulses) == []  # a silent baseline
    assert dropouts(np.where(np.arange(20_000) % 500 < 100, 0.0, 5.0)) == []  # a switch


def test_zeros_of_a_quiet_record_that_stands_elsewhere_are_dropouts():
    x = converted(1, 2.0, peak=10, noise=0.1).samples + 40.0
    x[30_000:30_100] = 0.0
    assert dropouts(x) == [[30_000, 30_100]]


def test_held_values_of_a_noisy_record_are_dropouts():
    x = np.random.default_rng(4).standard_normal(20_000)
    x[500:540] = x[500]
    x[9000:9016] = x[9000]
    assert dropouts(x) == [[500, 540], [9000, 9016]]


def test_a_dropout_is_filled_with_a_line():
    x = np.concatenate((np.full(50, 2.0), np.zeros(9), np.full(50, 4.0), np.zeros(5)))
    last = fill(x, np.array([[50, 59], [109, 114]]), np.nan)
    np.testing.assert_allclose(x[50:59], np.linspace(2, 4, 11)[1:-1])
    np.testing.assert_allclose(x[109:], 4.0)
    assert last == 4.0
