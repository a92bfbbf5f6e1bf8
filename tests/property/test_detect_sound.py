"""What must hold of the sound detector whatever the record."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.recordings import microphone
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound.sound import detect_sound

RATE = 8000.0
# More than seven windows of 16384 samples: the background of the first ends before the last.
X = microphone(rate=RATE, duration=15.0, seed=31).samples


def detect(pieces, **settings):
    return detect_sound(lambda: pieces, RATE, **settings)


@functools.cache
def whole():
    """What is found in X; not while tests are collected, for every worker would compile for it."""
    return detect([Piece(0, X)])


LOUDNESS = np.convolve(np.abs(X), np.ones(400) / 400, "same")
GATED = np.where(np.median(LOUDNESS) < LOUDNESS, X, 0.0)


def same(found, expected=None):
    expected = whole() if expected is None else expected
    for name in expected._fields:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


def test_there_is_something_to_find():
    assert len(whole().time) > 40


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.integers(1, len(X) - 1), max_size=40, unique=True),
)
def test_any_division_into_blocks_gives_the_same(cuts):
    edges = [0, *sorted(cuts), len(X)]
    same(detect([Piece(a, X[a:b]) for a, b in pairwise(edges)]))


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(1, len(X) - 1), max_size=40, unique=True))
def test_any_division_of_a_gated_sound_gives_the_same(cuts):
    edges = [0, *sorted(cuts), len(X)]
    found = detect([Piece(a, GATED[a:b]) for a, b in pairwise(edges)])
    assert len(found.time) > 40
    same(found, detect([Piece(0, GATED)]))


def test_blocks_of_one_sample_give_the_same():
    same(detect([Piece(n, X[n : n + 1]) for n in range(len(X))]))


@settings(max_examples=20, deadline=None)
@given(st.integers(-40, 40), st.booleans())
def test_unit_and_polarity_do_not_matter(power, upside_down):
    # Powers of two scale floating-point numbers exactly, so the result must scale exactly.
    scale = 2.0**power * (-1 if upside_down else 1)
    found = detect([Piece(0, scale * X)])
    np.testing.assert_array_equal(found.time, whole().time)
    np.testing.assert_array_equal(found.peak, abs(scale) * whole().peak)
    assert found.noise == abs(scale) * whole().noise


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 2**32 - 1))
def test_an_offset_does_not_matter(offset, seed):
    # Whole numbers are added without rounding.
    rng = np.random.default_rng(seed)
    x = np.round(100 * rng.standard_normal(8000))
    x[4000:4020] += 4000 * (-1) ** np.arange(20)
    found, moved = detect([Piece(0, x)]), detect([Piece(0, x + offset)])
    assert len(found.time) == 1
    np.testing.assert_array_equal(found.time, moved.time)
    np.testing.assert_allclose(found.peak, moved.peak, rtol=1e-12)


@settings(max_examples=60, deadline=None)
@example(1745, 1e-12, 3080, 4000.0)
@given(
    st.integers(0, 3000),
    st.sampled_from([0.0, 1e-200, 1e-12, 1.0, 1e12]),
    st.integers(0, 2**32 - 1),
    st.sampled_from([4000.0, 8000.0, 44_100.0, 192_000.0]),
)
def test_any_record_gives_times_in_order_and_inside(count, size, seed, rate):
    rng = np.random.default_rng(seed)
    x = size * rng.standard_normal(count) * (rng.random(count) < rng.random())
    found = detect_sound(lambda: [Piece(0, x)], rate)
    assert np.all(np.diff(found.time) > 0)
    assert np.all((found.time > 0) & (found.time < max(count / rate, 1e-9)))
    assert np.all(found.peak > 0)
    assert bool(found.reason) == (len(found.time) == 0)
