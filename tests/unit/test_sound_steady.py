"""Faint sounds of many modes in steady noise, which only the mean over narrow bands shows."""

import numpy as np
import pytest
from scipy import special

import impactsig
from impactsig.detect.sound.deciding._steady import ROUGH, steady_odds, unsteadiness

PER = 5.8e-3  # [s], of a frame of narrow bands


def membrane(rng, rate: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Strokes at random places of a membrane, each of peak 1, and their instants."""
    zeros = np.array([(m, z) for m in range(12) for z in special.jn_zeros(m, 9)])
    tone = 200.0 * zeros[:, 1] / zeros[:, 1].min()
    decay = 0.05 * (tone.min() / tone) ** 0.7
    time = np.arange(0.4, duration - 0.3, 0.23) + 0.02 * rng.random()
    x = np.zeros(int(duration * rate))
    for start in time:
        radius, angle = np.sqrt(0.9 * rng.random()), 2.0 * np.pi * rng.random()
        share = special.jv(zeros[:, 0], zeros[:, 1] * radius) * np.cos(zeros[:, 0] * angle)
        first = int(np.ceil(start * rate))
        since = (first + np.arange(int(0.3 * rate))) / rate - start
        modes = np.exp(-since / decay[:, None]) * np.sin(2.0 * np.pi * tone[:, None] * since)
        sound = share @ modes
        x[first : first + len(sound)] += sound / np.abs(sound).max()
    return x, time


@pytest.mark.parametrize("seed", [5, 8])
def test_strokes_on_a_membrane_6_db_above_noise_are_found(seed):
    rng, rate = np.random.default_rng(seed), 44_100.0
    x, time = membrane(rng, rate, 8.0)
    x += 0.5 * rng.standard_normal(len(x))
    found = impactsig.detect_impacts(impactsig.Recording(x, rate, sensor="sound")).time
    near = np.abs(found[:, None] - time) < 10e-3
    assert near.any(axis=0).mean() > 0.5
    assert near.any(axis=1).mean() > 0.9


def swelling(time: np.ndarray, often: float, depth: float) -> np.ndarray:
    return np.asarray(1.0 + depth * np.sin(2.0 * np.pi * often * time))


@pytest.mark.parametrize("rate", [8000.0, 22_050.0, 44_100.0])
@pytest.mark.parametrize(("often", "depth"), [(0.0, 0.0), (17.0, 0.5), (25.0, 0.3)])
def test_steady_noise_and_noise_that_swells_have_none(rate, often, depth):
    noise = np.random.default_rng(6).standard_normal(int(30 * rate))
    x = swelling(np.arange(len(noise)) / rate, often, depth) * noise
    found = impactsig.detect_impacts(impactsig.Recording(x, rate, sensor="sound"))
    assert len(found) <= (3 if depth == 0.5 else 0)  # without these odds as many


def test_only_noise_that_swells_falls_below_its_level():
    rng, count = np.random.default_rng(7), 2000
    time = PER * np.arange(count)
    steady = 12.0 + np.convolve(rng.standard_normal(count + 3), np.full(4, 0.5), "valid")
    struck = steady + 5.0 * (time % 0.3 < 0.06)
    at = np.arange(400, 1600, 100)
    usual = np.median(unsteadiness(steady, at, PER))
    assert np.median(unsteadiness(struck, at, PER)) < 1.3 * usual
    swells = unsteadiness(steady + 5.0 * np.sin(2.0 * np.pi * 9.0 * time), at, PER)
    assert swells.min() > 2.0 * usual
    assert swells.min() > ROUGH + 1.0


def odds_of(b: np.ndarray, crest: int) -> float:
    return float(steady_odds(np.array([crest]), b, PER)[0])


def test_a_crest_is_compared_with_its_median_and_with_what_lies_beside_it():
    steady = np.full(1000, 0.02)
    steady[500] = 0.25
    assert odds_of(steady, 500) > 1.0
    low = steady.copy()
    low[500] = 0.12  # as noise has it once in an hour
    assert odds_of(low, 500) < 0.0
    assert odds_of(np.where(steady < 0.1, 0.05, steady), 500) < 0.0  # rattle
    assert odds_of(np.where(steady < 0.1, 0.005, steady), 500) < -1.0  # no steady noise
    wide = steady.copy()
    wide[495:506] = 0.2
    wide[500] = 0.25
    assert odds_of(wide, 500) < -1.5
    beside_loud = steady.copy()
    beside_loud[700] = 3.0
    assert odds_of(beside_loud, 500) < odds_of(steady, 500) - 2.0
