"""AC-coupled force sensors: closed forms of half-sines behind a high-pass of the first order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import impactsig
from benchmarks.recordings import load_cell, score
from impactsig.detect._force import detect_force
from impactsig.detect._force_stretch import Wanted
from impactsig.detect.instrument import coupling as _coupling
from impactsig.detect.instrument.coupling_kernels import uncouple
from impactsig.detect.search.judging import Level
from impactsig.detect.signal.stream import Piece

RATE = 50_000.0


def coupled(time, contact, constant, heights, duration, rate=RATE):
    """Half-sines behind a high-pass, from y' + y / tau = x'."""
    t = np.arange(round(duration * rate)) / rate
    turn, x = np.pi * constant / contact, np.zeros(len(t))
    scale = turn / (1 + turn**2)
    for start, height in zip(time, heights, strict=True):
        since = t - start
        fade, phase = np.exp(-since.clip(0) / constant), np.pi * since / contact
        under_way = scale * (np.cos(phase) + turn * np.sin(phase) - fade)
        end = scale * (-1 - np.exp(-contact / constant))
        after = end * np.exp(-(since - contact).clip(0) / constant)
        x += height * np.select([since < 0, since < contact], [0, under_way], after)
    return x


def train(seed, contact, constant, noise, duration=4.0):
    rng = np.random.default_rng(seed)
    time = 0.03 + np.cumsum(contact + 0.01 + rng.exponential(0.03, 400))
    time = time[time < duration - 0.03]
    heights = np.exp(0.4 * rng.standard_normal(len(time)))
    x = coupled(time, contact, constant, heights, duration)
    return time, heights, x + noise * rng.standard_normal(len(x))


def time_constant(x):
    """Of the first stretches of 8192 samples; 0 if none shows."""
    return _coupling.time_constant(np.array_split(x[: 8192 * 5], 5), 1.0)


@pytest.mark.parametrize(
    ("contact", "constant"),
    [
        (0.3e-3, 20e-3),
        (3e-3, 0.5e-3),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0.3e-3, 1e-3), (3e-3, 5e-3))),
    ],
)
def test_the_time_constant_is_read_from_the_undershoot(constant, contact):
    x = train(41, contact, constant, 0.003)[2]
    assert time_constant(x) / RATE == pytest.approx(constant, rel=0.02)
    assert time_constant(-3.0 * x + 0.7) / RATE == pytest.approx(constant, rel=0.02)


def test_a_sensor_without_a_high_pass_has_none():
    time, heights, _ = train(42, 3e-3, 1e-3, 0.0)
    rng = np.random.default_rng(42)
    x = coupled(time, 3e-3, 1e6, heights, 4.0)
    t = np.arange(len(x)) / RATE
    assert time_constant(x + 0.01 * rng.standard_normal(len(x))) == 0.0
    tail = np.exp(-t[:500] / 1.5e-3) * np.sin(2 * np.pi * 3000 * t[:500])
    rings = x + signal.fftconvolve(np.diff(x, prepend=0.0), tail)[: len(x)]
    assert time_constant(rings + 0.003 * rng.standard_normal(len(x))) == 0.0
    settles = x + 3.0 * np.exp(-t / 0.05) + 0.01 * rng.standard_normal(len(x))
    assert time_constant(settles) == 0.0
    hum = x + np.sin(2 * np.pi * 50 * t) + 0.01 * rng.standard_normal(len(x))
    assert time_constant(hum) == 0.0
    assert _coupling.time_constant([], 1.0) == time_constant(np.zeros(8192)) == 0.0


def test_fits_that_show_no_coupling_end_the_search_for_one(monkeypatch):
    """Of hum between impacts; where contacts outlast the constant, the same one is found."""
    fits = []
    regress = _coupling.regress
    monkeypatch.setattr(_coupling, "regress", lambda *given: fits.append(0) or regress(*given))
    hum = load_cell(duration=1.0, seed=5).samples
    short = train(43, 3e-3, 1e-3, 0.01)[2]
    assert time_constant(hum) == 0.0
    assert 3 < len(fits) <= 12  # of 33 from all starts
    fits.clear()
    assert time_constant(short) / RATE == pytest.approx(1e-3, rel=0.01)
    assert len(fits) > 12


def test_to_undo_it_gives_the_pulses_back():
    x = coupled([0.01], 3e-3, 1e-3, [1.0], 0.1)
    force = np.sin(np.pi * (np.arange(151) / RATE) / 3e-3)
    uncouple(x, 1 / (1e-3 * RATE), 0.0, 0.0, 0.0)
    np.testing.assert_allclose(x[500:651], force, atol=1e-3)
    np.testing.assert_allclose(x[651:], 0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("constant", "noise"),
    [
        (1e-3, 0.001),
        (2e-3, 0.1),
        pytest.param(1e-3, 0.1, marks=pytest.mark.slow),
        pytest.param(2e-3, 0.001, marks=pytest.mark.slow),
    ],
)
def test_impacts_behind_a_high_pass(constant, noise):
    # 0.9 and fewer; with little noise and 1 ms the troughs were the impacts.
    time, heights, x = train(43, 3e-3, constant, noise)
    found = impactsig.detect_impacts(impactsig.Recording(-x, RATE, units="N", sensor="force"))
    assert found.settings["polarity"] == "negative"
    assert found.settings["ac_coupling"] == pytest.approx(constant, rel=0.2)
    f1, rms, pairs = score(found.time, time)
    assert f1 >= 0.995
    assert rms < 60e-6
    i, k = pairs.T
    # At 20 dB the time constant is read to a tenth, and with it what is proportional to it.
    assert abs(np.median(found.contact_time[i] / 3e-3) - 1) < (0.03 if noise > 0.01 else 1e-3)
    bound = 0.1 if noise > 0.01 else 2e-3
    assert abs(np.median(found.peak[i] / heights[k]) - 1) < bound
    assert abs(np.median(found.impulse[i] / (heights[k] * 6e-3 / np.pi)) - 1) < bound


def test_the_result_does_not_depend_on_how_the_record_is_cut():
    x = train(44, 3e-3, 1e-3, 0.01)[2]
    whole = impactsig.detect_impacts(impactsig.Recording(x, RATE, sensor="force"))
    assert "ac_coupling" in whole.settings
    wanted = Wanted(0.0, Level(), 0.0, False, 0.0, None, True)
    pieces = [Piece(a, x[a : a + 7001]) for a in range(0, len(x), 7001)]
    cut = detect_force(lambda: pieces, RATE, wanted, in_memory=False)
    np.testing.assert_array_equal(cut.columns[:, 0] / RATE, whole.time)
    np.testing.assert_array_equal(cut.columns[:, 2], whole.peak)


def test_a_contact_longer_than_the_time_constant_is_noted():
    x = train(45, 3e-3, 1e-3, 0.01)[2]
    notes = impactsig.detect_impacts(impactsig.Recording(x, RATE, sensor="force")).notes
    assert len(notes) == 1
    assert "AC coupled" in notes[0]
    x = train(45, 3e-3, 5e-3, 0.01)[2]
    assert not impactsig.detect_impacts(impactsig.Recording(x, RATE, sensor="force")).notes
