"""Single rises of power that are gradual, as of gusts of wind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from benchmarks.recordings import microphone, score
from impactsig.detect.sound.deciding._gradual_kernels import put_steady_odds
from impactsig.detect.sound.deciding.beside import PowersBeside
from impactsig.detect.sound.deciding.gradual import (
    ALONE,
    EACH,
    EDGES,
    MOST_OTHERS,
    NEAR,
    gradual_odds,
    most_odds_beside,
)
from tests.unit.test_detect_sound import detect


def gusts(seed: int, rate: float, seconds: float) -> np.ndarray:
    """Noise whose level changes at random, by up to 5 Hz."""
    rng = np.random.default_rng(seed)
    level = signal.sosfilt(
        signal.butter(2, 5.0, fs=1000.0, output="sos"),
        rng.standard_normal(round(1000 * seconds) + 500),
    )[500:]
    t = np.arange(round(seconds * rate)) / rate
    grown = np.interp(t, np.arange(len(level)) / 1000.0, level / level.std())
    return rng.standard_normal(len(t)) * np.exp(grown)


def test_gusts_are_hardly_impacts():
    noise = gusts(1, 22_050.0, 10.0)
    found, few = (detect(noise, 22_050.0, least_probability=p) for p in (0.5, 0.9))
    assert len(found.time) <= 8  # 50 otherwise
    assert any("gradual" in note for note in found.notes)
    assert not any("likely ones are none" in note for note in found.notes)
    assert set(few.time) <= set(found.time)


def test_impacts_in_gusts_are_found():
    truth = microphone(duration=10.0, mean_rate=6.0, noise_db=-60.0, seed=8)
    found = detect(truth.samples + 0.02 * gusts(2, truth.rate, 10.0), truth.rate)
    assert score(found.time, truth.time, 5e-3)[0] >= 0.87  # 0.80 otherwise


def test_what_the_first_pass_tells_of_gradual_rises():
    count, at = 9, np.array([16 * 4])
    one, none = np.ones(count), np.zeros(count)

    def steady(b=0.33, h=20.0, grown=0.5):
        rises, out = np.zeros(4 * count), np.empty(1)
        rises[17] = h
        growth = none.copy()
        growth[5] = grown
        put_steady_odds(at, np.array([0.2]), b * one, 8.0 * one, growth, rises, 3, out)
        return out[0]

    expected = 0.55 * np.log(21.0) + 1.5 * np.log(9.0) + 0.95 * np.log(0.23) - 5.4
    assert steady() == pytest.approx(expected - 0.9 * 0.5)
    assert steady(grown=4.0) == pytest.approx(expected - 0.9 * 3.0)
    # What does not rise in narrow bands, or rises at once in an octave, is not gradual.
    assert steady(b=0.32) == steady(h=60.0) == np.inf


def test_the_odds_against_sums_by_hand():
    rng, rate, lags = np.random.default_rng(2), 8000.0, (1, 2)
    x = rng.standard_normal(600)
    attack, steady = np.array([300.5, 310.5, 100.5, 560.5]), np.array([1.0, np.inf, 1.0, 1.0])
    lag, slope = lags
    y = x.copy()
    y[lag + slope :] -= 1.5 * x[slope:-lag] - 0.5 * x[: -lag - slope]

    def power(first: int, last: int) -> float:
        return float(np.log(np.mean(y[301 + 8 * first : 301 + 8 * last] ** 2)))

    rise, wide = power(0, 4) - power(-4, 0), power(1, 8) - power(-8, -1)
    before = power(-8, -1) - power(-16, -8)

    def odds_of(x: np.ndarray) -> np.ndarray:
        beside = PowersBeside(EDGES, rate, lags, beyond=False)
        beside.add(x, attack, np.isfinite(steady))
        return gradual_odds(steady, beside.powers(), beside.edges)

    for scale in (1.0, 1e6):
        step = np.where(np.arange(600) > 300, scale, 1.0)
        odds = odds_of(x * step)
        assert np.isinf(odds[1:]).all()  # not asked, and too near to the ends
        assert np.isinf(odds[0])  # no rise, and a sudden one
    grown = np.exp(0.05 / 8.0 * np.arange(600))  # 0.1 neper of power in 1 ms
    rise, wide, before = rise + 0.4, wide + 0.9, before + 0.75
    odds = odds_of(x * grown)
    assert np.isinf(odds[1:]).all()
    assert odds[0] == pytest.approx(1.0 + 2.2 * (rise - 0.75 * wide) - 1.6 * before, abs=0.2)
    x[165:240] = 0.0  # beside digital silence
    assert np.isinf(odds_of(x * grown)[0])


def test_company_makes_gradual_rises_less_likely():
    instant = 0.3 * NEAR * np.arange(40)
    odds, likely = np.full(40, -0.1), np.ones(40, bool)
    odds[20:] = np.inf
    most = most_odds_beside(instant, odds, likely)
    assert most[0] == pytest.approx(-0.1 + ALONE + 3 * EACH)
    assert most[10] == pytest.approx(-0.1 + ALONE + MOST_OTHERS * EACH)
    assert np.isinf(most[20:]).all()
    assert most_odds_beside(instant[:1], odds[:1], likely[:1]) == pytest.approx([-0.1 + ALONE])
    alone = most_odds_beside(instant, odds, ~likely)
    assert alone[:20] == pytest.approx(-0.1 + ALONE)
