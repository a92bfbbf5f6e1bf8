"""Return map, histogram and measures of variation of interspike intervals."""

import numpy as np
import pytest

import impactsig
from impactsig import Impacts, InvalidInput
from tests import naive

RNG = np.random.default_rng(20240607)
POISSON = RNG.exponential(0.045, 40_000)


def test_the_return_map_pairs_each_interval_with_a_later_one():
    x, y = impactsig.return_map([1.0, 2.0, 4.0, 8.0], lag=2)
    assert x.tolist() == [1, 2]
    assert y.tolist() == [4, 8]


@pytest.mark.parametrize("lag", [1, 2, 3])
def test_no_pair_reaches_across_a_gap(lag):
    time = np.array([0.0, 1, 3, 6, 10, 20, 21, 23, 26, 30, 35])
    impacts = Impacts.from_times(time, gaps=[[11, 12]])
    x, y = impactsig.return_map(impacts, lag)
    intervals = np.diff(time)
    lost = 4  # the interval from 10 s to 20 s
    expected = [
        (intervals[k], intervals[k + lag])
        for k in range(len(intervals) - lag)
        if not k <= lost <= k + lag
    ]
    assert list(zip(x.tolist(), y.tolist(), strict=True)) == expected


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_impacts_give_an_empty_return_map(count):
    x, y = impactsig.return_map(Impacts.from_times(np.arange(count)))
    assert len(x) == len(y) == 0


@pytest.mark.parametrize("lag", [0, -1, 1.5, True])
def test_a_lag_is_a_positive_whole_number(lag):
    with pytest.raises(InvalidInput, match="lag"):
        impactsig.return_map([1.0, 2.0, 3.0], lag)


@pytest.mark.parametrize("wrong", [[1.0, -1.0], [np.nan, 1.0], [np.inf, 1.0], [[1.0, 2.0]], ["a"]])
@pytest.mark.parametrize(
    "function",
    [
        impactsig.return_map,
        impactsig.interval_histogram,
        impactsig.coefficient_of_variation,
        impactsig.cv2,
        impactsig.local_variation,
    ],
)
def test_intervals_are_finite_and_not_negative(function, wrong):
    with pytest.raises(InvalidInput, match="intervals"):
        function(wrong)


def test_a_poisson_train_has_variation_1_and_a_regular_one_0():
    # the standard errors at 40 000 intervals are 0.005 (CV), 0.004 (CV2) and 0.006 (LV)
    assert impactsig.coefficient_of_variation(POISSON) == pytest.approx(1, abs=0.03)
    assert impactsig.cv2(POISSON) == pytest.approx(1, abs=0.02)
    assert impactsig.local_variation(POISSON) == pytest.approx(1, abs=0.03)
    regular = np.full(100, 0.045)
    assert impactsig.coefficient_of_variation(regular) == pytest.approx(0, abs=1e-12)
    assert impactsig.cv2(regular) == 0
    assert impactsig.local_variation(regular) == 0


def test_alternating_intervals_in_closed_form():
    """I = 1, 3, 1, 3, ...: CV = 1/2, CV2 = 2 * 2/4 = 1, LV = 3 (2/4)^2 = 3/4."""
    alternating = np.tile([1.0, 3.0], 50)
    assert impactsig.coefficient_of_variation(alternating) == pytest.approx(0.5)
    assert impactsig.cv2(alternating) == pytest.approx(1)
    assert impactsig.local_variation(alternating) == pytest.approx(0.75)


def test_a_slow_change_of_rate_moves_cv_but_not_the_local_measures():
    slow = POISSON[:20_000] * np.repeat([1.0, 4.0], 10_000)
    assert impactsig.coefficient_of_variation(slow) > 1.2
    assert impactsig.cv2(slow) == pytest.approx(1, abs=0.03)
    assert impactsig.local_variation(slow) == pytest.approx(1, abs=0.04)


def test_variation_agrees_with_its_slow_twin():
    some = POISSON[:300]
    assert impactsig.cv2(some) == pytest.approx(naive.cv2(some), rel=1e-12)
    assert impactsig.local_variation(some) == pytest.approx(naive.local_variation(some), rel=1e-12)


def test_variation_leaves_out_pairs_across_a_gap():
    time = np.concatenate((np.arange(10.0), 100 + 3 * np.arange(10.0)))
    impacts = Impacts.from_times(time, gaps=[[9.5, 50.0]])
    assert impactsig.cv2(impacts) == 0
    assert impactsig.cv2(Impacts.from_times(time)) > 0.1


@pytest.mark.parametrize("function", [impactsig.cv2, impactsig.local_variation])
def test_two_impacts_at_one_instant_twice_are_refused(function):
    with pytest.raises(InvalidInput, match="0 s"):
        function([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("function", "few"),
    [
        (impactsig.coefficient_of_variation, [1.0]),
        (impactsig.coefficient_of_variation, [0.0, 0.0]),
        (impactsig.cv2, [1.0]),
        (impactsig.local_variation, []),
        (impactsig.interval_histogram, []),
    ],
)
def test_what_cannot_be_told_from_so_few_is_an_error(function, few):
    with pytest.raises(InvalidInput, match="intervals"):
        function(few)


CLUSTERS = np.concatenate((RNG.normal(0.9, 0.005, 500), RNG.normal(1.1, 0.005, 500))) * 0.045
TRAINS = {
    "poisson": POISSON[:2000],
    "one cluster": RNG.normal(0.045, 0.00045, 2000),
    "two clusters": CLUSTERS,
    "clusters and missed spikes": np.concatenate((CLUSTERS, 2 * CLUSTERS[::20])),
    "rounded": np.round(RNG.normal(0.045, 0.00045, 2000), 4),
    "equal": np.full(50, 0.045),
    "nearly equal": 0.045 + 1e-15 * RNG.standard_normal(50),
    "two lengths": np.repeat([0.045, 0.09], 50),
    "one interval": np.array([0.045]),
    "all at once": np.zeros(5),
}


@pytest.mark.parametrize("name", TRAINS)
@pytest.mark.parametrize("bins", [None, 7])
def test_the_density_integrates_to_1_and_holds_every_interval(name, bins):
    histogram = impactsig.interval_histogram(TRAINS[name], bins)
    assert histogram.count.sum() == len(TRAINS[name])
    assert np.sum(histogram.density * np.diff(histogram.edges)) == pytest.approx(1, rel=1e-12)
    assert np.all(np.diff(histogram.edges) > 0)
    if bins:
        assert len(histogram.density) == bins


def test_the_bin_width_resolves_clusters_and_smooths_chaos():
    """Within a factor of 3 of the width that is best for many: normal 3.49 sd n^(-1/3) (Scott).

    For p = exp(-I/T)/T the integral of p'^2 is 1/(2 T^3), so h = (6/(n/(2 T^3)))^(1/3)
    = (12/n)^(1/3) T.
    """
    width = {name: np.diff(impactsig.interval_histogram(TRAINS[name]).edges)[0] for name in TRAINS}
    normal = 3.49 * 0.005 * 0.045 * 500 ** (-1 / 3)
    for name in ("two clusters", "clusters and missed spikes"):
        assert normal / 3 < width[name] < 3 * normal
    exponential = (12 / 2000) ** (1 / 3) * 0.045
    assert exponential / 3 < width["poisson"] < 3 * exponential


def test_the_width_has_the_least_leave_one_out_score():
    values = TRAINS["two clusters"]
    chosen = impactsig.interval_histogram(values)
    best = naive.leave_one_out_score(values, chosen.edges)
    for number in (1, 5, 20, 80, 320, 1280, 4096):
        edges = np.linspace(values.min(), values.max(), number + 1)
        assert best <= naive.leave_one_out_score(values, edges) + 1e-9


@pytest.mark.parametrize("number", [5, 12, 40])
@pytest.mark.parametrize("seed", range(6))
def test_of_few_intervals_too_the_width_has_the_least_score_of_all_tried(number, seed):
    # n + 1 and n - 1 in Rudemo's formula differ where there are few.
    values = np.random.default_rng([seed, number]).exponential(0.045, number)
    numbers = np.unique(np.geomspace(1, 4096, 80).astype(int))
    edges = [np.linspace(values.min(), values.max(), bins + 1) for bins in numbers]
    scores = [naive.leave_one_out_score(values, one) for one in edges]
    chosen = impactsig.interval_histogram(values)
    assert len(chosen.count) == numbers[np.argmin(scores)]


def test_rounded_intervals_lie_inside_their_bins():
    histogram = impactsig.interval_histogram(TRAINS["rounded"])
    steps = np.diff(histogram.edges) / 1e-4
    assert steps == pytest.approx(np.round(steps), abs=1e-4)
    to_edge = np.abs(TRAINS["rounded"][:, None] - histogram.edges).min()
    assert to_edge == pytest.approx(0.5e-4, rel=1e-3)


def test_given_edges_leave_the_rest_out():
    histogram = impactsig.interval_histogram([0.1, 0.2, 0.3, 5.0], bins=[0.0, 0.25, 1.0])
    assert histogram.count.tolist() == [2, 1]
    assert histogram.density == pytest.approx([2 / 3 / 0.25, 1 / 3 / 0.75])


@pytest.mark.parametrize("bins", [0, -3, 2.5, True, [1.0], [2.0, 1.0], [10.0, 20.0]])
def test_bins_that_cannot_be_used(bins):
    with pytest.raises(InvalidInput, match="bins"):
        impactsig.interval_histogram([0.1, 0.2, 0.3], bins)


def test_intervals_of_impacts_and_of_an_array_give_the_same():
    impacts = Impacts.from_times(np.cumsum(POISSON[:100]))
    from_impacts = impactsig.interval_histogram(impacts)
    from_array = impactsig.interval_histogram(np.diff(impacts.time))
    assert np.array_equal(from_impacts.edges, from_array.edges)
    assert np.array_equal(from_impacts.density, from_array.density)


def test_a_histogram_draws_itself():
    pytest.importorskip("matplotlib").use("agg")
    assert impactsig.interval_histogram(POISSON[:100]).plot().get_xlabel()


@pytest.mark.parametrize("exponent", [-900, 900])
def test_measures_of_a_train_are_the_same_in_any_unit(exponent):
    scaled = np.ldexp(POISSON, exponent)
    assert impactsig.coefficient_of_variation(scaled) == impactsig.coefficient_of_variation(POISSON)
    one, other = impactsig.interval_histogram(POISSON), impactsig.interval_histogram(scaled)
    np.testing.assert_array_equal(other.count, one.count)
    np.testing.assert_array_equal(other.edges, np.ldexp(one.edges, exponent))
    assert np.isfinite(
        impactsig.interval_histogram(1e300 * np.array([1.0, 2, 1e8] * 50)).density
    ).all()
    with pytest.raises(InvalidInput, match="another unit"):
        impactsig.interval_histogram(np.full(9, 1e-310))
