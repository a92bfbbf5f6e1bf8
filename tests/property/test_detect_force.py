"""What must hold of the force detector whatever the record."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import impactsig
from benchmarks.recordings import load_cell

RATE = 50_000.0
TRUTH = load_cell(duration=3.0, seed=21)


@functools.cache
def whole():
    """What is found; not while tests are collected, for every worker would compile for it."""
    return impactsig.detect_impacts(impactsig.Recording(TRUTH.samples, RATE))


def same(found, expected=None):
    expected = whole() if expected is None else expected
    for name in ("time", "contact_time", "peak", "impulse", "rise_time", "flags"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert (found.threshold, found.noise) == (expected.threshold, expected.noise)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 149_999), max_size=40, unique=True))
def test_any_division_into_blocks_gives_the_same(cuts):
    edges = [0, *sorted(cuts), len(TRUTH.samples)]
    blocks = [
        impactsig.Recording(TRUTH.samples[a:b], RATE, start=a / RATE) for a, b in pairwise(edges)
    ]
    same(impactsig.detect_impacts(blocks))


@settings(max_examples=15, deadline=None)
@given(st.integers(-40, 40), st.booleans())
def test_unit_and_direction_do_not_matter(power, upside_down):
    # Powers of two scale floating-point numbers exactly, so the result must scale exactly.
    scale = 2.0**power * (-1 if upside_down else 1)
    found = impactsig.detect_impacts(impactsig.Recording(scale * TRUTH.samples, RATE))
    np.testing.assert_array_equal(found.time, whole().time)
    np.testing.assert_array_equal(found.contact_time, whole().contact_time)
    np.testing.assert_array_equal(found.peak, abs(scale) * whole().peak)


@settings(max_examples=15, deadline=None)
@given(st.floats(-1e4, 1e4), st.floats(-100, 100))
def test_offset_and_start_only_shift(offset, start):
    rec = impactsig.Recording(TRUTH.samples + offset, RATE, start=start)
    found = impactsig.detect_impacts(rec)
    np.testing.assert_allclose(found.time - start, whole().time, atol=1e-7)
    np.testing.assert_allclose(found.peak, whole().peak, rtol=1e-3, atol=1e-3)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(0, 2000),
    st.sampled_from([0.0, 1e-12, 1.0, 1e6]),
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.sampled_from(["as it is", "whole numbers", "mostly zero"]),
    st.sampled_from([None, 1.0, "3 sigma"]),
)
def test_no_record_crashes_and_results_are_sound(count, noise, seed, steps, kind, threshold):
    rng = np.random.default_rng(seed)
    x = noise * rng.standard_normal(count)
    if steps:
        x += np.repeat(rng.standard_normal(count // 50 + 1) * 10.0, 50)[:count]
    if kind == "whole numbers":
        x = np.round(x)
    if kind == "mostly zero":
        x = (rng.random(count) < 0.05) * rng.integers(-5, 6, count).astype(float)
    rec = impactsig.Recording(x, RATE)
    found = impactsig.detect_impacts(rec)
    if threshold is not None and found.noise:
        found = impactsig.detect_impacts(rec, threshold=threshold)
    assert np.all(np.diff(found.time) > 0)
    assert np.all(found.contact_time > 0)
    assert np.all(found.impulse > 0)
    assert np.all((found.rise_time >= 0) & (found.rise_time <= found.contact_time))
    assert np.all((found.time >= 0) & (found.time + found.contact_time <= found.stop + 1e-9))
    assert np.all(found.peak > 0)
    assert bool(found.reason) == (len(found) == 0)
