"""Surrogates keep what they are to keep; the test of them has the size and the power it claims."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from scipy.stats import rankdata

import impactsig
from impactsig import Impacts, InvalidInput, prediction_error, surrogate_test, surrogates
from tests import firing

METHODS = ["shuffled", "autoregressive"]
RNG = np.random.default_rng(5)
NOISE = lfilter([1], [1, -0.7], RNG.standard_normal(400))[100:]


def logistic(count):
    x = np.empty(count)
    x[0] = 0.4
    for k in range(1, count):
        x[k] = 4 * x[k - 1] * (1 - x[k - 1])
    return x


@pytest.mark.parametrize("function", [lambda x: x, lambda x: x**3, np.exp])
def test_autoregressive_surrogates_have_the_values_and_the_correlation_of_their_scores(function):
    """The mean autocorrelation of the surrogates' scores is that of the data's, AR(1) or not."""
    made = surrogates(function(NOISE), 60, seed=1)
    np.testing.assert_array_equal(np.sort(made.values), np.tile(np.sort(made.original), (60, 1)))
    scores = [rankdata(row) for row in (made.original, *made.values)]
    own, *others = [np.corrcoef(one[:-1], one[1:])[0, 1] for one in scores]
    assert np.mean(others) == pytest.approx(own, abs=4 * np.std(others) / np.sqrt(60) + 0.005)
    assert made.order >= 1


@pytest.mark.parametrize("function", [lambda x: x**3, lambda x: x + 6 * np.sign(x)])
def test_of_a_monotone_function_only_the_gap_that_it_opens_counts(function):
    """All is by ranks: the statistics are equal, but for the groups that a gap sets apart."""
    x = NOISE[:200]
    plain, bent = (surrogate_test(one, count=19, seed=1) for one in (x, function(x)))
    equal = np.array_equal(plain.surrogates, bent.surrogates)
    assert equal == (function(1.0) == 1.0)
    np.testing.assert_array_equal(
        surrogate_test(2 * function(x) - 5, count=19, seed=1).surrogates, bent.surrogates
    )


def _second_order(rng, n=200):
    """Poles 0.9 exp(+-0.7 i)."""
    recursion = [1, -1.8 * np.cos(0.7), 0.81]
    return lfilter([1], recursion, rng.standard_normal(n + 100))[100:]


@pytest.mark.parametrize(
    "function", [lambda x: x**3, lambda x: x + 12 * np.sign(x)], ids=["cube", "two groups"]
)
def test_linear_processes_behind_steep_functions_are_seldom_rejected(function):
    """Of 15 series 0.75 are expected; IAAFT surrogates reject four in five, and all of them."""
    rejected = 0
    for run in range(15):
        x = function(_second_order(np.random.default_rng([run, 3])))
        rejected += surrogate_test(x, count=19, seed=run).rejected
    assert rejected <= 3


def test_noise_as_1_over_f_is_warned_of_and_white_noise_is_not():
    """A random walk has a power 1/f^2, and the dimension 2 of a Brownian path."""
    walk = np.random.default_rng(8).standard_normal(400).cumsum()
    said = " ".join(surrogate_test(walk, count=19, seed=1).warnings)
    assert "1/f^" in said
    assert "finite correlation dimension" in said
    white = surrogate_test(walk[1:] - walk[:-1], count=19, seed=1)
    assert not white.warnings


def test_where_no_linear_process_has_the_spectrum_nothing_is_rejected():
    """Two lines of a spectrum, which no autoregressive process of few coefficients has."""
    n = np.arange(300)
    found = surrogate_test(np.sin(0.7 * n) + np.sin(0.99 * n), count=19, seed=1)
    assert found.spectrum_error > 3
    assert found.p_value == 0.05
    assert not found.decided
    assert not found.rejected
    assert found.describe().startswith("not decided")
    henon = surrogate_test(logistic(300), count=19, seed=1)
    assert henon.decided
    assert henon.spectrum_error < 2


def test_shuffled_surrogates_are_permutations():
    made = surrogates(NOISE, 3, "shuffled", seed=1)
    np.testing.assert_array_equal(np.sort(made.values), np.tile(np.sort(NOISE), (3, 1)))
    assert not np.array_equal(made.values[0], made.values[1])
    np.testing.assert_array_equal(np.asarray(made), made.values)
    assert len(made) == 3
    assert made.order == 0
    assert "independently" in repr(made)
    assert "order" in repr(surrogates(NOISE, 1, seed=1))


@pytest.mark.parametrize("method", METHODS)
def test_a_seed_gives_the_same_and_a_prefix_of_more(method):
    few = surrogates(NOISE, 2, method, seed=7).values
    np.testing.assert_array_equal(few, surrogates(NOISE, 5, method, seed=7).values[:2])
    sequence = np.random.SeedSequence(7)
    np.testing.assert_array_equal(few, surrogates(NOISE, 2, method, seed=sequence).values)
    assert not np.array_equal(few, surrogates(NOISE, 2, method, seed=8).values)
    drawn = np.random.default_rng(7)
    first, second = (surrogates(NOISE, 1, method, seed=drawn).values for _ in range(2))
    assert not np.array_equal(first, second)


def test_a_drift_is_not_rejected_and_warned_of():
    found = surrogate_test(NOISE + 0.5 * np.arange(len(NOISE)), count=19, seed=1)
    assert not found.rejected
    assert "lowest frequencies" in found.describe()


def test_the_p_value_is_the_rank():
    """A statistic that counts its calls: the data come first, the surrogates after."""
    calls = iter([3.0, *range(19)])
    test = surrogate_test(NOISE, lambda x: next(calls), count=19, alternative="less", seed=1)
    assert test.statistic == 3
    assert test.p_value == 5 / 20  # 0, 1, 2, 3 are not above
    calls = iter([3.0, *range(19)])
    test = surrogate_test(NOISE, lambda x: next(calls), count=19, alternative="greater", seed=1)
    assert test.p_value == 17 / 20
    calls = iter([-1.0, *range(19)])
    test = surrogate_test(NOISE, lambda x: next(calls), count=19, seed=1)
    assert test.alternative == "two-sided"
    assert test.p_value == 2 / 20
    assert not test.rejected


@pytest.mark.parametrize("flow", ["rossler", "lorenz"])
def test_integrate_and_fire_intervals_are_more_than_noise(flow):
    for seed in range(2):
        test = surrogate_test(firing.intervals(flow, 1000, seed), count=19, seed=seed)
        assert test.p_value == 0.05
        assert test.deviation < -10
        assert test.describe().startswith("more than a linear Gaussian process")


def test_each_null_hypothesis_is_told_from_the_next():
    """AR(1) is not independent, but linear, also behind an exponential."""
    assert surrogate_test(NOISE, surrogates="shuffled", seed=1).rejected
    assert not surrogate_test(NOISE, seed=1).rejected
    assert not surrogate_test(np.exp(NOISE), seed=1).rejected


def test_shuffled_values_are_compared_as_they_are():
    found = surrogate_test(NOISE, surrogates="shuffled", count=19, seed=1)
    assert found.statistic == prediction_error(NOISE).value
    assert found.spectrum_error is None
    assert found.name == "prediction error"


def test_the_logistic_map_is_found_by_both_statistics():
    x = logistic(500)
    assert surrogate_test(x, seed=1).rejected
    assert surrogate_test(x, "time_reversal_asymmetry", seed=1).rejected


def test_the_size_of_the_test_is_not_far_off():
    """Of 50 realisations 2.5 +- 1.5 are to be rejected; the slow test looks more closely."""
    rejected = 0
    for run in range(50):
        rng = np.random.default_rng([1, run])
        x = np.exp(0.5 * lfilter([1], [1, -0.8], rng.standard_normal(228))[100:])
        rejected += surrogate_test(x, "time_reversal_asymmetry", count=39, seed=run).rejected
    assert rejected <= 8


def test_given_impacts_their_intervals_are_tested():
    isi = firing.intervals("lorenz", 300, 1)
    impacts = Impacts(np.concatenate(([0.0], np.cumsum(isi))))
    one, other = (surrogate_test(x, count=19, seed=1) for x in (impacts, impacts.intervals()))
    assert one.statistic == other.statistic
    np.testing.assert_array_equal(one.surrogates, other.surrogates)


def test_lists_series_and_whole_numbers_are_series_too():
    whole = RNG.integers(0, 10**6, 200)
    expected = surrogates(whole.astype(float), 2, seed=1).values
    for same in (whole, whole.tolist(), pd.Series(whole)):
        np.testing.assert_array_equal(surrogates(same, 2, seed=1).values, expected)


def test_what_is_odd_about_a_series_is_said():
    periodic = surrogate_test(np.tile([1.0, 2, 3, 5], 50), count=19, seed=1)
    assert "periodic: it repeats every 4 values" in periodic.describe()
    assert "periodic" in repr(periodic)
    coarse = surrogate_test(np.round(NOISE), count=19, seed=1)
    assert "distinct" in coarse.warnings[0]
    assert surrogate_test(NOISE, count=19, seed=1).warnings == ()


@pytest.mark.parametrize(
    "x",
    [
        [1.0, np.nan] * 50,
        [1.0, np.inf] * 50,
        [2.0] * 100,
        [1.0, 2.0, 3.0],
        np.ones((10, 10)),
        ["a"] * 30,
        1.0,
    ],
)
@pytest.mark.parametrize("function", [surrogates, surrogate_test])
def test_what_is_no_series_is_refused(function, x):
    with pytest.raises(InvalidInput, match=r"^x:"):
        function(x)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"surrogates": "iaaft"}, "surrogates"),
        ({"statistic": "mean"}, "statistic"),
        ({"statistic": 3}, "statistic"),
        ({"statistic": lambda x: np.nan}, "statistic"),
        ({"statistic": lambda x: "much"}, "statistic"),
        ({"count": 5}, "count"),
        ({"alternative": "more"}, "alternative"),
        ({"seed": "a"}, "seed"),
    ],
)
def test_arguments_that_cannot_be_used(options, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        surrogate_test(NOISE, **options)


def test_a_return_map_that_is_a_function_and_one_that_is_none():
    found = impactsig.return_map_determinism(logistic(1000), seed=1)
    assert found.explained > 0.98
    assert found.p_value == 0.01
    assert "random order" in repr(found)
    random = impactsig.return_map_determinism(RNG.random(1000), neighbors=10, seed=1)
    # 1 - (1 + 1/k) on average
    assert random.surrogates.mean() == pytest.approx(-0.1, abs=0.02)
    assert random.explained == pytest.approx(-0.1, abs=0.1)
    assert random.p_value > 0.01
    two_back = impactsig.return_map_determinism(logistic(1000)[::2], lag=1, seed=1)
    assert 0.8 < two_back.explained < found.explained  # the twice iterated map is steeper


def test_the_asymmetry_of_values_whose_cubes_vanish_is_that_of_others():
    x = logistic(200)
    expected = impactsig.time_reversal_asymmetry(x)
    assert impactsig.time_reversal_asymmetry(1e-120 * x) == pytest.approx(expected)
