"""The correlation sum: closed forms, what the default radii are, and what is refused."""

import matplotlib
import numpy as np
import pandas as pd
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

import impactsig
from impactsig import Impacts, InvalidInput, correlation_sum
from impactsig.reconstruct.sums import _counting, _pairs, _radii
from tests import naive_reconstruct
from tests.naive_reconstruct_embed import henon

RNG = np.random.default_rng(4)
NOISE = RNG.uniform(size=4000)


@pytest.mark.parametrize("kernel", ["pairs", "boxes", "trees"])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_points_on_a_line(kernel, m):
    # x_i = i: the distance of two vectors is the difference of their indices, in any dimension.
    n, window = 500, 3
    radii = np.array([0.5, 3.0, 4.0, 4.5, 20.0, 1000.0])
    vectors = n - (m - 1)
    lags = [np.arange(window + 1, min(int(r), vectors - 1) + 1) for r in radii]
    expected = [np.sum(vectors - each) for each in lags]
    found = _counting.count_pairs(np.arange(n, dtype=float), (m,), 1, window, radii, 1, kernel)
    np.testing.assert_array_equal(found[0], expected)


@pytest.mark.parametrize("n", [60, 3000])
def test_boxes_that_no_radius_divides_are_counted_not_visited(n):
    # Two heaps of diameter 1, 10 apart.
    values = np.random.default_rng(n).permutation(np.concatenate([NOISE[:n], 10 + NOISE[:n]]))
    radii = np.array([1.0, 2.0, 12.0])
    found = _counting.count_pairs(values, (1,), 1, 0, radii, 1, "trees")
    np.testing.assert_array_equal(found, [[n * (n - 1)] * 2 + [n * (2 * n - 1)]])
    assert _counting._left_to_compare(_counting._tree(values, 1, 1), _pairs.bins_of(radii)) == 0


def test_two_vectors_are_one_pair_at_their_greatest_difference():
    found = correlation_sum([0.0, 1.0, 5.0], [1, 2], theiler=0, radii=[0.5, 1.0, 3.9, 4.0, 5.0])
    np.testing.assert_array_equal(found.counts, [[0, 1, 1, 2, 3], [0, 0, 0, 1, 1]])
    np.testing.assert_array_equal(found.pairs, [3, 1])
    np.testing.assert_array_equal(found.sums[1], [0, 0, 0, 1, 1])


def test_uniform_noise_has_the_closed_form():
    # |u - v| <= r has the probability 2 r - r^2, and differences of different values are
    # independent but for values that several pairs share; five standard deviations bound these.
    radii = np.geomspace(0.01, 1, 15)
    found = correlation_sum(NOISE, range(1, 5), theiler=3, radii=radii)
    inside = 2 * radii - radii**2
    for m, sums in zip(found.dimensions, found.sums, strict=True):
        # The variance of a U-statistic of noise: 4 m / n times that of the projection on one
        # value, whose square is at most (2 r)^2, and the pairs' own.
        expected = inside**m
        spread = expected * np.sqrt(4 * m**2 / len(NOISE) + 2 / (expected * len(NOISE) ** 2 / 2))
        spread[-1] = 0
        assert np.all(np.abs(sums - expected) <= 5 * spread)
    assert found.local_slopes()[0, 0] == pytest.approx(1, abs=0.1)


def test_slopes_of_a_power_law_are_its_exponent():
    radii = np.array([1.0, 2.0, 8.0])
    counts = np.array([[4, 16, 256], [0, 1, 8]])
    pairs = np.array([1000, 900])
    sums = counts / pairs[:, None]
    result = impactsig.results.CorrelationSum(
        radii, counts, pairs, (1, 2), 1, 0, "max", "step", 2.0, sums
    )
    np.testing.assert_allclose(result.local_slopes(), [[2, 2], [np.nan, 1.5]], rtol=1e-12)
    np.testing.assert_allclose(result.slope_radii, [2**0.5, 4])


@pytest.mark.parametrize("kernel", ["pairs", "boxes", "trees", None])
def test_more_radii_than_a_byte_can_tell(kernel):
    x = henon(120)
    radii = np.sort(RNG.uniform(0.001, 0.5, 300))
    expected = naive_reconstruct.correlation_counts(x, (1, 2, 4), 2, 1, radii)
    np.testing.assert_array_equal(
        _counting.count_pairs(x, (1, 2, 4), 2, 1, radii, 2, kernel), expected
    )


@pytest.mark.parametrize("spread", [1e-12, 1e-3, 1.0, 1e300])
def test_radii_however_close_or_far_apart_have_exact_counts(spread):
    x = henon(400)
    radii = np.unique(0.3 * (1 + spread * np.linspace(0, 1, 50)))
    expected = naive_reconstruct.correlation_counts(x, (2,), 1, 0, radii)
    for kernel in ("pairs", "boxes", "trees"):
        found = _counting.count_pairs(x, (2,), 1, 0, radii, 1, kernel)
        np.testing.assert_array_equal(found, expected)


def test_a_long_series_counts_alike_by_both_kernels_and_any_threads():
    # Longer than a chunk and a strip, and with the tables of 32 bits emptied in between.
    x, dimensions, radii = henon(9000), (1, 2, 5), np.geomspace(1e-3, 0.05, 20)
    case = (x, dimensions, 2, 4, radii)
    reference = _counting.count_pairs(*case, 1, "pairs")
    for workers, kernel in ((2, "pairs"), (3, "boxes"), (3, "trees"), (None, None)):
        np.testing.assert_array_equal(_counting.count_pairs(*case, workers, kernel), reference)


def test_tables_are_emptied_before_they_overflow(monkeypatch):
    monkeypatch.setattr(_pairs, "EMPTY_AT", 5000)
    x, radii = np.round(henon(600), 1), np.array([0.05, 0.4, 3.0])
    counts = np.zeros((2, 4), np.int64)
    bins = _pairs.bins_of(radii)
    # Interpreted, because the compiled kernel would not see the changed limit.
    count = getattr(_pairs.count_diagonals, "py_func", _pairs.count_diagonals)
    count(x, 1, 600, 150, 1, np.array([0, 1]), bins, counts)
    expected = np.zeros((2, 4), np.int64)
    for lag in range(1, 600, 150):
        d = np.abs(x[:-lag] - x[lag:])
        for row, each in enumerate((d, np.maximum(d[:-1], d[1:]))):
            expected[row] += np.bincount(np.searchsorted(radii, each), minlength=4)
    np.testing.assert_array_equal(counts, expected)


def test_default_radii_run_from_the_nearest_pair_to_the_farthest():
    x = henon(1000)
    found = correlation_sum(x, (1, 2, 3))
    np.testing.assert_allclose(np.log2(found.radii) * 4, np.round(np.log2(found.radii) * 4))
    assert found.theiler >= 1
    assert not found.counts[:, 0].any()
    assert found.counts[0, 1] > 0
    np.testing.assert_array_equal(found.counts[:, -1], found.pairs)
    assert found.counts[0, -2] < found.pairs[0]
    # Ties: the first radius holds only these.
    tied = correlation_sum(np.round(x, 1), (1, 2), theiler=0)
    assert tied.radii[0] > 0.05
    equal = naive_reconstruct.correlation_counts(np.round(x, 1), (1, 2), 1, 0, [1e-9])
    np.testing.assert_array_equal(tied.counts[:, :1], equal)


def test_default_radii_of_a_long_series_bound_the_neighbours(monkeypatch):
    monkeypatch.setattr(_radii, "ALL_PAIRS_UP_TO", 3000)
    monkeypatch.setattr(_radii, "NEIGHBOURS", 50)
    x = henon(6000)
    found = correlation_sum(x, (1, 2, 3), theiler=1)
    mean = 2 * found.counts[1, -1] / (len(x) - 1)
    # The radius is rounded up to a quarter octave, over which C grows by 2^(1.22 / 4) or so.
    assert 45 < mean < 75
    tied = correlation_sum(np.round(x * 2), (2,), theiler=1)
    assert tied.counts[0, -1] > tied.counts[0, 0] > 0


def test_a_single_dimension_stands_for_all_up_to_it():
    x = henon(300)
    found = correlation_sum(x, 3, theiler=1, radii=[0.1, 0.5])
    assert found.dimensions == (1, 2, 3)
    alone = correlation_sum(x, [3], theiler=1, radii=[0.1, 0.5])
    np.testing.assert_array_equal(alone.counts[0], found.counts[2])


def test_any_series_of_numbers_will_do():
    whole = RNG.integers(0, 50, 300)
    expected = correlation_sum(whole.astype(float), (1, 2), theiler=2).counts
    for same in (whole, whole.tolist(), pd.Series(whole), whole.astype(np.float32)):
        np.testing.assert_array_equal(correlation_sum(same, (1, 2), theiler=2).counts, expected)
    impacts = Impacts.from_times(np.cumsum(np.r_[1.0, whole + 1.0]))
    np.testing.assert_array_equal(
        correlation_sum(impacts, (1, 2), theiler=2).counts,
        correlation_sum(impacts.intervals(), (1, 2), theiler=2).counts,
    )


def test_a_constant_series_is_counted_where_radii_are_given():
    found = correlation_sum(np.full(50, 0.045), (1, 2), theiler=0, radii=[1e-9, 1.0])
    np.testing.assert_array_equal(found.sums, 1)
    np.testing.assert_array_equal(found.local_slopes(), 0)
    with pytest.raises(InvalidInput, match=r"x: got 50 values that are all 0\.045.*periodic"):
        correlation_sum(np.full(50, 0.045))


@np.errstate(over="ignore")
def test_a_difference_beyond_the_greatest_number_is_within_no_radius():
    x = [-1.7e308, 1.7e308, 0.0]
    found = correlation_sum(x, 1, theiler=0, radii=[1.0, 1.75e308], workers=1)
    np.testing.assert_array_equal(found.counts, [[0, 2]])


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"dimensions": 0}, "dimensions"),
        ({"dimensions": []}, "dimensions"),
        ({"dimensions": [2, 1]}, "dimensions"),
        ({"dimensions": [2, 2]}, "dimensions"),
        ({"dimensions": 1.5}, "dimensions"),
        ({"dimensions": "two"}, "dimensions"),
        ({"dimensions": 60, "delay": 2}, "x: got 100 values; required: at least 120"),
        ({"delay": 0}, "delay"),
        ({"delay": 0.5}, "delay"),
        ({"theiler": -1}, "theiler"),
        ({"theiler": 98, "dimensions": 2}, "theiler: got 98; required: at most 97"),
        ({"radii": []}, "radii"),
        ({"radii": [0.0, 1.0]}, "radii"),
        ({"radii": [2.0, 1.0]}, "radii"),
        ({"radii": [1.0, 1.0]}, "radii"),
        ({"radii": [1.0, np.nan]}, "radii"),
        ({"radii": [1.0, np.inf]}, "radii"),
        ({"radii": "wide"}, "radii"),
        ({"workers": 0}, "workers"),
    ],
)
def test_what_cannot_be_counted_is_named(options, named):
    with pytest.raises(InvalidInput, match=named):
        correlation_sum(np.arange(100.0), **options)
    assert correlation_sum(np.arange(100.0), 2, theiler=97).pairs.tolist() == [3, 1]


@pytest.mark.parametrize(
    "x", [[1.0, np.nan, 2.0], [1.0, np.inf], [[1.0, 2.0]], [1.0], [], ["a"], [-1e308, 1.7e308]]
)
def test_what_is_no_series_is_refused(x):
    with pytest.raises(InvalidInput, match="x"):
        correlation_sum(x, 1)


def test_the_figure_shows_every_dimension_and_the_slopes_of_enough_pairs():
    result = correlation_sum(henon(1000), (1, 2, 3))
    figure = Figure()
    sums, slopes = result.plot(figure)
    figure.canvas.draw()
    assert [line.get_label() for line in sums.lines] == ["$m = 1$", "$m = 2$", "$m = 3$"]
    for row, (curve, slope) in enumerate(zip(sums.lines, slopes.lines, strict=True)):
        shown = result.counts[row] > 0
        np.testing.assert_array_equal(curve.get_ydata()[shown], result.sums[row][shown])
        told = ~np.isnan(slope.get_ydata())
        np.testing.assert_array_equal(told, result.counts[row, :-1] >= 100)
        np.testing.assert_array_equal(slope.get_ydata()[told], result.local_slopes()[row][told])
    few = correlation_sum(henon(10), (1, 2)).plot(Figure())
    assert "no slopes" in few[1].texts[0].get_text()
    assert "dimension 1, 2, 3, delay 1" in str(result)
