"""Matching the impacts of two trains."""

from __future__ import annotations

import doctest
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
        ([1.0], [0.9995, 1.0005], [[0, 0]], 2 / 3),
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


@given(
    st.lists(st.integers(0, 400), unique=True, max_size=30),
    st.lists(st.integers(0, 400), unique=True, max_size=30),
    st.integers(1, 30),
)
def test_pairs_are_each_others_nearest(a, b, within):
    """Against the definition, element by element."""
    a, b = sorted(a), sorted(b)
    pairs = []
    for i, s in enumerate(a):
        for j, t in enumerate(b):
            to_b = min(range(len(b)), key=lambda k: (abs(b[k] - s), k))
            to_a = min(range(len(a)), key=lambda k: (abs(a[k] - t), k))
            if to_b == j and to_a == i and abs(s - t) <= within:
                pairs.append([i, j])
    assert match_impacts(train(a), train(b), within).pairs.tolist() == pairs


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
