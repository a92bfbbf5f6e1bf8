"""Impacts as hits of slots that recur: the model that period(m, n) is read from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

REACH = 4.0  # a slot reaches this many standard deviations to either side
LEAST_RECURRING = 3  # impacts near a later one, from which the noise is read
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
    """The slots of a fold of `fold` cycles that most impacts fall in.

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
    span = float(cycles[-1] - cycles[0] - np.diff(gaps, axis=1).sum())
    phase = cycles % fold
    width = _recurrence_jitter(cycles, fold, floor, widest)
    thin = n // ENOUGH + 1  # every so many of the sorted phases have the heaps of all
    centre = _peel(np.sort(phase)[::thin], fold, width, 0.5 * least * span / fold / thin)
    for turn in range(10):
        if not len(centre):
            none, empty = np.zeros(0, np.int64), np.zeros(n)
            score = poisson_score(n, span)
            return SlotFit(
                fold, cycles, centre, 0.0, none, none, n, 1.0, score, none, empty, empty > 0
            )
        instant, offset, hit = assign(cycles, centre, fold, REACH * width)
        slot = instant % len(centre)
        hits = np.bincount(slot[hit], minlength=len(centre))
        due = np.maximum(_due(centre, fold, cycles, gaps, REACH * width), hits)
        strong = hits >= least * due
        mean = np.bincount(slot[hit], offset[hit], len(centre)) / np.maximum(hits, 1)
        spread = offset[hit] - mean[slot[hit]]
        jitter = _rms(spread)
        if turn > 1 and strong.all() and abs(jitter - width) < 1e-3 * width:
            break
        centre, width = np.sort((centre + mean)[strong] % fold), min(max(jitter, floor), widest)
        since = cycles - cycles[hit].mean()
        slope = float(spread @ since[hit] / max(since[hit] @ since[hit], 1e-300))
        cycles = cycles - slope * since
        phase = cycles % fold
    total, others = int(hits.sum()), n - int(hits.sum())
    jitter = _rms(offset[hit])
    sigma = max(jitter, floor)
    score = -total * (np.log(sigma * np.sqrt(2 * np.pi)) + 0.5 * (jitter / sigma) ** 2)
    score += _xlogy(total, total / due.sum()) + _xlogy(due.sum() - total, 1 - total / due.sum())
    score += _xlogy(others, others / span) - others
    score -= (2 * len(centre) + 1.5) * np.log(n)
    score -= 0.5 * total * (floor / sigma) ** 2 * (1 - 1 / len(centre))
    chance = bunching_chance(phase[~hit], offset[~hit], fold, len(centre), width)
    return SlotFit(
        fold, cycles, centre, jitter, hits, due, n, chance, float(score), instant, offset, hit
    )


def assign(
    cycles: np.ndarray, centre: np.ndarray, fold: int, reach: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The number of the instant due nearest each impact, the offset from it, and whether it hits.

    Instants are numbered in the order of time: of m slots, number k belongs to slot k modulo m.
    """
    slot, offset = nearest_slot(cycles % fold, centre, fold)
    turn = np.round((cycles - offset - centre[slot]) / fold).astype(np.int64)
    instant = turn * len(centre) + slot
    return instant, offset, once(instant, offset, reach)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def bunching_chance(
    phase: np.ndarray, offset: np.ndarray, fold: int, slots: int, width: float
) -> float:
    """Chance that impacts which hit no slot, were they spurious, would bunch at a phase so much.

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


def _recurrence_jitter(cycles: np.ndarray, fold: int, floor: float, widest: float) -> float:
    """Timing noise, from how nearly impacts come again after some folds (robust).

    The greatest of what 1 to 25 folds say: what changes slowly shows little after one.
    """
    greatest = widest
    for turns in (1, 2, 3, 8, 25):
        due = cycles + turns * fold
        after = np.clip(np.searchsorted(cycles, due), 1, len(cycles) - 1)
        nearest = np.where(due - cycles[after - 1] < cycles[after] - due, after - 1, after)
        miss = cycles[nearest] - due
        miss = miss[np.abs(miss) < 0.25]
        if len(miss) < LEAST_RECURRING:
            break
        deviation = 1.4826 / np.sqrt(2) * float(np.median(np.abs(miss - np.median(miss))))
        greatest = deviation if turns == 1 else max(greatest, deviation)
    return float(min(max(greatest, floor), widest))


def _peel(phase: np.ndarray, fold: int, width: float, least: float) -> np.ndarray:
    """Centres of the heaps of sorted phases, the highest first, down to `least` impacts.

    An impact counts its neighbours within one standard deviation, two thirds of its heap: a wider
    window would sit astride two heaps that touch.
    """
    centre: list[float] = []
    while len(phase) >= max(least, 1):
        round_once = np.concatenate((phase - fold, phase, phase + fold))
        low = np.searchsorted(round_once, phase - width)
        high = np.searchsorted(round_once, phase + width, side="right")
        top = int(np.argmax(high - low))
        if high[top] - low[top] < least:
            break
        middle = float(round_once[low[top] : high[top]].mean()) % fold
        centre.append(middle)
        away = np.abs((phase - middle + fold / 2) % fold - fold / 2)
        phase = phase[away > 2.5 * width]
    return np.sort(centre)


def nearest_slot(phase: np.ndarray, centre: np.ndarray, fold: int) -> tuple[np.ndarray, np.ndarray]:
    """The slot nearest each phase on the circle of `fold` cycles, and the offset from it."""
    ring = np.concatenate(([centre[-1] - fold], centre, [centre[0] + fold]))
    between = np.searchsorted(0.5 * (ring[1:] + ring[:-1]), phase)
    return (between - 1) % len(centre), phase - ring[between]


def once(instant: np.ndarray, offset: np.ndarray, reach: float) -> np.ndarray:
    """Which impacts hit the instant due that they are numbered with: within reach, the nearest."""
    hit = np.abs(offset) <= reach
    near = np.flatnonzero(hit)
    near = near[np.argsort(instant[near], kind="stable")]
    again = np.diff(instant[near]) == 0
    contend = near[np.append(again, False) | np.append(False, again)]
    if len(contend):
        contend = contend[np.lexsort((np.abs(offset[contend]), instant[contend]))]
        hit[contend[1:][np.diff(instant[contend]) == 0]] = False
    return hit


def _due(
    centre: np.ndarray, fold: int, cycles: np.ndarray, gaps: np.ndarray, margin: float
) -> np.ndarray:
    """How often each slot is due from the first impact to the last, outside gaps."""
    total = _count(centre, fold, cycles[0] - margin, cycles[-1] + margin)
    for low, high in gaps:
        total = total - _count(centre, fold, low, high)
    return total


def _count(centre: np.ndarray, fold: int, low: float, high: float) -> np.ndarray:
    return (np.floor((high - centre) / fold) - np.floor((low - centre) / fold)).astype(np.int64)
