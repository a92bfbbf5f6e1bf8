"""Band powers and the background of a sound against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound._core_kernels import (
    BLOCKS,
    CONVERTER_STEP,
    GREATEST,
    LEAST,
    RESOLUTION,
    ROUNDING,
    bound_noise,
    may_hum,
    mean_square,
    put_narrow,
)
from impactsig.detect.sound.powers.band_kernels import RANGE, background, group_means
from impactsig.detect.sound.powers.bands import Spectrum, bands_at, degrees_of_freedom
from impactsig.detect.sound.powers.floor import noise_power, quantile_bias
from impactsig.detect.sound.powers.holes import falls_of, has_holes


def noise_of(means, sounding, bias, *, holes=False):
    """Of one window that is all there is."""
    whole = np.array([[0], [len(sounding)]])
    return noise_power(means, sounding, whole, bias, holes)[:, 0]


@pytest.mark.parametrize("rate", [8000, 22_050, 44_100, 96_000])
def test_bands_hold_the_power_of_white_noise(rate):
    bands = bands_at(rate, 256)
    x = 0.3 * np.random.default_rng(1).standard_normal(256 * 3000)
    power = Spectrum(bands).powers(x, 8192, 2900)
    # Away from the offset that is taken off; 2900 frames of one coefficient scatter by 3 %.
    np.testing.assert_allclose(power.mean(axis=1)[4:], 0.09 * bands.gain[4:], rtol=0.15)
    assert np.mean(power.mean(axis=1)[4:] / bands.gain[4:]) == pytest.approx(0.09, rel=0.02)


def test_a_tone_is_in_its_band_with_the_power_of_the_window():
    bands = bands_at(44_100, 256)
    size = len(bands.window)
    k = 200
    x = 0.5 * np.cos(2 * np.pi * k / size * np.arange(8192))
    power = Spectrum(bands).powers(x, 1024, 8)
    weight = np.zeros(len(bands.first))
    begin = 0
    for b, (first, width) in enumerate(zip(bands.first, bands.width, strict=True)):
        row = np.zeros(size)
        row[first : first + width] = bands.weights[begin : begin + width]
        # A Hann window of length N leaves N/2 at the tone, N/4 on either side; times half of 0.5.
        weight[b] = np.sum(
            row[k - 1 : k + 2] * (0.25 * size * np.array([0.25, 0.5, 0.25]) * 2) ** 2
        )
        begin += width
    strong = weight > 1e-3 * weight.max()
    np.testing.assert_allclose(power[strong, 3], weight[strong] / 4, rtol=1e-4)


def test_an_offset_is_no_power():
    bands = bands_at(44_100, 256)
    assert Spectrum(bands).powers(np.full(8192, 0.7), 1024, 8).max() < 1e-9


@pytest.mark.parametrize("rate", [8000, 22_050, 44_100])
def test_noise_power_is_unbiased(rate):
    hop = 16 * 2 ** int(np.log2(rate * 0.5e-3))
    bands = bands_at(rate, hop)
    x = np.random.default_rng(2).standard_normal(8 * hop * 4000)
    power = Spectrum(bands).powers(x, 4 * hop, 8 * 3980)
    means = np.empty((len(power), 3980))
    group_means(power, np.ones(power.shape[1], np.bool_), 8, means)
    bias = quantile_bias(degrees_of_freedom(rate, hop, 8))
    noise = noise_of(means, np.ones(3980, np.bool_), bias)
    # The lowest bands also hold what is left of the mean.
    ratio = noise[4:] / bands.gain[4:]
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)


def test_quantile_bias_is_that_of_chi_squared():
    from scipy import stats

    for n in (4, 8, 16, 64, 256):
        assert quantile_bias(np.array(n)) == pytest.approx(stats.chi2(n).ppf(0.1) / n, rel=0.015)


def test_groups_that_silence_touches_do_not_count():
    means = np.tile([0.0, 5.0, 0.1], 40)[None]
    noise = noise_of(means, np.tile([False, True, False], 40), np.array([1.0]))
    np.testing.assert_allclose(noise, 5.0, rtol=1e-4)
    assert noise_of(means, np.zeros(120, np.bool_), np.array([8.0])) == [0.0]


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("kind", ["noise", "steps", "falling"])
@pytest.mark.parametrize("share", [1.0, 0.6, 0.01])
def test_noise_of_windows_is_the_quantile_of_each(kind, share, holes):
    rng = np.random.default_rng(9)
    means = rng.exponential(1.0, (5, 400))
    if kind == "steps":
        means = np.rint(means)
    elif kind == "falling":  # the lowest third of all is in the last windows
        means *= 10.0 ** -np.linspace(0.0, 9.0, 400)
    sounding = rng.random(400) < share
    first, last = np.array([0, 0, 60, 100, 300, 400]), np.array([50, 120, 120, 300, 301, 400])
    bias = rng.uniform(0.5, 1.0, 5)
    noise = noise_power(means, sounding, np.array([first, last]), bias, holes)
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        for b in range(5):
            values = np.sort(means[b, begin:end][sounding[begin:end]])
            if holes and len(values):
                values = values[values >= 10.0**-5.5 * values[-1]]
            expected = values[int(0.1 * len(values))] / bias[b] if len(values) else 0.0
            assert noise[b, k] == expected


def test_holes_are_no_background():
    means = np.concatenate((np.full(50, 1e-9), np.linspace(1.0, 2.0, 41), [3e3]))[None]
    sounding, bias = np.ones(92, np.bool_), np.array([0.5])
    assert noise_of(means, sounding, bias) == [2e-9]
    assert noise_of(means, sounding, bias, holes=True) == pytest.approx([2.2])  # fourth of 42
    means[0, :50] = 0.02  # less than 55 dB below the strongest: no hole
    assert noise_of(means, sounding, bias, holes=True) == pytest.approx([0.04])


def test_bands_that_empty_while_others_fill_are_those_of_a_codec():
    filled = np.random.default_rng(3).random((40, 100)) < 0.5
    always, now_and_then = np.ones(100, np.bool_), np.arange(100) % 2 == 0

    def holes(filled, empty=1e-8, sounding=always):
        return has_holes(*falls_of(np.where(filled, 1.0, empty), sounding))

    assert holes(filled)
    assert not holes(filled, empty=1e-3)  # no room, but no hole either
    assert not holes(np.tile(filled[0], (40, 1)))  # all at once, as with impacts
    assert not holes(filled, sounding=now_and_then)  # none side by side


def test_falls_are_counted_in_every_other_band():
    means = np.ones((4, 3))
    means[0], means[2] = [1.0, 1e-5, 1e-5], [1e-3, 1.0, 1.0]
    means[1] = [1e-9, 1.0, 1e-9]
    np.testing.assert_array_equal(falls_of(means, np.ones(3, np.bool_)), [4, 1, 1])
    np.testing.assert_array_equal(falls_of(means, np.array([False, True, True])), [2, 0, 0])


def test_background_is_40_db_below_the_strongest_nearby():
    means = np.full((1, 100), 1e-6)
    means[0, 50] = 2.0
    out = np.empty((1, 40))
    background(np.array([[1e-6]]), 100, means, 30, 10, out)
    assert np.all(out[0, 10:31] == 2e-4)
    assert np.all(out[0, :10] == 1e-6)
    assert np.all(out[0, 31:] == 1e-6)


@pytest.mark.parametrize(("first", "nearby"), [(0, 21), (37, 21), (60, 21), (5, 0), (50, 200)])
def test_background_follows_the_strongest_nearby_wherever_it_is_asked_for(first, nearby):
    rng = np.random.default_rng(0)
    means = rng.exponential(1.0, (5, 100)) * rng.choice([1.0, 1e6], (5, 100))
    means[1] *= 1e-6  # of which nothing counts
    means[3] = 1e-6
    means[3, 45] = 2e4  # one does, just
    noise, out = 1.0 + rng.exponential(1.0, (5, 3)), np.empty((5, 40))
    noise[3] = 1.9
    background(noise, 16, means, first, nearby, out)
    for g in range(40):
        near = means[:, max(first + g - nearby, 0) : first + g + nearby + 1]
        own = noise[:, g // 16]
        np.testing.assert_array_equal(out[:, g], np.maximum(own, RANGE * near.max(axis=1)))


def test_noise_is_at_least_that_of_rounding_and_of_steps():
    cores = np.empty((3, 5))
    cores[:, BLOCKS], cores[:, RESOLUTION] = 64.0, [0.0, 0.0, 1e-3]
    cores[:, LEAST], cores[:, GREATEST] = [-2.0, -1.0, -1.0], [1.0, 3.0, 5.0]
    cores[:, CONVERTER_STEP] = [np.inf, 0.1, 0.5]
    near = np.array([[0, 1], [0, 2], [1, 3]])
    gains, leakage = np.array([1.2, 0.9, 0.7]), np.array([0.1, 10.0])
    noise = np.random.default_rng(4).exponential(3e-4, (7, 3))  # three octaves, two low ones
    noise[:, 0] *= 1e-9
    bounded, unresolved = np.empty((7, 3)), np.empty(3, np.bool_)
    assert bound_noise(noise, cores, near, gains, leakage, bounded, unresolved)
    steps, size = np.array([0.0, 0.1, 0.1]), np.array([2.0, 3.0, 5.0])
    toggling, rounding = 0.25 * steps**2, ([0.0, 0.0, 1e-3] * size) ** 2
    least = np.empty((7, 3))
    least[:3] = np.maximum(np.outer(gains, toggling), rounding)
    least[3:5] = np.maximum(gains[-1] * toggling, rounding)
    least[5:] = np.outer(leakage, np.maximum((ROUNDING * size) ** 2, toggling))
    np.testing.assert_array_equal(bounded, np.maximum(noise, least))
    assert (bounded > noise).any(axis=1).all()
    hidden = np.median(noise[:3], axis=0) < toggling * np.median(gains) / 3.0
    np.testing.assert_array_equal(unresolved, hidden)
    assert 0 < hidden.sum() < 3


def test_noise_of_narrow_bands_lies_beside_their_greatest_mean():
    noise, means = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[5.0, 9.0, 6.0], [8.0, 7.0, 1.0]])
    out = np.empty((2, 2, 2))
    put_narrow(
        noise,
        np.pad(means, ((0, 0), (2, 1)), constant_values=10.0),
        np.array([[2, 3], [4, 5]]),
        out,
    )
    np.testing.assert_array_equal(out, [[[1.0, 3.0], [9.0, 8.0]], [[2.0, 4.0], [9.0, 8.0]]])


@pytest.mark.parametrize("cores", [1, 4, 5])
def test_mean_square_of_white_noise_is_that_of_its_octaves(cores):
    rng = np.random.default_rng(cores)
    noise, gains = rng.exponential(1.0, (cores, 4)), rng.uniform(0.5, 2.0, 4)
    expected = np.sum(np.median(noise, axis=0) / gains / [2, 4, 8, 16])
    assert mean_square(noise, gains) == pytest.approx(expected, rel=1e-12)


def test_hum_may_be_heard_where_its_crests_count():
    crests, noise, level = np.array([[2.0, 1.0], [0.1, 0.2]]), np.ones((2, 3)), np.full((2, 3), 1.6)
    assert not may_hum(level, noise, crests)
    level[0, 1] = 1.4  # of which twice is less than 3
    assert may_hum(level, noise, crests)


def test_means_are_of_what_is_heard_or_of_all():
    power = np.array([[1.0, 3.0, 100.0, 5.0, 7.0]])
    heard = np.array([True, True, False, False, False])
    out = np.empty((1, 2))
    group_means(power, heard, 3, out)
    np.testing.assert_array_equal(out, [[2.0, 6.0]])
