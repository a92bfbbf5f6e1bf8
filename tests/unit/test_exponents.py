"""The largest Lyapunov exponent, against maps and flows whose exponent is known."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from impactsig import Impacts, InvalidInput, lyapunov_exponent
from impactsig.reconstruct.divergence._following import Setting, follow_on
from impactsig.reconstruct.divergence._freed import LEVEL, width
from impactsig.reconstruct.divergence._region import (
    BLOCKS,
    Curve,
    Line,
    best_line,
    fit,
    interval,
    standard_error,
)
from tests import naive_reconstruct_embed as naive
from tests.series import lorenz, lorenz_intervals, noisy, roessler_intervals

NOISE = np.random.default_rng(5).normal(size=3000)
HENON, HENON_EXPONENT = naive.henon(20_000), 0.4192
LORENZ_EXPONENT = 0.9056


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (naive.logistic(5000), np.log(2)),
        (naive.tent(5000), np.log(1.9)),
        (naive.tent(5000, 1.5), np.log(1.5)),
    ],
    ids=["logistic", "tent 1.9", "tent 1.5"],
)
def test_maps_of_the_interval_have_the_exponent_of_their_slope(x, expected):
    found = lyapunov_exponent(x, dimension=1, theiler=1)
    assert found.verdict == "divergence"
    assert found.exponent == pytest.approx(expected, rel=0.02)
    assert found.interval[0] < expected < found.interval[1]


@pytest.mark.parametrize("method", ["rosenstein", "kantz"])
def test_henon(method):
    found = lyapunov_exponent(HENON, dimension=2, method=method)
    assert found.exponent == pytest.approx(HENON_EXPONENT, rel=0.05)


def test_the_method_of_kantz_follows_the_mean_gap_within_its_radius():
    x = naive.henon(250)
    found = lyapunov_exponent(x, dimension=2, theiler=3, method="kantz", radius=0.2, steps=5)
    vectors = np.stack((x[:-6], x[1:-5]), axis=1)
    logs = []
    for i in range(len(vectors)):
        who = np.array(sorted(naive.within(vectors, 0.2, 3, i)), int)
        if len(who):
            k = np.arange(6)
            gaps = np.abs(x[i + 1 + k] - x[who[:, None] + 1 + k])
            logs.append(np.log(gaps.mean(axis=0)))
    assert found.references == len(logs)
    assert np.allclose(found.stretch, np.median(logs, axis=0), rtol=1e-12)


@pytest.mark.parametrize(("dimension", "delay"), [(3, 4), (5, 2)])
def test_lorenz_per_second(dimension, delay):
    x = naive.lorenz_x(20_000)
    found = lyapunov_exponent(x, dimension=dimension, delay=delay, theiler=50, step=0.04)
    assert found.per_second == pytest.approx(LORENZ_EXPONENT, rel=0.05)
    low, high = found.interval_per_second
    assert low < LORENZ_EXPONENT < high
    assert found.exponent == pytest.approx(0.04 * found.per_second)


def test_the_radius_of_kantz_leaves_half_of_the_references_a_neighbour():
    x = lorenz(2000, 0)
    found = lyapunov_exponent(x, dimension=3, delay=4, theiler=50, method="kantz")
    # The radius is found on some of the references.
    assert found.references == pytest.approx(0.5 * len(x), rel=0.08)


@pytest.mark.parametrize("seed", [18, 19, 21])
def test_growth_while_the_vectors_turn_is_no_exponent(seed):
    # Short series grow by e only in the first (m - 1) delay steps or so, and twice too fast.
    found = lyapunov_exponent(
        lorenz(1000, seed), dimension=3, delay=4, theiler=50, step=0.04, method="kantz"
    )
    assert found.exponent is None or found.interval_per_second[0] < LORENZ_EXPONENT


@pytest.mark.parametrize("method", ["rosenstein", "kantz"])
def test_intervals_hold_the_exponent_most_of_the_time(method):
    held = []
    for start in np.linspace(0.0, 0.3, 30):
        found = lyapunov_exponent(naive.henon(1000, start), dimension=2, theiler=4, method=method)
        held.append(found.interval[0] < HENON_EXPONENT < found.interval[1])
    # At 95 % there would be 24 or fewer of 30 once in 700 times.
    assert np.mean(held) >= 0.8


@pytest.mark.parametrize(("dimension", "delay", "theiler"), [(1, 1, 1), (2, 1, 3), (3, 2, 8)])
def test_the_stretch_is_that_of_the_slow_twin(dimension, delay, theiler):
    x = naive.henon(250)
    found = lyapunov_exponent(x, dimension=dimension, delay=delay, theiler=theiler, steps=9)
    median, mean = naive.stretch(x, dimension, delay, theiler, 9)
    assert np.allclose(found.stretch, median, rtol=1e-12)
    assert np.allclose(found.mean_stretch, mean, rtol=1e-12)


def test_of_two_lines_the_one_known_to_the_lesser_share_is_taken():
    """The flat one has the lesser error, but only as its slope is less."""
    steps = np.r_[np.full(10, 0.8), 1.6, np.full(10, 1.0)]
    shares = np.r_[np.full(10, 0.20), 0.2, np.full(10, 0.18)]
    signs = np.where(np.arange(BLOCKS) % 2, 1.0, -1.0)[:, None] * np.sqrt(BLOCKS)
    stretch = np.concatenate(([0.0], np.cumsum(steps))) - 30
    blocks = np.concatenate((np.zeros((BLOCKS, 1)), np.cumsum(signs * shares * steps, 1)), 1)
    line = best_line(Curve(stretch, blocks, True), 0, 3, 21, -40.0)
    assert line.first >= 11
    assert line.slope == pytest.approx(1.0)


def test_a_curve_that_winds_about_its_line_has_the_greater_error():
    steps = np.arange(13.0)
    winding = 0.2 * np.sin(2 * np.pi * steps / 4)  # alike in both halves
    straight, wound = (
        fit(Curve(0.3 * steps + more, np.zeros((BLOCKS, 13)), True), 0, 12)
        for more in (0 * steps, winding)
    )
    assert standard_error(straight) == pytest.approx(0.06 * 0.3)
    assert standard_error(wound) > 0.3 / 12


@pytest.mark.parametrize("bound", [1.5, 2.0, 3.0])
def test_the_upper_end_is_that_of_a_slope_that_had_to_be_below_a_bound(bound):
    """Of the deviates below the bound, one in 40 is as low as this if the mean is at the end."""
    line = Line(0, 10, 1.0, 0.0, 0.08, 0.0, 0.0, True)
    error = standard_error(line)
    low, high = interval(line._replace(most=1 + bound * error))
    assert (low, 2 - low) == pytest.approx(interval(line))
    end = norm.ppf(0.975) * (high - 1) / (1 - low)
    draws = end + np.random.default_rng(1).standard_normal(4_000_000)
    assert np.mean(draws[draws < bound] <= 0) == pytest.approx(0.025, rel=0.1)


def test_a_slope_just_below_its_bound_has_a_finite_interval():
    line = Line(0, 10, 1.0, 0.0, 0.08, 0.0, 0.0, True)
    usual, just = interval(line), interval(line._replace(most=1.0))
    assert (just[1] - 1) / (usual[1] - 1) == pytest.approx(2.5 / norm.ppf(0.975))


def test_of_a_curve_that_soon_ends_the_greatest_slope_is_known():
    """It is 2 e-folds from its end, and may not get there before step 9."""
    curve = Curve(0.2 * np.arange(12.0) - 3.0, np.zeros((BLOCKS, 12)), True)
    line = best_line(curve, 0, 9, 9, -40.0, -1.0)
    assert line.most == pytest.approx((2.0 - 0.2 * line.first) / (9 - line.first))
    assert best_line(curve, 0, 0, 9, -40.0, -1.0).most == np.inf


def test_the_region_can_be_overruled_and_is_a_least_squares_line():
    found = lyapunov_exponent(HENON[:3000], dimension=2, region=(2, 6))
    k = np.arange(2, 7)
    slope, intercept = np.polyfit(k, found.stretch[2:7], 1)
    assert found.region == (2, 6)
    assert found.exponent == pytest.approx(slope, rel=1e-9)
    assert found.intercept == pytest.approx(intercept, rel=1e-9)


@pytest.mark.parametrize("method", ["rosenstein", "kantz"])
@pytest.mark.parametrize("dimension", [1, 2, 4])
@pytest.mark.parametrize(
    "x",
    [NOISE, naive.autoregressive(3000, 0.95), np.cumsum(NOISE)],
    ids=["white", "coloured", "walk"],
)
def test_noise_has_no_exponent(x, dimension, method):
    found = lyapunov_exponent(x, dimension=dimension, method=method, theiler=20)
    assert found.verdict == "no scaling region"
    assert found.exponent is None
    assert found.interval is None
    assert found.per_second is None
    assert "no exponent" in found.describe()


def test_noise_that_is_known_does_not_lessen_the_exponent():
    # With 2 % the median gap begins at twice that of the noise, and reads 0.36 on the mean.
    found = []
    for seed in range(12):
        x = naive.henon(2000, 0.02 * seed)
        found.append(
            lyapunov_exponent(noisy(x, 0.02, seed), dimension=2, value_error=0.02 * x.std())
        )
    assert np.mean([one.exponent for one in found]) == pytest.approx(HENON_EXPONENT, rel=0.04)
    assert np.mean([one.interval[0] < HENON_EXPONENT < one.interval[1] for one in found]) > 0.8
    assert found[0].noise == pytest.approx(0.02 * naive.henon(2000, 0.0).std())


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_known_noise_on_a_cycle_is_no_growth(noise):
    x = np.sin(0.1 * np.arange(3000)) + noise * NOISE
    found = lyapunov_exponent(x, dimension=3, delay=10, value_error=noise)
    assert found.verdict == "no divergence"
    assert abs(found.exponent) < 1e-3


def test_white_noise_has_no_exponent_though_some_of_it_is_known():
    found = lyapunov_exponent(NOISE, dimension=2, value_error=0.3)
    assert (found.verdict, found.exponent) == ("no scaling region", None)


def test_the_width_of_the_kernel_is_that_of_the_slow_twin_and_of_the_gaps_without_noise():
    rng = np.random.default_rng(2)
    gaps = np.exp(rng.normal(0.0, 1.0, 20_000)) * rng.choice((-1, 1), 20_000)
    noise = 0.4
    blurred = gaps + noise * np.sqrt(2) * rng.standard_normal(len(gaps))
    found = width(np.log(np.abs(blurred)), noise)
    assert found == pytest.approx(naive.kernel_width(blurred[:2000], noise, LEVEL), abs=0.15)
    few = width(np.log(np.abs(blurred[:300])), noise)
    assert few == pytest.approx(naive.kernel_width(blurred[:300], noise, LEVEL), abs=1e-5)
    assert found == pytest.approx(width(np.log(np.abs(gaps)), 0.0), abs=0.03)


def test_pairs_that_are_followed_twice_count_once():
    slopes, errors = [], []
    for start in np.linspace(0.0, 0.3, 60):
        x = naive.henon(500, start)
        curve = follow_on(Setting(x, 2, 1, 4, "rosenstein", None, 0.0), 8, False).curve
        line = fit(curve, 0, 6)
        slopes.append(line.slope)
        errors.append(line.chance)
    # Without that the errors are by 1.27 too small.
    assert np.mean(errors) == pytest.approx(np.std(slopes), rel=0.15)


def test_the_errors_of_impacts_are_those_of_their_instants():
    intervals = 0.05 * (2 + HENON[:1000])
    time = np.concatenate(([0.0], np.cumsum(intervals)))
    time += 3e-5 * np.random.default_rng(1).standard_normal(len(time))
    stated = lyapunov_exponent(np.diff(time), dimension=2, timing_error=3e-5)
    borne = lyapunov_exponent(Impacts(time, time_error=np.full(len(time), 3e-5)), dimension=2)
    assert borne.exponent == stated.exponent
    assert borne.noise == pytest.approx(np.sqrt(2) * 3e-5)
    plain = lyapunov_exponent(np.diff(time), dimension=2)
    assert plain.noise is None
    assert plain.exponent != stated.exponent


@pytest.mark.parametrize("known", [False, True])
def test_intervals_hold_the_exponent_of_a_flow_that_keeps_its_phase(known):
    held = []
    for seed in range(2000, 2008):
        x = roessler_intervals(2000, seed)
        found = lyapunov_exponent(x, dimension=3, value_error=0.0 if known else None)
        assert found.level < found.far - 0.5
        assert any("keep the phase" in one for one in found.warnings)
        held.append(found.interval[0] < 0.0714 * x.mean() < found.interval[1])
    # At 95 % there would be 5 or fewer of 8 once in 170 times.
    assert np.mean(held) >= 0.75


@pytest.mark.parametrize("r", [3.6, 3.65])
def test_neighbours_in_a_band_are_as_far_apart_as_that_is_wide(r):
    x = [0.3]
    for _ in range(2099):
        x.append(r * x[-1] * (1 - x[-1]))
    x = np.array(x[100:])
    found = lyapunov_exponent(x, dimension=2, value_error=0.0)
    assert found.interval[0] < np.log(abs(r * (1 - 2 * x))).mean() < found.interval[1]
    # That of values an even number of steps, and so no band, apart.
    gaps = np.abs(x[:1000] - x[1000:])
    assert found.level == pytest.approx(width(np.log(gaps), 0.0), abs=0.15)


def test_gaps_that_end_where_those_of_any_two_do_have_no_level_of_their_own():
    for x, dimension in ((naive.henon(1000), 2), (lorenz_intervals(1000, 3), 5)):
        assert lyapunov_exponent(x, dimension=dimension).level is None


def test_what_a_curve_was_raised_by_is_no_growth_and_known_to_half():
    k = np.arange(11.0)
    blocks = np.zeros((BLOCKS, 11))
    plain = Curve(0.15 * k, blocks)
    assert best_line(plain, 0, 0, 10, -1.0) is not None
    raised = Curve(0.15 * k, blocks, False, 0.06 * k)
    assert best_line(raised, 0, 0, 10, -1.0) is None
    expected = np.hypot(0.06 / 2 / np.sqrt(3), 0.17 / 10)
    assert standard_error(fit(raised, 0, 10)) == pytest.approx(expected, rel=1e-9)


def test_a_series_that_recurs_exactly_is_periodic():
    found = lyapunov_exponent(np.tile([1.0, 2.0, 3.5], 100), dimension=2)
    assert (found.verdict, found.exponent, found.period) == ("periodic", 0.0, 3)
    assert "periodic" in str(found)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_neighbours_on_a_cycle_stay_together(noise):
    x = np.sin(0.1 * np.arange(3000)) + noise * NOISE
    found = lyapunov_exponent(x, dimension=3, delay=10)
    assert found.verdict == "no divergence"
    assert abs(found.exponent) < 1e-3
    assert "stay together" in found.describe()


@pytest.mark.parametrize(("noise", "doubtful"), [(True, True), (False, False)])
def test_an_exponent_within_two_errors_of_0_is_warned_of(noise, doubtful):
    # Gaps in coloured noise grow ever more slowly, by 1.8 errors here; those of a map steadily.
    x = naive.autoregressive(3000, 0.95) if noise else HENON[:3000]
    found = lyapunov_exponent(x, dimension=2, theiler=20, region=(6, 14) if noise else (1, 6))
    low, high = found.interval
    error = (high - low) / 2 / student.ppf(0.975, 29)  # over 30 blocks of time
    assert found.verdict == "divergence"
    assert (found.exponent < 2 * error) == doubtful
    warning = "the exponent is not told apart from 0"
    assert (warning in found.warnings) == doubtful
    assert (warning in found.describe()) == doubtful


def test_rounded_values_are_flagged_and_gaps_of_the_rounding_not_used():
    found = lyapunov_exponent(np.round(HENON[:5000], 2), dimension=2)
    assert found.exponent == pytest.approx(HENON_EXPONENT, rel=0.15)
    assert found.interval[0] < HENON_EXPONENT < found.interval[1]
    assert found.stretch[found.region[0]] >= np.log(0.02 * (1 - 1e-9))
    assert "different values" in found.describe()


def test_values_too_coarse_give_no_number():
    found = lyapunov_exponent(np.round(3 * HENON[:3000]), dimension=2)
    assert found.exponent is None


def test_gaps_that_are_mostly_zero_give_no_number():
    x = np.random.default_rng(1).choice([0.0, 0, 0, 0, 0, 1, 2.5], size=2000)
    found = lyapunov_exponent(x, dimension=2, theiler=2)
    assert found.verdict == "no scaling region"
    assert np.isneginf(found.stretch).any()
    assert lyapunov_exponent(x, dimension=2, theiler=2, region=(2, 6)).exponent is None


def test_of_impacts_it_is_also_per_second_of_the_mean_interval():
    intervals = 0.05 * (2 + HENON[:3000])
    impacts = Impacts(np.concatenate(([0.0], np.cumsum(intervals))))
    found = lyapunov_exponent(impacts, dimension=2)
    assert found.exponent == pytest.approx(HENON_EXPONENT, rel=0.05)
    assert found.per_second == pytest.approx(found.exponent / intervals.mean(), rel=1e-9)


def test_lists_and_pandas_are_taken():
    expected = lyapunov_exponent(HENON[:500], dimension=2).exponent
    assert lyapunov_exponent(HENON[:500].tolist(), dimension=2).exponent == expected
    assert lyapunov_exponent(pd.Series(HENON[:500]), dimension=2).exponent == expected


@pytest.mark.parametrize(
    "x",
    [
        [],
        np.full(500, 2.0),
        np.full(500, 3),
        np.where(np.arange(500) == 7, np.nan, HENON[:500]),
        np.where(np.arange(500) == 7, -np.inf, HENON[:500]),
        HENON[:500].reshape(2, -1),
        HENON[:60],
        "text",
    ],
)
def test_what_is_no_series_is_refused(x):
    with pytest.raises(InvalidInput) as caught:
        lyapunov_exponent(x, dimension=2)
    assert caught.value.argument == "x"


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"dimension": 0}, "dimension"),
        ({"dimension": 2, "delay": 0}, "delay"),
        ({"dimension": 2, "theiler": -1}, "theiler"),
        ({"dimension": 2, "theiler": 400}, "x"),
        ({"dimension": 2, "delay": 600}, "x"),
        ({"dimension": 2, "method": "wolf"}, "method"),
        ({"dimension": 2, "step": 0}, "step"),
        ({"dimension": 2, "steps": 3}, "steps"),
        ({"dimension": 2, "region": (5, 5)}, "region"),
        ({"dimension": 2, "region": 5}, "region"),
        ({"dimension": 2, "radius": 0.1}, "radius"),
        ({"dimension": 2, "method": "kantz", "radius": -0.1}, "radius"),
        ({"dimension": 2, "timing_error": -1.0}, "timing_error"),
        ({"dimension": 2, "value_error": np.nan}, "value_error"),
        ({"dimension": 2, "method": "kantz", "timing_error": 0.1}, "timing_error"),
        ({"dimension": 2, "method": "kantz", "value_error": 0.1}, "value_error"),
        ({"dimension": 2, "method": "kantz", "radius": 1e-12}, "x"),
    ],
)
def test_arguments_that_cannot_be_are_named(options, named):
    with pytest.raises(InvalidInput) as caught:
        lyapunov_exponent(HENON[:700], **options)
    assert caught.value.argument == named
