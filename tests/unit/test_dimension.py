"""The correlation dimension: what it refuses, what it flags, and closed forms of its parts."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from impactsig import Impacts, InvalidInput, correlation_dimension
from impactsig.reconstruct import _bending, _bootstrap, _estimators, _periodic, _scaling
from impactsig.reconstruct._counting import pair_counts_by_block
from impactsig.reconstruct._nearest import log_distances_by_block
from impactsig.reconstruct._values import exact_period

from ..series import henon, lorenz_intervals, noisy, torus


@pytest.fixture(scope="module")
def attractor():
    return correlation_dimension(henon(1000), 3)


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
        ("dimensions", 1),
        ("dimensions", (3,)),
        ("dimensions", (3, 2)),
        ("dimensions", 2.5),
        ("delay", 0),
        ("theiler", -1),
        ("theiler", 2.5),
        ("region", (0.2, 0.1)),
        ("region", (-1, 1)),
        ("region", 0.1),
        ("region", (0.1, np.nan)),
        ("resolution", 0),
        ("resolution", "fine"),
        ("seed", -1),
        ("workers", 0),
    ],
)
def test_arguments_that_cannot_be_used_are_named(argument, value):
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
    assert (found.verdict, found.value) == ("constant", 0.0)
    assert "constant" in str(found)


def test_a_constant_up_to_rounding_is_constant():
    found = correlation_dimension(0.1 * np.ones(200) + np.tile([0, 1e-17, 2e-17, 1e-17], 50))
    assert found.verdict == "constant"


@pytest.mark.parametrize("period", [1, 2, 3, 7, 30])
def test_periodic_intervals_are_recognised_and_not_fitted(period):
    one = np.random.default_rng(period).uniform(1, 2, period)
    found = correlation_dimension(np.resize(one, 300))
    assert found.value == 0.0
    assert found.verdict == ("periodic" if period > 1 else "constant")
    assert found.correlation is None
    if period > 1:
        assert found.period == period
        assert f"every {period} steps" in found.describe()


def test_periodic_to_within_the_resolution_is_periodic():
    """Intervals of period 3 between instants that were sampled at 1 kHz."""
    instants = np.cumsum(np.resize([0.1234567, 0.2345678, 0.3456789], 300))
    found = correlation_dimension(np.diff(np.floor(instants * 1000) / 1000), resolution=1e-3)
    assert (found.verdict, found.period, found.value) == ("periodic", 3, 0.0)


def train(cycle, count, jitter, seed=0):
    """Impacts of a cycle of intervals, their instants known to within `jitter`."""
    instants = np.cumsum(np.resize(cycle, count + 1))
    return Impacts.from_times(instants + np.random.default_rng(seed).normal(0, jitter, count + 1))


@pytest.mark.parametrize("cycle", [[0.045], [0.02, 0.03], [0.02, 0.02, 0.03], np.arange(2, 9) / 99])
def test_a_train_that_recurs_but_for_the_timing_is_periodic(cycle):
    found = [correlation_dimension(train(cycle, 300, 1e-5, seed)) for seed in range(10)]
    assert sum(one.verdict == "periodic" and one.period == len(cycle) for one in found) >= 9
    likely = next(one for one in found if one.verdict == "periodic")
    assert likely.value == 0.0
    assert likely.noise == pytest.approx(np.sqrt(2) * 1e-5, rel=0.2)
    assert "to within noise of" in str(likely)


def test_independent_noise_about_values_that_are_apart_is_no_motion():
    x = np.resize([1.0, 2.0, 4.0], 300)
    assert correlation_dimension(noisy(x, 0.02), 3).period == 3
    assert correlation_dimension(noisy(x, 0.5), 3).verdict != "periodic"


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
        lorenz_intervals(300),
        5 + 0.1 * henon(300),
        np.resize([1, 2, 3.0], 300) + 0.02 * np.sin(0.37 * np.arange(300)),
        np.resize([1, 2, 3.0], 300) + np.linspace(0, 0.1, 300),
        1 + 0.002 * torus(300, frequencies=2),
        np.random.default_rng(0).exponential(size=300),
    ],
    ids=["chaos", "small chaos", "modulated", "drifting", "torus", "Poisson"],
)
def test_what_moves_about_its_cycle_is_not_periodic(x):
    assert _periodic.noisy_cycle(x, 0.0, True) is None


def test_noise_is_told_from_an_attractor_that_unfolds():
    """A share of a noise level is reported where there is none only as a possibility."""
    clean = [correlation_dimension(lorenz_intervals(1000, seed), 3, theiler=12) for seed in (1, 2)]
    assert all(one.noise == 0 for one in clean)
    assert not any("noise of" in str(one) for one in clean)


def test_the_scaling_region_ends_before_the_bump_of_the_local_slopes():
    """The beam's slopes are 1 up to C = 0.004, and 1.6 where its two laminae meet."""
    from impactsig import scenes, simulate

    run = simulate(scenes.karpodinis(20.1), periods=4000, transient=200)
    found = correlation_dimension(run.impacts.intervals(), 4)
    radii, one = found.correlation.radii, found.by_dimension[-1]
    inside = (radii >= found.region[1] / 4) & (radii <= found.region[1])
    assert found.value == pytest.approx(1.0, abs=0.1)
    assert one.slopes[inside].max() < 1.2


def test_a_quasi_periodic_series_is_not_periodic():
    found = correlation_dimension(torus(300, frequencies=1), 3)
    assert found.verdict == "dimension"


def test_integers_of_three_values_are_periodic_only_if_they_recur():
    assert correlation_dimension(np.tile([1, 2, 3], 60)).period == 3
    found = correlation_dimension(np.random.default_rng(0).integers(1, 4, 300))
    assert found.verdict == "no plateau"
    assert found.value is None
    assert "rounded to 1" in str(found)


def test_quantised_values_are_flagged_and_read_above_their_step():
    x = np.round(henon(2000), 2)
    found = correlation_dimension(x, 3)
    assert found.resolution == pytest.approx(0.01)
    assert found.region[0] >= 0.02
    assert "rounded to 0.01" in str(found)
    assert found.value == pytest.approx(1.22, abs=0.12)


def test_no_radius_below_the_resolution_given_is_used():
    found = correlation_dimension(henon(2000), 3, resolution=0.01)
    assert all(one.region[0] >= 0.02 for one in found.by_dimension)


def test_duplicated_stretches_are_flagged():
    x = henon(400)
    found = correlation_dimension(np.concatenate((x, [0.123], x)), 3)
    assert any("coincide" in warning for warning in found.warnings)


def test_noise_on_a_structure_is_found_and_radii_below_it_left_out():
    x = noisy(henon(2000), 0.05)
    found = correlation_dimension(x, 4)
    # Levels of other realisations scatter by 4 %.
    assert found.noise / henon(2000).std() == pytest.approx(0.05, rel=0.12)
    assert found.floor >= 2.3 * found.noise
    assert found.region[0] >= found.floor
    assert "noise of about" in str(found)


def test_a_series_of_noise_has_no_plateau():
    found = correlation_dimension(np.random.default_rng(1).normal(size=1000))
    assert found.verdict == "no plateau"
    assert found.value is found.interval is None
    assert str(found).startswith("no plateau")


# -- the same whatever it is given in --------------------------------------------------------


def test_lists_series_float32_and_impacts_are_read(attractor):
    import pandas as pd

    x = henon(1000)
    for given in (x.tolist(), pd.Series(x, index=np.arange(1000) + 7)):
        assert correlation_dimension(given, 3).value == attractor.value
    assert correlation_dimension(x.astype(np.float32), 3).value == pytest.approx(
        attractor.value, abs=1e-3
    )
    run = impactsig.Impacts(np.cumsum(x + 2), duration=3000.0)
    assert correlation_dimension(run, 3).value == pytest.approx(attractor.value, abs=0.02)


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1e6, 1e200])
def test_units_do_not_matter(attractor, scale):
    found = correlation_dimension(scale * henon(1000), 3)
    assert found.value == pytest.approx(attractor.value, abs=0.01)
    assert found.region[1] == pytest.approx(scale * attractor.region[1], rel=0.1)


def test_workers_do_not_matter_and_the_seed_moves_only_the_interval_much(attractor):
    one = correlation_dimension(henon(1000), 3, workers=1)
    assert (one.value, one.interval) == (attractor.value, attractor.interval)
    other = correlation_dimension(henon(1000), 3, seed=1)
    assert other.interval != attractor.interval
    assert other.value == pytest.approx(attractor.value, abs=0.03)


# -- evidence --------------------------------------------------------------------------------


def test_the_result_carries_its_evidence(attractor):
    assert attractor.verdict == "dimension"
    assert attractor.interval[0] < attractor.value < attractor.interval[1]
    assert attractor.plateau[-1] == 3
    assert set(attractor.estimates) == {"Takens", "slope", "nearest neighbours (D1)"}
    assert attractor.spread == np.ptp(list(attractor.estimates.values()))
    assert [one.embedding for one in attractor.by_dimension] == [1, 2, 3]
    for one in attractor.by_dimension:
        assert one.slopes.shape == one.slope_errors.shape == attractor.correlation.radii.shape
    assert f"{attractor.value:.2f}" in str(attractor)
    assert "95 %" in str(attractor)


def test_a_region_given_is_the_region_used(attractor):
    found = correlation_dimension(henon(1000), 3, region=(0.02, 0.2))
    assert found.region == pytest.approx((0.02, 0.2), rel=0.1)
    assert found.value == pytest.approx(1.22, abs=0.1)
    assert "region given" in found.estimator


def test_a_region_without_pairs_gives_no_number():
    found = correlation_dimension(henon(300), 3, region=(1e-12, 1e-11))
    assert found.verdict == "no plateau"
    assert found.value is None


def test_the_figure_shows_all_dimensions_and_the_thesis_figure_is_one_call():
    import matplotlib

    matplotlib.use("Agg")
    panels = correlation_dimension(lorenz_intervals(500), (1, 2, 3), theiler=12).plot()
    assert len(panels) == 3
    assert len(panels[0].get_lines()) == 3
    assert len(correlation_dimension(np.tile([1.0, 2.0], 100)).plot()) == 3
    matplotlib.pyplot.close("all")


# -- its parts -------------------------------------------------------------------------------

RADII = 2.0 ** (np.arange(-64, 1) / 8)
STEP = np.log(2) / 8


@pytest.mark.parametrize("dimension", [0.5, 1.0, 2.7])
def test_a_power_law_gives_its_exponent_by_every_estimator(dimension):
    sums = RADII**dimension
    assert _estimators.takens(sums, STEP, 8)[20:] == pytest.approx(dimension, rel=1e-12)
    assert _estimators.slope(sums, STEP, 5, 40) == pytest.approx(dimension, rel=1e-12)
    assert _estimators.local_slopes(sums, STEP, 2)[2:-2] == pytest.approx(dimension, rel=1e-12)


def test_takens_is_the_inverse_mean_logarithm():
    d = np.random.default_rng(0).uniform(0, 1, 200_000) ** 0.5
    sums = np.array([(d <= r).mean() for r in RADII])
    below = d[d <= RADII[56]]
    expected = 1 / np.log(RADII[56] / below).mean()
    assert _estimators.takens(sums, STEP, 0)[56] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_uniform_points_in_a_cube_have_its_dimension_by_their_neighbours(dimension):
    points = np.random.default_rng(dimension).uniform(size=(4000, dimension))
    draws = _bootstrap.multipliers(10, 0)
    found = _estimators.Neighbours(points, 0, 10, 0).dimension(draws, 0.0)
    assert found[0] == pytest.approx(dimension, rel=0.05)


def test_log_distances_are_those_of_neighbours_without_the_block_left_out():
    rng = np.random.default_rng(3)
    logs = np.sort(rng.normal(size=(12, 9)), axis=1)
    block_of, own = rng.integers(0, 4, (12, 9)), rng.integers(0, 4, 12)
    weights, ranks = _bootstrap.without_each(4), np.array([1, 2])
    naive = np.zeros((5, 4, 2))
    for row, weight in enumerate(weights):
        for i in range(12):
            naive[row, own[i]] += logs[i, weight[block_of[i]] > 0][ranks - 1]
    assert log_distances_by_block(logs, block_of, own, weights, ranks) == pytest.approx(naive)


def test_sums_without_a_block_are_those_of_the_pairs_among_the_others():
    rng = np.random.default_rng(5)
    counts = np.triu(rng.integers(1, 9, (5, 5))).astype(np.int64)
    counts = np.stack([counts, 2 * counts], axis=-1) + np.triu(np.ones((5, 5), np.int64))[..., None]
    found = _bootstrap.sums_without_each(counts)
    for row, kept in enumerate([range(5), *(np.delete(np.arange(5), b) for b in range(5))]):
        left = counts[np.ix_(kept, kept)].sum(axis=(0, 1))
        assert found[row] == pytest.approx(left / left[-1])


def test_pair_variance_is_that_of_the_pairs_alone_whatever_the_blocks_add():
    rng = np.random.default_rng(0)
    found, sums = [], []
    for _ in range(4000):
        chance = np.triu(rng.normal(size=(8, 8)), 1)
        block = 10 * rng.normal(size=8)
        found.append(_bootstrap.pair_variance(np.triu(chance + block + block[:, None] + 3, 1)))
        sums.append(chance.sum())
    assert np.mean(found) == pytest.approx(28, rel=0.02)  # 8 * 7 / 2 pairs of variance 1
    assert np.var(sums) == pytest.approx(np.mean(found), rel=0.07)


@pytest.mark.parametrize("density", ["even", "varying"])
def test_the_spread_of_resamples_is_that_of_a_statistic_of_pairs(density):
    """Pairs of independent values within a radius: by chance of pairs, and of the values."""
    n, blocks, radius = 200, 20, 0.02
    draws = _bootstrap.multipliers(blocks, 0)
    seen, told = [], []
    for seed in range(300):
        x = np.random.default_rng(seed).uniform(size=n)
        x = x if density == "even" else x**3
        close = np.triu(np.abs(x[:, None] - x) <= radius, 1)
        block = np.arange(n) * blocks // n
        counts = np.zeros((blocks, blocks, 2))
        np.add.at(
            counts, (block[:, None], block), np.stack([close, np.triu(np.ones((n, n)), 1)], -1)
        )
        sums = _bootstrap.sums_without_each(counts)[:, 0]
        total = counts[..., 1].sum()
        noise = _bootstrap.pair_variance((counts[..., 0] - sums[0] * counts[..., 1]) / total)
        drawn = _bootstrap.resampled(sums, noise, draws)
        assert drawn[0] == sums[0]
        seen.append(sums[0])
        told.append(drawn[1:].var())
    assert np.sqrt(np.mean(told)) == pytest.approx(np.std(seen), rel=0.15)


def test_the_quantum_of_multiples_is_found_and_none_of_a_continuous_series():
    rng = np.random.default_rng(0)
    assert _scaling.quantum(rng.integers(0, 50, 500) * 0.02) == pytest.approx(0.02)
    assert _scaling.quantum(rng.normal(size=500)) == 0
    assert _scaling.quantum(np.tile(rng.normal(size=50), 10)) == 0


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


@pytest.mark.parametrize("most", [3, 5])
def test_nothing_is_extrapolated_downwards(most):
    """The rise of local slopes is what could go on; the beam's intervals have none."""
    from impactsig import scenes, simulate

    train = simulate(scenes.karpodinis(20.1), periods=4000, transient=200).impacts
    found = correlation_dimension(train, most)
    assert found.verdict == "dimension"
    assert found.extrapolated is None or found.extrapolated >= found.interval[0]


PAIRS = np.geomspace(50, 5000, 20)
CHANCE = _bending.RUNS / np.maximum.outer(PAIRS, PAIRS)


def estimates(count, dimension=2.0, seed=0):
    """Takens' estimates as `bend` takes them to err: what each adds to the one before is apart."""
    rng = np.random.default_rng(seed)
    return dimension * (1 + rng.multivariate_normal(np.zeros(len(PAIRS)), CHANCE, count))


def test_a_power_law_does_not_bend():
    drawn = estimates(200)
    drawn[0] = 2.0
    assert _bending.bend(drawn, PAIRS, STEP, 0.03)[0] == pytest.approx(0, abs=1e-20)


def test_chance_bends_by_one_standard_error_squared():
    drawn = estimates(4000)
    found = _bending.bend(drawn, PAIRS, STEP, 0.0)
    assert found.mean() == pytest.approx(1, rel=0.1)
    assert np.mean(found > 3.84) == pytest.approx(0.05, abs=0.015)


@pytest.mark.parametrize("fall", [-0.3, 0.3])
def test_a_bend_is_told_in_its_standard_errors(fall):
    """By the closed form of generalised least squares with covariance known."""
    places = STEP * np.arange(len(PAIRS))
    drawn = estimates(4000)
    design = np.column_stack([np.ones(len(PAIRS)), places])
    error = 2.0 * np.sqrt(np.linalg.inv(design.T @ np.linalg.inv(CHANCE) @ design)[1, 1])
    drawn[0] = 2.0 - fall * (places - places[-1])
    found = _bending.bend(drawn, PAIRS, STEP, 0.0)[0]
    assert found == pytest.approx((fall / error) ** 2, rel=0.1)


def test_too_few_scales_and_unknown_estimates_tell_of_no_bend():
    drawn = estimates(50)
    assert not _bending.bend(drawn[:, :3], PAIRS[:3], STEP, 0.03).any()
    drawn[3, 0] = np.nan
    assert not _bending.bend(drawn, PAIRS, STEP, 0.03).any()


def test_odds_are_even_where_the_gain_pays_for_the_parameter():
    even = np.full(3, np.log(500))
    assert _bending.odds([even], 500) == pytest.approx(1)
    assert _bending.odds([even - 1, even + 3], 500) == pytest.approx(np.exp(0.5))


def test_the_doubt_about_the_noise_is_its_scatter_over_realisations():
    """The jackknife takes the chance of single pairs in twice: up to sqrt(2) too much."""
    radii = 2.0 ** (np.arange(-96, 1) / 8)
    levels, doubts = [], []
    for seed in range(30):
        clean = henon(1000, seed)
        x = noisy(clean, 0.05, seed)
        extent = np.ptp(x)
        counts = [pair_counts_by_block(x / extent, m, 1, 12, radii, 11, 1) for m in (3, 4)]
        found = _scaling.noise_level(counts, radii, (3, 4))
        levels.append(found.level * extent / clean.std())
        doubts.append(np.log(found.factor))
    # They scatter by 6 %: the median of 30 by 1.4 %.
    assert np.median(levels) == pytest.approx(0.05, rel=0.05)
    told, seen = np.median(doubts), np.log(levels).std()
    # Of 30 the scatter is known to 13 %.
    assert 0.75 * seen < told < 1.25 * np.sqrt(2) * seen
