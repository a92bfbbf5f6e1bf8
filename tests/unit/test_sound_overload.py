"""Sound that an overloaded microphone or converter had pushed aside."""

from __future__ import annotations

import mir_eval
import numpy as np
import pytest
import soundfile

from impactsig.detect.sound._kernels import GROUP
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound.deciding.overload import (
    CROWD,
    EVEN,
    NONE,
    OCTAVES,
    SLOPE,
    TOGETHER,
    Overload,
    may_be_edges,
)
from impactsig.detect.sound.powers.bands import Spectrum, bands_at
from tests.unit.test_detect_sound import detect, group_starts, onsets

RATE = 22_050.0


@pytest.mark.parametrize("overload", ["soft", "hard"])
def test_edges_of_an_overload_are_no_strokes(shared_data, overload):
    scores = []
    for name in ("Hendrix", "Reggae"):
        x, rate = soundfile.read(shared_data(f"audio_onsets/mdb/{name}.flac"))
        x /= np.abs(x).max()
        loud = np.tanh(6.0 * x) if overload == "soft" else np.clip(2.0 * x, -1.0, 1.0)
        time = detect(loud, rate).time
        truth = onsets(shared_data(f"audio_onsets/mdb/{name}_class.txt"))
        found = time[group_starts(time, 0.03)]
        scores.append(mir_eval.onset.f_measure(truth, found, window=0.025)[0])
    assert np.mean(scores) >= 0.89  # 0.78 and 0.87 otherwise


def odds_of_each(x: np.ndarray, places: list[float], asked: list[bool]) -> np.ndarray:
    scale = scale_at(RATE)
    spectrum = Spectrum(bands_at(RATE, GROUP * scale.hop))
    limits = float(x.min()), float(x.max())
    overload = Overload(limits, spectrum, scale, RATE)
    for part in np.array_split(np.arange(len(places)), 3):  # as from several windows
        overload.add(x, np.array(places)[part], np.array(asked, bool)[part])
    return overload.odds()


def odds_of(x: np.ndarray, place: float, *, asked: bool = True) -> float:
    return float(odds_of_each(x, [place], [asked])[0])


def test_only_new_sound_counts_near_the_limits():
    rng = np.random.default_rng(3)
    t = np.arange(round(0.4 * RATE)) / RATE
    tone = np.sin(2 * np.pi * 60.0 * t)  # beyond 0.8 for 41 % of the time
    steady = tone + 0.002 * rng.standard_normal(len(t))
    place = len(t) // 2 + 0.5
    fading = tone + 0.02 * np.exp(-t / 0.03) * rng.standard_normal(len(t))
    assert odds_of(fading, place) == pytest.approx(SLOPE * np.log(NONE / EVEN), abs=0.5)
    louder = steady + 0.02 * (t >= 0.2) * rng.standard_normal(len(t))
    # 20 dB in nearly all bands: N is ln 100, less what the greatest of more frames is above it
    assert odds_of(louder, place) == pytest.approx(SLOPE * np.log(np.log(100.0) / EVEN), abs=1.0)
    assert odds_of(steady + 5.0, place) == pytest.approx(odds_of(steady, place), abs=0.1)
    assert odds_of(steady, place, asked=False) == np.inf
    assert odds_of(0.01 * rng.standard_normal(len(t)), place) == np.inf  # far from the limits
    assert odds_of(steady, 300.5) == np.inf  # too little before it


def test_dense_impacts_and_those_that_octaves_show_are_not_asked():
    sparse = np.arange(20) * 0.1
    shown = np.where(np.arange(20) % 2 == 0, OCTAVES, 0.5 * OCTAVES)
    assert np.array_equal(may_be_edges(sparse, shown), shown < OCTAVES)
    dense = np.arange(4 * CROWD) * 0.02
    assert not may_be_edges(dense, np.zeros(len(dense)))[CROWD:-CROWD].any()


def test_rises_have_the_odds_that_each_has_alone():
    rng = np.random.default_rng(5)
    t = np.arange(round(1.0 * RATE)) / RATE
    loud = (t < 0.7) * np.sin(2 * np.pi * 60.0 * t)  # far from the limits afterwards
    x = loud + 0.003 * np.exp(3.0 * np.sin(40.0 * t)) * rng.standard_normal(len(t))
    places = [10.5, *(RATE * np.array([0.1, 0.13, 0.131, 0.4, 0.5, 0.85]) + 0.5), len(t) - 300.5]
    asked = [True, True, True, True, False, True, True, True]
    together = odds_of_each(x, places, asked)
    pairs = zip(places, asked, strict=True)
    alone = [odds_of(x, place, asked=one) for place, one in pairs]
    np.testing.assert_allclose(together, alone, rtol=1e-12)
    assert np.isfinite(together).tolist() == [False, True, True, True, False, True, False, False]
    assert np.unique(together).size == 5
    many = TOGETHER // 2  # more than wait at a time
    again = odds_of_each(x, many * places, many * asked)
    np.testing.assert_allclose(again, np.tile(alone, many), rtol=1e-12)
