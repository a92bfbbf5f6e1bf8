"""Dimensions of systems in the literature, and what short and noisy series of them give.

Hénon 1.220 +- 0.036, Lorenz 2.05 +- 0.01, Rössler 1.991 +- 0.065 (Sprott, Chaos and Time-Series
Analysis, 2003); of Rössler's intervals all tools see a plateau at 1.84. Interspike intervals have
the dimension of the flow (Sauer 1994).
"""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import correlation_dimension

from ..series import henon, ikeda, lorenz, lorenz_intervals, noisy, roessler_intervals, torus

INTERVALS = {"dimensions": 4, "theiler": 12}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("series", "options", "truth", "within"),
    [
        (henon, {"dimensions": 3, "theiler": 1}, 1.22, 0.02),
        (lorenz, {"dimensions": (2, 3, 4), "delay": 4, "theiler": 50}, 2.05, 0.06),
        (lorenz_intervals, INTERVALS, 2.05, 0.06),
        (roessler_intervals, INTERVALS, 1.84, 0.03),
    ],
)
def test_long_series_have_the_published_dimension(series, options, truth, within):
    found = [correlation_dimension(series(20_000, seed), **options) for seed in range(3)]
    assert all(one.verdict == "dimension" for one in found)
    assert np.mean([one.value for one in found]) == pytest.approx(truth, abs=within)


@pytest.mark.parametrize(
    ("series", "truth"), [(roessler_intervals, 1.99), (lorenz_intervals, 2.05)]
)
@pytest.mark.parametrize(("noise", "bias"), [(0.0, 0.15), (0.05, 0.2)])
def test_three_hundred_intervals_tell_the_dimension(series, truth, noise, bias):
    found = [
        correlation_dimension(noisy(series(300, seed), noise, seed), **INTERVALS)
        for seed in range(15)
    ]
    values = np.array([one.value for one in found if one.value is not None])
    assert len(values) >= 14
    # The sample of 15 may miss the mean by two of its standard errors.
    assert abs(values.mean() - truth) <= bias + 2 * values.std() / np.sqrt(len(values))


@pytest.mark.slow
@pytest.mark.parametrize("series", [roessler_intervals, lorenz_intervals])
def test_three_hundred_intervals_scatter_little_and_know_it(series):
    found = [correlation_dimension(series(300, seed), **INTERVALS) for seed in range(1000, 1200)]
    values = np.array([one.value for one in found if one.value is not None])
    assert len(values) >= 198
    # Of 200 the scatter itself is known to 5 %.
    assert values.std() <= 0.15 * 1.1
    low, high = np.array([one.interval for one in found if one.interval is not None]).T
    assert 0.88 <= np.mean((low <= values.mean()) & (values.mean() <= high)) <= 0.995


@pytest.mark.parametrize("seed", range(3))
def test_noise_fills_every_dimension(seed):
    found = correlation_dimension(np.random.default_rng(seed).normal(size=2000), range(2, 6))
    assert found.verdict == "no plateau"
    for one in found.by_dimension:
        assert one.value >= 0.9 * one.embedding


@pytest.mark.parametrize(
    ("series", "count", "dimensions", "truth", "within"),
    [
        (ikeda, 2000, 4, 1.69, 0.15),
        (lambda n, seed: torus(n, seed, 1), 500, 3, 1.0, 0.1),
        # Points of a torus lie more evenly than by chance, so that short series read too high.
        (lambda n, seed: torus(n, seed, 2), 10_000, (3, 4), 2.0, 0.2),
    ],
)
def test_systems_nothing_was_chosen_by(series, count, dimensions, truth, within):
    found = correlation_dimension(series(count, 1), dimensions, theiler=1)
    assert found.verdict == "dimension"
    assert found.value == pytest.approx(truth, abs=within)
