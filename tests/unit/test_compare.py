"""Two trains side by side: distances against closed forms and slow twins, words and a figure."""

from __future__ import annotations

from itertools import combinations_with_replacement

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.figure import Figure

from impactsig import (
    Impacts,
    InvalidInput,
    coefficient_of_variation,
    cv2,
    identify_period,
    local_variation,
    plot,
)
from impactsig.comparison import Comparison, compare
from tests import naive


def at_random(seed, count=300, mean=0.05, **known):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.exponential(mean, count))
    return Impacts.from_times(time, start=0.0, duration=float(time[-1]), **known)


# -- the numbers -----------------------------------------------------------------------------


def test_a_train_is_at_no_distance_from_itself():
    train = at_random(0, peak=np.linspace(1, 2, 300), contact_time=np.full(300, 3e-4))
    found = compare(train, train)
    for one in (found.interval, found.peak, found.contact_time):
        assert (one.statistic, one.wasserstein) == (0.0, 0.0)
        assert one.p_value == pytest.approx(1.0)
        assert one.mean[0] == one.mean[1]
    assert found.impulse is found.approach_velocity is None
    assert found.notes == ()


@pytest.mark.parametrize(("sizes", "seed"), [((30, 40), 1), ((300, 250), 2)])
def test_distances_are_those_of_their_definitions(sizes, seed):
    a, b = at_random(seed, sizes[0]), at_random(seed + 10, sizes[1], mean=0.07)
    found = compare(a, b).interval
    x, y = a.intervals(), b.intervals()
    assert found.statistic == pytest.approx(naive.greatest_difference(x, y), abs=1e-12)
    assert found.wasserstein == pytest.approx(naive.area_between(x, y), rel=1e-9)
    assert found.count == (sizes[0] - 1, sizes[1] - 1)
    assert found.mean == (pytest.approx(x.mean()), pytest.approx(y.mean()))
    assert found.deviation == (pytest.approx(x.std()), pytest.approx(y.std()))


def test_p_values_of_equal_distributions_are_uniform():
    p = [
        compare(at_random(2 * k, size), at_random(2 * k + 1, size)).interval.p_value
        for k in range(100)
        for size in (60, 150)  # exact, and by the limit law
    ]
    assert 0.01 < np.mean(np.array(p) < 0.05) < 0.1
    assert np.mean(p) == pytest.approx(0.5, abs=0.1)
    apart = compare(at_random(0), at_random(1, mean=0.1)).interval
    assert apart.p_value < 1e-4


def test_a_clock_that_is_off_moves_every_interval_by_as_much():
    steady = Impacts.from_times(0.05 * np.arange(400))
    late = Impacts.from_times(0.050001 * np.arange(400))
    found = compare(steady, late).interval
    assert found.statistic == 1.0
    assert found.wasserstein == pytest.approx(1e-6, rel=1e-6)


def test_each_train_is_measured_by_itself():
    rng = np.random.default_rng(3)
    turn = np.arange(200)
    double = np.sort(np.concatenate((turn, turn + 0.3))) * 0.05
    a = Impacts.from_times(double + 1e-5 * rng.standard_normal(400), start=-0.1, duration=12.0)
    b = at_random(3)
    found = compare(a, b, forcing_period=0.05, names=("rig", "model"))
    assert (found.a.period.impacts, found.a.period.periods) == (2, 1)
    assert found.b.period.kind == identify_period(b, 0.05).kind == "irregular"
    for one, train in ((found.a, a), (found.b, b)):
        assert one.impacts is train
        assert one.count == len(train)
        assert one.rate == len(train) / train.duration
        assert one.cv == coefficient_of_variation(train)
        assert one.cv2 == cv2(train)
        assert one.lv == local_variation(train)
    assert (found.a.name, found.b.name) == ("rig", "model")
    assert compare(a, b).a.period is None


def test_gaps_are_no_part_of_the_run():
    train = Impacts.from_times([1.0, 2.0, 8.0, 9.0], start=0.0, duration=10.0, gaps=[[3.0, 7.0]])
    found = compare(train, train)
    assert found.a.rate == pytest.approx(4 / 6)
    assert found.interval.count == (2, 2)
    assert found.interval.mean == (1.0, 1.0)


def test_strengths_are_compared_in_one_unit_only():
    known = {"peak": np.full(300, 2.0), "impulse": np.full(300, 1e-3)}
    a, b = at_random(1, unit="N", **known), at_random(2, unit="V", **known)
    found = compare(a, b)
    assert found.peak is found.impulse is None
    assert found.notes == ("strengths not compared: their units differ, N and V",)
    other = at_random(2, unit="N", peak=np.full(300, 3.0), approach_velocity=np.ones(300))
    found = compare(a, other)
    assert found.peak.wasserstein == pytest.approx(1.0)
    assert found.impulse is found.approach_velocity is None
    assert compare(other, other).approach_velocity.wasserstein == 0


TINY = [[], [1.0], [1.0, 1.0], [1.0, 2.0], [1.0, 2.0, 4.0]]


@pytest.mark.parametrize(
    ("first", "second"),
    [*combinations_with_replacement(TINY, 2), *((one, None) for one in TINY), (TINY[3], [])],
)
def test_tiny_trains_have_a_result_that_says_so(first, second):
    a = Impacts(first)
    b = at_random(0) if second is None else Impacts(second)
    found = compare(a, b, forcing_period=0.05)
    assert isinstance(found, Comparison)
    assert (found.interval is None) == (min(len(a), len(b)) < 2)
    assert (len(found.notes) == 1) == (min(len(a), len(b)) < 2)
    words = found.describe()
    assert "too few" in words
    assert "nan" not in words.lower()
    assert found.plot(Figure()).shape == (2, 2)


def test_words():
    a = Impacts.from_times(0.05 * np.arange(101), contact_time=np.full(101, 3e-4))
    b = Impacts.from_times(0.0501 * np.arange(101), contact_time=np.full(101, 3.02e-4))
    words = compare(a, b, forcing_period=0.05, names=("rig", "model")).describe().splitlines()
    assert words[0].startswith("rig: 101 impacts in 5 s, 20.2 per second; CV ")
    assert words[0].endswith("period(1,1): 1 impact per forcing period")
    assert words[1].startswith("model: 101 impacts in 5.01 s")
    assert words[2].startswith("intervals: mean 50 ms and 50.1 ms; Kolmogorov-Smirnov 1 (p ")
    assert words[2].endswith("Wasserstein 100 µs")
    assert words[3].startswith("contact time: mean 0.3 ms and 0.302 ms;")
    assert words[3].endswith("Wasserstein 2 µs")
    assert len(words) == 4
    assert str(compare(a, b)) == compare(a, b).describe()


@pytest.mark.parametrize(
    ("a", "b", "settings", "argument"),
    [
        ([0.1, 0.2], Impacts([]), {}, "a"),
        (Impacts([]), np.ones(3), {}, "b"),
        (Impacts([]), Impacts([]), {"forcing_period": 0.0}, "forcing_period"),
        (Impacts([]), Impacts([]), {"forcing_period": np.nan}, "forcing_period"),
    ],
)
def test_what_cannot_be_used_is_named(a, b, settings, argument):
    with pytest.raises(InvalidInput, match=rf"^{argument}: "):
        compare(a, b, **settings)


# -- the figure ------------------------------------------------------------------------------


def test_the_figure_shows_both_over_common_bins_and_at_one_scale():
    a, b = at_random(1), at_random(2, mean=0.08)
    found = compare(a, b, names=("rig", "model $"))
    (densities, distributions), (left, right) = plot.comparison(found, Figure())
    outlines = [patch for patch in densities.patches if not patch.get_fill()]
    assert len(outlines) == 2
    np.testing.assert_array_equal(*(one.get_data().edges for one in outlines))
    for one, side in zip(outlines, (1, -1), strict=True):
        stairs = one.get_data()
        assert np.sum(stairs.values * np.diff(stairs.edges)) == pytest.approx(side)
    for line, train in zip(distributions.get_lines(), (a, b), strict=True):
        x, share = line.get_data()
        np.testing.assert_array_equal(x[1:-1], np.sort(train.intervals()))
        assert (share[0], share[-1]) == (0.0, 1.0)
    (mark,) = distributions.collections
    low, high = mark.get_segments()[0][:, 1]
    assert high - low == pytest.approx(found.interval.statistic)
    for ax, train in ((left, a), (right, b)):
        cloud = ax.get_lines()[-1]
        np.testing.assert_array_equal(cloud.get_xdata(), train.intervals()[:-1])
        np.testing.assert_array_equal(cloud.get_ydata(), train.intervals()[1:])
    assert left.get_xlim() == right.get_xlim() == left.get_ylim()
    assert [left.get_title("left"), right.get_title("left")] == ["rig", r"model \$"]


def test_bins_are_no_narrower_than_the_step_of_a_rounded_train():
    # Bins that suit both together, or the exact train alone, would leave gaps between the samples.
    step = 5e-4
    exact = Impacts(np.cumsum(0.05 + 0.0002 * np.sin(np.arange(2000.0))))
    rounded = Impacts(np.rint(exact.time / step) * step)
    for a, b in ((exact, rounded), (rounded, exact)):
        densities = plot.comparison(compare(a, b), Figure())[0, 0]
        for patch in densities.patches:
            edges = patch.get_data().edges
            assert np.diff(edges).min() > 0.99 * step
            for train in (a, b):
                assert edges[0] <= train.intervals().min()
                assert train.intervals().max() <= edges[-1]


def test_bins_stay_few_where_one_train_is_silent_for_long():
    steady = Impacts(0.05 * np.arange(200) + 1e-6 * np.sin(np.arange(200.0)))
    silent = Impacts(np.append(steady.time, 500.0))
    densities = plot.comparison(compare(steady, silent), Figure())[0, 0]
    assert len(densities.patches[0].get_data().values) <= 4096


def test_a_figure_of_its_own_by_default():
    found = compare(at_random(1), at_random(2))
    panels = found.plot()
    panels[0, 0].figure.canvas.draw()
    assert pyplot.fignum_exists(panels[0, 0].figure.number)
    pyplot.close(panels[0, 0].figure)
