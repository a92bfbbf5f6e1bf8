"""Matching the impacts of two trains."""

from __future__ import annotations

import doctest
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from impactsig import Impacts, InvalidInput, match_impacts, matching


def train(times):
    return Impacts.from_times(np.asarray(times, float))


def test_example():
    assert doctest.testmod(matching, extraglobs={"Impacts": Impacts}).failed == 0


def test_pairs_missed_and_spurious():
    found = match_impacts(train([0.1, 1.002, 2.0, 2.003, 9.0]), train([1.0, 2.001, 3.0]), 5e-3)
    assert found.pairs.tolist() == [[1, 0], [2, 1]]  # 2.003 is the second nearest of 2.001
    assert found.spurious.tolist() == [0, 3, 4]
    assert found.missed.tolist() == [2]
    np.testing.assert_allclose(found.error, [0.002, -0.001])
    assert found.precision == 2 / 5
    assert found.recall == 2 / 3
    assert found.f1 == pytest.approx(2 / (5 / 2 + 3 / 2))
    assert found.rms == pytest.approx(math.sqrt((4 + 1) / 2) * 1e-3)


@pytest.mark.parametrize(
    ("a", "b", "pairs", "f1"),
    [
        ([], [], [], math.nan),
        ([], [1.0], [], 0.0),
        ([1.0], [], [], 0.0),
        ([1.0], [1.0], [[0, 0]], 1.0),
        ([1.0, 2.0], [1.0], [[0, 0]], 2 / 3),
        ([1.0], [0.9996, 1.0005], [[0, 0]], 2 / 3),
        ([1.0], [1.002], [], 0.0),
    ],
)
def test_few(a, b, pairs, f1):
    found = match_impacts(train(a), train(b))
    assert found.pairs.tolist() == pairs
    assert found.pairs.shape == (len(pairs), 2)
    assert found.f1 == pytest.approx(f1, nan_ok=True)
    assert len(found.pairs) + len(found.spurious) == len(a)
    assert len(found.pairs) + len(found.missed) == len(b)


def test_a_common_delay_is_taken_off_or_found():
    rng = np.random.default_rng(3)
    truth = np.cumsum(rng.uniform(0.03, 0.06, 500))
    heard = truth + 0.0029 + rng.normal(0, 2e-5, 500)
    kept = rng.random(500) > 0.1
    given = match_impacts(train(heard[kept]), train(truth), delay=0.0029)
    searched = match_impacts(train(heard[kept]), train(truth), 5e-3, delay=None)
    for one in (given, searched):
        assert one.missed.tolist() == np.flatnonzero(~kept).tolist()
        assert not len(one.spurious)
        assert one.rms == pytest.approx(2e-5, rel=0.15)
    assert searched.delay == pytest.approx(0.0029, abs=5e-6)
    assert not len(match_impacts(train(heard), train(truth)).pairs)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([1.0], train([1])), "found"),
        ((train([1]), None), "truth"),
        ((train([1]), train([1]), 0), "within"),
        ((train([1]), train([1]), math.nan), "within"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, name):
    with pytest.raises(InvalidInput) as caught:
        match_impacts(*arguments)
    assert caught.value.argument == name
    with pytest.raises(InvalidInput, match="delay"):
        match_impacts(train([1]), train([1]), delay=math.inf)


@given(
    st.lists(st.floats(0, 1), max_size=12),
    st.lists(st.floats(0, 1), max_size=12),
    st.sampled_from([0.02, 0.1, 0.5, 2.0]),
)
def test_no_other_assignment_agrees_better(a, b, within):
    a, b = np.sort(a), np.sort(b)
    pairs = match_impacts(train(a), train(b), within).pairs
    gain = np.maximum(within - np.abs(a[:, None] - b[None, :]), 0.0)
    best = gain[linear_sum_assignment(gain, maximize=True)].sum()
    assert gain[tuple(pairs.T)].sum() == pytest.approx(best, abs=1e-12)
    assert np.all(np.diff(pairs, axis=0) > 0)
    assert np.all(np.abs(a[pairs[:, 0]] - b[pairs[:, 1]]) <= within)


def test_dense_trains_keep_their_pairs():
    # Impacts as close as their errors: each the nearest of the other, 7900 pairs would be found.
    rng = np.random.default_rng(1)
    truth = np.cumsum(rng.exponential(1e-3, 12_000))
    found = match_impacts(train(truth + rng.normal(0, 5e-4, 12_000)), train(truth))
    assert len(found.pairs) > 0.94 * 12_000
