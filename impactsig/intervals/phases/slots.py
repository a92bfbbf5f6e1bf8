"""The model of period(m, n): m slots per fold of n cycles, in which impacts recur."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .slot_kernels import REACH, peel, recurrence_jitter, settle

ENOUGH = 10_000  # impacts to find the slots with


class SlotFit(NamedTuple):
    """m slots in a fold of n cycles, and how well they predict the impacts."""

    fold: int
    cycles: np.ndarray  # (n,) the impacts, once the rate and the phase are refined
    centre: np.ndarray  # (m,) [cycles], ascending in [0, fold)
    jitter: float  # standard deviation about the centres [cycles]
    hits: np.ndarray  # (m,) how often each slot was hit
    due: np.ndarray  # (m,) how often it might have been
    impacts: int
    chance: float  # that the other impacts bunch as they do where they come at random
    score: float  # log-likelihood less a penalty for every parameter
    instant: np.ndarray  # (n,) the number of the instant due that is nearest to each impact
    offset: np.ndarray  # (n,) [cycles] from that instant
    hit: np.ndarray  # (n,) whether the impact is the one that was due then


def poisson_score(impacts: int, span: float) -> float:
    """Score of impacts at random instants, `span` cycles long."""
    return impacts * np.log(impacts / span) - impacts - 0.5 * np.log(impacts)


def fit_slots(
    cycles: np.ndarray, fold: int, gaps: np.ndarray, floor: float, widest: float, least: float
) -> SlotFit:
    """Fit the slots of a fold of `fold` cycles that contain the most impacts.

    Every slot is hit at most once in `fold` cycles, with one probability p; a hit comes normally
    distributed about the slot; the other impacts are a Poisson process of rate s. With H hits in
    D instants due, residuals d and S other impacts in U cycles the log-likelihood is

        -H ln(w sqrt(2 pi)) - sum(d^2)/(2 w^2) + H ln p + (D - H) ln(1 - p) + S ln s - s U,

    where w is the standard deviation of d, but at least `floor`. The parameters are m centres, w,
    p and s; the penalty is 2 ln N a centre and ln(N)/2 for the others. The Bayesian information
    criterion's ln(N)/2 a centre would find a doubled period by chance in one regular train in a
    hundred, since several folds compete. Slots apart by less than `floor` count as one: what they
    could gain is taken away as well. Beyond `widest` the phase counts as lost. A slot is hit at
    `least` that share of the instants when it is due.
    """
    n = len(cycles)
    span = float(cycles[-1] - cycles[0])
    if len(gaps):
        span -= float(np.sum(gaps[:, 1] - gaps[:, 0]))
    width = recurrence_jitter(cycles, fold, floor, widest)
    thin = n // ENOUGH + 1  # every so many of the sorted phases have the heaps of all
    phase = np.sort(cycles % fold)[::thin].copy()
    centre = peel(phase, fold, width, 0.5 * least * span / fold / thin)
    cycles, centre, width, hits, due, instant, offset, hit = settle(
        cycles, fold, gaps, floor, widest, least, centre, width
    )
    if not len(centre):
        none, empty = np.zeros(0, np.int64), np.zeros(n)
        score = poisson_score(n, span)
        return SlotFit(fold, cycles, centre, 0.0, none, none, n, 1.0, score, none, empty, empty > 0)
    total, instants = int(hits.sum()), max(int(due.sum()), 1)
    others = n - total
    jitter = _rms(offset[hit])
    sigma = max(jitter, floor)
    score = -total * (np.log(sigma * np.sqrt(2 * np.pi)) + 0.5 * (jitter / sigma) ** 2)
    score += _xlogy(total, total / instants) + _xlogy(instants - total, 1 - total / instants)
    score += _xlogy(others, others / span) - others
    score -= (2 * len(centre) + 1.5) * np.log(n)
    score -= 0.5 * total * (floor / sigma) ** 2 * (1 - 1 / len(centre))
    chance = bunching_chance(cycles[~hit] % fold, offset[~hit], fold, len(centre), width)
    return SlotFit(
        fold, cycles, centre, jitter, hits, due, n, chance, float(score), instant, offset, hit
    )


def _rms(values: np.ndarray) -> float:
    return math.sqrt(float(values @ values) / len(values)) if len(values) else 0.0


def bunching_chance(
    phase: np.ndarray, offset: np.ndarray, fold: int, slots: int, width: float
) -> float:
    """Probability that spurious impacts would bunch at a phase as strongly as those without a slot.

    An impact that comes now and then, at a phase of its own, is no part of a period: chaos shows
    itself so. What comes close after or before a slot is left out (a ringing of the sensor). The
    bound is Bonferroni's over windows opened by each impact.
    """
    away = 2 * REACH * width
    free = fold - 2 * away * slots
    window = REACH * max(width, 0.01)
    phase = np.sort(phase[np.abs(offset) > away])
    if len(phase) < 3 or free <= 2 * window:
        return 1.0
    from scipy.special import bdtrc

    ring = np.concatenate((phase, phase + fold))
    inside = int(np.max(np.searchsorted(ring, phase + window) - np.arange(len(phase))))
    more = bdtrc(inside - 2, len(phase) - 1, window / free) if inside > 1 else 1.0
    return float(min(1.0, len(phase) * more))


def _xlogy(count: float, value: float) -> float:
    return count * np.log(value) if count else 0.0
