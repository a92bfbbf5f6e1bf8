"""Motions that change during a run: the stretches, the changes between them, the probabilities."""

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, track_period
from impactsig.intervals import track
from impactsig.intervals.phases.structure import strongest_line

T = 0.05


def changing(seed=0):
    """100 periods of (1, 1), then 100 of (2, 2); jitter 0.5 %, 3 % missed."""
    rng = np.random.default_rng(seed)
    turns = np.arange(200.0)
    turns[101::2] += 0.2
    turns = turns + 0.005 * rng.standard_normal(200)
    return Impacts.from_times(T * turns[rng.random(200) > 0.03])


def test_a_period_that_doubles_is_two_stretches():
    found = track_period(changing(), T)
    assert [one.period.name for one in found.stretches] == ["period(1,1)", "period(2,2)"]
    # the impact that is the first to be off comes at 101.2 periods
    assert found.changes == pytest.approx([100.6 * T], abs=2.5 * T)
    assert found.stretches[0].stop == found.stretches[1].start == found.changes[0]
    assert found.probability.shape == (len(found.time), len(found.kinds))
    assert found.probability.sum(axis=1) == pytest.approx(1)
    # windows across the change are cut there, so no window shows a mixture
    recurs = found.probability[:, [found.kinds.index("chaotic"), found.kinds.index("irregular")]]
    assert recurs.sum(axis=1).max() < 0.2
    assert found.describe().count("\n") == 1


def test_a_period_that_drifts_and_does_not_change_is_one_stretch():
    rng = np.random.default_rng(1)
    turns = np.arange(150.0)
    turns = turns + 0.01 * turns**2 / 300 + 0.005 * rng.standard_normal(150)
    found = track_period(Impacts.from_times(T * turns), T)
    assert [one.period.name for one in found.stretches] == ["period(1,1)"]
    assert not len(found.changes)


def test_a_period_that_is_lost_ends_a_stretch():
    rng = np.random.default_rng(2)
    steady = np.arange(80.0) + 0.005 * rng.standard_normal(80)
    lost = 80 + np.cumsum(rng.exponential(1.0, 60))
    found = track_period(Impacts.from_times(T * np.append(steady, lost)), T)
    first, last = found.stretches
    assert first.period.name == "period(1,1)"
    assert last.period.aperiodic
    assert found.changes == pytest.approx([80 * T], abs=10 * T)


@pytest.mark.parametrize(("spread", "seed"), [(0.2, 2), (0.23, 3)])
def test_chaos_near_a_period_is_one_stretch_and_its_end_is_seen(spread, seed):
    """Its phases are far from random, but no period: the slots score, and are not kept to."""
    rng = np.random.default_rng([seed, 7])
    x = np.empty(165)
    x[0] = rng.uniform(-0.5, 0.5)
    for k in range(1, 165):
        x[k] = 1 - 1.99999 * abs(x[k - 1])
    turns = np.arange(165) + np.repeat((spread, 0.0), (90, 75)) * x
    turns = turns + 0.005 * rng.standard_normal(165)
    found = track_period(Impacts.from_times(np.sort(T * (turns - turns[0]))), T, max_periods=1)
    assert [one.period.kind for one in found.stretches] == ["chaotic", "periodic"]
    assert found.changes == pytest.approx([89.5 * T], abs=3 * T)


def test_stretches_of_one_motion_are_one(monkeypatch):
    """Where windows show a change that the stretches themselves do not."""
    rng = np.random.default_rng(3)
    turns = np.append(np.arange(120.0), 120 + np.cumsum(rng.exponential(1.0, 60)))
    turns[:120] += 0.005 * rng.standard_normal(120)

    def changed(odds, change):
        assert odds.shape == (9, 2)  # windows; (1, 1) and none
        return np.array([1, 1, 1, 0, 0, 0, 1, 1, 1])

    monkeypatch.setattr(track, "best_path", changed)
    found = track_period(Impacts.from_times(T * turns), T, max_periods=1)
    assert [one.period.name for one in found.stretches][:-1] == ["period(1,1)"]
    assert found.stretches[-1].period.aperiodic


def test_windows_across_a_change_are_no_motion_of_their_own():
    paths = [
        ([0, 0, 1, 1, 1, 2, 2], [0, 0, 0, 2, 2, 2, 2]),
        ([0, 0, 1, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0]),
        ([0, 0, 1, 1, 1, 1, 2], [0, 0, 1, 1, 1, 1, 2]),
        ([1, 1, 2, 2, 2, 1, 1], [1, 1, 2, 2, 2, 1, 1]),
    ]
    for path, expected in paths:
        assert track._without_straddling(np.array(path), [1]).tolist() == expected
    assert track._without_straddling(np.zeros(5, int), []).tolist() == [0] * 5


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("impacts", {"impacts": np.arange(100.0)}),
        ("impacts", {"impacts": Impacts.from_times(np.arange(30.0))}),
        ("window", {"window": 10}),
        ("forcing_period", {"forcing_period": None}),
        ("forcing_period", {"forcing_period": -1.0}),
    ],
)
def test_arguments_that_cannot_be_used_are_named(name, given):
    arguments = {"impacts": changing(), "forcing_period": T, **given}
    with pytest.raises(InvalidInput) as caught:
        track_period(**arguments)
    assert caught.value.argument == name


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_where_nothing_is_left_there_is_no_line():
    assert strongest_line(np.arange(0.5, 55.0), np.zeros(55), 1.0, 0.04) is None
