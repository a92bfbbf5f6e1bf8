"""Surrogates keep what they are to keep; the test of them has the size and the power it claims."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

import impactsig
from impactsig import Impacts, InvalidInput, prediction_error, surrogate_test, surrogates
from tests import firing

METHODS = ["shuffled", "phase", "iaaft"]
RNG = np.random.default_rng(5)
NOISE = lfilter([1], [1, -0.7], RNG.standard_normal(400))[100:]


def logistic(count):
    x = np.empty(count)
    x[0] = 0.4
    for k in range(1, count):
        x[k] = 4 * x[k - 1] * (1 - x[k - 1])
    return x


@pytest.mark.parametrize("n", [300, 299])
def test_phase_surrogates_keep_mean_and_spectrum(n):
    x = NOISE[:n] + 3
    made = surrogates(x, 5, "phase", match_ends=False, seed=1)
    assert made.values.shape == (5, n)
    np.testing.assert_allclose(
        np.abs(np.fft.rfft(made.values)), np.tile(np.abs(np.fft.rfft(x)), (5, 1)), rtol=1e-9
    )
    assert made.spectrum_error.max() < 1e-12
    assert np.abs(np.corrcoef(np.vstack((x, made.values)))[0, 1:]).max() < 0.5


@pytest.mark.parametrize("n", [300, 299])
def test_iaaft_surrogates_have_the_values_and_nearly_the_spectrum(n):
    x = np.exp(0.3 * NOISE[:n])
    made = surrogates(x, 5, "iaaft", match_ends=False, seed=1)
    np.testing.assert_array_equal(np.sort(made.values), np.tile(np.sort(x), (5, 1)))
    size = np.abs(np.fft.rfft(x))[1:]
    apart = np.abs(np.fft.rfft(made.values))[:, 1:] - size
    expected = np.sqrt(np.sum(apart**2, axis=1) / np.sum(size**2))
    np.testing.assert_allclose(made.spectrum_error, expected)
    assert expected.max() < 0.1
    shuffled = surrogates(x, 5, "shuffled", seed=1)
    assert shuffled.spectrum_error.min() > 5 * expected.max()
    assert (made.iterations > 2).all()


def test_shuffled_surrogates_are_permutations():
    made = surrogates(NOISE, 3, "shuffled", seed=1)
    np.testing.assert_array_equal(np.sort(made.values), np.tile(np.sort(NOISE), (3, 1)))
    assert not np.array_equal(made.values[0], made.values[1])
    np.testing.assert_array_equal(np.asarray(made), made.values)
    assert len(made) == 3
    assert "IAAFT" not in repr(made)


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


def test_the_stretch_that_is_taken_closes_on_itself():
    """A sine of 10.4 turns: the jump from end to start is that of neighbours after trimming."""
    x = np.sin(2 * np.pi * 10.4 * np.arange(1000) / 1000)
    made = surrogates(x, 1, "phase", seed=1)
    np.testing.assert_array_equal(made.original, x[made.start : made.start + len(made.original)])
    assert 900 <= len(made.original) < 1000
    assert abs(made.original[0] - made.original[-1]) <= np.median(np.abs(np.diff(x)))
    power = np.abs(np.fft.rfft(made.original)) ** 2
    jumped = np.abs(np.fft.rfft(x)) ** 2
    assert power[50:].sum() / power[1:].sum() < 0.05 * jumped[50:].sum() / jumped[1:].sum()
    assert not made.warnings


def closed_stretch(x):
    """The longest stretch that leads on from its end to its start, by trying one after another.

    Its jump there, and its change of slope, are no greater than the median between neighbours; a
    tenth of the series may go. Where none does it, the best. Also by how much its ends miss.
    """
    n = len(x)
    steps = [x[i + 1] - x[i] for i in range(n - 1)]
    bends = [steps[i + 1] - steps[i] for i in range(n - 2)]
    usual_step, usual_bend = np.median(np.abs(steps)), np.median(np.abs(bends))
    best = np.inf, 0, n
    for length in range(n, n - n // 10 - 1, -1):
        tried = []
        for start in range(n - length + 1):
            part = x[start : start + length]
            jump = abs(part[0] - part[-1]) / usual_step
            slip = abs((part[1] - part[0]) - (part[-1] - part[-2])) / usual_bend
            tried.append((max(jump, slip), start, start + length))
        best = min(best, min(tried), key=lambda one: one[0])
        if best[0] <= 1:
            break
    return best


@pytest.mark.parametrize("kind", ["noise", "walk", "sine", "drift"])
@pytest.mark.parametrize("seed", range(8))
def test_the_stretch_is_that_of_the_slow_twin(kind, seed):
    rng = np.random.default_rng([seed, 11])
    n = int(rng.integers(80, 140))
    x = {
        "noise": lambda: rng.standard_normal(n),
        "walk": lambda: rng.standard_normal(n).cumsum(),
        "sine": lambda: np.sin(rng.uniform(0.1, 0.7) * np.arange(n)) + 0.01 * rng.random(n),
        "drift": lambda: rng.standard_normal(n) + 0.5 * np.arange(n),
    }[kind]()
    miss, start, stop = closed_stretch(x)
    found = surrogates(x, 0, "phase")
    assert (found.start, found.start + len(found.original)) == (start, stop)
    np.testing.assert_array_equal(found.original, x[start:stop])
    assert bool(found.warnings) == (miss > 2)
    if miss > 2:
        assert f"by {miss:.2g} times" in found.warnings[0]


def test_a_drift_is_warned_of():
    drifting = NOISE + 0.5 * np.arange(len(NOISE))
    assert "drift" in surrogates(drifting, 1, seed=1).warnings[0]
    assert "drift" in surrogate_test(drifting, count=19, seed=1).describe()
    assert not surrogates(drifting, 1, "shuffled", seed=1).warnings


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
    """AR(1) is not independent, its exponential not Gaussian; neither is beyond IAAFT's null."""
    bent = np.exp(NOISE)
    assert surrogate_test(NOISE, surrogates="shuffled", seed=1).rejected
    assert not surrogate_test(NOISE, surrogates="phase", seed=1).rejected
    assert surrogate_test(bent, np.min, surrogates="phase", seed=1).rejected
    assert not surrogate_test(bent, np.min, surrogates="iaaft", seed=1).rejected
    assert not surrogate_test(bent, surrogates="iaaft", seed=1).rejected


def test_the_iaaft_test_does_not_depend_on_scale_and_hardly_on_skewness():
    x = lfilter([1], [1, -0.7], np.random.default_rng(6).standard_normal(600))[100:]
    plain, scaled, skewed = (
        surrogate_test(v, count=19, seed=1) for v in (x, 1e-3 * x + 7, np.exp(0.5 * x))
    )
    assert scaled.statistic == pytest.approx(plain.statistic, rel=1e-3)
    assert skewed.statistic == pytest.approx(plain.statistic, rel=0.05)
    assert skewed.spectrum_error < 2 * plain.spectrum_error
    raw = surrogate_test(np.exp(0.5 * x), surrogates="phase", count=19, seed=1)
    expected = prediction_error(surrogates(np.exp(0.5 * x), 0, "phase").original).value
    assert raw.statistic == expected


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
        ({"surrogates": "twin"}, "method"),
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
