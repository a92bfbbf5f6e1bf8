"""The measured train among simulated ones: its rank is a p-value, and tells what is unlike them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from impactsig.fitting._exchanged import compared, exchanged
from impactsig.fitting._judging import JUDGED, LEAST_P
from impactsig.fitting._partition import Train

TRAINS, COUNT = 20, 120


def alike(rng, trains, long=0.3, count=COUNT, false=0.02):
    """Trains of one or two periods in turn, at one phase, some instants at any other."""
    x, starts = [], []
    for _ in range(trains):
        steps = np.where(rng.random(count) < long, 2.0, 1.0)
        at = np.cumsum(steps) + 0.02 * rng.standard_normal(count)
        extra = count * rng.random(rng.poisson(false * count))
        x.append(np.sort(np.concatenate((at, extra))))
    counts = [len(one) for one in x]
    owner = np.repeat(np.arange(trains), counts)
    starts = np.cumsum(counts) - counts
    return Train(np.concatenate(x), None, owner[1:] == owner[:-1], starts)


def test_of_trains_of_one_kind_none_is_nearer_than_the_others():
    # Had the measured one chosen the phases and classes, it would: 4 of 21 then come too seldom.
    rng = np.random.default_rng(1)
    draws, level, rejected, ranks = 400, 4 / (TRAINS + 1), 0, []
    for _ in range(draws):
        every = alike(rng, TRAINS + 1)
        measured = every.split()[0]
        first = len(measured.x)
        others = Train(every.x[first:], None, every.joined[first:], every.starts[1:] - first)
        found = compared(measured, others)
        rejected += found.p_value <= level
        ranks.append(found.p_value)
    assert abs(rejected - draws * level) < 3 * np.sqrt(draws * level * (1 - level))
    mean = (TRAINS + 2) / (2 * (TRAINS + 1))
    assert abs(np.mean(ranks) - mean) < 3 * 0.29 / np.sqrt(draws)


def test_a_train_of_another_kind_is_farther_than_all():
    rng = np.random.default_rng(2)
    found = compared(alike(rng, 1, long=0.6), alike(rng, TRAINS))
    assert found.p_value == 1 / (TRAINS + 1)
    assert found.distance > 5
    measured, mean, scatter = found.shares
    assert np.max(np.abs(measured - mean) / scatter) > 3
    assert measured.sum() == pytest.approx(1)
    assert found.failed == 0


def test_trains_without_impacts_count_as_nearer():
    rng = np.random.default_rng(3)
    some = alike(rng, TRAINS // 2)
    starts = np.concatenate((some.starts, np.full(TRAINS // 2, len(some.x))))
    found = compared(alike(rng, 1, long=0.6), some._replace(starts=starts))
    assert found.failed == TRAINS // 2
    assert found.p_value == 1 / (TRAINS + 1)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_trains_that_are_too_short_explain_nothing(count):
    rng = np.random.default_rng(4)
    found = compared(alike(rng, 1), alike(rng, TRAINS, count=count, false=0.0))
    assert (found.p_value, found.failed) == (LEAST_P, TRAINS)


def test_what_a_fit_leaves_open_is_drawn():
    """Shares of long steps that scatter: one at the edge is explained, with none open it is not."""
    rng = np.random.default_rng(5)

    def simulated(psi):
        drawn.append(psi)
        every = [alike(rng, 1, long=float(one)) for one in psi[:, 0]]
        starts = np.concatenate(([0], np.cumsum([len(one.x) for one in every])[:-1]))
        joined = np.concatenate([np.append(one.joined, False) for one in every])[:-1]
        return Train(np.concatenate([one.x for one in every]), None, joined, starts)

    drawn: list[np.ndarray] = []
    problem = SimpleNamespace(
        share=1.0, train=alike(rng, 1, long=0.5), rng=rng, simulate=simulated,
        box=(np.array([0.05]), np.array([0.95])),
    )  # fmt: skip
    sure = exchanged(problem, np.array([0.3]), np.zeros((1, 1)))
    unsure = exchanged(problem, np.array([0.3]), np.array([[0.15**2]]))
    assert sure.p_value <= 2 / (JUDGED + 1) < unsure.p_value
    assert np.ptp(drawn[0]) == 0
    assert drawn[1].std() == pytest.approx(0.15, rel=0.3)
    assert drawn[1].min() >= 0.05
