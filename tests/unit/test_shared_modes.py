"""Impacts of shared modes behind a linear-phase filter: timed by how a sound begins there."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, signal

from benchmarks import sound_errors, sound_timing, strange_sounds
from benchmarks.recordings import coloured, microphone, score
from benchmarks.sound_timing import MODES, band_limited, crossing
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound.sound import detect_sound
from impactsig.detect.sound.timing._edge import (
    NO_FILTER,
    causal,
    chebyshev,
    cliff,
    high_pass,
    responses,
    slope,
    whitening,
)
from impactsig.detect.sound.timing._edge_kernels import PARTS, step_modes
from impactsig.detect.sound.timing._shared_exponents import (
    RINGS,
    SharedExponents,
    no_rings,
    with_rings,
)
from impactsig.detect.sound.timing._shared_modes_fit import CLOSE, OWN, PRIORS, Behind
from impactsig.detect.sound.timing._shared_modes_kernels import (
    FINE,
    add_rings,
    crossings,
)
from impactsig.detect.sound.timing._shift_kernels import (
    Search,
    Shifts,
    log_probabilities,
    most_probable,
)
from impactsig.detect.sound.timing.shared_modes import LEARN, SharedModes
from tests import naive_sound

RATE = 8000.0
EXPONENTS = np.array([-1 / 48 + 2j * np.pi * 2140 / RATE, -1 / 32 + 2j * np.pi * 3710 / RATE])
STOPPED = ((2100.0, 5e-3, 1.0), (3700.0, 4e-3, 0.8), (5900.0, 3e-3, 0.6))
APART = 3e-3  # [s], within which a sound that is found is that of an impact
NONE = np.array([0.0, 1.0, 0.0])  # taps that pass everything


def detect(x, rate):
    return detect_sound(lambda: [Piece(0, np.asarray(x))], rate)


def apart(exponents, response, taps, first, last):
    """Modes, and what lies beyond them, PARTS values to a sample."""
    modes, columns = step_modes(exponents, response, taps, first, last)
    values = columns.transpose(1, 2, 0).reshape(columns.shape[1], -1)
    count = PARTS * (last - first) + 1
    assert not values[:, count:].any()
    assert not values[modes + 2 :].any()
    return values[:modes, :count], values[modes : modes + 2, :count]


def model_of(exponents, response, taps, noise=0.0, rate=RATE):
    """Modes behind a filter, in sounds that have passed that of the taps."""
    return Behind(taps, float(np.sum(taps**2)), rate, noise)(exponents, response)


def exponents_of(sounds, guess, noise):
    """Those that sounds may share, the first few and the others by themselves."""
    rings = with_rings(no_rings(RATE, RINGS[0]), sounds[:8], guess[:8], RATE)
    found = SharedExponents(with_rings(rings, sounds[8:], guess[8:], RATE), noise)
    return ([] if found.first is None else [found.first, *found.weaker]), found.folded


def learned(truth):
    """What shared modes make of a record, and the error of each instant [s]."""
    found = detect(truth.samples, truth.rate)
    f1, _, pairs = score(found.time, truth.time, APART)
    assert f1 > 0.99
    right, true = pairs.T
    # No impact is found twice. What noise elsewhere is taken for has no instant to be judged.
    beside = np.delete(found.time, right)[:, None] - truth.time
    assert (np.abs(beside) > APART).all()
    found = found._replace(time=found.time[right], time_error=found.time_error[right])
    return found, found.time - truth.time[true]


# The numbers that are wanted, on modes and seeds that nothing was chosen on.


DECIMATORS = ("resample", "resample_poly", "decimate", "sox")
SCATTERS = ((49.0, 60, "five"), (20.0, 75, "three"))


@pytest.mark.parametrize(
    ("rate", "decimator", "noise", "most", "modes"),
    [
        # Each decimator with each noise at one rate; the other rates are slow.
        pytest.param(rate, decimator, *one, marks=() if (i + j + k) % 3 == 0 else pytest.mark.slow)
        for i, rate in enumerate((8000, 11_025, 16_000))
        for j, decimator in enumerate(DECIMATORS)
        for k, one in enumerate(SCATTERS)
    ],
)
def test_scatter_behind_common_decimators(rate, decimator, noise, most, modes):
    truth = band_limited(rate, decimator, noise, 201, modes=MODES[modes], count=120)
    found, off = learned(truth)
    assert 1e6 * np.std(off) <= most
    assert abs(np.mean(off)) < 0.5 / rate
    if noise < 30:  # in less noise the errors of the model decide
        scaled = (off - np.median(off)) / found.time_error
        assert 0.5 < np.sqrt(np.mean(scaled**2)) < 1.6


def test_six_modes_are_learned_from_longer_rings():
    frequencies = 1200.0, 1750.0, 2300.0, 2800.0, 3300.0, 3700.0
    modes = [(one, 7.2 / one, 1.0 - 0.5 * k / 5) for k, one in enumerate(frequencies)]
    truth = band_limited(8000, "sox", 20.0, 202, modes=modes, count=100)
    found, off = learned(truth)
    assert 1e6 * np.std(off) < 90  # 150 and more by attacks
    assert 0.5 < np.std(off / found.time_error) < 1.6


# Modes that are nearly shared, and those of one mode each in a room: 2.1 and 2.3 by models.
@pytest.mark.parametrize("seed", [886_018, 889_123])
def test_modes_that_are_not_shared_are_not_learned_from_longer_rings(seed):
    off, error = sound_errors.errors(strange_sounds.record(seed)[0]).T
    assert 0.5 < np.std(off / error) < 1.5


# Each sound has one mode, anywhere in half of the band: longer rings span the more of it.
def test_sounds_of_one_band_have_no_shared_modes():
    truth = microphone(rate=8000, duration=7.0, noise_db=-12, seed=4)
    modes = SharedModes(8000.0, 1, 2)
    modes.add(truth.samples, np.rint(truth.time * 8000) - 0.5)
    modes.timing()
    assert modes.model is None


LOW = ((450.0, 12e-3, 1.0), (1250.0, 8e-3, 0.8), (2000.0, 6e-3, 0.7), (3000.0, 4e-3, 0.6))


@pytest.mark.parametrize("rate", [11_025, 16_000])
def test_the_start_of_a_mode_below_what_is_fitted_is_fitted(rate):
    found, off = learned(band_limited(rate, "resample", 20.0, 303, modes=LOW, count=150))
    assert 1e6 * np.std(off) < 60  # 91 and 66 by the modes above
    assert 0.7 < np.std(off / found.time_error) < 1.25  # 1.8 and 1.6 by them


@pytest.mark.parametrize(("noise", "most"), [(20.0, 70), (49.0, 30)])
def test_a_filter_that_does_not_ring_before_impacts_is_found(monkeypatch, noise, most):
    forward = partial(signal.decimate, zero_phase=False)
    monkeypatch.setitem(sound_timing.DECIMATORS, "forward", forward)
    found, off = learned(band_limited(8000, "forward", noise, 303, modes=MODES["three"], count=150))
    off = off - np.median(off)  # its delay
    assert 1e6 * np.std(off) < most  # 85 and 49 by symmetric filters
    assert 0.5 < np.std(off / found.time_error) < 1.25  # 1.3 and 2.2 by them


def test_a_gentle_filter_that_does_not_ring_before_impacts_is_found(monkeypatch):
    def gentle(x, times):
        return signal.sosfilt(signal.butter(4, 0.7 / times, output="sos"), x)[::times]

    monkeypatch.setitem(sound_timing.DECIMATORS, "gentle", gentle)
    found, off = learned(band_limited(8000, "gentle", 49.0, 303, modes=MODES["three"], count=150))
    off = off - np.median(off)
    assert 1e6 * np.std(off) < 40
    assert 0.5 < np.std(off / found.time_error) < 1.25  # 3 by steep filters


def test_folded_modes_are_tried_behind_the_filter_that_other_modes_favour():
    # By the strong modes two filters are equally probable; only one of them fits a folded mode.
    truth = band_limited(11_025, "resample_poly", 49.0, 15_101, modes=MODES["sample"])
    _, off = learned(truth)
    assert 1e6 * np.std(off) < 20  # 46 behind the other


def test_a_mode_that_a_filter_nearly_stops_times_impacts():
    # One mode lies within the band; the second is 30 dB weaker there, and below the noise.
    found, off = learned(band_limited(8000, "decimate", 20.0, 211, modes=STOPPED, count=120))
    assert 1e6 * np.std(off) < 65  # 89 by the one mode
    assert 0.75 < np.std(off / found.time_error) < 1.25


def test_errors_tell_of_a_mode_that_is_not_found():
    scaled = []
    for seed in (213, 216, 222):
        found, off = learned(band_limited(8000, "decimate", 20.0, seed, modes=STOPPED, count=120))
        scaled.append(np.std(off / found.time_error))
    assert 0.8 < np.sqrt(np.mean(np.square(scaled))) < 1.6  # 1.9 to 2.1 if misfits were white noise


@pytest.mark.parametrize("rate", [8000, 11_025, 16_000, 22_050])
def test_a_record_without_a_filter_keeps_its_attacks(rate):
    truth = band_limited(rate, "", 49.0, 202, modes=MODES["sample"], count=60)
    found, off = learned(truth)
    np.testing.assert_allclose(found.time * rate % 1, 0.5, atol=1e-6)
    assert np.std(off) < 0.5 / rate
    # Folded modes begin slowly, as behind a filter: their errors are stated too large.
    assert 0.4 < np.std(off / found.time_error) < 1.3


@pytest.mark.parametrize("rate", [8000, 11_025])
def test_of_modes_new_at_each_impact_the_crossing_is_taken(rate):
    rng = np.random.default_rng(203)
    parts = []
    for seed in range(30):
        tones = sorted(rng.uniform(1500, 0.45 * rate, 3))
        modes = [(tone, rng.uniform(2e-3, 6e-3), 1.0) for tone in tones]
        parts.append(band_limited(rate, "sox", 49.0, seed, modes=modes, count=4))
    x = np.concatenate([part.samples for part in parts])
    begins = np.cumsum([0] + [len(part.samples) for part in parts[:-1]]) / rate
    time = np.concatenate([part.time + at for part, at in zip(parts, begins, strict=True)])
    found = detect(x, rate)
    _, deviation, pairs = score(found.time, time, 3e-3)
    plain = np.concatenate([crossing(part, 0.3, False) - part.time for part in parts])
    off = found.time[pairs[:, 0]] - time[pairs[:, 1]]
    assert 0.6 < np.std(off / found.time_error[pairs[:, 0]]) < 1.3
    assert deviation < 1.3 * np.std(plain)
    assert deviation < 150e-6


@pytest.mark.parametrize("decimator", ["resample_poly", "sox"])
@pytest.mark.parametrize("rate", [8000, 11_025, 16_000])
def test_impacts_of_one_waveform_are_timed_by_it(rate, decimator):
    truth = band_limited(
        rate, decimator, 49.0, 204, modes=MODES["sample"], count=80, phases=(0.3, 1.9, 4.0)
    )
    found, off = learned(truth)
    assert found.alike > 0.3  # the attacks of others are more than a millisecond early
    alike = np.argsort(found.time_error)[: round(found.alike * len(off))]  # others are less exact
    assert np.std(off[alike]) < 2e-6
    assert np.std(off) < 3e-6


def test_neither_division_into_blocks_nor_unit_matters():
    truth = band_limited(8000, "sox", 30.0, 205, modes=MODES["three"], count=LEARN + 40)
    x = truth.samples
    whole = detect(x, truth.rate)
    assert np.isfinite(whole.time_error).sum() > LEARN
    rng = np.random.default_rng(205)
    for count in (1, 7, 100):
        edges = [0, *np.sort(rng.choice(np.arange(1, len(x)), count, replace=False)), len(x)]
        pieces = [Piece(int(a), x[a:b]) for a, b in pairwise(edges)]
        again = detect_sound(lambda p=pieces: p, truth.rate)
        np.testing.assert_array_equal(again.time, whole.time)
        np.testing.assert_array_equal(again.time_error, whole.time_error)
    np.testing.assert_array_equal(detect(-(2.0**-9) * x, truth.rate).time, whole.time)


def test_no_more_than_the_sounds_learned_from_are_kept():
    truth = band_limited(8000, "sox", 30.0, 206, modes=MODES["three"], count=60)
    modes = SharedModes(8000.0, 1, 2)
    attacks = np.rint(truth.time * 8000) - 0.5
    for _ in range(10):
        modes.add(truth.samples, attacks)
        assert len(modes.waves) <= LEARN
    assert modes.learned
    assert not len(modes.waves)
    assert len(modes.timing()[:, 0]) == 10 * len(attacks)


# The parts.


@pytest.mark.parametrize("size", [40, 111])
def test_lagged_products_are_those_of_the_hankel_matrix(size):
    rng, width = np.random.default_rng(17), size // 2
    decay = np.exp(-np.arange(130) / 30)
    guess = np.array([0.0, 3.6, 128.9 - size, 2.0, np.nan, 1.0, 129.0 - size])
    sounds, skip = decay * rng.standard_normal((7, 130)), 2
    sounds[5] = 0.0
    total, expected = np.ones((2, width, width))
    floor, rows = 0.0, size - width + 1
    for sound, at in zip(sounds, guess, strict=True):
        ring = sound[: 0 if np.isnan(at) else int(at) + skip + size][-size:]
        if ring.any() and at + skip + size < 131:  # neither one that is cut off nor silence counts
            energy = ring @ ring
            hankel = ring[np.arange(rows)[:, None] + np.arange(width)]
            expected += hankel.T @ hankel / energy
            floor += rows / energy
    assert add_rings(sounds, guess, skip, size, rows, total) == pytest.approx(floor, rel=1e-14)
    np.testing.assert_allclose(np.triu(total), np.triu(expected), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("response", [cliff(1.0), cliff(0.9), slope()])
def test_modes_behind_a_filter_are_its_convolution_with_them(response):
    reach = (len(response) - 1) // 32
    modes, beyond = apart(EXPONENTS, response, NONE, -30, 40)
    places = np.arange(-30 * PARTS, 40 * PARTS + 1) / PARTS
    lattice = np.arange(-reach * 16, reach * 16 + 1) / 16
    at = {u: value for u, value in zip(lattice, response, strict=True)}
    np.testing.assert_allclose(beyond[0], [at.get(u, 0.0) for u in places], atol=1e-12)
    fine = np.arange(-reach * 256, reach * 256 + 1) / 256
    if reach == 10:
        k = np.sinc(fine) * np.kaiser(len(fine), 5.0)
    else:
        share = response[reach * 16]
        k = share * np.sinc(share * fine) * np.cos(0.5 * np.pi * fine / reach) ** 2
    for u, column in zip(places[::23], modes.T[::23], strict=True):
        inside = fine <= u
        for j, exponent in enumerate(EXPONENTS):
            sound = k[inside] * np.exp(exponent * (u - fine[inside]))
            value = integrate.simpson(sound, x=fine[inside]) if inside.sum() > 2 else 0.0
            assert column[j] == pytest.approx(value.real, abs=1e-4)
            assert column[j + len(EXPONENTS)] == pytest.approx(value.imag, abs=1e-4)


def test_without_a_filter_modes_are_themselves():
    modes, beyond = apart(EXPONENTS, NO_FILTER, NONE, -5, 20)
    u = np.arange(-5 * PARTS, 20 * PARTS + 1) / PARTS
    expected = np.where(u >= 0, np.exp(EXPONENTS[:, None] * u), 0.0)
    np.testing.assert_allclose(modes, np.concatenate((expected.real, expected.imag)), atol=1e-12)
    assert not beyond.any()


def test_responses_pass_what_is_far_below_their_edge():
    for response in responses():
        reach = (len(response) - 1) // 32
        u = np.arange(-reach * 16, reach * 16 + 1) / 16
        for share in (0.0, 0.3, 0.5):
            gain = np.sum(response * np.cos(np.pi * share * u)) / 16
            assert gain == pytest.approx(1.0, abs=0.02)
    # Forward alone it delays, and passes the root.
    turn = np.exp(1j * np.pi * np.outer((0.5, 1.0), np.arange(-384, 385) / 16))
    once, twice = (np.abs(turn @ response) / 16 for response in (causal()[0], chebyshev()))
    np.testing.assert_allclose(once, np.sqrt(twice), atol=1e-2)  # its end is cut off
    # At half the rate 1 / (1 + ripple T_8(x)^2), x the ratio of the prewarped frequencies.
    stop = np.sum(chebyshev() * np.cos(np.pi * np.arange(-384, 385) / 16)) / 16
    ratio = np.tan(np.pi / 32) / np.tan(0.8 * np.pi / 32)
    closed = 1 / (1 + (10**0.005 - 1) * np.cosh(8 * np.arccosh(ratio)) ** 2)
    assert stop == pytest.approx(closed, abs=5e-4)


def test_the_high_pass_filter_stops_hum_and_passes_modes():
    taps = high_pass(RATE)
    n = np.arange(len(taps)) - len(taps) // 2
    gain = {f: np.sum(taps * np.cos(2 * np.pi * f / RATE * n)) for f in (0, 100, 2000, 3500)}
    assert abs(gain[0]) < 1e-12
    assert abs(gain[100]) < 0.02
    assert gain[2000] == pytest.approx(1.0, abs=0.01)
    assert gain[3500] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("response", [cliff(1.0), cliff(0.95), slope(), chebyshev(), *causal()])
def test_the_shift_of_a_sound_without_noise_is_recovered(response):
    taps = high_pass(RATE)
    model = model_of(EXPONENTS, response, taps)
    model.prior, model.error = (1e-9, 1e-9), 1e-9  # all modes lie in the band; no noise
    rng = np.random.default_rng(8)
    modes, _ = apart(EXPONENTS, response, taps, -60, 80)
    shifts = rng.integers(-4 * PARTS, 4 * PARTS, 20)
    places = PARTS * np.arange(20, 120) - shifts[:, None]
    sounds = np.einsum("ij,jik->ik", rng.standard_normal((20, len(modes))), modes[:, places])
    for sign in (1.0, -1e-3):
        fits = model.fit(sign * sounds, np.full(20, 40.0), np.zeros(20, int))
        # Between two shifts of the model it interpolates.
        assert np.abs(fits[:, 0] - 40.0 - shifts / PARTS).max() < 0.6 / PARTS
        assert (np.abs(fits[:, 2]) < 1e-9).all()
    model.noise = 1.0  # beside which half of them are nothing
    sounds[::2] *= 1e-158
    fits = model.fit(1e3 * sounds, np.full(20, 40.0), np.zeros(20, int))
    assert np.isnan(fits[::2]).all()
    assert np.isfinite(fits[1::2]).all()


def test_the_misfit_of_a_model_is_what_others_leave_along_a_shift():
    """Against bases that are made orthonormal one sound at a time."""
    taps, response = high_pass(RATE), cliff(0.9)
    rng = np.random.default_rng(15)
    truth, _ = apart(EXPONENTS, response, taps, -60, 80)
    shifts = rng.integers(-PARTS, PARTS + 1, 24)
    places = PARTS * np.arange(20, 120) - shifts[:, None]
    sounds = np.einsum("ij,jik->ik", rng.standard_normal((24, 4)), truth[:, places])
    model = model_of(EXPONENTS[:1], response, taps, 1e-12)  # one of the two
    model.prior, model.error = (1e-12, 1e-12), 1e-3
    model.fit_first(sounds, np.full(24, 40.0), None, 1.0)
    modes, _ = apart(EXPONENTS[:1], response, taps, -60, 80)
    fits, left, change = model.fit(sounds, np.full(24, 40.0), np.zeros(24, int)), [], []
    size, lead = model.fine.size, model.part.lead
    for sound, instant in zip(sounds, fits[:, 0], strict=True):
        first = int(np.rint(instant)) - lead
        part = sound[first : first + size]
        shift = int(np.rint(PARTS * (instant - first - lead)))
        sooner, columns, later = (
            modes[:, PARTS * (60 - lead + np.arange(size)) - one].T
            for one in (shift - 1, shift, shift + 1)
        )
        amplitudes = np.linalg.lstsq(columns, part)[0]
        moved = (later - sooner) @ amplitudes
        moved -= columns @ np.linalg.lstsq(columns, moved)[0]
        left.append((part - columns @ amplitudes) / np.linalg.norm(part))
        change.append(moved / np.linalg.norm(moved))
    squares = (np.array(change) @ np.array(left).T) ** 2
    np.fill_diagonal(squares, 0.0)
    assert model.misfit == pytest.approx(OWN * np.median(squares.sum(axis=0)) / 23, rel=1e-6)
    assert model.misfit > 0.0


def test_what_has_learned_finds_the_same_again():
    """From the prior beside its own on, and by columns for the shifts about origins alone."""
    taps, response = high_pass(RATE), cliff(0.9)
    rng = np.random.default_rng(16)
    truth, _ = apart(EXPONENTS, response, taps, -60, 80)
    places = PARTS * np.arange(20, 120) - rng.integers(-PARTS, PARTS + 1, 24)[:, None]
    sounds = np.einsum("ij,jik->ik", rng.standard_normal((24, 4)), truth[:, places])
    sounds += 1e-2 * rng.standard_normal(sounds.shape)
    model = model_of(EXPONENTS, response, taps, 1e-4)
    held = model.starts(sounds, np.full(24, 40.0), 24)[1]
    model.learn(held, 1e-7)
    first = model.prior, model.error, model.evidence
    assert model.prior[0] == PRIORS[-1]  # no impulse is there
    model.learn(held, 1e-7)
    assert (model.prior, model.error, model.evidence) == first
    model.learn_from(held.starts, 1e-7)
    assert model.prior == first[0]
    assert (model.error, model.evidence) == pytest.approx(first[1:], rel=1e-9)
    again = model.about(held.starts)
    np.testing.assert_allclose(again.projections, held.projections, rtol=1e-9, atol=1e-12)
    _, loud = model.starts(sounds, np.full(24, 40.0), 8)
    energy = np.sum(sounds[:, 40 - model.part.lead :][:, : model.fine.size] ** 2, axis=1)
    np.testing.assert_array_equal(loud.starts.which, np.sort(np.argsort(-energy)[:8]))
    rows = np.isin(held.starts.which, loud.starts.which)
    np.testing.assert_array_equal(loud.projections, held.projections[rows])


def test_models_are_compared_by_the_shifts_next_to_the_origin():
    model = model_of(EXPONENTS, cliff(0.9), high_pass(22_050.0), rate=22_050.0)
    grams = model.starts(np.ones((1, 400)), np.array([200.0]), 1)[1].shifts.grams
    beside = (len(model.fine.places) - grams.shape[1]) // 2
    assert grams.shape[1] == 2 * PARTS * CLOSE + 1 < len(model.fine.places)
    expected = model.fine.grams[:, beside:-beside]
    np.testing.assert_allclose(grams, expected, rtol=1e-12, atol=1e-15)


def test_exponents_are_those_of_the_sounds():
    rng = np.random.default_rng(9)
    t = np.arange(60)
    amplitude = rng.standard_normal((30, 2)) + 1j * rng.standard_normal((30, 2))
    sounds = (amplitude @ np.exp(EXPONENTS[:, None] * t)).real
    choices, others = exponents_of(sounds, np.zeros(30), 0.0)
    found = choices[0][np.argsort(choices[0].imag)]
    np.testing.assert_allclose(found, EXPONENTS, atol=1e-8)
    # The mode at 3.7 kHz may be one at 4.3, folded.
    folded = others[-1][np.argsort(others[-1].imag)]
    np.testing.assert_allclose(folded.imag[1], 2 * np.pi - EXPONENTS.imag[1], atol=1e-8)


def test_a_mode_that_may_be_noise_is_the_last_choice():
    rng = np.random.default_rng(14)
    amplitude = rng.standard_normal((200, 2)) + 1j * rng.standard_normal((200, 2))
    amplitude[:, 1] *= 0.1
    sounds = (amplitude @ np.exp(EXPONENTS[:, None] * np.arange(60))).real
    sounds += 0.15 * rng.standard_normal(sounds.shape)
    choices, _ = exponents_of(sounds, np.zeros(200), 0.15**2)
    assert [len(choice) for choice in choices] == [1, 2]
    np.testing.assert_allclose(np.sort(choices[-1].imag), EXPONENTS.imag, atol=0.05)


def test_sounds_without_modes_in_common_have_no_exponents():
    noise = np.random.default_rng(10).standard_normal((60, 60))
    assert exponents_of(noise, np.zeros(60), 0.0) == ([], [])


def test_sounds_of_which_much_lies_beside_the_strong_modes_share_none():
    rng = np.random.default_rng(12)
    amplitude = rng.standard_normal((200, 2)) + 1j * rng.standard_normal((200, 2))
    sounds = (amplitude @ np.exp(EXPONENTS[:, None] * np.arange(60))).real
    sounds += 0.35 * rng.standard_normal(sounds.shape)
    known, faint = 0.35**2, 0.4 * 0.35**2
    choices, _ = exponents_of(sounds, np.zeros(200), known)
    np.testing.assert_allclose(np.sort(choices[0].imag), EXPONENTS.imag, atol=0.02)
    # What the same noise is beyond that known is no mode, but a quarter of the energy.
    assert exponents_of(sounds, np.zeros(200), faint) == ([], [])


def test_sounds_that_are_hardly_numbers_have_no_exponents():
    t = np.arange(60)
    sounds = np.tile(1e-161 * np.exp(EXPONENTS[:1] * t).real, (30, 1))
    assert exponents_of(sounds, np.zeros(30), 0.0) == ([], [])


def test_twin_of_the_probability_of_a_shift():
    rng = np.random.default_rng(11)
    q = np.linalg.qr(rng.standard_normal((30, 4)))[0]
    k = rng.standard_normal((30, 2))
    k -= q @ (q.T @ k)
    y = q @ rng.standard_normal(4) + 0.2 * k @ rng.standard_normal(2)
    y += 0.05 * rng.standard_normal(30)
    square = k.T @ k
    gram = np.array([square[0, 0], square[1, 1], square[0, 1]])
    energy = y @ y
    values = []
    for scale in (1.0, 0.3):  # the densities differ by a constant only
        projection = np.array([np.sum((q.T @ y) ** 2) / energy, *(scale * k.T @ y) / energy**0.5])
        value, explained = np.empty((2, 1))
        at_one = projection[:, None], scale**2 * gram[:, None]
        log_probabilities(*at_one, 2e-3, (1e-2, 3e-3), value, explained)
        slow = naive_sound.log_probability(y, q, scale * k, 2e-3, (1e-2, 3e-3))
        values.append(value[0] - slow)
        assert 0.0 < explained[0] < 1.0
    assert values[0] == pytest.approx(values[1], rel=1e-9)


def test_evidence_is_the_integral_of_the_probability():
    """Of sounds whose explained part is a known function of the shift, whatever the prior is."""
    grid, step, freedom, noise, energy = np.arange(-12, 13), 0.25, 30.0, 1e-3, 2.0
    priors, unit = np.array([[1e-2, 1e-3], [1e-3, 1e-4], [1e-4, 1e-5]]), (3.0, 2.0)
    projections = np.zeros((9, 3, len(grid)))
    projections[:, 0] = 0.9 * np.exp(-((grid * step) ** 2) / 50.0)
    grams = np.array([[u] * len(grid) for u in (*unit, 0.0)])
    at = noise / energy + (0.1 / freedom - noise / energy)

    def learned(rows, least, enough=-np.inf, begin=0):
        search = Search(priors[rows], begin, 1e-4, least, enough)
        shifts = Shifts(grams, step, freedom)
        return most_probable(projections, np.full(9, energy), shifts, noise, search)

    def evidence(s, prior):
        d = np.linspace(-3.0, 3.0, 20_001)
        value = 0.9 * np.exp(-(d**2) / 50.0) / (2.0 * s)
        constant = 0.5 / s + 0.5 * freedom * np.log(s)
        constant += 0.5 * sum(np.log(1.0 + v * g / s) for v, g in zip(prior, unit, strict=True))
        return np.log(integrate.simpson(np.exp(value - 0.45 / s), x=d)) + 0.45 / s - constant

    for row, prior in enumerate(priors):
        found = learned([row], 1e-7)
        assert found == pytest.approx(
            (evidence(at, prior), prior[0], at - noise / energy), rel=1e-6
        )
        assert learned([row], 0.02)[2] == 0.02
    # Nothing is explained by an impulse: the least of its variances is the most probable.
    assert learned([0, 1, 2], 1e-7)[1] == 1e-4
    assert learned([2, 1, 0], 1e-7)[1] == 1e-4
    for rows in ([0, 1, 2], [2, 1, 0]):  # wherever the search begins
        for begin in range(3):
            assert learned(rows, 1e-7, begin=begin)[1] == 1e-4
    assert learned([0, 1, 2], 1e-7, enough=np.inf)[1] == 1e-2


@pytest.mark.parametrize("error", [0.0, 1e6])
def test_noise_is_white_behind_what_whitens_it(error):
    rng, taps = np.random.default_rng(14), high_pass(RATE)
    noise = coloured(rng, 200_000, RATE)
    white = whitening(noise[:144_000].reshape(-1, 36), taps, RATE, error)
    np.testing.assert_allclose(white, white[::-1], atol=1e-12)
    # Power in bands of 500 Hz between the high-pass filter and half the rate.
    spectrum = np.abs(np.fft.rfft(np.convolve(noise, white, "valid"))) ** 2
    edges = np.arange(1500, 4001, 500) * 2 * len(spectrum) // int(RATE)
    power = np.array([spectrum[a:b].mean() for a, b in pairwise(edges)])
    if error == 0.0:
        assert power.max() < 1.35 * power.min()
    else:  # where models leave more than noise, nothing is whitened
        np.testing.assert_allclose(white, taps, atol=0.02)


def test_twin_of_the_crossing():
    rng = np.random.default_rng(12)
    sounds = rng.standard_normal((5, 60)) * np.linspace(0, 1, 60) ** 2
    sounds[4] = 0.0
    out = np.empty((5, 3))
    crossings(sounds, 10, 12, 45, (0.3, 0.0, 0.6), out)
    assert np.isnan(out[4]).all()
    for y, (found, beyond, error) in zip(sounds[:4], out[:4], strict=True):
        greatest, above = 0.01, 3.0
        while above - greatest > 0.01:
            level = (greatest + above) / 2
            reached = np.isfinite(naive_sound.crossing(y, 12, 45, level, FINE))
            greatest, above = (level, above) if reached else (greatest, level)
        slow = naive_sound.crossing(y, 12, 45, 0.3 * greatest, FINE)
        assert 0.0 <= slow - found < 1 / FINE
        assert naive_sound.modulus(y, slow + beyond - 1 / FINE) >= 0.3 * greatest - 1e-2
        assert naive_sound.modulus(y, slow + beyond) < 0.3 * greatest + 1e-2
        slope = FINE * (naive_sound.modulus(y, slow) - naive_sound.modulus(y, slow - 1 / FINE))
        assert error == pytest.approx(np.sqrt(np.mean(y[:10] ** 2)) / slope, rel=1e-6)
