"""Slots of a fold: each kernel against its slow twin, and what is known is computed once."""

import numpy as np
import pytest

from impactsig import Impacts, identify_period
from impactsig.intervals.phases import tracking as _tracking
from impactsig.intervals.phases.slot_kernels import (
    assign,
    peel,
    recurrence_jitter,
    remainder,
    settle,
)

from .. import naive_slots


def spoilt(rng, centre, fold, count=60, jitter=0.02):
    """Hits of slots, nine in ten of those due, and a tenth as many impacts besides."""
    due = (fold * np.arange(count)[:, None] + np.asarray(centre)).ravel()
    came = due[rng.random(len(due)) < 0.9] + 0.3
    came = came + jitter * rng.standard_normal(len(came))
    return np.sort(np.append(came, rng.uniform(came[0], came[-1], len(due) // 10)))


SLOTS = [((0.0,), 1), ((0.0, 0.35), 1), ((0.0, 1.15), 2), ((0.0, 0.9, 2.3), 3)]


@pytest.mark.parametrize(("centre", "fold"), SLOTS)
@pytest.mark.parametrize("jitter", [0.001, 0.03])
def test_noise_and_heaps_are_those_of_the_twin(centre, fold, jitter):
    rng = np.random.default_rng([1, fold, len(centre)])
    cycles = spoilt(rng, centre, fold, jitter=jitter)
    width = recurrence_jitter(cycles, fold, 1e-3, 0.08)
    assert width == pytest.approx(naive_slots.recurrence_jitter(cycles, fold, 1e-3, 0.08))
    phase = np.sort(cycles % fold)
    found = peel(phase, fold, width, 15.0)
    assert len(found) == len(centre)
    assert found == pytest.approx(np.array(naive_slots.peel(phase, fold, width, 15.0)))
    scattered = np.sort(rng.uniform(0, fold, 80))
    np.testing.assert_allclose(
        peel(scattered, fold, 0.05, 3.0), naive_slots.peel(scattered, fold, 0.05, 3.0)
    )


def test_recurrences_too_few_to_tell_leave_the_widest():
    cycles = np.cumsum(np.linspace(1.3, 1.7, 9))
    assert recurrence_jitter(cycles, 1, 1e-3, 0.08) == 0.08


@pytest.mark.parametrize(("centre", "fold"), SLOTS)
def test_impacts_hit_the_instants_of_the_twin(centre, fold):
    rng = np.random.default_rng([2, fold, len(centre)])
    cycles, at = spoilt(rng, centre, fold), np.asarray(centre) + 0.31
    n = len(cycles)
    instant, slot = np.empty((2, n), np.int64)
    offset, hit = np.empty(n), np.empty(n, bool)
    assign(cycles, at, fold, 0.08, instant, slot, offset, hit)
    expected = naive_slots.assign(cycles, at, fold, 0.08)
    assert instant.tolist() == expected[0]
    assert offset == pytest.approx(np.array(expected[1]))
    assert hit.tolist() == expected[2]
    np.testing.assert_array_equal(slot, instant % len(at))
    assert len(set(instant[hit])) == hit.sum() < n


@pytest.mark.parametrize("fold", [1, 3, 7, 49])
def test_phases_are_remainders_to_the_last_bit(fold):
    rng = np.random.default_rng([4, fold])
    near = fold * rng.integers(-50, 10**6, 500).astype(float)
    values = [near, np.nextafter(near, -np.inf), np.nextafter(near, np.inf), [-1e-20, 0.0, 1e-300]]
    for value in [*np.concatenate(values), *rng.uniform(-1e3, 1e9, 500)]:
        assert remainder(value, fold) == value % fold


def test_what_is_settled_is_of_one_set_of_slots():
    """Where ten rounds do not settle either: one impact goes to and fro."""
    rng = np.random.default_rng(3)
    for _ in range(40):
        cycles = np.sort(rng.uniform(0, 40, 60))
        centre = np.sort(rng.uniform(0, 2, 6))
        moved, at, width, hits, due, instant, offset, hit = settle(
            cycles, 2, np.zeros((0, 2)), 1e-3, 0.08, 0.2, centre, 0.05
        )
        if not len(at):
            continue
        assert len(hits) == len(due) == len(at)
        expected = naive_slots.assign(moved, at, 2, 4 * width)
        assert instant.tolist() == expected[0]
        assert offset == pytest.approx(np.array(expected[1]), abs=1e-12)
        assert hits.tolist() == np.bincount(instant[hit] % len(at), minlength=len(at)).tolist()


@pytest.mark.parametrize("forcing_period", [None, 1.0])
def test_no_warp_of_an_irregular_train_is_computed_twice(forcing_period, monkeypatch):
    asked = []
    for name in ("steady_rate", "tracked_rate"):
        usual = getattr(_tracking, name)

        def counted(cycles, tolerance, name=name, usual=usual):
            asked.append((name, cycles.tobytes()))
            return usual(cycles, tolerance)

        monkeypatch.setattr(_tracking, name, counted)
    time = np.cumsum(np.random.default_rng(4).exponential(1.0, 100))
    assert identify_period(Impacts.from_times(time), forcing_period).kind == "irregular"
    assert len(set(asked)) == len(asked) > 2
