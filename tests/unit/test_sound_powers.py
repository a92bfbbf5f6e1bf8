"""Rules by which powers of a sound are read, each just beside where it changes a result."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound._cores import Backgrounds
from impactsig.detect.sound._growth_kernels import add_powers
from impactsig.detect.sound._kernels import GROUP, octave_powers
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound.powers._gate_kernels import hold_bands
from impactsig.detect.sound.powers.bands import Spectrum, bands_at
from impactsig.detect.sound.powers.gate import Gate
from impactsig.detect.sound.powers.holes import falls_of, has_holes
from impactsig.detect.sound.powers.hum import bands_below, crests_at, high_pass, hum_bands

RATE = 22_050.0
SCALE = scale_at(RATE)
HOP = GROUP * SCALE.hop
BANDS = bands_at(RATE, HOP)


@pytest.mark.parametrize("frequency", [400.0, 600.0])
def test_crests_of_a_tone_are_four_times_its_power_in_the_octaves(frequency):
    tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency / RATE * np.arange(1 << 14))
    power = np.empty((SCALE.octaves, len(tone) // SCALE.hop))
    octave_powers(tone, SCALE.octaves, *np.empty((3, len(tone) // 2)), power)
    expected = 4.0 * power[:, 100:-100].mean(axis=1)
    in_bands = Spectrum(BANDS).powers(tone, 4096, 9)[:, 4]
    np.testing.assert_allclose(crests_at(SCALE, RATE, HOP) @ in_bands, expected, rtol=0.1)


# Of a background of 1, twice counts: crests of 1.3 above the lowest band are heard, of 0.9 not.
@pytest.mark.parametrize(
    ("bands", "stopped"),
    [
        ([5.0, 0.4, 0.9, 0.0], 2),
        ([5.0, 0.4, 1.1, 0.0], 3),
        ([0.6, 0.4, 0.9, 0.0], 0),  # together less than twice
        ([5.0, 0.4, 0.9, 4.9], 2),
        ([5.0, 0.4, 0.9, 5.1], 0),  # pulses within the octaves, which no filter separates
    ],
)
def test_no_more_bands_are_stopped_than_hum_is_heard_in(bands, stopped):
    crests = np.array([[1.0, 1.0, 1.0, 1.0], [0.1, 0.1, 0.1, 0.1]])
    assert hum_bands(np.ones(2), np.array(bands), crests, 3) == stopped


def test_the_filter_before_the_octaves_is_no_longer_than_for_150_hz():
    below = bands_below(SCALE, RATE, HOP)  # the highest of these is nearer to the octaves
    taps = high_pass(SCALE, RATE, BANDS, below)
    kaiser = (90.0 - 7.95) / (2.285 * 2.0 * np.pi * 150.0 / RATE) + 1.0
    assert len(taps.taps) == pytest.approx(kaiser, abs=2.0)


def test_gates_open_and_close_within_4_ms():
    gate, frames = Gate(SCALE, RATE, BANDS), 400
    gate.begin()
    x = np.cos(2.0 * np.pi * 300.0 / RATE * np.arange(frames * SCALE.hop))
    begin, end = 150 * SCALE.hop, 250 * SCALE.hop
    x[begin:end] = 0.0
    power = np.empty((SCALE.octaves, frames))
    octave_powers(x, SCALE.octaves, *np.empty((3, len(x) // 2)), power)
    ramped, _ = gate.octaves(x, power, (0, frames), frames)
    changed = np.flatnonzero(ramped != x)
    ramp = round(4e-3 * RATE)
    np.testing.assert_array_equal(changed, [*range(begin, begin + ramp), *range(end - ramp, end)])


def test_a_gate_that_opens_in_the_next_window_does_not_close_there():
    gate, left = Gate(SCALE, RATE, BANDS), len(BANDS.window)
    gate.begin()
    power = np.ones((len(BANDS.first), 4))
    gate.silent = np.ones(2 * left + 4 * HOP, np.bool_)
    assert not gate.fill_narrow(power, left)[1:].any()
    gate.silent = np.zeros(2 * left + 4 * HOP, np.bool_)
    gate.silent[:left] = True  # to the middle of the first frame
    assert not gate.fill_narrow(power, left).any()
    gate.silent[:] = ~gate.silent
    assert gate.fill_narrow(power, left)[0]


@pytest.mark.parametrize(("share", "held"), [(0.12, 10.0), (0.08, 3.0)])
def test_less_than_a_tenth_of_a_window_tells_no_power(share, held):
    power = np.array([[share * 10.0]])
    last = np.array([3.0])
    hold_bands(power, np.array([share]), np.array([True]), last)
    assert last[0] == pytest.approx(held)
    assert power[0, 0] == pytest.approx(share * 10.0 + (1.0 - share) * held)


def test_holes_are_one_in_a_hundred_deep_falls_beside_rises():
    assert has_holes(1000, 11, 1)
    assert not has_holes(1000, 9, 9)
    assert not has_holes(100_000, 1001, 5)


@pytest.mark.parametrize(("count", "counted"), [(2, 0), (3, 3)])
def test_falls_count_from_one_in_a_thousand_on(count, counted):
    means = np.ones((40, 101))
    means[: 2 * count : 2, -1] = 1e-5  # every other band, of 20 x 100 pairs
    assert falls_of(means, np.ones(101, np.bool_))[:2] == (2000, counted)


def test_sounds_of_any_strength_have_powers():
    x = np.random.default_rng(6).standard_normal(4096)
    plain, faint = (Spectrum(BANDS).powers(one, 2048, 3) for one in (x, 2.0**-400 * x))
    np.testing.assert_array_equal(faint, 2.0**-800 * plain)


def test_the_strongest_of_a_second_on_either_side_is_nearby():
    found = Backgrounds(SCALE, RATE, BANDS)
    block = 8 * HOP / RATE
    assert found.nearby == round(1.0 / block)
    assert found.within == round(4.0 / block)


def test_sounds_that_are_not_whole_or_silent_add_no_power():
    sounds = np.array([[9.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0], [9.0, 4.0, 0.0, 2.0]])
    total = np.zeros(3)
    assert add_powers(sounds, np.array([1, 1, 2]), 1, total) == 1  # over the energy of 2 and 3
    np.testing.assert_allclose(total, np.array([1.0, 4.0, 9.0]) / 13.0)
    assert add_powers(sounds, np.array([-1, -1, 1]), 0, total[:1]) == 1
    assert total[0] == pytest.approx(1.0 / 13.0 + 1.0)
