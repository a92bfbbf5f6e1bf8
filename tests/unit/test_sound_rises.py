"""Rises in one octave: low tones, and power that swells."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.recordings import score
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound._kernels import BLOCK, STEP, octave_rise
from impactsig.detect.sound._rise_kernels import OctaveMeans, low_likelihood, rise_likelihood
from impactsig.detect.sound._rises import clear_ratio
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound.deciding._rise_odds import high_crests
from impactsig.detect.sound.deciding._rise_odds_kernels import find_higher, judge_rises
from impactsig.detect.sound.sound import detect_sound

RATE = 22_050.0


def detect(x, rate=RATE, **options):
    return detect_sound(lambda: [Piece(0, x)], rate, **options)


# 0.87 and 0.93 by octaves above 1.4 kHz and narrow bands, at 400 Hz; now 0.943 and 0.976.
@pytest.mark.parametrize(("tone", "decay", "least"), [(900.0, 4e-3, 0.99), (400.0, 5e-3, 0.94)])
@pytest.mark.parametrize("rate", [11_025.0, 44_100.0])
def test_low_tones_that_die_within_milliseconds_are_found(tone, decay, least, rate):
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.08, 0.3, 100))
    x = 0.1 * rng.standard_normal(round((time[-1] + 0.3) * rate))
    for start in time:
        first = int(np.ceil(start * rate))
        since = np.arange(first, first + round(8 * decay * rate)) / rate - start
        x[first : first + len(since)] += np.exp(-since / decay) * np.sin(
            2 * np.pi * tone * since + rng.uniform(0, 2 * np.pi)
        )
    found = detect(x, rate)
    assert score(found.time, time, 10e-3)[0] >= least


# 32 to 134 by rises in narrow bands alone.
@pytest.mark.parametrize(("rate", "pace"), [(8000, 1.5), (22_050, 1.5), (22_050, 4.0)])
def test_noise_that_swells_has_hardly_any_impacts(rate, pace):
    rng = np.random.default_rng(6)
    t = np.arange(30 * rate) / rate
    x = rng.standard_normal(len(t)) * (1.0 + 0.7 * np.sin(2 * np.pi * pace * t))
    assert len(detect(x, float(rate)).time) <= 4


@pytest.mark.parametrize(("past", "forward"), [(8, 8), (11, 11), (3, 12), (1, 1)])
def test_rise_of_the_octaves_by_its_definition(past, forward):
    rng = np.random.default_rng(8)
    frames, left, octaves = 1203, 20, 3
    power = (
        rng.exponential(1.0, (octaves, frames + 60))
        * np.repeat(rng.choice([1e-9, 1.0, 9.0], (octaves, 80)), 16, axis=1)[:, : frames + 60]
    )
    power[1, 300:420] = 0.0
    level = rng.uniform(0.1, 1.0, (octaves, -(-frames // BLOCK)))
    level[1, 3] = 0.0  # where all is 0 nothing rises
    weights, scale = np.array([0.5, 0.3, 0.2]), scale_at(RATE)._replace(past=past, forward=forward)
    after, out = np.empty((octaves, frames)), np.empty(frames)
    every = np.empty((2, octaves, -(-frames // STEP)))
    octave_rise(power, left, scale, level, weights, after, every, out)
    falling = np.arange(forward, 0, -1) / np.arange(forward + 1).sum()
    before, expected = np.empty((octaves, frames)), np.zeros(frames)
    for j in range(frames):
        now = power[:, left + j : left + j + forward] @ falling
        before[:, j] = power[:, left + j - past : left + j].mean(axis=1)
        np.testing.assert_allclose(after[:, j], now, rtol=1e-12)
        base = np.maximum(before[:, j], 2.0 * level[:, j // BLOCK])
        some = (now > base) & (base > 0.0)
        expected[j] = weights[some] @ np.log(now[some] / base[some])
    assert 0.1 < (expected > 0.0).mean() < 0.95
    np.testing.assert_allclose(out, expected, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(every, np.stack((after, before))[:, :, ::STEP], rtol=1e-12)


NO_LOW_OCTAVES = np.empty(0, np.int64), np.empty(0, np.int64)


# A sound that rings on is itself the median that its rise is compared with: F1 of 0.22 to 0.9
# before.
@pytest.mark.parametrize("seed", [11, 12, 14, 16])
def test_strikes_that_ring_for_half_a_second_are_found(seed):
    rng, rate = np.random.default_rng(seed), 8000.0
    time = 0.2 + np.cumsum(rng.uniform(0.7, 1.3, 16))
    x = 0.1 * rng.standard_normal(round((time[-1] + 1.0) * rate))
    for start in time:
        first = int(np.ceil(start * rate))
        since = np.arange(first, len(x)) / rate - start
        for tone, decay in ((1480.0, 0.45), (2730.0, 0.3)):
            phase = 2 * np.pi * (tone * since + rng.random())
            x[first:] += np.exp(-since / decay) * np.sin(phase)
    assert score(detect(x, rate).time, time, 10e-3)[0] >= 0.95


def test_likelihood_of_a_step_in_power():
    # Power 1 and then 5: F reaches 5 at the step, and A is 1.
    power, width, freedom = np.where(np.arange(96) < 48, 1.0, 5.0), 4, 7.0
    expected = 0.5 * freedom * (5.0 - 1.0 - np.log(5.0))
    out, quiet = np.zeros(2 * 128 // STEP), np.zeros(8)
    low_likelihood(power, 16, 4, width, quiet, 0, 1.0, np.full(2, 0.5), freedom, 2.0, out)
    assert np.argmax(out) == 48 - 16  # a coefficient a cell
    assert out[48 - 16] == pytest.approx(expected)
    assert out[: 48 - 16 - width].max() == 0.0  # nothing rises
    every, one = np.array([[np.full(128 // STEP, 5.0)], [np.full(128 // STEP, 1.0)]]), np.ones(1)
    for background, rise in ((0.5, 5.0), (2.0, 2.5)):  # less than what was before is none
        out = np.zeros(128 // STEP)
        least = np.array([[background]])
        means = OctaveMeans(*NO_LOW_OCTAVES, one, freedom * one, 2.0 * one)
        rise_likelihood(every, np.empty((0, 0)), 0, quiet[None], 0, least, means, out)
        np.testing.assert_allclose(out, 0.5 * freedom * (rise - 1.0 - np.log(rise)))


def test_clear_rises_are_held_against_the_median_of_parts():
    rng = np.random.default_rng(0)
    parts, bias, freedom = rng.exponential(2.0, (1, 40)), np.array([0.5]), np.array([7.0])
    every = np.array([[np.full(1024 // STEP, 50.0)], [np.full(1024 // STEP, 1.0)]])
    least = np.full((1, 8), 0.1)
    clear = clear_ratio(*freedom)
    assert 3.5 * (clear - 1.0 - np.log(clear)) == pytest.approx(3.0)
    out, low = np.zeros((2, 1024 // STEP)), np.zeros(1024 // STEP)
    means = OctaveMeans(*NO_LOW_OCTAVES, bias, freedom, clear)
    fixed = every, np.empty((0, 0)), 0, parts, 4, least
    rise_likelihood(*fixed, means, out[0])
    rise_likelihood(*fixed, means._replace(clear=51.0 * clear), out[1])
    power = np.where(np.arange(300) % 2, 1.0, 60.0)  # F is 34 or 27
    low_likelihood(power, 16, 4, 4, parts[0], 4, 0.5, least[0], 7.0, float(clear[0]), low)
    for k in range(8):
        about = [parts[0, min(max(4 + 4 * k - 6 + i, 0), 39)] for i in range(16)]
        usual = max(2.0 * np.sort(about)[8], 1.0)
        assert usual > 1.0
        expected = 3.5 * (50.0 / usual - 1.0 - np.log(50.0 / usual))
        np.testing.assert_allclose(out[0, 32 * k : 32 * k + 32], expected)
    assert (out[1] == 0.0).all()  # nothing is clear
    assert (low == 0.0).all()  # what was before is nearly as strong


def test_crests_of_h_are_judged_by_what_is_near():
    seconds, groups = 1e-3, 400
    h, b, known = np.zeros(4 * groups), np.full(groups, 0.05), np.ones(groups, bool)
    frame = np.arange(200, 6400, 200)  # evident impacts, five a second
    odds = np.full(len(frame), 6.0)
    h[frame // STEP] = 200.0
    h[[330, 1000, 1010]] = 60.0, 200.0, 40.0  # alone, on an impact, 40 ms after one

    def judged(frame, odds, h, b, known):
        crest = high_crests(h, seconds)
        turned, own, at = np.empty(len(frame)), np.empty(len(crest)), np.empty_like(crest)
        rattle, none = np.zeros(len(h) * STEP // BLOCK + 1), np.empty(0)
        number = judge_rises(
            frame, odds, none.astype(int), none, 0.0, h, crest, b, known, rattle, seconds,
            turned, at, own,
        )  # fmt: skip
        return turned, at[:number].tolist(), own[:number].tolist()

    turned, at, own = judged(frame, odds, h, b, known)
    assert at == [1320, 4040]
    assert own[0] > 0.0 > own[1]
    assert (turned > 0.0).all()
    # Beside digital silence nothing is known, and nothing changes.
    turned, at, _ = judged(frame, odds, h, b, ~known)
    assert (turned == odds).all()
    assert not at
    turned, at, _ = judged(frame[:0], odds[:0], h[:8], b[:2], known[:2])
    assert not len(turned)
    assert not at


@pytest.mark.parametrize(
    ("change", "moves"),
    [
        ({}, True),
        ({"b": 0.32}, False),  # nothing rises in narrow bands
        ({"odds": -0.1}, False),
        ({"known": False}, False),
        ({"here": 26.0}, False),  # the other crest is no four times as high
        ({"height": 0.3}, False),  # C exceeds noise here
        ({"steps": 5}, False),  # 20 ms away
    ],
)
def test_likely_impacts_in_narrow_bands_belong_to_a_high_crest_of_h(change, moves):
    case = {"b": 0.4, "odds": 0.1, "known": True, "here": 24.0, "height": 0.1, "steps": 4} | change
    h, frame = np.zeros(400), np.array([800])
    h[200], h[200 + case["steps"]] = case["here"], 100.0
    b, known = np.full(100, case["b"]), np.full(100, case["known"])
    place, height = np.array([790, 800]), np.array([0.3, case["height"]])
    crest, there = high_crests(h, 1e-3), np.empty(1, np.int64)
    found = find_higher(
        frame, np.full(1, case["odds"]), place, height, 0.2, h, crest, b, known, 1e-3, there
    )
    assert found == moves
