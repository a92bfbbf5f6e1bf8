"""What digital silence in a sound is replaced by, against closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from impactsig import Recording, detect_impacts
from impactsig.detect.sound._kernels import EDGE, octave_powers
from impactsig.detect.sound._nearby import greatest_within
from impactsig.detect.sound.deciding._tone_kernels import put_tone_odds
from impactsig.detect.sound.powers._gate_kernels import (
    CLOSED,
    bridge,
    heard_shares,
    hold,
    hold_bands,
    renew_powers,
    silent_frames,
    silent_samples,
    soften,
)
from impactsig.detect.sound.powers.fades import beside_fades, edge_steps


def test_silence_is_a_run_of_frames_without_power():
    power = np.ones((2, 40))
    power[:, 5 : 5 + CLOSED] = 0.0
    power[:, 20 : 19 + CLOSED] = 0.0  # too short
    power[0, 28:] = 0.0  # not in every octave
    out = np.empty(40, np.bool_)
    silent_frames(power, 0, 40, out)
    np.testing.assert_array_equal(np.flatnonzero(out), np.arange(5, 5 + CLOSED))
    silent_frames(power, 6, 40, out)  # what is left of it is too short
    assert not out.any()


def test_silence_reaches_to_the_last_equal_sample():
    x = np.array([1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0])
    out, runs = np.empty(10, np.bool_), np.empty((2, 2), np.int64)
    assert silent_samples(x, np.array([False, False, True, False, False]), 2, out, runs) == 1
    np.testing.assert_array_equal(np.flatnonzero(out), np.arange(2, 8))
    np.testing.assert_array_equal(runs[0], [2, 8])


def test_silences_of_two_levels_without_a_sample_between_them_are_one():
    x = np.repeat([1.0, 0.0, 2.0, 0.0], [3, 5, 6, 2])
    out, runs = np.empty(16, np.bool_), np.empty((8, 2), np.int64)
    silent = np.isin(np.arange(8), [2, 3, 5])  # frame 3 is both
    silent[3] = False
    assert silent_samples(x, silent, 2, out, runs) == 1
    np.testing.assert_array_equal(runs[0], [3, 14])


def test_a_straight_line_is_no_silence():
    silent, out = np.array([False, True, True, False]), np.empty(8, np.bool_)
    assert silent_samples(np.arange(8.0), silent, 2, out, np.empty((2, 2), np.int64)) == 0
    assert not out.any()
    assert not silent.any()


def test_steps_become_ramps_and_clicks_stay():
    x = np.concatenate(([1.1, 1.0], np.zeros(20), [2.0, 2.1], np.zeros(20), [5.0, 0.0]))
    changed = np.zeros(24, np.bool_)
    soften(x, np.array([[2, 22], [24, 44]]), 4, 2, changed)
    np.testing.assert_array_equal(np.flatnonzero(changed), [1, 2, 9, 10, 12, 13])
    np.testing.assert_allclose(x[1:7], [1.0, 0.8, 0.6, 0.4, 0.2, 0.0])
    np.testing.assert_allclose(x[17:23], [0.0, 0.4, 0.8, 1.2, 1.6, 2.0])
    np.testing.assert_allclose(x[24:30], [2.1 * k / 5 for k in (4, 3, 2, 1, 0, 0)])
    assert not x[30:-2].any()


def test_a_short_silence_in_a_slow_wave_becomes_a_straight_line():
    wave = 100.0 * np.cos(0.02 * np.arange(400))
    x, out = wave.copy(), np.empty(400)
    x[150:170] = x[200] = x[20:80] = 0.0  # 60 samples are silence, one is a click
    changed = np.zeros(100, np.bool_)
    assert bridge(x, 4, 1.0, x.min(), x.max(), out, changed) == 1
    np.testing.assert_array_equal(np.flatnonzero(changed), np.arange(150 // 4, 170 // 4 + 1))
    np.testing.assert_allclose(out[149:171], np.linspace(x[149], x[170], 22))
    np.testing.assert_array_equal(np.delete(out, np.s_[150:170]), np.delete(x, np.s_[150:170]))


@pytest.mark.parametrize("what", ["impact", "clipped", "faint", "ends"])
def test_what_is_no_short_silence_stays(what):
    x, step = 100.0 * np.cos(0.02 * np.arange(400)), 1.0
    x[150:170] = 0.0
    if what == "impact":  # digital silence, and a sound of high tones begins
        x[170:] = 100.0 * np.sin(2.0 * np.arange(1, 231))
    elif what == "clipped":
        x[150:170] = x.max()
    elif what == "faint":
        step = 40.0
    else:
        x = x[152:168]
    changed = np.zeros(100, np.bool_)
    assert bridge(x, 4, step, x.min(), x.max(), np.empty(len(x)), changed) == 0
    assert not changed.any()


def bridged_run_by_run(x, longest, step):
    """What `bridge` does, one run of equal samples after the other."""
    out, edges = x.copy(), np.flatnonzero(np.diff(x)) + 1
    for begin, end in itertools.pairwise(edges):
        base = x[begin]
        if not 4 <= end - begin < longest or begin < 4 or end > len(x) - 4:
            continue
        sides = x[begin - 4 : begin][::-1] - base, x[end : end + 4] - base
        if any(np.abs(side).max() <= 3 * step for side in sides):
            continue
        jumps = [(abs(side[0]), abs(side[1] - side[0])) for side in sides]
        if any(jump > 3 * step and change > 0.5 * jump for jump, change in jumps):
            continue
        if x.min() < base < x.max():
            out[begin:end] = np.linspace(x[begin - 1], x[end], end - begin + 2)[1:-1]
    return out


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_silences_are_found_in_vector_lanes_as_one_by_one(seed, kind):
    rng = np.random.default_rng(seed)
    wave = rng.uniform(5.0, 60.0) * np.sin(rng.uniform(0.003, 0.1) * np.arange(3000))
    x = np.clip(np.round(wave), -30, 30)
    for begin in rng.integers(0, 3000, 80):  # some begin at the ends, some touch
        x[begin : begin + rng.integers(2, 30)] = rng.choice([0.0, 3.0, x[begin], x.max()])
    x, out, some = x.astype(kind), np.empty(3000), x[1000:1100]
    changed = np.zeros(1500, np.bool_)
    count = bridge(x, 2, 1.0, some.min(), some.max(), out, changed)
    expected = bridged_run_by_run(x.astype(float), 20, 1.0)
    assert count > 5
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-6 if kind is np.float32 else 1e-12)
    assert changed[np.flatnonzero(out != x) // 2].all()
    assert np.count_nonzero(changed) < 1400


@pytest.mark.parametrize("octaves", [3, 4])
def test_powers_are_renewed_where_samples_have_changed(octaves):
    rng, hop, frames = np.random.default_rng(7), 2**octaves, 600
    x = rng.standard_normal(frames * hop)

    def powers():
        scratch, power = np.empty((3, len(x) // 2)), np.empty((octaves, frames))
        octave_powers(x, octaves, *scratch, power)
        return power, scratch[(octaves + 1) % 2, :frames].copy()

    power, rest = powers()
    changed = np.zeros(frames, np.bool_)
    for begin, end in ((0, 3), (20, 21), (30, 33), (100, 350), (500, 502), (597, 600)):
        changed[begin:end] = True
        x[begin * hop : end * hop] = 0.0
    renew_powers(x, hop, greatest_within(changed, EDGE), power, rest)
    for renewed, expected in zip((power, rest), powers(), strict=True):
        np.testing.assert_array_equal(renewed, expected)


def test_silent_frames_have_the_mean_power_of_the_whole_ones_before():
    power = np.arange(1.0, 21.0)[None].copy()
    silent = np.zeros(20, np.bool_)
    silent[:2] = silent[10:15] = True
    hold(power, silent, 4, np.array([7.0]))
    np.testing.assert_array_equal(power[0, :3], [7.0, 7.0, 3.0])
    np.testing.assert_array_equal(power[0, 10:15], np.mean([6.0, 7.0, 8.0, 9.0]))
    assert power[0, 15] == 16.0


def test_a_steady_sound_has_the_same_power_in_bands_behind_a_gate():
    window = np.hanning(33)[:-1]
    silent = np.zeros(400, np.bool_)
    silent[100:200] = True
    share = np.empty(40)
    heard_shares(silent, 20, 8, window, share)
    squares = np.where(silent, 0.0, 3.0)
    direct = [np.sum(window**2 * squares[20 + 8 * g - 16 :][:32]) for g in range(40)]
    np.testing.assert_allclose(3.0 * share * np.sum(window**2), direct)
    power = np.array(direct)[None]
    hold_bands(power, share, np.diff(share, prepend=1.0) < 0.0, np.zeros(1))
    np.testing.assert_allclose(power, 3.0 * np.sum(window**2))


def test_silence_where_a_window_is_zero_leaves_all_of_it():
    window = np.random.default_rng(5).random(500)
    window[0] = 0.0
    silent = np.zeros(2000, np.bool_)
    silent[750] = True  # the first sample of the window about 1000
    share = np.empty(1)
    heard_shares(silent, 1000, 1, window, share)
    assert share[0] == 1.0


def test_a_low_tone_behind_a_gate_is_compared_with_what_is_audible_as_well():
    g, shut = np.full(1001, 8.0), np.arange(1001) % 3 > 0  # two thirds of the time
    g[500] = 100.0
    crest, weak, b = np.array([500]), np.zeros(0, int), np.full(1001, 0.05)
    least, gated, ungated = np.full(1, -np.inf), np.empty(1), np.empty(1)
    put_tone_odds(crest, weak, g, b, shut & False, 400, least, ungated)
    shut[500] = False
    put_tone_odds(crest, weak, np.where(shut, 0.0, g), b, shut, 400, least, gated)
    np.testing.assert_allclose(gated - ungated, 5.4 * 0.5 * (np.log(8 + 5) - np.log(0 + 5)))


def test_edges_of_silence_are_compared_with_what_is_8_ms_farther():
    audible = np.zeros(90, np.bool_)
    audible[10:25] = audible[40:43] = audible[70:90] = True  # the second one is too short
    power = np.full((2, 90), 2.0)
    power[:, 10] = [0.5, 0.125]  # a mean over octaves of ln 8 less
    power[:, 24] = 16.0
    power[:, 73] = 0.0  # nothing to compare with
    opening, closing = edge_steps(power, audible, 8e-3 / 3)
    np.testing.assert_allclose(opening, [-np.log(8.0)])
    np.testing.assert_allclose(closing, [np.log(8.0)])
    assert [len(side) for side in edge_steps(power[:, :11], audible[:11], 8e-3)] == [0, 0]
    assert [len(side) for side in edge_steps(power[:, :1], audible[:1], 8e-3)] == [0, 0]


@pytest.mark.parametrize(("ratio", "expected"), [(3.9, False), (4.1, True)])
def test_a_gate_fades_where_most_edges_are_softer_by_a_factor_of_four(ratio, expected):
    audible = np.arange(100) % 50 > 20
    steps, none = -np.log([ratio, ratio, 1e-3]), np.zeros(9)
    assert (beside_fades((steps, none), audible, ~audible, 5e-3) is not None) is expected
    assert (beside_fades((none, steps), audible, ~audible, 5e-3) is not None) is expected
    assert beside_fades((steps[:2], none), audible, ~audible, 5e-3) is None  # too few


def test_the_background_is_read_far_from_fades_where_enough_is_left():
    def kept(count, opening=-2.0, closing=-2.0):
        audible = np.zeros(400, np.bool_)
        for begin in range(20, 340, 60):
            audible[begin : begin + count] = True
        steps = np.full(3, opening), np.full(3, closing)
        beside = beside_fades(steps, audible, ~audible, 5e-3)
        return None if beside is None else np.flatnonzero(audible & ~beside) - 20

    np.testing.assert_array_equal(kept(30, opening=0.0)[:20], np.arange(20))  # 50 ms before
    np.testing.assert_array_equal(kept(30, closing=0.0)[:20], np.arange(10, 30))  # and after
    np.testing.assert_array_equal(kept(30)[:20], np.r_[10:20, 70:80])  # 50 ms away
    np.testing.assert_array_equal(kept(20)[:10], np.arange(5, 15))  # 25 ms
    assert kept(8) is None  # too little would be left


@pytest.mark.parametrize("sides", ["both", "closing"])
def test_a_gate_that_fades_over_tens_of_milliseconds_makes_no_impacts(sides):
    rng = np.random.default_rng(5)
    rate, beats = 22050, np.arange(0.5, 11.5, 0.7)
    t = np.arange(12 * rate) / rate
    x, open_ = 1e-3 * rng.standard_normal(len(t)), np.zeros(len(t))
    for beat in beats:
        later = np.maximum(t - beat, 0.0)
        x += np.exp(-later / 0.01) * np.sin(2 * np.pi * 3000 * later)
    for middle in np.concatenate((beats, beats + 0.35)):  # half of the time, noise alone
        open_[(t > middle - 0.06) & (t < middle + 0.16)] = 1.0
    if sides == "both":
        window = np.hanning(2 * round(0.04 * rate) + 1)
        gain = np.convolve(open_, window / window.sum(), "same")
        gain[gain < 1e-3] = 0.0
    else:  # 40 with a median over both sides
        gain = np.maximum(
            1.0 - (t - np.maximum.accumulate(np.where(open_ > 0.0, t, -1.0))) / 0.06, 0.0
        )
    found = detect_impacts(Recording(x * gain, rate=rate, sensor="sound"))
    assert len(found) == len(beats)  # 40 with a background that is read from what fades
    np.testing.assert_allclose(found.time, beats, atol=1e-3)
