"""Noise that swells again and again, impacts among it, and pulses of the mains."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.recordings import microphone, score
from benchmarks.sound_timing import MODES, band_limited
from benchmarks.varied_sound import result
from impactsig.detect.sound.deciding.beside import PowersBeside
from impactsig.detect.sound.deciding.notes import mains_notes
from impactsig.detect.sound.deciding.swells import (
    CROWD,
    EDGES,
    STEEP,
    SWELLS,
    crowds,
    most_odds,
    sharpness,
)
from tests.unit.test_detect_sound import detect


def swelling(rate: float, pace: float) -> np.ndarray:
    rng = np.random.default_rng(5)
    t = np.arange(round(8 * rate)) / rate
    return rng.standard_normal(len(t)) * (1.0 + 0.8 * np.sin(2 * np.pi * pace * t))


# Each swelling was an impact, without a note.
def test_noise_that_swells_50_times_a_second_is_hardly_an_impact():
    noise = swelling(44_100.0, 50.0)
    found, few = (detect(noise, 44_100.0, least_probability=p) for p in (0.5, 0.95))
    assert len(found.time) <= 4  # 401
    assert any("swells" in note for note in found.notes)
    assert set(few.time) <= set(found.time)


def test_impacts_among_swellings_are_found():
    truth = microphone(duration=8.0, rate=44_100.0, mean_rate=6.0, noise_db=-60.0, seed=8)
    noise = swelling(truth.rate, 50.0)
    found = detect(truth.samples + 0.05 * noise / noise.std(), truth.rate)
    assert score(found.time, truth.time, 5e-3)[0] >= 0.93  # 0.26 with the swellings


def test_dense_faint_impacts_are_no_swellings():
    truth = microphone(duration=8.0, mean_rate=28.0, noise_db=-6.0, seed=8)
    found = detect(truth.samples, truth.rate)
    assert score(found.time, truth.time, 10e-3)[0] >= 0.92
    assert not any("swells" in note for note in found.notes)


# The filter rings for milliseconds before and after: 31 of 200 were left.
def test_clear_impacts_behind_a_filter_are_no_swellings():
    truth = band_limited(8000, "decimate", 49.0, 15_001, modes=MODES["five"], count=60)
    found = detect(truth.samples, truth.rate)
    assert score(found.time, truth.time, 3e-3)[0] >= 0.98
    assert not any("swells" in note for note in found.notes)


# The clear impacts before and after must not hide that these attacks are uncertain.
def test_noise_that_swells_for_three_seconds_is_told_among_dense_impacts():
    truth = microphone(duration=12.0, rate=44_100.0, mean_rate=15.0, noise_db=-60.0, seed=9)
    noise = np.zeros(len(truth.samples))
    begin, end = round(5.0 * truth.rate), round(8.0 * truth.rate)
    noise[begin:end] = 0.05 * swelling(truth.rate, 50.0)[: end - begin]
    found = detect(truth.samples + noise, truth.rate).time
    inside = (t[(t > 5.0) & (t < 8.0)] for t in (found, truth.time))
    assert score(*inside, 5e-3)[0] >= 0.9  # 0.70 where the median of 3 s was asked


# Some 27 a second, whose innovations hardly rise.
@pytest.mark.parametrize(("seed", "disturbance"), [(55_000, "1/f noise"), (56_000, "drift")])
def test_impacts_that_ring_into_each_other_are_no_swellings(seed, disturbance):
    found = result(seed, disturbance)
    assert found.missed <= 0.2 * found.total  # half and more with a bound of R - 0.5


def test_sharpness_against_sums_by_hand():
    rng, rate, lag, slope = np.random.default_rng(2), 8000.0, 3, 2
    x = rng.standard_normal(370)
    attack = np.array([90.5, 201.5, 4.5, 369.5])

    def sharpness_of(x: np.ndarray, attack: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        beside = PowersBeside(EDGES, rate, (lag, slope), beyond=True)
        for some in (attack[:1], attack[1:]):
            beside.add(x, some, np.ones(len(some), bool))
        return sharpness(beside.powers(), rate)

    told, rise = sharpness_of(x, attack)

    def power(first: int, last: int) -> float:
        y = [
            x[i] - x[i - lag] - lag / slope * (x[i - lag] - x[i - lag - slope])
            for i in range(first, last)
        ]
        return float(np.mean(np.square(y)))

    for k, at in enumerate((91, 202)):
        sudden = np.log(power(at, at + 8) / power(at - 8, at))
        slow = np.log(power(at + 8, at + 32) / power(at - 32, at - 8))
        expected = sudden - 0.2 * max(slow, 0.0) - 0.6 - 1.7 / np.sqrt(8.0)
        assert told[k] == pytest.approx(expected, abs=1e-9)
        assert rise[k] == pytest.approx(slow, abs=1e-9)
    # Beyond the ends the first and the last sample go on.
    longer = np.concatenate((np.full(50, x[0]), x, np.full(50, x[-1])))
    again, _ = sharpness_of(longer, attack + 50.0)
    np.testing.assert_allclose(again, told, rtol=1e-12)
    step = np.where(np.arange(370) < 190, 1.0, 100.0) * x  # 9.2 neper at once
    expected = 0.8 * np.log(1e4) - 1.2
    found, _ = sharpness_of(step, np.array([189.5]))
    assert found == pytest.approx([expected], abs=1.5)


def test_only_a_crowd_of_gradual_rises_is_turned():
    instant = np.arange(200) / 25.0
    assert crowds(instant)[50]
    assert not crowds(60.0 / CROWD * instant).any()
    likely, sharp, rise = np.ones(200, bool), np.full(200, SWELLS - 0.1), np.full(200, 1.5)
    sharp[::5] = 3.0  # impacts among them
    most = most_odds(instant, likely, sharp, rise)
    assert (most[::5] == 8.0).all()
    assert (most[1::5] < 0.0).all()
    for others in (
        (likely, sharp + 0.2, rise),  # sudden
        (likely, sharp, 0.5 * rise),  # low tones
        (likely, sharp, rise + STEEP),  # smeared impacts
        (likely, np.full(200, np.nan), np.full(200, np.nan)),
        (sharp > 1.0, sharp, rise),  # unlikely rises are noise, and say nothing of the others
    ):
        assert np.isinf(most_odds(instant, *others)).all()
    sparse = most_odds(3.0 * instant, likely, sharp, rise)  # no more than CROWD near
    assert np.isinf(sparse).all()


@pytest.mark.parametrize(
    ("pace", "noted"), [(50.0, True), (60.0, True), (20.0, False), (57, False)]
)
def test_a_train_at_the_mains_is_noted(pace, noted):
    time = np.arange(100) / pace + 1e-5 * np.random.default_rng(0).standard_normal(100)
    assert bool(mains_notes(time)) == noted
    assert not mains_notes(time[:20])
