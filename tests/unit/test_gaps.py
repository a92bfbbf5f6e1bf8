"""No vector, neighbour's future or pair reaches across a gap of a run, whoever makes them."""

import numpy as np
import pytest
from scipy.special import ndtri

import impactsig
from impactsig import InvalidInput
from impactsig.reconstruct import _series, classic
from impactsig.reconstruct.information import information
from impactsig.reconstruct.sums import _counting
from tests import naive_reconstruct_embed as naive
from tests import naive_recurrence
from tests.gaps import parts, vectors, with_gaps

RNG = np.random.default_rng(8)
CUTS = [0, 37, 38, 90, 149]
X = 2 + naive.henon(150)
RUN = with_gaps(X, CUTS)
CASES = [(1, 1), (2, 1), (3, 1), (2, 3), (3, 2)]


def far_apart(places, theiler):
    return np.abs(places[:, None] - places) > theiler


def distances(found, maximum=True):
    gap = np.abs(found[:, None] - found)
    return gap.max(axis=2) if maximum else np.sqrt((gap**2).sum(axis=2))


def test_a_gap_is_nan_as_long_as_asked_for():
    for width in (1, 3):
        marked = _series.series(RUN, gap=width)
        assert len(marked) == 150 - len(CUTS) + width * len(CUTS)
        np.testing.assert_allclose(marked[width : width + 36], X[1:37], rtol=1e-9)
        assert np.isnan(marked[:width]).all()
    np.testing.assert_array_equal(_series.series(RUN), RUN.intervals())
    found = _series.stretches(_series.series(RUN, gap=2))
    for one, other in zip(found, filter(len, parts(X, CUTS)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize("length", [1, 2, 5])
def test_unbroken_is_what_holds_no_nan(length):
    x = np.where(RNG.random(60) < 0.2, np.nan, 1.0)
    expected = [not np.isnan(x[i : i + length]).any() for i in range(60 - length + 1)]
    np.testing.assert_array_equal(_series.unbroken(x, length), expected)


@pytest.mark.parametrize(("m", "delay"), CASES)
def test_delay_vectors(m, delay):
    _, expected = vectors(X, CUTS, m, delay)
    found = impactsig.delay_embed(RUN, m, delay)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert not found.flags.writeable


@pytest.mark.parametrize(("m", "delay"), CASES)
@pytest.mark.parametrize("theiler", [0, 4])
def test_correlation_sums(m, delay, theiler):
    places, found = vectors(X, CUTS, m, delay)
    pair = np.triu(far_apart(places, theiler))
    radii = np.array([0.05, 0.1, 0.4, 0.9])  # none of them a distance
    apart = distances(found)
    expected = [np.count_nonzero(apart[pair] <= r) for r in radii]
    result = impactsig.correlation_sum(RUN, [m], delay=delay, theiler=theiler, radii=radii)
    np.testing.assert_array_equal(result.counts[0], expected)
    assert result.pairs[0] == np.count_nonzero(pair)
    marked = _series.series(RUN, gap=delay)
    for kernel in ("pairs", "boxes", "trees"):
        counted = _counting.count_pairs(marked, range(1, m + 1), delay, theiler, radii, 2, kernel)
        np.testing.assert_array_equal(counted[-1], expected, kernel)


def test_default_radii_hold_all_pairs():
    found = impactsig.correlation_sum(RUN, 3)
    np.testing.assert_array_equal(found.counts[:, -1], found.pairs)


@pytest.mark.parametrize(("m", "delay"), CASES)
def test_false_neighbours(m, delay):
    places, found = _one_step_gaps(m + 1, delay)
    apart = distances(found[:, :m], maximum=False)
    apart[~far_apart(places, 3)] = np.inf
    other = np.argmin(apart, axis=1)
    gap = np.abs(found[:, m] - found[other, m])
    near = apart[np.arange(len(found)), other]
    result = impactsig.false_nearest_neighbors(RUN, [m], delay, 3, growth=5.0, size=1.0)
    assert result.by_growth[0] == pytest.approx(np.mean(gap > 5 * near), abs=1e-12)
    sd = RUN.intervals().std()
    assert result.by_size[0] == pytest.approx(np.mean(np.hypot(near, gap) > sd), abs=1e-12)


def _one_step_gaps(m, delay):
    """Places and vectors, where a gap counts as one step."""
    places, found, start = [], [], 0
    for part in parts(X, CUTS):
        for i in range(len(part) - (m - 1) * delay):
            places.append(start + i)
            found.append(part[i : i + (m - 1) * delay + 1 : delay])
        start += len(part) + 1
    return np.array(places), np.array(found)


@pytest.mark.parametrize(("m", "delay", "steps"), [(1, 1, 4), (2, 1, 6), (2, 2, 5)])
def test_neighbours_are_followed_between_gaps_only(m, delay, steps):
    places, whole = _one_step_gaps((m - 1) * delay + steps + 1, 1)
    span = (m - 1) * delay
    apart = distances(whole[:, : span + 1 : delay], maximum=False)
    apart[~far_apart(places, 2)] = np.inf
    other = np.argmin(apart, axis=1)
    gaps = np.abs(whole[:, span:] - whole[other, span:])
    found = impactsig.lyapunov_exponent(RUN, dimension=m, delay=delay, theiler=2, steps=steps)
    assert found.references == len(whole)
    np.testing.assert_allclose(found.stretch, np.median(np.log(gaps), axis=0), rtol=1e-6)


@pytest.mark.parametrize(("m", "delay", "horizon"), [(1, 1, 1), (2, 1, 3), (2, 3, 2)])
def test_predictions(m, delay, horizon):
    span = (m - 1) * delay
    places, whole = _one_step_gaps(span + horizon + 1, 1)
    found, future = whole[:, : span + 1 : delay], whole[:, -1]
    apart = distances(found)
    apart[~far_apart(places, 2)] = np.inf
    guess = future[np.argsort(apart, axis=1, kind="stable")[:, :5]].mean(axis=1)
    expected = np.sqrt(np.mean((guess - future) ** 2)) / future.std()
    for predictor in ("constant", "linear"):
        result = impactsig.prediction_error(
            RUN, m, delay, horizon, neighbors=6 if predictor == "linear" else 5, theiler=2,
            predictor=predictor,
        )  # fmt: skip
        assert result.references == len(whole)
        if predictor == "constant":
            assert result.value == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("m", "delay"), [(1, 1), (2, 2)])
@pytest.mark.parametrize("workers", [1, 3])
def test_recurrences(m, delay, workers):
    places, found = vectors(X, CUTS, m, delay)
    count = len(_series.series(RUN, gap=delay)) - (m - 1) * delay
    expected = np.zeros((count, count), bool)
    expected[np.ix_(places, places)] = distances(found) <= 0.3
    plotted = impactsig.recurrence_plot(RUN, m, delay, radius=0.3, workers=workers)
    np.testing.assert_array_equal(plotted.matrix, expected)
    assert f"{len(found)} vectors" in repr(plotted)
    result = impactsig.recurrence_quantification(
        RUN, m, delay, radius=0.3, theiler=2, workers=workers
    )
    diagonal, vertical = naive_recurrence.lines(expected, 2)
    np.testing.assert_array_equal(result.diagonals, np.bincount(diagonal, minlength=count + 1))
    np.testing.assert_array_equal(result.verticals, np.bincount(vertical, minlength=count + 1))
    assert result.recurrence_rate == sum(diagonal) / np.count_nonzero(far_apart(places, 2))


def test_autocorrelation_and_information_pair_nothing_across():
    lag = 2
    ends = [(part[:-lag], part[lag:]) for part in parts(X, CUTS)]
    first, second = (np.concatenate(each) for each in zip(*ends, strict=True))
    every = np.concatenate(parts(X, CUTS))
    covariance = np.mean((first - every.mean()) * (second - every.mean()))
    found = impactsig.embedding_delay(RUN, "1/e", longest=4)
    assert found.curve[lag] == pytest.approx(covariance / every.var(), rel=1e-6)
    scores = ndtri((np.argsort(np.argsort(every)) + 0.5) / len(every))
    pieces = np.split(scores, np.cumsum([len(part) for part in parts(X, CUTS)])[:-1])
    paired = [(part[:-lag], part[lag:]) for part in pieces]
    told = impactsig.embedding_delay(RUN, longest=4)
    expected = information(*(np.concatenate(each) for each in zip(*paired, strict=True)), 4)
    assert told.curve[lag] == pytest.approx(expected, abs=1e-9)


def test_steps_of_the_reversal_statistic():
    step = np.concatenate([part[3:] - part[:-3] for part in parts(X, CUTS)])
    expected = np.mean(step**3) / np.mean(step**2) ** 1.5
    assert impactsig.time_reversal_asymmetry(RUN, 3) == pytest.approx(expected, rel=1e-9)


def test_surrogates_are_of_the_longest_stretch_and_say_so():
    longest = max(parts(X, CUTS), key=len)
    for method in ("shuffled", "autoregressive"):
        found = impactsig.surrogates(RUN, 2, method, seed=1)
        np.testing.assert_allclose(found.original, longest, rtol=1e-9)
        assert f"the longest of {sum(map(bool, map(len, parts(X, CUTS))))} stretches" in repr(found)
    tested = impactsig.surrogate_test(RUN, "time_reversal_asymmetry", count=19, seed=1)
    assert tested.count <= len(longest)
    assert "between two gaps" in str(tested)
    decided = impactsig.return_map_determinism(RUN, count=19, seed=1)
    assert "between two gaps" in repr(decided)


def test_the_dimension_is_that_of_the_parts():
    x = 2 + naive.henon(4000)
    cuts = list(range(79, 4000, 80))
    whole = impactsig.correlation_dimension(x, 3, theiler=4, value_error=0.0)
    found = impactsig.correlation_dimension(with_gaps(x, cuts), 3, theiler=4, timing_error=0.0)
    assert found.verdict == "dimension"
    # Every interval after a gap would follow from nothing: the dimension would rise with m.
    low, high = whole.interval
    assert low < found.dimension < high


def test_the_exponent_is_that_of_the_parts():
    x = 2 + naive.henon(6000)
    found = impactsig.lyapunov_exponent(with_gaps(x, range(59, 6000, 60)), dimension=2)
    assert found.exponent == pytest.approx(0.4192, rel=0.05)


def test_a_period_is_seen_in_spite_of_a_gap():
    x = np.tile([1.0, 2.0, 4.0], 60)
    found = impactsig.lyapunov_exponent(with_gaps(x, [100]), dimension=1, theiler=1)
    assert (found.verdict, found.period) == ("periodic", 3)


@pytest.mark.parametrize(
    "measure",
    [classic.hurst_rs, classic.dfa, classic.sampen, lambda x: classic.lyap_r(x, dimension=2)],
)
def test_measures_that_cannot_tell_refuse_a_run_with_gaps(measure):
    with pytest.raises(InvalidInput, match=r"^x:.*gaps.*Impacts\.between"):
        measure(RUN)


SHORT = with_gaps(2 + naive.henon(120), range(3, 120, 4))


@pytest.mark.parametrize(
    "use",
    [
        lambda x: impactsig.delay_embed(x, 4),
        lambda x: impactsig.correlation_sum(x, 4, theiler=1),
        lambda x: impactsig.correlation_dimension(x, 4, theiler=1),
        lambda x: impactsig.lyapunov_exponent(x, dimension=2, theiler=1),
        lambda x: impactsig.false_nearest_neighbors(x, 4, theiler=1),
        lambda x: impactsig.averaged_false_neighbors(x, 4, theiler=1),
        lambda x: impactsig.prediction_error(x, 4),
        lambda x: impactsig.recurrence_quantification(x, 4, radius=0.1),
        lambda x: impactsig.time_reversal_asymmetry(x, 3),
        lambda x: impactsig.surrogates(x),
        lambda x: impactsig.surrogate_test(x),
        lambda x: impactsig.return_map_determinism(x),
    ],
)
def test_gaps_that_leave_no_vectors_are_named(use):
    with pytest.raises(InvalidInput, match=r"^x:"):
        use(SHORT)
