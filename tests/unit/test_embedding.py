"""Delay vectors, and the choice of delay and dimension."""

import numpy as np
import pandas as pd
import pytest
from scipy.special import digamma, ndtri

import impactsig
from impactsig import Impacts, InvalidInput
from tests import naive_reconstruct_embed as naive

NOISE = np.random.default_rng(5).normal(size=4000)
HENON = naive.henon(3000)
CHOICES = (
    lambda x: impactsig.embedding_delay(x, "1/e"),
    impactsig.embedding_delay,
    impactsig.false_nearest_neighbors,
    impactsig.averaged_false_neighbors,
)


@pytest.fixture(scope="module")
def lorenz():
    return naive.lorenz_x(5000)


# -- delay vectors -------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "delay"), [(1, 1), (2, 1), (3, 4), (4, 33)])
def test_row_i_holds_x_i_and_what_comes_whole_delays_later(m, delay):
    x = np.arange(100.0)
    vectors = impactsig.delay_embed(x, m, delay)
    assert vectors.shape == (100 - (m - 1) * delay, m)
    i, k = np.indices(vectors.shape)
    assert np.array_equal(vectors, i + k * delay)


def test_delay_vectors_are_a_view_that_cannot_be_written():
    x = np.arange(10.0)
    vectors = impactsig.delay_embed(x, 3)
    assert np.shares_memory(vectors, x)
    assert not vectors.flags.writeable
    assert x.flags.writeable


def test_series_come_as_lists_pandas_whole_numbers_or_impacts():
    expected = impactsig.delay_embed(np.array([3.0, 1, 2, 5]), 2)
    assert np.array_equal(impactsig.delay_embed([3, 1, 2, 5], 2), expected)
    assert np.array_equal(impactsig.delay_embed(pd.Series([3, 1, 2, 5]), 2), expected)
    assert np.array_equal(impactsig.delay_embed(Impacts([0, 3, 4, 6, 11]), 2), expected)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (([1, 2, 3], 0), "dimension"),
        (([1, 2, 3], 2.0), "dimension"),
        (([1, 2, 3], True), "dimension"),
        (([1, 2, 3], 2, 0), "delay"),
        (([1, 2, 3], 3, 2), "x"),
        ((np.ones((3, 2)), 2), "x"),
        (([1, np.nan, 3], 2), "x"),
    ],
)
def test_an_embedding_that_cannot_be_is_refused(arguments, named):
    with pytest.raises(InvalidInput) as caught:
        impactsig.delay_embed(*arguments)
    assert caught.value.argument == named


# -- delay ---------------------------------------------------------------------------------------


def test_the_autocorrelation_of_a_sine_is_a_cosine_and_zero_at_a_quarter():
    x = 3 + np.sin(2 * np.pi * np.arange(8000) / 50)
    found = impactsig.embedding_delay(x, "zero", longest=200)
    assert np.allclose(found.curve, np.cos(2 * np.pi * np.arange(201) / 50), atol=2e-3)
    assert found.delay == 13  # 50/4 is 12.5
    first = np.ceil(50 * np.arccos(np.exp(-1)) / (2 * np.pi))
    assert impactsig.embedding_delay(x, "1/e").delay == first


def test_the_autocorrelation_of_an_autoregressive_series_is_a_power():
    x = naive.autoregressive(100_000, 0.9)
    found = impactsig.embedding_delay(x, "1/e", longest=20)
    assert np.allclose(found.curve, 0.9 ** np.arange(21), atol=0.03)
    assert abs(found.delay - np.ceil(-1 / np.log(0.9))) <= 1


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.6, 0.9])
def test_the_information_of_gaussian_values_is_minus_half_ln_1_minus_rho_squared(correlation):
    x = naive.autoregressive(20_000, correlation)
    found = impactsig.embedding_delay(x, longest=1)
    expected = -0.5 * np.log(1 - correlation**2)
    # An estimate of independent pairs scatters by 0.6/sqrt(n), correlated ones by some more.
    assert found.curve[1] == pytest.approx(expected, abs=0.025)


def test_few_gaussian_pairs_tell_their_information():
    """Bins had 0.59 for 0.83; the mean of 60 estimates of 200 pairs each is known to 0.01."""
    estimates = []
    for seed in range(60):
        x, y = np.random.default_rng(seed).standard_normal((2, 200))
        y = 0.9 * x + np.sqrt(1 - 0.81) * y
        estimates.append(impactsig.mutual_information(x, y))
        assert estimates[-1] == pytest.approx(impactsig.mutual_information(y, x), abs=1e-12)
    assert np.mean(estimates) == pytest.approx(-0.5 * np.log(1 - 0.81), abs=0.04)


def test_the_information_is_that_of_the_naive_twin():
    x, y = np.random.default_rng(3).standard_normal((2, 60))
    score = [ndtri((np.argsort(np.argsort(one)) + 0.5) / 60) for one in (x, y)]
    apart = [np.abs(one[:, None] - one) for one in score]
    total = 0.0
    for i in range(60):
        both = np.sort(np.maximum(apart[0][i], apart[1][i]))  # the pair itself comes first
        near = [np.sum(one[i] < both[3]) - 1 for one in apart]
        total += digamma(3) + digamma(60) - sum(digamma(k + 1) for k in near)
    assert impactsig.mutual_information(x, y, neighbors=3) == pytest.approx(total / 60, abs=1e-12)


def test_values_that_are_equal_tell_no_more_than_they_do():
    """Rounding takes information away; of whole numbers the information is a sum over cells."""
    rng = np.random.default_rng(4)
    x = rng.integers(0, 3, 3000)
    y = (x + (rng.random(3000) < 0.3)) % 3
    p = np.histogram2d(x, y, bins=3)[0] / 3000
    independent = p.sum(1, keepdims=True) * p.sum(0, keepdims=True)
    expected = np.sum(p[p > 0] * np.log(p[p > 0] / independent[p > 0]))
    assert impactsig.mutual_information(x, y) == pytest.approx(expected, abs=0.04)
    rounded = np.round(rng.standard_normal((2, 2000)), 1)
    assert impactsig.mutual_information(*rounded) == pytest.approx(0, abs=4 * 0.7 / np.sqrt(2000))


@pytest.mark.parametrize(
    ("x", "y", "options", "named"),
    [
        ([1.0, 2, 3, 4, 5], [1.0, 2, 3, 4], {"neighbors": 2}, "y"),
        (np.arange(9.0), np.ones(9), {}, "y"),
        (np.arange(4.0), np.arange(4.0), {}, "x"),
        (np.arange(9.0), np.arange(9.0), {"neighbors": 0}, "neighbors"),
    ],
)
def test_what_has_no_information_is_refused(x, y, options, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        impactsig.mutual_information(x, y, **options)


@pytest.mark.parametrize("neighbors", [4, 10])
def test_the_information_of_independent_values_scatters_by_the_noise_it_says(neighbors):
    found = [
        impactsig.embedding_delay(
            np.random.default_rng(seed).normal(size=800), longest=20, neighbors=neighbors
        )
        for seed in range(15)
    ]
    curves = np.array([one.curve[1:] for one in found])
    assert abs(curves.mean()) < 0.3 * found[0].noise  # bins are off by many of these
    assert np.std(curves) == pytest.approx(found[0].noise, rel=0.25)


def test_information_does_not_change_with_a_rising_function():
    one = impactsig.embedding_delay(HENON[:1000])
    other = impactsig.embedding_delay(np.exp(HENON[:1000]))
    np.testing.assert_array_equal(one.curve, other.curve)


def test_a_lorenz_flow_has_its_first_minimum_where_others_find_it(lorenz):
    # 0.16 to 0.24 time units in the literature's figures.
    assert impactsig.embedding_delay(lorenz).delay in (4, 5, 6)


@pytest.mark.parametrize("x", [NOISE[:2000], HENON[:2000], naive.autoregressive(2000, 0.9)])
def test_a_curve_that_only_falls_has_no_delay_and_says_so(x):
    found = impactsig.embedding_delay(x)
    assert found.delay is None
    assert "without a minimum" in found.describe()


def test_neighbors_belong_to_the_information():
    with pytest.raises(InvalidInput, match=r"^neighbors:"):
        impactsig.embedding_delay(NOISE[:100], "zero", neighbors=4)


def test_an_autocorrelation_that_never_falls_has_no_delay_and_says_so():
    found = impactsig.embedding_delay(np.arange(100.0) ** 2, "1/e", longest=5)
    assert found.delay is None
    assert "stays above" in str(found)


# -- dimension -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "delay", "theiler"), [(1, 1, 0), (2, 1, 5), (3, 3, 12)])
@pytest.mark.parametrize("x", [naive.henon(180), np.round(NOISE[:180], 1)])
def test_false_neighbours_are_those_of_the_slow_twin(x, m, delay, theiler):
    found = impactsig.false_nearest_neighbors(x, [m], delay, theiler, growth=5.0, size=1.0)
    # Neighbours at one distance may differ, in rounded values.
    reach = 0 if x[0] != np.round(x[0], 1) else 0.1
    by_growth, by_size = naive.false_neighbors(x, m, delay, theiler, 5.0, 1.0)
    assert found.by_growth[0] == pytest.approx(by_growth, abs=reach + 1e-12)
    assert found.by_size[0] == pytest.approx(by_size, abs=reach + 1e-12)


def test_henon_needs_two_dimensions():
    assert impactsig.false_nearest_neighbors(HENON, 5).dimension == 2
    assert impactsig.averaged_false_neighbors(HENON, 5).dimension == 2


def test_the_logistic_map_needs_one_dimension():
    assert impactsig.false_nearest_neighbors(naive.logistic(2000), 4).dimension == 1


def test_lorenz_needs_three_dimensions(lorenz):
    assert impactsig.false_nearest_neighbors(lorenz, 5, 4).dimension == 3
    assert impactsig.averaged_false_neighbors(lorenz, 6, 4).dimension == 3


def test_a_sine_needs_two_dimensions():
    x = np.sin(0.1 * np.arange(3000))
    assert impactsig.false_nearest_neighbors(x, 4, 16).dimension == 2
    assert impactsig.averaged_false_neighbors(x, 4, 16).dimension == 2


def test_noise_has_no_dimension():
    averaged = impactsig.averaged_false_neighbors(NOISE, 6)
    assert not averaged.deterministic
    assert averaged.dimension is None
    assert np.allclose(averaged.e2, 1, atol=0.1)
    assert "no determinism" in averaged.describe()
    assert impactsig.false_nearest_neighbors(NOISE, 8).dimension is None


def test_neighbours_that_foretell_nothing_make_no_dimension():
    # Few are false by the criteria alone: the innovation is 0.44 of the spread.
    found = impactsig.false_nearest_neighbors(naive.autoregressive(4000, 0.9), 6)
    assert found.share.min() <= found.tolerance
    assert found.dimension is None
    assert "noise" in found.describe()


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize("choose", CHOICES)
@pytest.mark.parametrize(
    "x",
    [
        [],
        [1.0],
        np.ones(500),
        np.where(np.arange(500) == 7, np.nan, HENON[:500]),
        np.where(np.arange(500) == 7, np.inf, HENON[:500]),
        HENON[:500].reshape(2, -1),
        ["a"] * 500,
        HENON[:500] + 1j,
        HENON[:12],
        None,
    ],
)
def test_what_is_no_series_is_refused_by_name(choose, x):
    with pytest.raises(InvalidInput) as caught:
        choose(x)
    assert caught.value.argument == "x"


@pytest.mark.parametrize("choose", CHOICES[2:])
def test_a_series_of_few_values_has_no_dimension_and_says_why(choose):
    found = choose(np.tile([1.0, 2.0, 4.0], 200))
    assert found.dimension is None
    assert "3 values only" in found.describe()


@pytest.mark.parametrize("choose", CHOICES[2:])
def test_equal_vectors_are_no_neighbours(choose):
    with pytest.raises(InvalidInput, match="different values"):
        choose(np.append(np.ones(500), 2.0), 2, theiler=3)


@pytest.mark.parametrize("dimensions", [0, [], [2, 2], [3, 1], 2.5, "two"])
def test_dimensions_are_ascending_whole_numbers(dimensions):
    with pytest.raises(InvalidInput) as caught:
        impactsig.false_nearest_neighbors(HENON, dimensions)
    assert caught.value.argument == "dimensions"
