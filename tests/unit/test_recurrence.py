"""Recurrence plots and their lines, against the naive twin and by hand."""

import numpy as np
import pandas as pd
import pytest

from impactsig import Impacts, InvalidInput, recurrence_plot, recurrence_quantification
from tests import naive_recurrence

RNG = np.random.default_rng(3)
SERIES = {
    "random": RNG.random(80),
    "tied": RNG.integers(0, 3, 80).astype(float),
    "sine": np.sin(0.4 * np.arange(80)),
    "laminar": np.repeat(RNG.random(16), 5),
}


@pytest.mark.parametrize("name", SERIES)
@pytest.mark.parametrize(("dimension", "delay"), [(1, 1), (3, 2)])
@pytest.mark.parametrize(("theiler", "least"), [(0, 2), (3, 4)])
def test_all_measures_are_those_of_the_naive_twin(name, dimension, delay, theiler, least):
    x, radius = SERIES[name], 0.25
    matrix = naive_recurrence.recurrence_matrix(x, dimension, delay, radius)
    plotted = recurrence_plot(x, dimension, delay, radius=radius)
    np.testing.assert_array_equal(plotted.matrix, matrix)
    found = recurrence_quantification(
        x, dimension, delay, radius=radius, theiler=theiler, least_diagonal=least, least_vertical=3
    )
    diagonal, vertical = naive_recurrence.lines(matrix, theiler)
    for counted, lengths in ((found.diagonals, diagonal), (found.verticals, vertical)):
        np.testing.assert_array_equal(counted, np.bincount(lengths, minlength=len(matrix) + 1))
    share, mean, entropy, longest = naive_recurrence.measures(diagonal, least)
    assert (found.determinism, found.mean_diagonal) == (share, mean)
    assert found.entropy == (None if entropy is None else pytest.approx(entropy, abs=1e-12))
    assert found.longest_diagonal == longest
    share, mean, _, longest = naive_recurrence.measures(vertical, 3)
    assert (found.laminarity, found.trapping_time) == (share, mean)
    assert found.longest_vertical == longest
    pairs = (len(matrix) - theiler) * (len(matrix) - theiler - 1)
    assert found.recurrence_rate == sum(diagonal) / pairs


def test_a_period_of_four_by_hand():
    """Of 12 values the diagonals 4 and 8 above and below the main one recur, whole."""
    found = recurrence_quantification(np.tile([0.0, 1, 2, 3], 3), radius=0.5)
    assert found.recurrence_rate == pytest.approx(2 * (8 + 4) / (12 * 11))
    assert found.determinism == 1
    assert found.mean_diagonal == 6
    assert found.longest_diagonal == 8
    assert found.entropy == pytest.approx(np.log(2))
    assert found.laminarity == 0
    assert found.trapping_time is None
    assert "determinism 1, laminarity 0" in repr(found)


def test_independent_values_recur_in_lines_as_chance_has_it():
    """Diagonal points stand alone with probability (1 - RR)^2, so DET = 1 - (1 - RR)^2."""
    found = recurrence_quantification(RNG.random(3000), radius=0.05)
    rate = 0.05 * (2 - 0.05)
    assert found.recurrence_rate == pytest.approx(rate, abs=0.002)
    # exact for independent points; pairs that share a value make it a little more
    assert found.determinism == pytest.approx(1 - (1 - rate) ** 2, abs=0.01)
    smooth = recurrence_quantification(np.sin(0.05 * np.arange(1000)), 2, 30, radius=0.05)
    assert smooth.determinism > 0.99


def test_series_of_all_kinds_are_taken():
    expected = recurrence_plot(np.array([0.0, 1, 0, 2, 0]), radius=0.5).matrix
    impacts = Impacts([0.0, 0, 1, 1, 3, 3])
    for same in ([0, 1, 0, 2, 0], pd.Series([0, 1, 0, 2, 0]), impacts):
        np.testing.assert_array_equal(recurrence_plot(same, radius=0.5).matrix, expected)
    assert "5 vectors" in repr(recurrence_plot(impacts, radius=0.5))


def test_what_says_nothing_is_flagged():
    x = RNG.random(50)
    assert "smaller" in recurrence_quantification(x, radius=2).warnings[0]
    none = recurrence_quantification(x, radius=0)
    assert "larger" in none.warnings[0]
    assert none.determinism is None
    assert none.recurrence_rate == 0
    assert "constant" in recurrence_quantification([1.0] * 20, radius=0.1).describe()


@pytest.mark.parametrize(
    ("x", "options", "named"),
    [
        ([1.0, np.nan, 2.0], {}, "x"),
        ([1.0, np.inf, 2.0], {}, "x"),
        (np.ones((5, 5)), {}, "x"),
        ([1.0, 2.0], {"dimension": 5}, "x"),
        ([1.0, 2.0, 3.0], {"dimension": 0}, "dimension"),
        ([1.0, 2.0, 3.0], {"delay": 0}, "delay"),
        ([1.0, 2.0, 3.0], {"radius": -1.0}, "radius"),
        ([1.0, 2.0, 3.0], {"radius": "wide"}, "radius"),
    ],
)
@pytest.mark.parametrize("function", [recurrence_plot, recurrence_quantification])
def test_arguments_that_cannot_be_used(function, x, options, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        function(x, **{"radius": 0.5, **options})


def test_windows_and_sizes_that_leave_nothing():
    with pytest.raises(InvalidInput, match=r"^x:.*theiler 3"):
        recurrence_quantification([1.0, 2, 3, 4], radius=1, theiler=3)
    with pytest.raises(InvalidInput, match=r"^x:.*100 MB.*recurrence_quantification"):
        recurrence_plot(RNG.random(10_001), radius=1)
    with pytest.raises(InvalidInput, match=r"^least_diagonal"):
        recurrence_quantification([1.0, 2, 3, 4], radius=1, least_diagonal=0)


@pytest.mark.parametrize("theiler", [0, 3])
def test_a_given_matrix_has_the_lines_of_its_series(theiler):
    x = np.random.default_rng(2).random(80)
    plot = recurrence_plot(x, 2, radius=0.2)
    expected = recurrence_quantification(x, 2, radius=0.2, theiler=theiler)
    for given in (plot, plot.matrix):
        found = recurrence_quantification(given, theiler=theiler)
        np.testing.assert_array_equal(found.diagonals, expected.diagonals)
        np.testing.assert_array_equal(found.verticals, expected.verticals)
        assert found.recurrence_rate == expected.recurrence_rate
        assert found.entropy == expected.entropy
    assert recurrence_quantification(plot).radius == 0.2
    assert recurrence_quantification(plot.matrix).longest_diagonal == 79  # the main diagonal


@pytest.mark.parametrize("values", ["random", "rounded"])
@pytest.mark.parametrize("rate", [1e-4, 0.05, 0.5, 1.0])
def test_at_a_rate_the_radius_is_the_distance_of_that_rank(values, rate):
    x = np.random.default_rng(2).random(120)
    x = np.round(x, 1) if values == "rounded" else x
    vectors = np.column_stack((x[:-1], x[1:]))
    apart = np.abs(vectors[:, None] - vectors).max(-1)
    later = np.sort(apart[np.triu_indices(len(vectors), 3)])
    found = recurrence_quantification(x, 2, rate=rate, theiler=2)
    assert found.radius == later[max(round(rate * len(later)), 1) - 1]
    assert found.recurrence_rate == np.mean(later <= found.radius)
    assert recurrence_plot(x, 2, rate=rate).matrix.mean() >= rate


@pytest.mark.parametrize(
    ("x", "options", "named"),
    [
        (np.arange(9.0), {}, "radius"),
        (np.arange(9.0), {"radius": 1.0, "rate": 0.1}, "radius"),
        (np.arange(9.0), {"rate": 0.0}, "rate"),
        (np.arange(9.0), {"rate": 1.1}, "rate"),
        (np.eye(9, dtype=bool), {"radius": 0.1}, "radius"),
        (np.eye(9), {}, "x"),
        (np.eye(9, dtype=bool), {"theiler": 8}, "x"),
    ],
)
def test_of_radius_rate_and_matrix_one_is_given(x, options, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        recurrence_quantification(x, **options)


@pytest.mark.parametrize("exponent", [-1000, -1060, 1023])
def test_a_rate_is_found_in_any_unit(exponent):
    """A bin narrower than 4096/1.8e308 had an infinite number of bins to the unit."""
    x = np.round(2**12 * (2 * np.random.default_rng(2).random(60) - 1)) / 2**12
    expected = recurrence_quantification(x, 2, rate=0.1)
    found = recurrence_quantification(np.ldexp(x, exponent), 2, rate=0.1)
    assert found.radius == np.ldexp(expected.radius, exponent)
    np.testing.assert_array_equal(found.diagonals, expected.diagonals)


def test_a_distance_far_below_the_others_has_a_rank():
    x = np.array([0.0, 3e-310, 1.0, 3.0, 7.0])
    assert recurrence_quantification(x, rate=0.1).radius == x[1]


def test_at_a_rate_distances_may_be_beyond_all_numbers():
    x = np.array([-1.7e308, 0.0, 1.0, 1.7e308])
    assert recurrence_quantification(x, rate=0.1).radius == 1.0
    assert recurrence_quantification(x, rate=1.0).recurrence_rate == 1


@pytest.mark.parametrize("function", [recurrence_plot, recurrence_quantification])
def test_gaps_that_leave_no_vector_are_refused(function):
    broken = Impacts(np.arange(7.0), gaps=[[k + 0.4, k + 0.6] for k in range(1, 6, 2)])
    with pytest.raises(InvalidInput, match=r"^x:.*without a gap"):
        function(broken, 3, radius=0.1)
