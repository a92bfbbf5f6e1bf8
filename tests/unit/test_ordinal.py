"""Ordinal patterns against closed forms, and what ties and gaps do to them."""

import math
from itertools import permutations

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, ordinal_patterns


def test_patterns_are_the_ranks_within_each_vector():
    x = np.random.default_rng(1).random(300)
    found = ordinal_patterns(x, 4, 2)
    vectors = np.column_stack([x[k : k + 294] for k in range(0, 7, 2)])
    ranks = np.argsort(np.argsort(vectors, axis=1), axis=1)
    expected = [np.sum((ranks == one).all(axis=1)) for one in permutations(range(4))]
    np.testing.assert_array_equal(found.counts, expected)
    np.testing.assert_array_equal(found.patterns, list(permutations(range(4))))


def test_independent_values_have_all_patterns_alike():
    """ln 3! less (3! - 1)/(2 n) of bias; n = 20 000 overlapping vectors."""
    found = ordinal_patterns(np.random.default_rng(2).random(20_000), 3)
    assert found.entropy == pytest.approx(math.log(6), abs=5e-4)
    assert found.normalized_entropy == found.entropy / math.log(6)
    assert found.missing == 0


def test_the_logistic_map_never_falls_twice():
    """x' < x only above 3/4, from where the next value is below it: no pattern 2 1 0."""
    x = [0.4]
    for _ in range(2000):
        x.append(4 * x[-1] * (1 - x[-1]))
    found = ordinal_patterns(x, 3)
    assert found.missing == 1
    np.testing.assert_array_equal(found.patterns[found.counts == 0], [[2, 1, 0]])


def test_equal_values_count_as_rising_and_are_reported():
    found = ordinal_patterns([1, 1, 0, 0, 1, 0], 2)
    np.testing.assert_array_equal(found.counts, [3, 2])
    assert found.tied == 2 / 5
    assert "40%" in repr(found)
    assert not ordinal_patterns(np.random.default_rng(1).random(50)).warnings


def test_no_vector_reaches_across_a_gap():
    x = np.random.default_rng(3).random(30)
    times = np.concatenate(([0.0], np.cumsum(x)))
    gap = [(times[14] + 1e-9, times[15] - 1e-9)]
    found = ordinal_patterns(Impacts(times, gaps=gap), 3)
    expected = ordinal_patterns(x[:14], 3).counts + ordinal_patterns(x[15:], 3).counts
    np.testing.assert_array_equal(found.counts, expected)


@pytest.mark.parametrize(
    ("x", "order", "delay", "named"),
    [
        ([1.0, 2.0], 3, 1, "x"),
        (np.arange(9.0), 1, 1, "order"),
        (np.arange(9.0), 9, 1, "order"),
        (np.arange(9.0), 3, 0, "delay"),
        (np.arange(9.0), 4, 3, "x"),
    ],
)
def test_what_has_no_patterns_is_refused(x, order, delay, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        ordinal_patterns(x, order, delay)
