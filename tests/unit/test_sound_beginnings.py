"""Errors of instants of sounds whose low frequencies begin before the attack."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, special

import impactsig
from benchmarks.recordings import coloured
from impactsig.detect.sound._beginnings import BEFORE, NOISE, ORDER, POWERS, Beginnings, _fractions
from impactsig.detect.sound._low_kernels import begun_before, low_before, predictors

RATE = 22_050


def membrane(seed: int, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Strikes at other places of one membrane, white noise 20 dB below, and their times [s]."""
    rng = np.random.default_rng(seed)
    zeros = np.sort(np.concatenate([special.jn_zeros(order, 4) for order in range(7)]))
    tones, times = 250.0 * zeros / zeros[0], 0.3 + np.cumsum(rng.uniform(0.08, 0.16, count))
    decays = 0.03 / (1.0 + tones / 2500.0)
    samples = np.zeros(round((times[-1] + 0.5) * RATE))
    for time in times:
        first = int(np.ceil(time * RATE))
        since = np.arange(first, first + RATE // 5)[:, None] / RATE - time
        sound = np.exp(-since / decays) * np.sin(2.0 * np.pi * tones * since)
        sound = sound @ rng.standard_normal(len(tones))
        samples[first : first + len(sound)] += sound / np.abs(sound).max()
    return samples + 0.1 * rng.standard_normal(len(samples)), times


def test_a_membrane_that_is_heard_late_has_errors_that_hold():
    z = []
    for seed in (5, 6):
        samples, times = membrane(seed)
        found = impactsig.detect_impacts(impactsig.Recording(samples, RATE, sensor="sound"))
        pairs = impactsig.match_impacts(found, impactsig.Impacts.from_times(times), within=3e-3)
        i, j = pairs.pairs.T
        assert len(i) > 50
        off = found.time[i] - times[j]
        z.append((off - np.median(off)) / found.time_error[i])
    assert 0.4 < np.std(np.concatenate(z)) < 1.6


def rows_of(seed: int, count: int, early: int = 0, power: float = 30.0) -> np.ndarray:
    """Autoregressive noise, the latest value first, that is louder in the last `early` steps."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((count, 200))
    noise[:, 200 - early :] *= np.sqrt(power)
    for k in range(1, 200):
        noise[:, k] += 0.8 * noise[:, k - 1]
    return noise[:, ::-1][:, : BEFORE + NOISE + ORDER].copy()


def added(rows: np.ndarray) -> Beginnings:
    found = Beginnings(8000.0)
    found.found.append(rows)
    return found


def test_noise_begins_nowhere():
    for seed in range(5):
        rows = rows_of(seed, 100)
        spread = added(rows).spread(np.zeros(100), np.ones(100, np.bool_))
        assert not spread.any()
    # Nor do most impacts where one rises by chance.
    rows[0] = rows_of(9, 1, early=4, power=6.0)
    assert not added(rows).spread(np.zeros(100), np.ones(100, np.bool_)).any()
    silent = added(np.zeros((100, rows.shape[1])))
    assert not silent.spread(np.zeros(100), np.ones(100, np.bool_)).any()


def test_those_that_begin_earlier_than_others_are_less_certain():
    rows = np.concatenate((rows_of(1, 70), rows_of(2, 30, early=6)))
    found, likely = added(rows), np.ones(100, np.bool_)
    spread = found.spread(np.zeros(100), likely)
    assert np.median(spread[:70]) < 2.0 * found.step  # noise of a step tells little
    assert np.median(spread[70:]) == pytest.approx(6.0 * found.step, rel=0.25)
    # What a fit put earlier than the attack is late by less.
    spread = found.spread(np.full(100, -4.0 * found.step), likely)
    assert np.median(spread[70:]) == pytest.approx(2.0 * found.step, rel=0.5)
    # A delay that most impacts share is no error; too few impacts show nothing.
    common = added(rows_of(3, 100, early=6)).spread(np.zeros(100), likely)
    assert np.median(common) < 1.5 * found.step
    assert not found.spread(np.zeros(100), np.arange(100) < 7).any()


def test_evidence_is_that_of_variances_that_rise():
    rng = np.random.default_rng(4)
    rows, coefficients = (
        rng.standard_normal((3, BEFORE + NOISE + ORDER)),
        np.array([0.5, 0, 0, 0.1]),
    )
    rows[1, :4] *= 5.0
    rows[2] = 0.2  # what is predicted exactly is no noise
    rows[2, -1] = rows[2, 0]
    evidence = np.empty((3, BEFORE))
    begun_before(rows, BEFORE, coefficients, POWERS, evidence)
    for row, found in zip(rows[:2], evidence[:2], strict=True):
        error = [
            row[k] - coefficients[:ORDER] @ row[k + 1 : k + 1 + ORDER] - coefficients[ORDER]
            for k in range(BEFORE + NOISE)
        ]
        square = np.square(error)
        for n in range(1, BEFORE + 1):
            c = square[:n].sum() / square[BEFORE:].sum()
            each = POWERS ** (-n / 2) * ((1 + c / POWERS) / (1 + c)) ** (-(NOISE + n) / 2)
            assert found[n - 1] == pytest.approx(np.log(each.mean()), rel=1e-10)
    assert evidence[2] == pytest.approx(0.0)


def test_low_frequencies_are_triangular_means():
    x, step, out = np.random.default_rng(5).standard_normal(57), 4, np.empty((2, 3))
    low_before(x, np.array([47, 13]), step, out)
    assert np.isnan(out[1]).all()  # its first would need sample -1
    triangle = np.convolve(np.ones(step), np.ones(step)) / step
    for k, value in enumerate(out[0]):
        end = 47 - k * step + 1
        assert value == pytest.approx(triangle @ x[end - len(triangle) : end])


def test_noise_is_predicted_by_what_made_it():
    rows = rows_of(6, 500)
    found = np.empty(ORDER + 1)
    predictors(rows, BEFORE, found)
    # Rows that are loud by chance count less.
    assert found == pytest.approx([0.8, 0.0, 0.0, 0.0], abs=0.06)
    weight = 1.0 / (1.0 + np.mean(rows[:, BEFORE : BEFORE + NOISE] ** 2, axis=1))
    lagged = [rows[:, BEFORE + k : BEFORE + k + NOISE] for k in range(ORDER + 1)]
    value, *before = (np.sqrt(weight)[:, None] * v for v in (*lagged, np.ones_like(lagged[0])))
    expected = np.linalg.lstsq(np.stack([v.ravel() for v in before], 1), value.ravel())[0]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    # Of what stays the same, one coefficient predicts all.
    predictors(np.ones((20, rows.shape[1])), BEFORE, found)
    assert found == pytest.approx([1.0, 0.0, 0.0, 0.0])


def test_fractions_are_none_where_no_odds_exceed_one():
    evidence = np.zeros((20, 3))
    evidence[:, 1:] = -3.0
    assert _fractions(evidence, 0.0) is None
    evidence[:5, 2] = 10.0
    fraction = _fractions(evidence, BEFORE)
    assert fraction == pytest.approx([0.75, 0.0, 0.25], abs=0.02)
    # The gain is that of the logarithm of the probability.
    gain = np.sum(np.log(np.exp(evidence) @ fraction))
    assert _fractions(evidence, gain + 1e-9) is None
    assert _fractions(evidence, gain - 1e-9) is not None


def test_a_few_that_begin_early_are_found_among_many():
    early = np.arange(900) % 30 == 7
    rows = np.where(early[:, None], rows_of(2, 900, early=6), rows_of(1, 900))
    likely = np.ones(900, np.bool_)
    spread = added(rows).spread(np.zeros(900), likely)
    assert np.median(spread[early]) > 3.0 * added(rows).step
    assert not added(rows_of(1, 900)).spread(np.zeros(900), likely).any()


@pytest.mark.parametrize("evidence", [9.5, 10.0])
def test_fractions_count_where_they_gain_more_than_one_each(evidence):
    """Two impacts of a hundred begin early: ln L gains 2 ln(.98 + .02 e^E) + 98 ln(.98)."""
    of_each = np.full((100, BEFORE + 1), -30.0)
    of_each[:, 0] = 0.0
    of_each[:2, 4] = evidence
    gain = 2.0 * np.log(0.98 + 0.02 * np.exp(evidence)) + 98.0 * np.log(0.98)
    assert abs(gain - BEFORE) < 0.8
    assert (_fractions(of_each, BEFORE) is not None) == (gain > BEFORE)


# 370 us where steps had three samples, which pass a ninth of what rings at half the rate.
def test_ringing_of_a_steep_filter_is_no_beginning():
    near = impactsig.Microphone(
        distance=1e-9, gain=1e-9, modes=((930.0, 10e-3, 1.0), (2870.0, 5e-3, 0.8))
    )
    rng = np.random.default_rng(3)
    time = 0.1 + np.cumsum(0.06 * rng.uniform(0.6, 1.4, 100))
    impacts = impactsig.Impacts.from_times(time, start=0.0, duration=time[-1] + 0.2)
    impacts = replace(impacts, peak=rng.uniform(0.5, 1.5, len(time)))
    sound = impactsig.synthesize(impacts, near, rate=88_200.0, seed=3).samples
    x = signal.resample(sound[: len(sound) // 8 * 8], len(sound) // 8)
    x += 1e-3 * np.abs(x).max() * coloured(rng, len(x), 11_025)
    found = impactsig.detect_impacts(impactsig.Recording(x, 11_025.0, sensor="sound"))
    assert len(found) == len(time)
    assert np.median(found.time_error) < 40e-6
