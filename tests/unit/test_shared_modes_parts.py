"""The parts by which modes that impacts share time them: filters, projections, exponents."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate

from benchmarks.recordings import coloured
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
from tests import naive_sound

RATE = 8000.0
EXPONENTS = np.array([-1 / 48 + 2j * np.pi * 2140 / RATE, -1 / 32 + 2j * np.pi * 3710 / RATE])
NONE = np.array([0.0, 1.0, 0.0])  # taps that pass everything


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


def test_starts_that_are_known_are_fitted_as_those_that_are_found():
    taps, response = high_pass(RATE), cliff(0.9)
    rng = np.random.default_rng(18)
    truth, _ = apart(EXPONENTS, response, taps, -60, 80)
    places = PARTS * np.arange(20, 120) - rng.integers(-2 * PARTS, 2 * PARTS + 1, 12)[:, None]
    sounds = np.einsum("ij,jik->ik", rng.standard_normal((12, 4)), truth[:, places])
    sounds += 1e-2 * rng.standard_normal(sounds.shape)
    guess = np.append(np.full(11, 40.0), np.nan)
    models = [model_of(EXPONENTS, response, taps, 1e-4) for _ in range(3)]
    _, held = models[0].starts(sounds, guess, 12)
    known, found, beside = (
        model.fit_first(sounds, guess, starts, 1.0)
        for model, starts in zip(models, (held.starts, None, held.starts), strict=True)
    )
    np.testing.assert_array_equal(known, found)
    np.testing.assert_array_equal(known, beside)
    assert np.isnan(known[11]).all()
    assert np.isfinite(known[:11]).all()
    # Of sounds beyond those asked nothing is known.
    more = models[0].fit_first(np.vstack((sounds, sounds)), np.tile(guess, 2), held.starts, 1.0)
    np.testing.assert_array_equal(more[12:], more[:12])


def test_eigenvectors_are_those_of_the_strong_eigenvalues():
    rng = np.random.default_rng(19)
    sounds = rng.standard_normal((9, 80)) * np.exp(-np.arange(80) / 12.0)
    rings = with_rings(no_rings(RATE, RINGS[0]), sounds, np.zeros(9), RATE)
    whole = np.triu(rings.total) + np.triu(rings.total, 1).T
    value, vectors = np.linalg.eigh(whole)
    np.testing.assert_allclose(rings.eigenvalues, value, atol=1e-14 * value[-1])
    found = rings.eigenvectors(6)
    np.testing.assert_allclose(np.abs(found.T @ vectors[:, -6:]), np.eye(6), atol=1e-10)
