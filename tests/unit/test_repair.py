"""Repair of trains: what was missed comes back, what never was goes, the rest stays as it is."""

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, measure, repair_intervals, scenes, simulate
from impactsig.impacts import INFERRED
from impactsig.results import Repair

T = 0.05


def periodic(phases, count=400, jitter=1e-4, seed=0):
    rng = np.random.default_rng(seed)
    time = (np.arange(count)[:, None] + np.array(phases)).ravel() * T
    return Impacts(np.sort(time + rng.normal(0, jitter, len(time))), peak=np.ones(len(time)))


@pytest.fixture(scope="module")
def chaos():
    return {
        f: simulate(scenes.karpodinis(frequency=f), periods=1000, transient=300).impacts
        for f in (20.1, 20.3355)
    }


def scored(measured, repair, within):
    """Right and all joins, right and all splits, spurious and missed impacts there were."""
    joined = np.isin([join.impact for join in repair.joins], measured.spurious)
    put_in = [measured.impacts.time[split.after] + split.offset for split in repair.splits]
    missed = measured.truth.time[measured.missed]
    found = [np.abs(missed - instant).min(initial=np.inf) < within for instant in put_in]
    return np.array(
        [joined.sum(), len(joined), sum(found), len(found), len(measured.spurious), len(missed)]
    )


def changes(train, period, share, seeds=5):
    within = 0.05 * period
    total = 0
    for seed in range(seeds):
        seen = measure(train, missed=share, spurious=share, seed=seed)
        total = total + scored(seen, repair_intervals(seen.impacts, period), within)
    return total


@pytest.mark.parametrize(
    ("phases", "share"),
    [
        ([0], 0.05),
        ([0, 0.3], 0.02),
        ([0, 0.45, 0.8], 0.05),
        pytest.param([0], 0.02, marks=pytest.mark.slow),
        pytest.param([0, 0.3], 0.05, marks=pytest.mark.slow),
        pytest.param([0, 0.45, 0.8], 0.02, marks=pytest.mark.slow),
    ],
)
def test_a_periodic_train_gets_its_impacts_back(phases, share):
    joined, joins, found, splits, spurious, missed = changes(periodic(phases), T, share)
    assert joined >= 0.97 * joins
    assert found >= 0.97 * splits
    assert joined >= 0.9 * spurious
    assert found >= 0.9 * missed


def test_two_impacts_in_two_periods_are_a_period_too():
    time = np.concatenate((np.arange(0, 400, 2), np.arange(1, 400, 2) + 0.2)) * T
    joined, joins, found, splits, spurious, missed = changes(Impacts(np.sort(time)), T, 0.05)
    assert min(joined / joins, found / splits) > 0.97
    assert min(joined / spurious, found / missed) > 0.9


@pytest.mark.parametrize(
    ("frequency", "share"),
    [
        (20.1, 0.05),
        (20.3355, 0.02),
        pytest.param(20.1, 0.02, marks=pytest.mark.slow),
        pytest.param(20.3355, 0.05, marks=pytest.mark.slow),
    ],
)
def test_in_chaos_half_of_the_faults_are_mended_and_nothing_else_is_changed(
    chaos, frequency, share
):
    train, period = chaos[frequency], 1 / frequency
    joined, joins, found, splits, spurious, missed = changes(train, period, share, seeds=3)
    assert joined + found >= 0.98 * (joins + splits)
    assert joined + found >= 0.5 * (spurious + missed)


@pytest.mark.parametrize("frequency", [20.1, 20.3355])
def test_in_chaos_at_10_percent_what_is_changed_is_right(chaos, frequency):
    joined, joins, found, splits, *_ = changes(chaos[frequency], 1 / frequency, 0.1, seeds=2)
    assert joined + found >= 0.95 * (joins + splits)


def test_a_periodic_train_is_mended_at_20_percent():
    joined, joins, found, splits, spurious, missed = changes(periodic([0]), T, 0.2, seeds=3)
    precision = (joined + found) / (joins + splits)
    recall = (joined + found) / (spurious + missed)
    assert 2 * precision * recall / (precision + recall) >= 0.98


def test_a_drifting_train_is_mended_by_its_slots():
    n = np.arange(400.0)
    whole = T * (n + 0.005 * n**2 / 800)
    given = np.delete(whole, [50, 120, 300])
    found = repair_intervals(Impacts(given), T)
    put_in = [given[split.after] + split.offset for split in found.splits]
    assert put_in == pytest.approx(whole[[50, 120, 300]], abs=1e-2 * T)
    assert not found.joins


@pytest.mark.parametrize("frequency", [20.1, 20.3355])
def test_chaos_with_nothing_wrong_is_left_alone(chaos, frequency):
    train = chaos[frequency]
    found = repair_intervals(train, 1 / frequency)
    assert not found.splits
    assert not found.joins
    assert found.impacts is train
    np.testing.assert_array_equal(found.intervals, train.intervals())
    assert "nothing repaired (aperiodic (chaotic)" in repr(found)


def test_noise_is_left_alone():
    poisson = np.random.default_rng(1).exponential(T, 800)
    np.testing.assert_array_equal(repair_intervals(poisson, T).intervals, poisson)


def test_impacts_far_rarer_than_the_forcing_are_left_alone():
    """One interval of 9e8 forcing periods took hours: all rates that it tells apart were tried."""
    intervals = 0.1 + np.random.default_rng(3).random(222)
    intervals[100] = 9e8
    found = repair_intervals(intervals, 1.0)
    np.testing.assert_array_equal(found.intervals, intervals)


def test_what_was_changed_is_said_index_by_index():
    time = np.arange(60.0) * T
    given = np.sort(np.append(np.delete(time, [20, 40, 41]), 30.4 * T))
    found = repair_intervals(Impacts(given, peak=np.arange(58.0)), T)
    (join,) = found.joins
    assert given[join.impact] == 30.4 * T
    put_in = [given[split.after] + split.offset for split in found.splits]
    assert put_in == pytest.approx(time[[20, 40, 41]], abs=1e-3 * T)
    assert "0.4 forcing periods from any instant due in period(1,1)" in join.why
    assert "due in period(1,1)" in found.splits[0].why
    assert "3 missed impacts put in, 1 spurious ones taken out, by its period" in repr(found)
    inferred = found.impacts.flags == INFERRED
    assert np.flatnonzero(inferred).tolist() == [20, 40, 41]
    # all others as they were, bit by bit
    kept = np.delete(given, join.impact)
    np.testing.assert_array_equal(found.impacts.time[~inferred], kept)
    np.testing.assert_array_equal(
        found.impacts.peak[~inferred], np.delete(np.arange(58.0), join.impact)
    )
    assert found.impacts.peak[20] == (19 + 20) / 2


def test_intervals_are_split_and_joined_like_impacts():
    given = np.full(80, T)
    given[[10, 50]] = 2 * T, 0.3 * T
    given = np.insert(given, 51, 0.7 * T)
    found = repair_intervals(given, T)
    assert found.impacts is None
    assert found.intervals == pytest.approx(np.full(81, T), rel=1e-9)
    assert [split.after for split in found.splits] == [10]
    assert [join.impact for join in found.joins] == [51]


def test_a_spurious_impact_inside_a_doubled_interval():
    """Missed and false in the same interval: both are seen, since neither is near the other."""
    given = np.concatenate((np.full(40, T), [0.6 * T, 1.4 * T], np.full(40, T)))
    found = repair_intervals(given, T)
    assert found.intervals == pytest.approx(np.full(82, T), rel=1e-6)


def test_what_is_not_clear_stays():
    late = np.arange(80.0) * T
    late[40] += 0.08 * T  # a late impact, or a false one and one missed
    silence = np.delete(np.arange(80.0), [40, 41, 42, 43]) * T
    gap = Impacts(np.delete(np.arange(80.0), [40]) * T, gaps=[[39.5 * T, 40.5 * T]])
    for train in (Impacts(late), Impacts(silence), gap):
        assert repair_intervals(train, T).impacts is train


@pytest.mark.parametrize("few", [[], [T], [T] * 6])
def test_too_few_intervals_are_left_alone(few):
    found = repair_intervals(few, T)
    assert isinstance(found, Repair)
    assert found.intervals.tolist() == few
    assert "too few" in found.describe()


@pytest.mark.parametrize(
    ("isi", "period", "named"),
    [
        ([T] * 30, 0.0, "forcing_period"),
        ([T] * 30, np.nan, "forcing_period"),
        ([T, -T], T, "intervals"),
        ([T, np.nan], T, "intervals"),
        ([[T]], T, "intervals"),
        (["a"], T, "intervals"),
    ],
)
def test_arguments_that_cannot_be_used(isi, period, named):
    with pytest.raises(InvalidInput, match=f"^{named}"):
        repair_intervals(isi, period)
