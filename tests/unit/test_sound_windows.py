"""How a sound record is cut into windows, and what is read of their samples."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.recordings import microphone
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound import _cores
from impactsig.detect.sound._attack_kernels import counting_as_one
from impactsig.detect.sound._core_kernels import BLOCKS, CHANGES, extremes, put_near, reaching
from impactsig.detect.sound._cores import cores_of, window_size
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound._survey import Survey
from impactsig.detect.sound._windows import joined, windows
from impactsig.detect.sound.powers._gate_kernels import bridge
from impactsig.detect.sound.sound import detect_sound


def test_windows_of_one_core_and_of_more_tell_the_same(monkeypatch):
    x = microphone(rate=8000, duration=19.0, noise_db=-12, seed=4).samples
    x[60_000:64_000] = x[100_000:100_500] = 0.0  # silence, in two windows and in one
    x[33_000:98_000] *= 0.2  # noise of its own
    told = []
    for length in (1, 1 << 17):
        monkeypatch.setattr(_cores, "LENGTH", length)
        scale = scale_at(8000.0)
        survey = Survey(scale, 8000.0)
        count = 0
        for window in windows([Piece(0, x)], window_size(scale)):
            survey.add(window, cores_of(window.core, scale.hop))
            count += 1
        survey.finish()
        (passage,) = survey.passages
        told.append((count, survey, passage))
    (five, one, of_one), (two, more, of_more) = told
    assert (five, two) == (5, 2)
    np.testing.assert_array_equal(one.backgrounds.noise, more.backgrounds.noise)
    assert not np.array_equal(one.backgrounds.noise[0], one.backgrounds.noise[1])
    for column, other in zip(of_one, of_more, strict=True):
        np.testing.assert_array_equal(column, other)


def test_short_silences_are_read_as_if_they_had_been_bridged():
    rate, rng = 22_050.0, np.random.default_rng(3)
    t = np.arange(40_000) / rate
    x = np.sin(2 * np.pi * 150.0 * t) + 1e-3 * rng.standard_normal(len(t))
    x[15_000:15_400] += rng.standard_normal(400) * np.exp(-np.arange(400) / 80.0)
    for first in range(1_037, 38_000, 911):
        x[first : first + 24] = 0.0
    scale, whole = scale_at(rate), np.empty(len(x))
    least, greatest, step = extremes(x)
    changed = np.zeros(len(x) // scale.hop + 1, np.bool_)
    assert bridge(x, scale.hop, step, least, greatest, whole, changed) > 30
    found = []
    for one in (x, whole):
        survey = Survey(scale, rate)
        for window in windows([Piece(0, one)], window_size(scale)):
            survey.add(window, cores_of(window.core, scale.hop))
        survey.finish()
        found.append(survey.passages[0])
    for name in ("octaves", "rises", "bands", "place", "height"):
        both = (getattr(passage, name) for passage in found)
        np.testing.assert_array_equal(*both)


def test_stretches_within_reach_of_one():
    blocks = np.array([64, 64, 10, 64, 64])
    assert reaching(blocks, 2, 64) == (1, 4)
    assert reaching(blocks, 2, 65) == (0, 5)
    assert reaching(blocks, 0, 0) == (0, 1)
    cores, near, spans = np.empty((5, 5)), np.empty((3, 2), np.int64), np.empty((2, 3), np.int64)
    cores[:, BLOCKS] = blocks
    assert put_near(cores, 1, 65, near, spans) == 64
    np.testing.assert_array_equal(near, [[0, 4], [0, 5], [1, 5]])
    np.testing.assert_array_equal(spans, [[0, 63, 73], [193, 203, 266]])


def test_samples_beside_a_window_end_where_those_of_the_segment_do():
    x = np.arange(250)
    for window in windows([Piece(7, x)], 100):
        near, begins = window.beside(30)
        first, last = max(window.first - 30, 0), min(window.first + 130, 250)
        np.testing.assert_array_equal(near, x[first:last])
        assert begins == window.first - first
        assert np.shares_memory(near, x)


@pytest.mark.parametrize("kind", ["whole", "every second", "channel", "gap"])
def test_parts_that_follow_each_other_are_not_copied(kind):
    x = np.random.default_rng(1).standard_normal((400, 2))
    x = {"whole": x[:, 0].copy(), "every second": x.ravel()[::2]}.get(kind, x[:, 0])
    first = 101 if kind == "gap" else 100
    parts = [x[:100], x[first:250], x[250:250], x[250:300]]
    whole = joined(parts)
    np.testing.assert_array_equal(whole, np.concatenate(parts))
    assert np.shares_memory(whole, x) == (kind == "whole")


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int16])
@pytest.mark.parametrize("count", [1, 2, 64, 65, 1000])
def test_extremes(kind, count):
    x = (1000.0 * np.random.default_rng(2).standard_normal(count)).astype(kind)
    least, greatest, step = extremes(x)
    assert (least, greatest) == (x.min(), x.max())
    steps = np.abs(np.diff(x.astype(float)))
    steps = steps[steps > 0.0]
    assert step == (steps.min() if len(steps) >= CHANGES else np.inf)


@pytest.mark.parametrize(("count", "split", "lags"), [(9, 4, 20), (176, 88, 9), (352, 200, 16)])
def test_correlation_of_squares_at_all_lags(count, split, lags):
    squares = np.random.default_rng(3).standard_normal(count) ** 2
    squares = np.convolve(squares, np.ones(5))[:count]
    away = np.concatenate([part / part.mean() - 1.0 for part in np.split(squares, [split])])
    together = 1.0
    for lag in range(1, lags + 1):
        parts = np.split(away, [split])
        total = sum(float(np.sum(part[: max(len(part) - lag, 0)] * part[lag:])) for part in parts)
        together += 2.0 * max(total / np.sum(away**2), 0.0)
    assert counting_as_one(squares, split, 0.0, lags, 1.0) == pytest.approx(0.9 * together**0.6)


@pytest.mark.parametrize(("seconds", "times"), [(2.0, 1), (20.0, 2)])
def test_a_record_of_one_window_is_read_once(seconds, times):
    track = microphone(duration=seconds, rate=8000.0, tones=(1000, 3200), seed=3)
    read = []

    def pieces():
        read.append(1)
        return [Piece(0, track.samples)]

    found = detect_sound(pieces, 8000.0)
    assert len(found.time) > 5
    assert len(read) == times
