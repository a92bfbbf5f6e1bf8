"""The correlation dimension: what it refuses, what it recognises, and what its numbers claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

import impactsig
from impactsig import Impacts, InvalidInput, correlation_dimension
from impactsig.reconstruct._stated import typical
from impactsig.reconstruct._values import exact_period, quantum
from impactsig.reconstruct.dimensions import (
    _estimate as _dimension,
)
from impactsig.reconstruct.dimensions import (
    _faults,
    _jackknife,
    _kernel_sum,
    _limit,
    _unrelated,
)
from impactsig.reconstruct.dimensions._among_pairs import error_among_pairs
from impactsig.reconstruct.dimensions._kernel_sum import BLOCKS, kernel_sum
from impactsig.reconstruct.dimensions._noise import Noise, estimated
from impactsig.reconstruct.dimensions._slope import slope
from impactsig.reconstruct.recognition import _periodic, _tones, lingering

from .. import naive_reconstruct
from ..series import autoregressive, cat, coloured, henon, lorenz_intervals, noisy, torus


@pytest.fixture(scope="module")
def attractor():
    return correlation_dimension(henon(1000), value_error=0.0)


# -- refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("x", "argument"),
    [
        ([1.0, np.nan] * 100, "x"),
        ([1.0, np.inf] * 100, "x"),
        (np.ones((100, 3)), "x"),
        (["a", "b"] * 100, "x"),
        (np.arange(20.0) ** 2, "x"),
        ([], "x"),
    ],
)
def test_what_is_no_series_or_too_short_is_refused(x, argument):
    with pytest.raises(InvalidInput) as refused:
        correlation_dimension(x)
    assert refused.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("dimension", 0),
        ("dimension", 2.5),
        ("delay", 0),
        ("theiler", -1),
        ("theiler", 2.5),
        ("scales", (0.2, 0.1)),
        ("scales", (-1, 1)),
        ("scales", 0.1),
        ("scales", (0.1, np.nan)),
        ("timing_error", -1e-6),
        ("value_error", np.nan),
        ("missed", 0.6),
        ("missed", 0.1),
        ("spurious", -0.1),
        ("contraction", 0),
        ("resolution", 0),
        ("resolution", "fine"),
        ("workers", 0),
    ],
)
def test_arguments_that_cannot_be_used_are_named(argument, value):
    """Missed impacts of a series with negative values among them, which has none."""
    with pytest.raises(InvalidInput) as refused:
        correlation_dimension(henon(300), **{argument: value})
    assert refused.value.argument == argument


def test_too_short_for_delay_and_window_says_how_many_are_needed():
    with pytest.raises(InvalidInput, match="at least 290 for dimension 5, delay 10"):
        correlation_dimension(henon(200), 5, delay=10, theiler=200)


# -- flagged ---------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [0.0, 3.7, -1e300, 1e-300])
def test_a_constant_has_dimension_0_and_says_so(value):
    found = correlation_dimension(np.full(200, value))
    assert (found.verdict, found.dimension) == ("constant", 0.0)
    assert "constant" in str(found)


def test_a_constant_up_to_rounding_is_constant():
    found = correlation_dimension(0.1 * np.ones(200) + np.tile([0, 1e-17, 2e-17, 1e-17], 50))
    assert found.verdict == "constant"


@pytest.mark.parametrize("period", [1, 2, 3, 7, 30])
def test_periodic_intervals_are_recognised_and_not_fitted(period):
    one = np.random.default_rng(period).uniform(1, 2, period)
    found = correlation_dimension(np.resize(one, 300))
    assert found.dimension == 0.0
    assert found.verdict == ("periodic" if period > 1 else "constant")
    assert found.slope is None
    if period > 1:
        assert found.period == period
        assert f"every {period} steps" in found.describe()


def test_periodic_to_within_the_resolution_is_periodic():
    """Intervals of period 3 between instants that were sampled at 1 kHz."""
    instants = np.cumsum(np.resize([0.1234567, 0.2345678, 0.3456789], 300))
    found = correlation_dimension(np.diff(np.floor(instants * 1000) / 1000), resolution=1e-3)
    assert (found.verdict, found.period, found.dimension) == ("periodic", 3, 0.0)


def train(cycle, count, jitter, seed=0):
    """Impacts of a cycle of intervals, their instants known to within `jitter`."""
    instants = np.cumsum(np.resize(cycle, count + 1))
    return Impacts.from_times(instants + np.random.default_rng(seed).normal(0, jitter, count + 1))


@pytest.mark.parametrize("cycle", [[0.045], [0.02, 0.03], [0.02, 0.02, 0.03], np.arange(2, 9) / 99])
def test_a_train_that_recurs_but_for_the_timing_is_periodic(cycle):
    found = [correlation_dimension(train(cycle, 300, 1e-5, seed)) for seed in range(5)]
    assert sum(one.verdict == "periodic" and one.period == len(cycle) for one in found) >= 4
    likely = next(one for one in found if one.verdict == "periodic")
    assert likely.dimension == 0.0
    assert likely.noise == pytest.approx(np.sqrt(2) * 1e-5, rel=0.2)
    assert "to within noise of" in str(likely)


def test_independent_noise_about_values_that_are_apart_is_no_motion():
    x = np.resize([1.0, 2.0, 4.0], 300)
    assert correlation_dimension(noisy(x, 0.02)).period == 3
    assert correlation_dimension(noisy(x, 0.5)).verdict != "periodic"


@pytest.mark.parametrize("rate", [3.575, 3.59, 3.65, 3.9])
@pytest.mark.parametrize("count", [100, 1000])
def test_chaos_in_bands_visited_in_turn_is_not_periodic(rate, count):
    """The logistic map above its point of accumulation has 4, 2 and 1 bands."""
    x = np.empty(count + 1000)
    x[0] = 0.3
    for i in range(1, len(x)):
        x[i] = rate * x[i - 1] * (1 - x[i - 1])
    assert _periodic.noisy_cycle(x[1000:], 0.0, True) is None


@pytest.mark.parametrize(
    "x",
    [
        lambda: lorenz_intervals(300),
        lambda: 5 + 0.1 * henon(300),
        lambda: np.resize([1, 2, 3.0], 300) + 0.02 * np.sin(0.37 * np.arange(300)),
        lambda: np.resize([1, 2, 3.0], 300) + np.linspace(0, 0.1, 300),
        lambda: 1 + 0.002 * torus(300, frequencies=2),
        lambda: np.random.default_rng(0).exponential(size=300),
    ],
    ids=["chaos", "small chaos", "modulated", "drifting", "torus", "Poisson"],
)
def test_what_moves_about_its_cycle_is_not_periodic(x):
    assert _periodic.noisy_cycle(x(), 0.0, True) is None


@pytest.mark.parametrize(("tones", "noise"), [(1, 0.0), (2, 0.0), (1, 0.02), (2, 0.02)])
def test_a_torus_has_as_many_dimensions_as_tones(tones, noise):
    """0.11 was once found for the circle, and 0 of 40 intervals held the dimension of the torus."""
    found = correlation_dimension(noisy(torus(500, frequencies=tones), noise))
    assert (found.verdict, found.dimension) == ("quasi-periodic", tones)
    assert found.noise == pytest.approx(noise * torus(500, frequencies=tones).std(), abs=2e-3)


def test_harmonics_and_sums_of_two_tones_are_no_further_frequencies():
    k = np.arange(500)
    x = np.exp(np.cos(4.1 * k)) * (1 + 0.3 * np.cos(np.sqrt(3) * k))
    assert correlation_dimension(x).dimension == 2
    assert correlation_dimension(torus(500, frequencies=3)).dimension is None


NOISES = {
    "white": lambda n, rng: rng.normal(size=n),
    "exponential": lambda n, rng: rng.exponential(size=n),
    "AR(1)": lambda n, rng: autoregressive(n, [0.9], rng),
    "AR(2)": lambda n, rng: autoregressive(n, [1.6, -0.8], rng),
    "lognormal": lambda n, rng: np.exp(autoregressive(n, [0.8], rng)),
    "1/f": lambda n, rng: coloured(n, 1.0, rng),
    "1/f^2": lambda n, rng: coloured(n, 2.0, rng),
}


@pytest.mark.parametrize("name", NOISES)
def test_noise_has_no_dimension(name):
    found = [correlation_dimension(NOISES[name](400, np.random.default_rng(s))) for s in range(3)]
    assert [one.verdict for one in found] == ["noise"] * 3
    assert all(one.dimension is one.interval is one.slope is None for one in found)
    assert str(found[0]) == "no dimension: nothing tells the series from linear noise"


def test_a_motion_in_noise_is_no_noise():
    for x in (noisy(henon(300), 0.2), noisy(lorenz_intervals(300), 0.1)):
        assert correlation_dimension(x, value_error=0.1 * x.std()).verdict != "noise"


@pytest.mark.parametrize("jitter", [1e-6, 1e-5, 1e-4])
def test_python_and_command_and_report_recognise_the_same_period(jitter):
    """A period of two impacts that the report called 0, and Python "no plateau"."""
    rng = np.random.default_rng(3)
    time = np.cumsum(np.resize([0.04, 0.05], 300))
    kept = rng.random(300) > 0.03  # a few are missed, which breaks the order of the intervals
    impacts = Impacts.from_times((time + jitter * rng.standard_normal(300))[kept])
    found = correlation_dimension(impacts)
    assert (found.verdict, found.dimension, found.period) == ("periodic", 0.0, 2)
    assert found.noise == pytest.approx(np.sqrt(2) * jitter, rel=0.2)


def test_integers_of_three_values_are_periodic_only_if_they_recur():
    assert correlation_dimension(np.tile([1, 2, 3], 60)).period == 3
    found = correlation_dimension(np.random.default_rng(0).integers(1, 4, 300))
    assert found.dimension is None


def test_quantised_values_are_flagged_and_read_above_their_step():
    found = correlation_dimension(np.round(henon(2000), 2))
    assert found.resolution == pytest.approx(0.01)
    assert found.floor == pytest.approx(0.02)
    assert found.slope.scales[0] >= found.floor * (1 - 1e-9)
    assert "rounded to 0.01" in str(found)
    assert found.slope.interval[0] < 1.22 < found.slope.interval[1]


def test_a_copied_stretch_is_not_counted():
    x = henon(400)
    found = correlation_dimension(np.concatenate((x, [0.123], x)))
    assert found.slope is found.dimension is None
    assert "a copy of an earlier stretch" in str(found)


# -- noise -----------------------------------------------------------------------------------


def jittered(count, error, seed=0):
    """Intervals by the logistic map at r = 4, between instants known to within `error`."""
    x = np.empty(count)
    x[0] = 0.3 + 0.01 * seed
    for i in range(1, count):
        x[i] = 4 * x[i - 1] * (1 - x[i - 1])
    noise = error * np.random.default_rng(seed).standard_normal(count + 1)
    return 1 + x, 1 + x + np.diff(noise)


@pytest.mark.parametrize(("m", "delay"), [(2, 1), (3, 1), (3, 2)])
def test_the_corrected_sum_has_the_mean_of_the_noise_free_one(m, delay):
    noise = Noise(0.02, 0.01, "")
    clean = jittered(300, 0.0)[0]
    exact = kernel_sum(clean, m, delay, 3, np.zeros((m, m)), given=(0.06, 0.3))
    sums = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        x = clean + np.diff(0.02 * rng.standard_normal(301)) + 0.01 * rng.standard_normal(300)
        sums.append(kernel_sum(x, m, delay, 3, noise.covariance(m, delay), given=(0.06, 0.3)).sums)
    error = np.std(sums, axis=0) / np.sqrt(40)
    assert np.all(np.abs(np.mean(sums, axis=0) - exact.sums) < 3.5 * error)
    assert np.all(error < 0.02 * exact.sums)


def test_kernel_sums_are_those_of_the_slow_twin():
    x = jittered(120, 0.01)[1]
    covariance = Noise(0.01, 0.005, "").covariance(3, 1)
    found = kernel_sum(x, 3, 1, 4, covariance, given=(0.03, 0.4))
    expected = naive_reconstruct.kernel_sums(x, 3, 1, 4, covariance, found.scales)
    np.testing.assert_allclose(found.sums, expected, rtol=2e-7)
    assert found.pairs.sum(axis=(0, 1)) == pytest.approx(118 * 117 / 2 - 4 * 118 + 10)


def test_kernel_sums_hold_where_scales_are_far_below_the_leaves():
    """Neighbours 1e-8 apart are told by double precision, what is far by single."""
    rng = np.random.default_rng(4)
    x = rng.uniform(size=200)
    x = np.concatenate([x, x + 1e-8 * rng.standard_normal(200)])
    found = kernel_sum(x, 1, 1, 4, np.zeros((1, 1)), given=(3e-9, 0.01))
    gaps = np.concatenate([x[k:] - x[:-k] for k in range(5, len(x))])
    expected = [np.mean(np.exp(-((gaps / h) ** 2) / 4)) for h in found.scales]
    np.testing.assert_allclose(found.sums, expected, rtol=5e-7)


@pytest.mark.parametrize("covariance", [np.zeros((2, 2)), Noise(0.01, 0.0, "").covariance(2, 1)])
def test_kernel_sums_are_told_apart_by_the_blocks_of_both_vectors(covariance):
    """Of many leaves, each with points of many blocks, and of scales that few of them reach."""
    x = jittered(1200, 0.01)[1]
    found = kernel_sum(x, 2, 1, 30, covariance, given=(0.02, 0.4), workers=2)
    y = naive_reconstruct.delay_vectors(x, 2, 1)
    block = np.arange(len(y)) * BLOCKS // len(x)
    apart = np.subtract.outer(np.arange(len(y)), np.arange(len(y))) < -30
    for k in (0, len(found.scales) - 1):
        width = found.scales[k] ** 2 * np.eye(2) - covariance
        gaps = y[:, None] - y
        exponents = np.einsum("ijk,kl,ijl->ij", gaps, np.linalg.inv(width), gaps) / 4
        kernel = np.where(apart, np.exp(-exponents), 0) * found.scales[k] ** 2
        edges = np.searchsorted(block, np.arange(BLOCKS))
        parts = np.add.reduceat(np.add.reduceat(kernel, edges, axis=0), edges, axis=1)
        expected = parts / np.sqrt(np.linalg.det(width))
        np.testing.assert_allclose(found.parts[..., k], expected, rtol=3e-7, atol=3e-7)
        pairs = np.add.reduceat(np.add.reduceat(apart, edges, axis=0, dtype=int), edges, axis=1)
        np.testing.assert_array_equal(found.pairs[..., k], pairs)


def test_gaps_are_not_stepped_over_in_kernel_sums():
    x = jittered(120, 0.0)[0]
    x[[50, 80]] = np.nan
    found = kernel_sum(x, 2, 1, 4, np.zeros((2, 2)), given=(0.03, 0.4))
    expected = naive_reconstruct.kernel_sums(x, 2, 1, 4, np.zeros((2, 2)), found.scales)
    np.testing.assert_allclose(found.sums, expected, rtol=2e-7)


@pytest.mark.parametrize("given", ["impacts", "timing_error", "estimated"])
def test_the_result_says_where_the_noise_is_from(given):
    clean, x = jittered(1000, 0.01)
    if given == "impacts":
        time = np.cumsum(np.concatenate(([0.0], x)))
        found = correlation_dimension(Impacts(time, time_error=np.full(1001, 0.01)))
        assert "by the time_error of the impacts" in str(found)
    elif given == "timing_error":
        found = correlation_dimension(x, timing_error=0.01)
        assert "as given" in str(found)
    else:
        found = correlation_dimension(Impacts.from_times(np.cumsum(np.concatenate(([0.0], x)))))
        assert "estimated from the data" in str(found)
        assert found.slope.errors["noise"] > 0
    assert found.timing_error == pytest.approx(0.01, rel=0.25)
    assert found.noise == pytest.approx(np.sqrt(2) * found.timing_error)
    assert found.floor == pytest.approx(1.5 * found.noise)
    assert found.slope.scales[0] >= found.floor * (1 - 1e-9)
    exact = correlation_dimension(clean, value_error=0.0, scales=found.slope.scales)
    assert found.slope.interval[0] < exact.slope.value < found.slope.interval[1]


def test_a_few_impacts_that_are_hardly_timed_do_not_speak_for_all():
    rng = np.random.default_rng(4)
    x = 3 + henon(2000)
    error = rng.choice((1e-4, 0.1), 2001, p=(0.99, 0.01))
    time = np.cumsum(np.concatenate(([0.0], x))) + error * rng.standard_normal(2001)
    found = correlation_dimension(Impacts(time, time_error=error))
    assert found.timing_error == pytest.approx(1e-4)
    exact = correlation_dimension(x, 3, value_error=0.0, scales=found.slope.scales)
    assert found.slope.value == pytest.approx(exact.slope.value, abs=0.04)
    even = rng.uniform(0.5, 2.0, 2001) * 1e-4
    found = correlation_dimension(Impacts(time, time_error=even))
    assert found.timing_error == pytest.approx(np.sqrt(np.mean(even**2)), rel=0.05)


def uneven(count, seed):
    """Intervals of Hénon's map as impacts that are timed the better the longer the interval."""
    rng = np.random.default_rng(seed)
    x = 3 + henon(count, seed=seed)
    error = 3e-3 * 8.0 ** ((3 - x) / 1.3)[[0, *range(count)]]
    time = np.cumsum(np.concatenate(([0.0], x))) + error * rng.standard_normal(count + 1)
    return x, Impacts(time, time_error=error)


@pytest.mark.parametrize("delay", [1, 2])
def test_errors_count_as_often_as_their_vectors_have_neighbours(delay):
    train = uneven(300, 3)[1]
    train = replace(train, gaps=[[train.time[150] + 1e-3, train.time[151] - 1e-3]])
    usual = float(np.sqrt(np.mean(train.time_error**2)))
    expected = naive_reconstruct.error_among_pairs(train, delay, usual)
    assert error_among_pairs(train, delay, usual) == pytest.approx(expected, rel=1e-9)
    assert abs(expected / usual - 1) > 0.03


def test_noise_that_goes_with_the_state_is_taken_off():
    off = {"given": [], "usual": []}
    for seed in range(4):
        x, train = uneven(2000, seed)
        found = correlation_dimension(train)
        usual = float(np.sqrt(np.mean(train.time_error**2)))
        taken = correlation_dimension(train, timing_error=usual)
        for name, one in (("given", found), ("usual", taken)):
            exact = correlation_dimension(x, 3, value_error=0.0, scales=one.slope.scales)
            off[name].append(one.slope.value - exact.slope.value)
    assert abs(np.mean(off["given"])) < 0.02
    assert abs(np.mean(off["usual"])) > 2 * abs(np.mean(off["given"]))


def test_what_impacts_share_of_their_errors_is_no_noise_of_intervals():
    train = uneven(1000, 5)[1]
    both = np.hypot(train.time_error, 0.01)
    shared = replace(train, time=1e-2 * train.time, time_error=1e-2 * both,
                     shared_time_error=np.full(1001, 1e-4), start=None, duration=None)  # fmt: skip
    alone = replace(shared, time_error=1e-2 * train.time_error, shared_time_error=None)
    found, expected = (correlation_dimension(one) for one in (shared, alone))
    # Intervals of 0.03 s have 3 % of it.
    left = np.sqrt(0.03) * 1e-4
    assert found.timing_error == pytest.approx(np.hypot(expected.timing_error, left), rel=0.03)


def test_the_floor_printed_is_the_least_scale_used():
    """A guard once moved the scales up, and the floor that was printed stayed behind."""
    for seed in range(4):
        found = correlation_dimension(noisy(henon(600, seed), 0.02, seed), value_error=0.0144)
        assert f"floor {found.floor:.3g}" in str(found)
        assert found.slope.scales[0] == pytest.approx(found.floor, rel=1e-6)


@pytest.mark.parametrize("level", [0.01, 0.03])
def test_the_level_of_noise_is_found(level):
    x = noisy(henon(1500), level)
    found = estimated(x, 1, 2, 0.0, False, None)
    assert found.of_value / henon(1500).std() == pytest.approx(level, rel=0.25)
    assert np.hypot(*found.other) > found.of_value / 1.5


def test_beyond_the_noise_only_the_slope_is_given_and_what_is_needed():
    x = noisy(henon(2000), 0.05)
    error = 0.05 * henon(2000).std()
    found = correlation_dimension(x, value_error=error)
    assert (found.verdict, found.dimension, found.interval) == ("slope", None, None)
    assert "e-folds" in found.reason
    assert found.slope.span < 1.6
    needed = float(found.needed.split("noise of ")[1].split()[0])
    better = noisy(henon(2000), needed / error * 0.05)
    assert correlation_dimension(better, value_error=needed).dimension is not None


def test_too_few_impacts_say_how_many_are_needed():
    found = correlation_dimension(lorenz_intervals(300), 4, theiler=6, value_error=0.0)
    assert found.dimension is None
    needed = int(found.needed.split("about ")[1].split()[0])
    assert 300 < needed < 3000
    more = correlation_dimension(lorenz_intervals(2 * needed), 4, theiler=6, value_error=0.0)
    assert more.dimension is not None


def test_scales_at_which_unrelated_vectors_are_near_are_left_out():
    """D2 is 2; four steps expand by 47, and slopes over all scales were 2.2 on average."""
    found = [correlation_dimension(cat(2000, seed), value_error=0.0) for seed in range(4)]
    slopes = [one.slope.value for one in found]
    assert abs(np.mean(slopes) - 2) < 0.1
    assert all(one.interval[0] < 2 < one.interval[1] for one in found if one.dimension is not None)
    assert sum(one.dimension is not None for one in found) >= 3


def test_unrelated_values_steepen_the_slope_by_as_much_as_they_add():
    """Of uniform values K_1 is an integral of (1 - d) exp(-d^2 / 4 H^2); near states add H^2."""
    scales = np.geomspace(0.02, 0.08, 5)
    root = np.exp(-1 / (4 * scales**2))
    near = 2 * scales * np.sqrt(np.pi) * erf(1 / (2 * scales)) - 4 * scales**2 * (1 - root)
    sums = scales**2 + near**3
    values = np.random.default_rng(0).uniform(size=20_000)
    chance = _unrelated.unrelated(scales, values, 3, 2, 0.0)
    np.testing.assert_allclose(chance, near**3, rtol=0.1)
    found = _unrelated.steepened(scales, sums, chance)
    steeper = np.gradient(np.log(sums), np.log(scales)) - 2
    np.testing.assert_allclose(found[1:-1], steeper[1:-1], rtol=0.1)  # one-sided at the ends
    np.testing.assert_allclose(_unrelated.freed(sums, near**3), scales**2)
    assert np.all(np.isinf(_unrelated.steepened(scales, 0.8 * near**3, chance)))


def sums_of(scales, values):
    """A kernel sum without chance: the share of a pair of blocks is the same at all scales."""
    blocks = _kernel_sum.BLOCKS
    pairs = np.ones((blocks, blocks, len(scales)))
    return _kernel_sum.KernelSum(scales, values * pairs, pairs, 1e6 * values, 1000)


def test_what_unrelated_vectors_add_is_an_error_of_the_dimension():
    """H^1.5 and 0.4 H^3 of unrelated ones: over an e-fold their slope is that of the sum above."""
    scales = np.exp(np.linspace(-2.2, 0.0, 8))
    chance = 0.4 * scales**3
    sums = sums_of(scales, scales**1.5 + chance)
    found = _limit.departure(sums, chance, 2.2)
    steeper = np.polyfit(np.log(scales), np.log(sums.sums), 1)[0] - 1.5
    assert found.span == pytest.approx(0.13 / 2.2)
    assert found.unrelated == pytest.approx(steeper / np.sqrt(3))
    assert found.rising == pytest.approx(0.0, abs=1e-9)


def test_a_slope_that_still_rises_towards_small_scales_has_that_error():
    """ln K with slopes of 1 above and 1.2 below; the other way round it is none."""
    logs = np.linspace(-2.4, 0.0, 8)
    none = np.full(8, 1e-30)
    for low, high, expected in ((1.2, 1.0, 0.2), (1.0, 1.2, 0.0)):
        values = np.where(logs < logs[3:5].mean(), low, high) * (logs - logs[3:5].mean())
        found = _limit.departure(sums_of(np.exp(logs), 1e-3 * np.exp(values)), none, 2.4)
        assert found.rising == pytest.approx(expected / 2 / np.sqrt(3), abs=1e-9)


def test_the_dimension_is_read_below_the_scales_of_unrelated_vectors():
    """A hump of unrelated vectors over the largest scales of a power law of 5 e-folds."""
    scales = np.exp(np.linspace(-5.0, 0.0, 15))
    chance = 2 * scales**4
    some = _limit.best_scales(sums_of(scales, scales**1.5 + chance), chance)
    left = scales[some]
    assert left[0] == scales[0]
    assert left[-1] < 0.4
    assert np.log(left[-1] / left[0]) >= 1.6
    everywhere = _limit.best_scales(sums_of(scales, scales**1.5), np.full(15, 1e-30))
    assert everywhere == slice(0, 15)


def winding(seed):
    """x + y / 2 + cos t / 2 of a solenoid that winds three times and contracts by 0.1."""
    rng = np.random.default_rng(seed)
    t, x, y = rng.uniform(size=3)
    values = np.empty(2000)
    for i in range(-200, 2000):
        x, y = 0.1 * x + np.cos(2 * np.pi * t), 0.1 * y + np.sin(2 * np.pi * t)
        t = (3 * t + 1e-15 * rng.uniform()) % 1.0
        if i >= 0:
            values[i] = x + 0.5 * y + 0.5 * np.cos(2 * np.pi * t)
    return values


def test_strands_far_apart_are_read_at_small_scales():
    """Up to the largest scales D2 came out as 1.69 +- 0.08 and was held in 12 %."""
    found = [correlation_dimension(winding(seed), value_error=0.0) for seed in range(6)]
    d2 = 1 + np.log(3) / np.log(10)
    assert abs(np.mean([one.dimension for one in found]) - d2) < 0.13
    assert sum(one.interval[0] < d2 < one.interval[1] for one in found) >= 5


EXPANDING = {"five-fold": lambda x: 5 * x % 1, "Gauss": lambda x: 1 / x % 1}


@pytest.mark.parametrize("name", EXPANDING)
def test_strongly_expanding_maps_have_dimension_1_or_are_refused(name):
    """Both fill [0, 1]; five-fold expansion is 125 over a vector, that of Gauss is unbounded.

    The last coordinates then look like noise at all but the smallest scales that 500 values reach:
    Gauss' map once had a dimension of 1.2 to 1.5.
    """
    answered = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        x = rng.uniform(size=500)
        for i in range(1, 500):  # binary digits run out
            x[i] = (EXPANDING[name](x[i - 1]) + 1e-15 * rng.uniform()) % 1
        found = correlation_dimension(x, value_error=0.0)
        if found.dimension is not None:
            answered += 1
            assert found.interval[0] < 1 < found.interval[1]
        else:
            assert found.reason
            assert "inf" not in found.reason
    assert (answered > 0) == (name == "five-fold")


def test_a_slope_that_rises_with_a_further_coordinate_is_no_dimension():
    """Over scales that the caller chooses, and of Gauss' map, all that there are."""
    x = np.random.default_rng(1).uniform(size=500)
    for i in range(1, 500):
        x[i] = 1 / x[i - 1] % 1
    found = correlation_dimension(x, value_error=0.0, scales=(0.005, 0.1), dimension=3)
    assert found.verdict == "slope"
    assert "still rises with a further coordinate" in found.reason


# -- missed and spurious impacts -------------------------------------------------------------


def test_faults_are_of_the_shares_that_are_asked_for():
    x = np.full(20_000, 1.0)
    x[7000] = np.nan
    found = _faults.with_faults(x, 0.05, 0.02, 0)
    assert np.count_nonzero(np.isnan(found)) == 1
    assert np.nansum(found) == pytest.approx(np.nansum(x))
    assert len(found) - 20_000 == pytest.approx(-600, abs=100)
    np.testing.assert_array_equal(_faults.with_faults(x, 0.0, 0.0, 0), x)


def test_missed_and_spurious_impacts_widen_the_interval_or_are_refused():
    clean, _ = jittered(1500, 0.0)
    train = Impacts.from_times(np.cumsum(np.concatenate(([0.0], clean))))
    few = impactsig.measure(train, missed=0.03, spurious=0.03, seed=1).impacts
    found = correlation_dimension(few, missed=0.03)
    assert found.spurious == pytest.approx(0.03, abs=0.01)  # by the probability of the impacts
    assert found.slope.errors["missed and spurious impacts"] > 0
    assert found.interval[0] < 1 < found.interval[1]
    many = correlation_dimension(few, missed=0.1, spurious=0.1)
    assert many.dimension is None
    assert "repair" in many.needed


# -- the same whatever it is given in --------------------------------------------------------


def test_lists_series_float32_and_impacts_are_read(attractor):
    import pandas as pd

    x = henon(1000)
    for given in (x.tolist(), pd.Series(x, index=np.arange(1000) + 7)):
        assert correlation_dimension(given, value_error=0.0).slope == attractor.slope
    single = correlation_dimension(x.astype(np.float32), value_error=0.0)
    assert single.dimension == pytest.approx(attractor.dimension, abs=1e-3)
    run = Impacts(np.cumsum(x + 2), duration=3000.0, time_error=np.zeros(1000))
    assert correlation_dimension(run).dimension == pytest.approx(attractor.dimension, abs=0.02)


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1e6, 1e200])
def test_units_do_not_matter(attractor, scale):
    found = correlation_dimension(scale * henon(1000), value_error=0.0)
    assert found.dimension == pytest.approx(attractor.dimension, abs=1e-6)
    assert found.slope.scales[1] == pytest.approx(scale * attractor.slope.scales[1], rel=1e-6)


def test_workers_do_not_matter(attractor):
    one = correlation_dimension(henon(1000), value_error=0.0, workers=1)
    assert (one.slope, one.interval) == (attractor.slope, attractor.interval)


# -- evidence --------------------------------------------------------------------------------


def test_the_result_carries_its_evidence(attractor):
    slope = attractor.slope
    assert attractor.verdict == "dimension"
    taken = attractor.dimension_slope
    assert (attractor.dimension, attractor.interval) == (taken.value, taken.interval)
    low, high = attractor.interval
    assert high - low > slope.interval[1] - slope.interval[0]
    assert low < taken.value < high
    assert slope.interval[0] < slope.value < slope.interval[1]
    assert slope.span >= 1.6
    assert taken.span >= 1.6
    assert attractor.scales.shape == attractor.sums.shape == attractor.slopes.shape
    assert attractor.scales[[0, -1]] == pytest.approx(slope.scales)
    assert "covers chance, the choice of scales" in str(attractor)
    assert "and unrelated vectors); slope" in str(attractor)


def test_a_short_span_of_a_low_dimension_goes_on_towards_the_extent():
    """Of the logistic map with 2 % of noise 1.2 e-folds lie below K = 0.03; its D2 is 1."""
    x = np.empty(2000)
    x[0] = 0.3
    for i in range(1999):
        x[i + 1] = 3.9999 * x[i] * (1 - x[i])
    found = correlation_dimension(noisy(x, 0.02), value_error=0.02 * x.std())
    assert found.slope.span > 1.6
    assert 0.03 < found.sums[-1] < 0.09
    assert found.interval[0] < 1 < found.interval[1]


def test_scales_given_are_the_scales_used():
    found = correlation_dimension(henon(1000), scales=(0.01, 0.1), value_error=0.0)
    assert found.slope.scales == pytest.approx((0.01, 0.1))
    none = correlation_dimension(henon(300), scales=(1e-12, 1e-11), value_error=0.0)
    assert (none.verdict, none.slope) == ("no scales", None)


def test_the_dimension_by_kaplan_and_yorke_needs_a_contraction(attractor):
    """Hénon's map shrinks areas by 0.3: 1 + 0.419 / (0.419 - ln 0.3) = 1.258."""
    assert attractor.kaplan_yorke is None
    found = correlation_dimension(henon(2000), value_error=0.0, contraction=-np.log(0.3))
    assert found.kaplan_yorke.interval[0] < 1.258 < found.kaplan_yorke.interval[1]
    assert found.kaplan_yorke.value == pytest.approx(1.258, abs=0.03)
    assert "D1 by Kaplan and Yorke 1.2" in str(found)


def test_the_figure_shows_the_slope_and_its_band(attractor):
    import matplotlib

    matplotlib.use("Agg")
    sums, slopes = attractor.plot()
    assert len(sums.get_lines()) == 2
    assert f"slope {attractor.slope.value:.2f}" in slopes.get_title(loc="center")
    assert len(correlation_dimension(np.tile([1.0, 2.0], 100)).plot()) == 2
    matplotlib.pyplot.close("all")


# -- its parts -------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [1, 2])
def test_uniform_points_have_the_dimension_of_their_space(dimension):
    """Far from the edges K(H) is (2 H sqrt(pi))^D; the edges take some of it away."""
    x = np.random.default_rng(dimension).uniform(size=4000)
    found = kernel_sum(x, dimension, 1, 0, np.zeros((dimension, dimension)), given=(0.004, 0.01))
    expected = (2 * np.sqrt(np.pi) * found.scales) ** dimension
    np.testing.assert_allclose(found.sums, expected * (1 - 2 * found.scales) ** dimension, rtol=0.1)
    assert slope(found).value == pytest.approx(dimension, abs=0.1)


def test_sums_without_a_block_are_those_of_the_pairs_among_the_others():
    rng = np.random.default_rng(5)
    parts = np.triu(rng.integers(1, 9, (5, 5)))[..., None] * np.array([1, 2])
    found = _jackknife.without_each(parts)
    for row, kept in enumerate([range(5), *(np.delete(np.arange(5), b) for b in range(5))]):
        np.testing.assert_array_equal(found[row], parts[np.ix_(kept, kept)].sum(axis=(0, 1)))


def test_pair_variance_is_that_of_the_pairs_alone_whatever_the_blocks_add():
    rng = np.random.default_rng(0)
    found, sums = [], []
    for _ in range(4000):
        chance = np.triu(rng.normal(size=(8, 8)), 1)
        block = 10 * rng.normal(size=8)
        found.append(_jackknife.pair_variance(np.triu(chance + block + block[:, None] + 3, 1)))
        sums.append(chance.sum())
    assert np.mean(found) == pytest.approx(28, rel=0.02)  # 8 * 7 / 2 pairs of variance 1
    assert np.var(sums) == pytest.approx(np.mean(found), rel=0.07)


@pytest.mark.parametrize(("by_blocks", "most"), [(0.0, 1.35), (0.2, 1.04), (1.0, 1.04)])
def test_the_variance_is_that_of_the_sum_whatever_share_single_pairs_have(by_blocks, most):
    """It adds where there is none by blocks, as no variance is taken for negative."""
    rng = np.random.default_rng(0)
    blocks, found, sums = 16, [], []
    for _ in range(3000):
        visited = by_blocks * rng.normal(size=blocks)
        parts = 3 + visited + visited[:, None] + rng.normal(size=(blocks, blocks))
        parts = np.triu(parts, 1)
        # Half as many pairs within a block.
        within = 1.5 + visited + np.sqrt(0.5) * rng.normal(size=blocks)
        found.append(float(_jackknife.variance(parts + np.diag(within))))
        sums.append(parts.sum() + within.sum())
    truth = blocks**3 * by_blocks**2 + blocks**2 / 2
    assert np.var(sums) == pytest.approx(truth, rel=0.1)
    assert 0.96 < np.mean(found) / truth < most


def test_the_error_of_a_slope_is_its_scatter():
    """Independent values, so that every series is another realisation."""
    slopes = []
    for seed in range(60):
        x = np.random.default_rng(seed).uniform(size=400) ** 2
        slopes.append(slope(kernel_sum(x, 2, 1, 0, np.zeros((2, 2)), given=(0.01, 0.1))))
    told = np.sqrt(np.mean([one.error**2 for one in slopes]))
    # Of 60 the scatter is known to 9 %.
    assert told == pytest.approx(np.std([one.value for one in slopes]), rel=0.18)
    assert kernel_sum(x, 2, 1, 0, np.zeros((2, 2))).parts.shape[:2] == (BLOCKS, BLOCKS)


def test_an_error_taken_for_exact_takes_no_students_t():
    chance, exact = 0.01, 0.05
    assert _dimension._half_width(chance, chance) == pytest.approx(2.0395 * chance, rel=1e-4)
    total = np.hypot(chance, exact)
    assert _dimension._half_width(chance, total) == pytest.approx(1.96 * total, rel=1e-3)
    assert _dimension._half_width(0.0, total) == pytest.approx(1.96 * total, rel=1e-3)


def test_scales_of_few_pairs_are_left_out_of_a_slope_that_has_others():
    x = henon(3000, 3)
    found = correlation_dimension(x, value_error=0.0)
    least = correlation_dimension(x, value_error=0.0, scales=(1e-9, found.slope.scales[1]))
    half = [np.ptp(one.slope.interval) / 2 for one in (found, least)]
    assert least.slope.scales[0] < found.slope.scales[0]
    assert half[0] < 0.75 * half[1]
    assert found.slope.interval[0] < 1.21 < found.slope.interval[1]


def test_where_no_dimension_can_be_read_the_slope_takes_the_scales_of_the_extent_too():
    found = correlation_dimension(lorenz_intervals(500, 6), value_error=0.0)
    assert found.verdict == "slope"
    assert found.sums[-1] == pytest.approx(0.03, rel=0.1)
    assert "below the extent of the attractor" in found.reason


def test_tones_of_a_drift_are_none():
    assert _tones.tones(np.linspace(-1.7, 1.7, 500), 0.0) is None


def test_the_quantum_of_multiples_is_found_and_none_of_a_continuous_series():
    rng = np.random.default_rng(0)
    assert quantum(rng.integers(0, 50, 500) * 0.02) == pytest.approx(0.02)
    assert quantum(rng.normal(size=500)) == 0
    assert quantum(np.tile(rng.normal(size=50), 10)) == 0


def test_recurrence_is_the_least_period():
    x = np.resize(np.random.default_rng(0).normal(size=12), 120)
    assert exact_period(x, 0.0) == 12
    x[-1] += 1e-6
    assert exact_period(x, 0.0) is None
    assert exact_period(x, 1e-5) == 12


@pytest.mark.parametrize("count", [3, 5, 14, 15, 20, 40])
def test_a_short_series_may_recur_too(count):
    x = np.resize([1.0, 2.0, 3.0, 5.0, 4.0], count)
    assert exact_period(x) == (5 if count >= 15 else None)


def test_a_slow_drift_is_no_period():
    assert exact_period(np.linspace(0, 1, 500), 0.01) is None


def test_the_share_of_stays_near_a_cycle():
    """30 stays of 20 values near a cycle of 2, each after 20 irregular ones."""
    rng = np.random.default_rng(0)
    parts = [np.concatenate((rng.uniform(size=20), np.tile([0.2, 0.8], 10))) for _ in range(30)]
    assert lingering.lingering(np.concatenate(parts)) == pytest.approx(0.45, abs=0.05)
    assert lingering.lingering(rng.uniform(size=600)) == 0


@pytest.mark.parametrize(("frequency", "lingers"), [(20.1, False), (20.5, True)])
def test_d1_of_a_motion_that_lingers_near_a_cycle_comes_with_a_warning(frequency, lingers):
    scene = impactsig.scenes.karpodinis(frequency)
    x = impactsig.simulate(scene, periods=1000, transient=300).impacts.intervals()[:500]
    found = correlation_dimension(x, timing_error=0.0, contraction=3.0)
    assert found.kaplan_yorke is not None
    assert any("near a cycle" in one for one in found.warnings) == lingers


@pytest.mark.parametrize("every", [8, 25])
def test_a_train_of_short_stretches_between_gaps_is_no_error(every):
    """Of stretches of fewer than 30 values, states of too few coordinates were made."""
    x = 1.5 + henon(90)
    time = np.concatenate(([0.0], np.cumsum(x)))
    gaps = [[time[k] + 0.1, time[k] + 0.2] for k in range(every, 90, every)]
    found = correlation_dimension(Impacts(time, gaps=gaps), 1)
    assert found.verdict == "noise"
    assert "nothing tells" in found.describe()


@pytest.mark.parametrize(
    "given", [{"value_error": 1e300}, {"timing_error": 1e300}, {"scales": (1e200, 1e300)}]
)
def test_noise_and_scales_far_beyond_the_series_give_no_dimension(given):
    found = correlation_dimension(1e-130 * henon(300), **given)
    assert found.dimension is None
    assert found.reason


@pytest.mark.parametrize(
    "given", [{"value_error": 1e-170}, {"resolution": 1e-170}, {"scales": (1e-320, 1.0)}]
)
def test_noise_and_scales_far_below_the_series_are_as_none(given):
    expected = correlation_dimension(henon(300), value_error=0.0)
    found = correlation_dimension(henon(300), **{"value_error": 0.0, **given})
    assert found.slope.value == pytest.approx(expected.slope.value, abs=0.2)


@pytest.mark.parametrize("level", [1e-200, 1.0, 1e200])
def test_the_typical_error_can_be_far_from_1(level):
    errors = level * np.array([3.0, 4.0, 3.0, 4.0] * 20 + [1e3])
    assert typical(errors) == pytest.approx(level * np.sqrt(12.5))
    assert typical(np.zeros(3)) == 0
